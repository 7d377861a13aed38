//! Pictures against closed forms: Snell, Fresnel, Beer and Lambert, the white furnace.

mod common;

use common::{draw, floor, frame, scene, square, view};
use meniscus_render_cpu::whitted::AuxiliaryPixel;
use meniscus_render_cpu::{Settings, Whitted};
use meniscus_sim::glam::{DVec3, UVec2, Vec3};
use meniscus_sim::optics;
use meniscus_sim::render::View;
use meniscus_sim::scene::description::{Motion, Object};
use meniscus_sim::scene::description::{Shape, Sky, Sun};

const N: f64 = optics::WATER_INDEX as f64;

/// Unit direction through the middle of a pixel, written out again from the definition of a view.
fn pixel_ray(view: &View, x: u32, y: u32) -> DVec3 {
    let forward = (view.target - view.position).as_dvec3().normalize();
    let right = forward.cross(view.up.as_dvec3()).normalize();
    let up = right.cross(forward);
    let tan = (0.5 * f64::from(view.vertical_fov)).tan();
    let (w, h) = (f64::from(view.size.x), f64::from(view.size.y));
    let u = (2.0 * (f64::from(x) + 0.5) / w - 1.0) * tan * w / h;
    let v = (1.0 - 2.0 * (f64::from(y) + 0.5) / h) * tan;
    (forward + u * right + v * up).normalize()
}

fn exact() -> Whitted {
    Whitted::new(Settings {
        visual_range: None,
        cutoff: 0.0,
        ..Settings::default()
    })
}

#[test]
fn the_floor_below_flat_water_is_seen_where_snell_says() {
    let depth = 1.7;
    for (spacing, origin) in [(0.25_f32, 0.0), (25.0, 1000.0)] {
        // Also with everything a hundred times as large.
        let unit = f64::from(spacing) / 0.25;
        let mut spec = square(65, spacing);
        spec.origin += origin;
        let mut scene = scene(spec);
        floor(&mut scene, -(depth * unit) as f32);
        let middle = 8.0 * unit as f32 + origin;
        let eye = Vec3::new(
            middle - 5.0 * unit as f32,
            2.1 * unit as f32,
            middle + 3.0 * unit as f32,
        );
        let view = view(eye, Vec3::new(middle, 0.0, middle), UVec2::new(160, 120));
        let aux = exact()
            .render_aux(&scene, &frame(spec, |_| 0.0), &view, &|_| true)
            .unwrap();
        let mut worst = 0.0_f64;
        for y in 0..view.size.y {
            for x in 0..view.size.x {
                let d = pixel_ray(&view, x, y);
                let pixel = aux.pixel(x, y);
                if d.y > -0.05 {
                    continue;
                }
                assert!(pixel.water);
                let surface = eye.as_dvec3() - d * (f64::from(eye.y) / d.y);
                let sin = d.x.hypot(d.z) / N;
                let across = DVec3::new(d.x, 0.0, d.z).normalize();
                let truth = surface + across * (sin / (1.0 - sin * sin).sqrt() * depth * unit)
                    - DVec3::Y * depth * unit;
                let seen = pixel.refracted.as_dvec3();
                // Error in pixels: as seen from the eye straight through, at the distance of the point.
                let angle =
                    ((seen - eye.as_dvec3()).normalize() - (truth - eye.as_dvec3()).normalize()).length();
                worst = worst.max(angle / (f64::from(view.vertical_fov) / f64::from(view.size.y)));
                let length = (truth - surface).length();
                assert!((f64::from(pixel.refracted_length) / length - 1.0).abs() < 1e-5);
                let f = f64::from(optics::fresnel(-d.y as f32, 1.0 / optics::WATER_INDEX));
                assert!((f64::from(pixel.fresnel) - f).abs() < 1e-6);
            }
        }
        assert!(worst < 0.01, "{worst} pixels");
    }
}

