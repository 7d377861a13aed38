//! Pictures against `whitted` with one interface.

use crate::support::*;
use glam::UVec2;
use meniscus_render_gpu::facts::Facts;
use meniscus_render_gpu::{GpuRenderer, Heights, Settings, Technique, Walk};
use meniscus_sim::render::View;
use meniscus_sim::stage::Lens;
use meniscus_sim::{Frame, Grid, Scene};

const SIZE: UVec2 = UVec2::new(96, 54);

/// Scenes of ground and water, sky of each kind, open, walled and periodic edges, and things in the water.
#[test]
fn heightfield_is_the_truth_to_a_hundredth_of_flip() {
    for (name, camera, index) in [
        ("ripple-tank", None, 8),
        ("pool", Some("edge"), 20),
        ("pool", Some("under water"), 20),
        ("lagoon", None, 10),
        ("calm-bay", None, 0),
        ("swell", None, 5),
    ] {
        let scene = scene(name);
        let frame = frame(&scene, index);
        let view = view(&scene, camera, SIZE);
        let truth = truth_image(&scene, &frame, &view);
        let mut renderer = gpu(Technique::Heightfield);
        let (image, report) = gpu_image(&mut renderer, &scene, &frame, &view);
        keep(
            &format!(
                "heightfield-{name}-{}",
                camera.unwrap_or("first").replace(' ', "-")
            ),
            &[&truth, &image],
        );
        let flip = score(&truth, &image, None);
        println!(
            "{name} {camera:?}: {flip:?} rmse {} {report:?}",
            rmse(&truth, &image, None)
        );
        assert!(flip.mean <= 0.02, "{name} {camera:?}: {flip:?}");
    }
}

/// Pixels between where the ray tracer's refracted ray ends and where the technique takes it to end: median and 99th
/// percentile.
fn places(
    technique: Technique,
    change: impl Fn(&mut Settings),
    scene: &Scene,
    frame: &Frame,
    view: &View,
) -> (f32, f32) {
    let truth = truth().render_aux(scene, frame, view, &|_| true).unwrap();
    let mut settings = Settings::new(technique);
    change(&mut settings);
    let met = GpuRenderer::new(settings).met(scene, frame, view).unwrap();
    let lens = Lens::new(view).unwrap();
    let project = |p: glam::Vec3| {
        let q = p.as_dvec3() - lens.eye;
        let depth = q.dot(lens.forward);
        let x = q.dot(lens.right) / lens.right.length_squared() / depth;
        let y = q.dot(lens.up) / lens.up.length_squared() / depth;
        glam::vec2(x as f32, y as f32) * 0.5 * view.size.as_vec2()
    };
    let mut errors: Vec<f32> = truth
        .pixels
        .iter()
        .zip(&met)
        .filter(|(t, m)| t.water && m.water && t.refracted_length.is_finite())
        .filter_map(|(t, m)| Some((project(t.refracted) - project(m.refracted?)).length()))
        .collect();
    errors.sort_by(f32::total_cmp);
    assert!(errors.len() > 500, "{}", errors.len());
    (errors[errors.len() / 2], errors[(errors.len() - 1) * 99 / 100])
}

#[test]
fn heightfield_finds_refracted_places_to_half_a_pixel() {
    let scene = scene("pool");
    let frame = frame(&scene, 20);
    let edge = view(&scene, Some("edge"), SIZE);
    let beside = View {
        position: glam::vec3(-1.6, -0.4, 1.0),
        target: glam::vec3(3.0, -0.7, 2.0),
        ..edge.clone()
    };
    for (name, view) in [("from the edge", edge), ("through the glass", beside)] {
        let (median, most) = places(Technique::Heightfield, |_| {}, &scene, &frame, &view);
        println!("{name}: median {median} px, 99th percentile {most} px");
        assert!(most <= 0.5, "{name}: {most}");
    }
}

/// On flat water the broad phase is exact at its vertices: what is left is the straight edges between them, a pixel's own
/// width (its place is that of its middle), and silhouettes.
#[test]
fn two_phase_is_exact_on_flat_water() {
    let scene = scene("pool");
    let flat = Frame::new(scene.grid);
    let view = view(&scene, Some("edge"), SIZE);
    let (median, _) = places(
        Technique::TwoPhase,
        |s| s.tessellation = 0.01,
        &scene,
        &flat,
        &view,
    );
    let (_, most) = places(Technique::TwoPhase, |_| {}, &scene, &flat, &view);
    println!("median {median} px, 99th percentile {most} px");
    assert!(median <= 0.02 && most <= 1.0, "{median} {most}");
}

