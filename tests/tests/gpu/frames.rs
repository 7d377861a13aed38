//! What the renderer must survive: long recordings, other sizes, a lost device, too much for the adapter.

use crate::support::*;
use glam::UVec2;
use meniscus_render_gpu::Technique;
use meniscus_sim::render::{Image, RenderError, Renderer as _};
use meniscus_sim::{Grid, GridSpec};

const SMALL: UVec2 = UVec2::new(14, 8);

#[test]
fn a_frame_is_drawn_twice_to_the_same_bits() {
    let scene = scene("pool");
    let frame = frame(&scene, 6);
    let view = view(&scene, None, UVec2::new(24, 16));
    for technique in [
        Technique::Heightfield,
        Technique::TwoPhase,
        Technique::DistanceField,
    ] {
        let mut renderer = gpu(technique);
        let (first, _) = gpu_image(&mut renderer, &scene, &frame, &view);
        let (second, _) = gpu_image(&mut renderer, &scene, &frame, &view);
        assert!(first == second, "{technique:?}");
        if technique == Technique::Heightfield {
            // Also on a device of its own.
            let (third, _) = gpu_image(&mut gpu(technique), &scene, &frame, &view);
            assert!(second == third);
        }
    }
}

#[test]
fn five_hundred_frames_stream_without_growth() {
    // A driver may keep some; before its uniforms were moved to storage buffers, lavapipe kept 12 MB a frame.
    const MOST: u64 = 32 << 20;
    let scene = scene("ripple-tank");
    let mut frame = frame(&scene, 0);
    let view = view(&scene, None, UVec2::new(8, 6));
    let mut renderer = gpu(Technique::Heightfield);
    let mut image = Image::default();
    let mut held = 0;
    let mut pipelines = 0;
    let mut resident = None;
    for k in 0..500_u32 {
        // A wave that goes round, so that every frame is another one.
        for (n, h) in frame.elevation.as_mut_slice().iter_mut().enumerate() {
            *h = 0.01 * (0.3 * n as f32 + 0.2 * k as f32).sin();
        }
        frame.index = u64::from(k);
        renderer
            .render(&scene, &frame, &view, &mut image, &|_| true)
            .unwrap();
        if k == 1 {
            (held, pipelines) = (renderer.held_bytes(), renderer.pipelines());
        }
        if k == 100 {
            resident = resident_bytes();
        }
    }
    assert_eq!((renderer.held_bytes(), renderer.pipelines()), (held, pipelines));
    if let (Some(before), Some(after)) = (resident, resident_bytes()) {
        let grown = after.saturating_sub(before);
        eprintln!("the process grew by {grown} bytes in 400 frames");
        assert!(grown <= MOST, "{grown} bytes in 400 frames");
    }
    assert!(image.pixels.iter().all(|p| p.is_finite()));
}

/// Bytes of this process in memory, where the system tells.
fn resident_bytes() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|line| line.starts_with("VmRSS:"))?;
    Some(1024 * line.split_whitespace().nth(1)?.parse::<u64>().ok()?)
}

#[test]
fn a_hundred_sizes_and_back_hold_what_the_first_held() {
    let scene = scene("ripple-tank");
    let frame = frame(&scene, 3);
    for technique in [Technique::Heightfield, Technique::TwoPhase] {
        let mut renderer = gpu(technique);
        let first = view(&scene, None, SMALL);
        let (before, _) = gpu_image(&mut renderer, &scene, &frame, &first);
        let held = renderer.held_bytes();
        for k in 0..100_u32 {
            let view = view(&scene, None, UVec2::new(1 + k % 13, 1 + k % 7));
            gpu_image(&mut renderer, &scene, &frame, &view);
        }
        let (after, _) = gpu_image(&mut renderer, &scene, &frame, &first);
        assert!(before == after);
        // A buffer may stay up to four times as large as it must be.
        assert!(
            renderer.held_bytes() <= 4 * held,
            "{} {held}",
            renderer.held_bytes()
        );
    }
}