#[test]
fn a_checkerboard_below_flat_water_changes_colour_where_snell_says() {
    let spec = square(65, 0.25);
    let mut scene = scene(spec);
    floor(&mut scene, -1.0);
    scene.description.ground.checker = 0.5;
    scene.description.ground.albedo = Vec3::ZERO;
    scene.description.ground.shore_albedo = Vec3::ONE;
    let view = view(
        Vec3::new(8.1, 4.0, 8.2),
        Vec3::new(8.1, 0.0, 8.0),
        UVec2::new(200, 150),
    );
    let (image, _) = draw(&mut exact(), &scene, &frame(spec, |_| 0.0), &view);
    let mut tested = 0;
    for y in 0..view.size.y {
        for x in 0..view.size.x {
            let d = pixel_ray(&view, x, y);
            let eye = view.position.as_dvec3();
            let surface = eye - d * (eye.y / d.y);
            let sin = d.x.hypot(d.z) / N;
            let across = DVec3::new(d.x, 0.0, d.z).normalize_or_zero();
            let p = surface + across * (sin / (1.0 - sin * sin).sqrt());
            let (u, v) = (p.x / 0.5, p.z / 0.5);
            // Away from the edges by more than half a filtered pixel.
            if (u - u.round()).abs().min((v - v.round()).abs()) < 0.06 {
                continue;
            }
            let light = (u.floor() + v.floor()).rem_euclid(2.0) == 1.0;
            let f = optics::fresnel(-d.y as f32, 1.0 / optics::WATER_INDEX);
            let expected = if light { 1.0 } else { f };
            let seen = image.pixel(x, y).x;
            assert!(
                (seen - expected).abs() < 2e-3,
                "({x}, {y}): {seen} instead of {expected}"
            );
            tested += 1;
        }
    }
    assert!(tested > 15_000, "{tested}");
}

/// What the camera at depth 5 sees at `angle` from the zenith: (Fresnel, whether there is a refracted ray).
fn from_below(angle: f64, waves: f32) -> AuxiliaryPixel {
    let spec = square(129, 0.5);
    let scene = scene(spec);
    let eye = Vec3::new(32.0, -5.0, 32.0);
    let target = eye.as_dvec3() + DVec3::new(angle.sin(), angle.cos(), 0.0) * 1000.0;
    let view = View {
        vertical_fov: 1e-3,
        ..view(eye, target.as_vec3(), UVec2::ONE)
    };
    let frame = frame(spec, |p| waves * (p.x + 0.7 * p.y).sin());
    *exact()
        .render_aux(&scene, &frame, &view, &|_| true)
        .expect("the scene of the test is drawn")
        .pixel(0, 0)
}

#[test]
fn total_reflection_begins_at_the_critical_angle_to_1e_4() {
    let critical = (1.0 / N).asin();
    let below = from_below(critical - 1e-4, 0.0);
    assert!(below.water && below.fresnel < 1.0 && below.refracted.length() == 0.0);
    let (mut low, mut high) = (critical - 0.01, critical + 0.01);
    while high - low > 1e-6 {
        let middle = 0.5 * (low + high);
        if from_below(middle, 0.0).fresnel < 1.0 {
            low = middle
        } else {
            high = middle
        }
    }
    assert!((0.5 * (low + high) - critical).abs() < 1e-4, "{low} {critical}");
    // Beyond it the reflected ray goes down and is whole.
    let beyond = from_below(critical + 0.2, 0.0);
    assert_eq!(beyond.fresnel, 1.0);
}

