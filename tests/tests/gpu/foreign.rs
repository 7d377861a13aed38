//! Depth, written and honoured: callers draw their own geometry among the water.

use crate::support::*;
use glam::{UVec2, Vec3};
use meniscus_render_gpu::{Foreign, Settings, Technique};
use meniscus_sim::render::{Image, RenderError};
use meniscus_sim::stage::Lens;

const SIZE: UVec2 = UVec2::new(64, 36);

/// Distances are those to what the ray tracer meets first.
#[test]
fn distances_are_those_of_the_truth() {
    let scene = scene("pool");
    let frame = frame(&scene, 20);
    for (camera, technique) in [
        ("edge", Technique::Heightfield),
        ("under water", Technique::TwoPhase),
    ] {
        let view = view(&scene, Some(camera), SIZE);
        let truth = truth().render_aux(&scene, &frame, &view, &|_| true).unwrap();
        let distances = gpu(technique).distances(&scene, &frame, &view).unwrap();
        let mut off: Vec<f32> = truth
            .pixels
            .iter()
            .zip(&distances)
            .filter(|(t, _)| t.distance.is_finite())
            .map(|(t, d)| (d / t.distance - 1.0).abs())
            .collect();
        off.sort_by(f32::total_cmp);
        let (median, most) = (off[off.len() / 2], off[off.len() * 95 / 100]);
        println!("{camera} {technique:?}: median {median}, 95th percentile {most}");
        // Triangles leave the patches that rays meet by a quarter of their twist.
        assert!(
            median < 1e-4 && most < 1e-2,
            "{camera} {technique:?}: {median} {most}"
        );
        let sky = truth.pixels.iter().zip(&distances);
        let agree = sky
            .filter(|(t, d)| t.distance.is_finite() == d.is_finite())
            .count();
        assert!(agree >= distances.len() * 99 / 100, "{agree}");
    }
}

/// A ball of the caller's that hangs half in the water is seen where it is nearer than water and walls, and nowhere else.
#[test]
fn what_the_caller_draws_hides_and_is_hidden() {
    let scene = scene("pool");
    let frame = frame(&scene, 20);
    let view = view(&scene, Some("edge"), SIZE);
    let lens = Lens::new(&view).unwrap();
    let (centre, radius) = (glam::dvec3(3.0, 0.0, 2.0), 0.6);
    let colour = Vec3::new(0.1, 0.9, 0.2);
    let mut layer = Foreign {
        size: SIZE,
        radiance: vec![colour; (SIZE.x * SIZE.y) as usize],
        distance: Vec::new(),
    };
    for k in 0..SIZE.x * SIZE.y {
        let at = (UVec2::new(k % SIZE.x, k / SIZE.x).as_dvec2() + 0.5) / SIZE.as_dvec2();
        let d = (lens.forward + (2.0 * at.x - 1.0) * lens.right + (1.0 - 2.0 * at.y) * lens.up).normalize();
        let to = centre - lens.eye;
        let along = to.dot(d);
        let inside = radius * radius - (to - along * d).length_squared();
        layer.distance.push(if inside > 0.0 {
            (along - inside.sqrt()) as f32
        } else {
            f32::INFINITY
        });
    }
    for (technique, multisampled) in [
        (Technique::Heightfield, false),
        (Technique::Heightfield, true),
        (Technique::TwoPhase, true),
    ] {
        let mut settings = Settings::new(technique);
        settings.switches.multisampled = multisampled;
        let mut renderer = meniscus_render_gpu::GpuRenderer::new(settings);
        let (without, _) = gpu_image(&mut renderer, &scene, &frame, &view);
        let distances = renderer.distances(&scene, &frame, &view).unwrap();
        let mut with = Image::default();
        renderer
            .render_with(&scene, &frame, &view, &layer, &mut with)
            .unwrap();
        keep(
            &format!("foreign-{technique:?}-{multisampled}"),
            &[&without, &with],
        );
        let (mut shown, mut hidden) = (0, 0);
        // Pixels beside those that show the ball may get more rays because of it.
        let beside = |k: usize| {
            let w = SIZE.x as usize;
            [k.wrapping_sub(1), k + 1, k.wrapping_sub(w), k + w]
                .into_iter()
                .any(|n| {
                    layer
                        .distance
                        .get(n)
                        .is_some_and(|theirs| *theirs < 1.01 * distances[n])
                })
        };
        for (k, (&theirs, &ours)) in layer.distance.iter().zip(&distances).enumerate() {
            // Four samples of a pixel at an edge are some of each.
            if (theirs / ours - 1.0).abs() < if multisampled { 0.1 } else { 1e-5 } {
                continue;
            }
            if theirs < ours {
                // An edge of the caller's is an edge of the picture: more rays at places of the same pixel, where the
                // same lies in front.
                assert!((with.pixels[k] - colour).length() < 1e-3, "{technique:?} {k}");
                shown += 1;
            } else if !(multisampled && technique == Technique::Heightfield && beside(k)) {
                assert!(with.pixels[k] == without.pixels[k], "{technique:?} {k}");
                hidden += u32::from(theirs.is_finite());
            }
        }
        println!("{technique:?}: {shown} pixels shown, {hidden} hidden");
        assert!(shown > 30 && hidden > 10, "{shown} {hidden}");
        // And the next picture is without it again.
        assert!(gpu_image(&mut renderer, &scene, &frame, &view).0 == without);
    }
    layer.radiance.pop();
    let refused =
        gpu(Technique::Heightfield).render_with(&scene, &frame, &view, &layer, &mut Image::default());
    assert!(matches!(refused, Err(RenderError::View { .. })));
}