/// Waves of slopes up to 0.2: the narrow phase is better than the broad one alone, and both phases than every baseline.
#[test]
fn two_phases_are_better_than_one_and_than_the_baselines() {
    let scene = scene("pool");
    let mut frame = Frame::new(scene.grid);
    let spec = scene.grid;
    frame.elevation = Grid::from_fn(spec, |i, j| {
        let p = spec.position(i, j);
        0.02 * (5.0 * p.x + 3.0 * p.y).sin() + 0.008 * (9.0 * p.y - 4.0 * p.x).sin()
    });
    let view = view(&scene, Some("edge"), SIZE);
    let truth = truth_image(&scene, &frame, &view);
    let water: Vec<bool> = crate::support::truth()
        .render_aux(&scene, &frame, &view, &|_| true)
        .unwrap()
        .pixels
        .iter()
        .map(|p| p.water)
        .collect();
    let (both, _) = places(Technique::TwoPhase, |_| {}, &scene, &frame, &view);
    let (broad, _) = places(
        Technique::TwoPhase,
        |s| s.switches.narrow_steps = 0,
        &scene,
        &frame,
        &view,
    );
    println!("median {both} px with the narrow phase, {broad} px without");
    assert!(both < 0.5 * broad);
    let mut scores = Vec::new();
    for technique in Technique::ALL {
        let (image, _) = gpu_image(&mut gpu(technique), &scene, &frame, &view);
        let flip = score(&truth, &image, Some(&water)).mean;
        keep(
            &format!("lively-{}", technique.name().replace(':', "-")),
            &[&truth, &image],
        );
        println!("{}: {flip}", technique.name());
        scores.push((technique, flip));
    }
    let of = |which| scores.iter().find(|(t, _)| *t == which).unwrap().1;
    for worse in [
        Technique::NoRefraction,
        Technique::Offset,
        Technique::ScreenSpace,
        Technique::DistanceField,
    ] {
        assert!(of(Technique::TwoPhase) < of(worse), "{worse:?}");
    }
    assert!(of(Technique::Heightfield) < 0.02);
}

/// The paper's own walk finds what the exact one finds, but for what is thinner than its radius.
#[test]
fn the_safety_radius_is_nearly_exact_on_gentle_water() {
    let scene = scene("pool");
    let frame = frame(&scene, 20);
    let view = view(&scene, Some("edge"), SIZE);
    let (median, _) = places(
        Technique::Heightfield,
        |s| s.walk = Walk::Safety,
        &scene,
        &frame,
        &view,
    );
    println!("median {median} px");
    assert!(median <= 0.1, "{median}");
}

/// With a radius a texel, and with heights in 16 bits, places are found to a fraction of a pixel; the latter in half the memory.
#[test]
fn radii_a_texel_and_heights_in_sixteen_bits() {
    let scene = scene("pool");
    let frame = frame(&scene, 20);
    let view = view(&scene, Some("edge"), SIZE);
    let of = |walk, heights| {
        let change = |s: &mut Settings| (s.walk, s.heights) = (walk, heights);
        places(Technique::Heightfield, change, &scene, &frame, &view).1
    };
    let map = of(Walk::SafetyMap, Heights::Single);
    let sixteen = of(Walk::Pyramid, Heights::Sixteen);
    println!("99th percentile {map} px with radii, {sixteen} px in 16 bits");
    assert!(map <= 0.5 && sixteen <= 0.5, "{map} {sixteen}");
    let words = |heights| {
        let mut settings = Settings::new(Technique::Heightfield);
        settings.heights = heights;
        Facts::of_scene(&scene, &scene.grid, SIZE, &settings)
            .unwrap()
            .height_words()
    };
    let (single, sixteen) = (words(Heights::Single), words(Heights::Sixteen));
    assert!(20 * sixteen <= 11 * single, "{sixteen} {single}");
}