#[test]
fn snells_window_has_its_size_and_is_as_bright_as_the_sky() {
    let spec = square(65, 0.5);
    let mut scene = scene(spec);
    floor(&mut scene, -30.0);
    scene.description.ground.albedo = Vec3::ZERO;
    scene.description.ground.shore_albedo = Vec3::ZERO;
    let eye = Vec3::new(16.0, -4.0, 16.0);
    let view = View {
        vertical_fov: 2.0,
        ..view(eye, eye + Vec3::Y, UVec2::splat(256))
    };
    let (image, _) = draw(&mut exact(), &scene, &frame(spec, |_| 0.0), &view);
    let critical = (1.0 / N).asin();
    for y in 0..256 {
        for x in 0..256 {
            let angle = pixel_ray(&view, x, y).y.acos();
            let seen = image.pixel(x, y).x;
            if angle > critical + 0.01 {
                assert!(
                    seen < 1e-6,
                    "black floor is mirrored outside the window: {seen} at {angle}"
                );
            } else if angle < critical - 0.01 {
                let t = 1.0 - optics::fresnel(angle.cos() as f32, optics::WATER_INDEX);
                assert!((seen - t).abs() < 1e-4, "{seen} instead of {t} at {angle}");
            }
        }
    }
}

#[test]
fn absorption_follows_beer_and_lambert_to_1e_6() {
    let spec = square(65, 0.25);
    let mut scene = scene(spec);
    floor(&mut scene, -3.0);
    let absorption = Vec3::new(0.31, 0.047, 0.0092);
    scene.description.water.absorption = absorption;
    // The floor shines by itself as far as the camera can tell: light of a known amount, whatever reached it.
    scene.description.ground.albedo = Vec3::splat(0.5);
    scene.description.ground.shore_albedo = Vec3::splat(0.5);
    let view = view(
        Vec3::new(8.0, 4.0, 13.0),
        Vec3::new(8.0, -1.0, 8.0),
        UVec2::new(60, 40),
    );
    let still = frame(spec, |_| 0.0);
    let (image, _) = draw(&mut exact(), &scene, &still, &view);
    let aux = exact().render_aux(&scene, &still, &view, &|_| true).unwrap();
    // On a level floor under flat water the radiance of the floor is the same everywhere: take it from one pixel and
    // predict all the others by the length of their way through the water.
    let floor_radiance = |x: u32, y: u32| {
        let p = aux.pixel(x, y);
        let way = optics::transmittance(absorption, p.refracted_length);
        (image.pixel(x, y) - Vec3::splat(p.fresnel)) / ((1.0 - p.fresnel) * way)
    };
    let reference = floor_radiance(30, 20);
    for y in 0..40 {
        for x in 0..60 {
            let p = aux.pixel(x, y);
            let way = optics::transmittance(absorption, p.refracted_length);
            let expected = Vec3::splat(p.fresnel) + (1.0 - p.fresnel) * way * reference;
            let error = (image.pixel(x, y) - expected).abs().max_element();
            assert!(error < 1e-6, "({x}, {y}): {error}");
        }
    }
    assert!(
        reference.x < 0.5 * reference.z,
        "red is absorbed on the way down too: {reference}"
    );
}

#[test]
fn a_white_furnace_is_white() {
    // A uniform sky over white ground, clear water with waves of all slopes: every way light can take ends at radiance
    // 1, so every pixel is 1 whatever the interface depth. From above, and from below.
    let spec = square(97, 0.1);
    let mut scene = scene(spec);
    floor(&mut scene, -0.8);
    scene.description.ground.albedo = Vec3::ONE;
    scene.description.ground.shore_albedo = Vec3::ONE;
    let waves = frame(spec, |p| {
        0.12 * (4.0 * p.x + p.y).sin() + 0.1 * (3.0 * p.y - 2.0 * p.x).cos()
    });
    for depth in [1, 3, 6] {
        for eye in [
            Vec3::new(4.0, 1.5, 8.0),
            Vec3::new(4.0, -0.5, 6.0),
            Vec3::new(-20.0, 3.0, 4.0),
        ] {
            let mut renderer = Whitted::new(Settings {
                interface_depth: depth,
                ..Settings::default()
            });
            let view = view(eye, Vec3::new(5.0, -0.2, 4.0), UVec2::new(120, 90));
            let (image, _) = draw(&mut renderer, &scene, &waves, &view);
            for (k, p) in image.pixels.iter().enumerate() {
                assert!(
                    (*p - 1.0).abs().max_element() < 2e-4,
                    "depth {depth}, eye {eye}, pixel {k}: {p}"
                );
            }
        }
    }
}