#[test]
fn a_frame_of_another_grid_is_drawn_as_if_it_were_the_first() {
    let scene = scene("ripple-tank");
    let coarse = frame(&scene, 5);
    let spec = *coarse.spec();
    let fine_spec = GridSpec::new(spec.origin, 0.5 * spec.spacing, 2 * spec.size - 1).unwrap();
    let mut fine = meniscus_sim::Frame::new(fine_spec);
    fine.elevation = Grid::from_fn(fine_spec, |i, j| {
        coarse.elevation.sample(fine_spec.position(i, j))
    });
    let view = view(&scene, None, SMALL);
    let mut renderer = gpu(Technique::Heightfield);
    gpu_image(&mut renderer, &scene, &coarse, &view);
    let (after, _) = gpu_image(&mut renderer, &scene, &fine, &view);
    let (alone, _) = gpu_image(&mut gpu(Technique::Heightfield), &scene, &fine, &view);
    assert!(after == alone);
    let (back, _) = gpu_image(&mut renderer, &scene, &coarse, &view);
    let (fresh, _) = gpu_image(&mut gpu(Technique::Heightfield), &scene, &coarse, &view);
    assert!(back == fresh);
}

/// Frames in which only the water moves share one voxel field; a body that moves makes another.
#[test]
fn a_voxel_field_stands_until_something_moves() {
    let scene = scene("pool");
    let mut frame = frame(&scene, 3);
    let view = view(&scene, None, SMALL);
    let mut renderer = gpu(Technique::DistanceField);
    let (first, _) = gpu_image(&mut renderer, &scene, &frame, &view);
    for h in frame.elevation.as_mut_slice() {
        *h *= 0.5;
    }
    let (calmer, _) = gpu_image(&mut renderer, &scene, &frame, &view);
    assert!(first != calmer);
    assert_eq!(renderer.voxel_fields(), 1);
    let mut poses: Vec<_> = (0..scene.description.objects.len())
        .map(|k| {
            let at = meniscus_sim::stage::objects::standing(&scene, &frame, k).unwrap();
            let mut pose = meniscus_sim::BodyPose::default();
            (pose.position, pose.rotation) = (at.position.as_vec3(), at.rotation.as_quat());
            pose
        })
        .collect();
    poses[0].position.x += 0.5;
    frame.bodies = Some(poses);
    let (moved, _) = gpu_image(&mut renderer, &scene, &frame, &view);
    assert_eq!(renderer.voxel_fields(), 2);
    assert!(gpu_image(&mut gpu(Technique::DistanceField), &scene, &frame, &view).0 == moved);
}

#[test]
fn a_lost_device_is_replaced() {
    let scene = scene("ripple-tank");
    let frame = frame(&scene, 3);
    let view = view(&scene, None, SMALL);
    let mut renderer = gpu(Technique::Heightfield);
    let (before, _) = gpu_image(&mut renderer, &scene, &frame, &view);
    renderer.lose_device();
    let (after, _) = gpu_image(&mut renderer, &scene, &frame, &view);
    assert!(before == after);
}

#[test]
fn what_is_too_large_or_impossible_is_refused_by_name() {
    let scene = scene("ripple-tank");
    let mut still = frame(&scene, 0);
    let mut renderer = gpu(Technique::Heightfield);
    let mut image = Image::default();
    // Wider than the textures of any adapter that is common today, as long as it is within what an image may be.
    let wide = view(&scene, None, UVec2::new(16_384, 16_384));
    match renderer.render(&scene, &still, &wide, &mut image, &|_| true) {
        Err(RenderError::Unsupported { what, .. }) => {
            assert!(what.contains("16384") || what.contains("bytes"), "{what}");
            assert!(what.contains("adapter `"), "{what}");
        }
        other => panic!("{other:?}"),
    }
    let view = view(&scene, None, SMALL);
    assert!(matches!(
        renderer.render(&scene, &still, &view, &mut image, &|_| false),
        Err(RenderError::Interrupted)
    ));
    let inside = meniscus_sim::render::View {
        position: view.target - glam::Vec3::new(1.0, 40.0, 0.0),
        ..view.clone()
    };
    let error = renderer
        .render(&scene, &still, &inside, &mut image, &|_| true)
        .unwrap_err();
    assert!(error.to_string().contains("inside the ground"), "{error}");
    still.elevation.as_mut_slice()[7] = f32::NAN;
    let error = renderer
        .render(&scene, &still, &view, &mut image, &|_| true)
        .unwrap_err();
    assert!(error.to_string().contains("elevation"), "{error}");
    // And it still draws.
    still.elevation.as_mut_slice()[7] = 0.0;
    gpu_image(&mut renderer, &scene, &still, &view);
}