/// Four samples a pixel, or four more rays where pixels differ, come nearer to the ray tracer's many at the edges of things.
#[test]
fn multisampling_takes_away_stairs() {
    let scene = scene("pool");
    let frame = frame(&scene, 20);
    let mut view = view(&scene, Some("edge"), SIZE);
    view.samples = 16;
    let truth = truth_image(&scene, &frame, &view);
    view.samples = 1;
    let places = crate::support::truth()
        .render_aux(&scene, &frame, &view, &|_| true)
        .unwrap();
    // Pixels in front of the water, where triangles are all that there is.
    let dry: Vec<bool> = places.pixels.iter().map(|p| !p.water).collect();
    for technique in [Technique::TwoPhase, Technique::Heightfield] {
        let of = |multisampled| {
            let mut settings = Settings::new(technique);
            settings.switches.multisampled = multisampled;
            let (image, report) = gpu_image(&mut GpuRenderer::new(settings), &scene, &frame, &view);
            keep(
                &format!("multisampled-{technique:?}-{multisampled}"),
                &[&truth, &image],
            );
            assert_eq!(
                technique == Technique::Heightfield && multisampled,
                report.stages.iter().any(|(name, _)| *name == "edges"),
                "{report:?}"
            );
            (rmse(&truth, &image, Some(&dry)), rmse(&truth, &image, None))
        };
        let (one, four) = (of(false), of(true));
        println!("{technique:?}: 1 sample {one:?}, 4 samples {four:?} (dry, all)");
        assert!(
            four.0 < 0.8 * one.0 && four.1 < one.1,
            "{technique:?}: {one:?} {four:?}"
        );
    }
}

/// Foam, droplets, and the sides of an aquarium with the ball and the box behind them.
#[test]
fn foam_droplets_and_glass_are_the_truth_too() {
    let scene = scene("pool");
    let mut frame = frame(&scene, 20);
    let spec = scene.grid;
    frame.foam = Some(Grid::from_fn(spec, |i, j| {
        let p = spec.position(i, j) - glam::vec2(3.5, 2.0);
        (1.2 - p.length()).clamp(0.0, 1.0)
    }));
    let mut droplets = meniscus_sim::Droplets::default();
    for k in 0..60 {
        let a = k as f32 * 0.7;
        droplets.position.push(glam::vec3(
            3.0 + 1.3 * a.sin(),
            0.2 + 0.01 * k as f32,
            2.0 + 1.1 * (1.7 * a).cos(),
        ));
        droplets.velocity.push(glam::Vec3::ZERO);
        droplets.radius.push(0.02 + 0.001 * k as f32);
    }
    frame.droplets = Some(droplets);
    let edge = view(&scene, Some("edge"), SIZE);
    let beside = View {
        position: glam::vec3(-1.6, -0.4, 1.0),
        target: glam::vec3(3.0, -0.7, 2.0),
        ..edge.clone()
    };
    for (name, view) in [("foam", &edge), ("aquarium", &beside)] {
        let truth = truth_image(&scene, &frame, view);
        let (image, _) = gpu_image(&mut gpu(Technique::Heightfield), &scene, &frame, view);
        keep(&format!("heightfield-{name}"), &[&truth, &image]);
        let flip = score(&truth, &image, None);
        println!("{name}: {flip:?}");
        assert!(flip.mean <= 0.01, "{name}: {flip:?}");
    }
}

/// More samples a pixel come nearer to what the ray tracer makes of many.
#[test]
fn samples_take_away_stairs() {
    let scene = scene("pool");
    let frame = frame(&scene, 20);
    let mut view = view(&scene, Some("edge"), UVec2::new(48, 27));
    view.samples = 64;
    let truth = truth_image(&scene, &frame, &view);
    let mut renderer = gpu(Technique::Heightfield);
    let [one, eight] = [1, 8].map(|samples| {
        view.samples = samples;
        rmse(&truth, &gpu_image(&mut renderer, &scene, &frame, &view).0, None)
    });
    println!("1 sample {one}, 8 samples {eight}");
    assert!(eight < 0.6 * one, "{one} {eight}");
}

/// Flat water shows every pixel what the broad phase drew there; waves send some rays beyond the picture's edge, which are counted.
#[test]
fn what_lies_beyond_the_picture_is_counted() {
    let scene = scene("pool");
    let mut frame = Frame::new(scene.grid);
    // All of it is water, far from the walls.
    let view = View {
        position: glam::vec3(3.0, 1.2, 2.0),
        target: glam::vec3(3.0, 0.0, 1.7),
        vertical_fov: 0.5,
        ..view(&scene, Some("edge"), SIZE)
    };
    let mut renderer = gpu(Technique::TwoPhase);
    let mut beyond = |frame: &Frame| {
        gpu_image(&mut renderer, &scene, frame, &view);
        renderer.missing()[0]
    };
    let calm = beyond(&frame);
    let spec = scene.grid;
    frame.elevation = Grid::from_fn(spec, |i, j| {
        0.01 * (8.0 * (spec.position(i, j).x + spec.position(i, j).y)).sin()
    });
    let lively = beyond(&frame);
    let border = 2 * (SIZE.x + SIZE.y);
    println!("{calm} pixels on flat water, {lively} on waves, of {border} at the border");
    assert!(
        calm == 0 && lively > border / 20 && lively < 4 * border,
        "{calm} {lively}"
    );
}