#[test]
fn what_is_not_reflected_is_refracted() {
    // Sky of radiance 1 over black ground, and the reverse: the two pictures add up to 1.
    let spec = square(97, 0.1);
    let mut dark_ground = scene(spec);
    floor(&mut dark_ground, -0.8);
    dark_ground.description.ground.albedo = Vec3::ZERO;
    dark_ground.description.ground.shore_albedo = Vec3::ZERO;
    let still = frame(spec, |_| 0.0);
    let view = view(
        Vec3::new(4.0, 1.5, 8.0),
        Vec3::new(5.0, -0.2, 4.0),
        UVec2::new(120, 90),
    );
    let (image, _) = draw(&mut exact(), &dark_ground, &still, &view);
    let aux = exact()
        .render_aux(&dark_ground, &still, &view, &|_| true)
        .unwrap();
    for (p, a) in image.pixels.iter().zip(&aux.pixels).filter(|(_, a)| a.water) {
        assert!((p.x - a.fresnel).abs() < 1e-6, "{p} {}", a.fresnel);
    }
}

#[test]
fn a_ball_under_water_throws_its_shadow_where_the_refracted_beam_is_cut() {
    let spec = square(65, 0.25);
    let mut scene = scene(spec);
    floor(&mut scene, -3.0);
    scene.description.ground.shore_albedo = Vec3::splat(0.5);
    scene.description.ground.albedo = Vec3::splat(0.5);
    scene.description.light.sky = Sky::Uniform { radiance: Vec3::ZERO };
    scene.description.light.sun = Some(Sun {
        elevation: 40.0,
        azimuth: 90.0,
        irradiance: Vec3::ONE,
        radius: 0.01,
    });
    scene.description.objects = vec![Object {
        name: "ball".to_owned(),
        shape: Shape::Sphere { radius: 0.3 },
        position: Vec3::new(8.0, -1.0, 8.0),
        rotation: meniscus_sim::glam::Quat::IDENTITY,
        velocity: meniscus_sim::glam::Vec3::ZERO,
        spin: meniscus_sim::glam::Vec3::ZERO,
        density: 1000.0,
        motion: Motion::Fixed,
        color: None,
    }];
    // The sun stands in +X: the beam below goes towards −X at the refracted angle.
    let sin = 40.0_f64.to_radians().cos() / N;
    let shift = 2.0 * sin / (1.0 - sin * sin).sqrt();
    let centre = DVec3::new(8.0 - shift, -3.0, 8.0);
    // Seen from under water, so that only the beam is refracted.
    let eye = Vec3::new(8.0 - shift as f32, -0.2, 8.0);
    let view = View {
        vertical_fov: 1.2,
        ..view(eye, centre.as_vec3(), UVec2::splat(101))
    };
    let (image, _) = draw(&mut exact(), &scene, &frame(spec, |_| 0.0), &view);
    let level = image.pixel(5, 50).x;
    let (mut sum, mut count) = (DVec3::ZERO, 0.0);
    for y in 0..101 {
        for x in 0..101 {
            let d = pixel_ray(&view, x, y);
            let p = eye.as_dvec3() + d * ((-3.0 - f64::from(eye.y)) / d.y);
            if (p - centre).length() < 0.8 && image.pixel(x, y).x < 0.6 * level {
                sum += p;
                count += 1.0;
            }
        }
    }
    assert!(count > 50.0 && level > 0.0);
    // The shadow's centre, to a pixel of 38 mm.
    assert!((sum / count - centre).length() < 0.02, "{} {centre}", sum / count);
}
