//! Pictures that stay on the device of the window.

use crate::canvas::read;
use crate::support::{Folder, TRAY, run, scene, wait};
use meniscus::app::model::display::Display;
use meniscus::app::model::nobody;
use meniscus::app::model::player::Player;
use meniscus::app::model::recent::Recent;
use meniscus::app::model::renderers::{self, Choices};
use meniscus_render_cpu::camera;
use meniscus_render_cpu::tonemap::ToneMap;
use meniscus_render_gpu::device::Gpu;
use meniscus_render_gpu::{GpuRenderer, Settings, Technique};
use meniscus_sim::glam::UVec2;
use meniscus_sim::render::{Image, Renderer as _};
use meniscus_sim::{Frame, FrameSource as _};
use std::sync::Arc;

#[test]
fn what_is_shown_without_leaving_the_device_is_what_would_be_saved() {
    let gpu = Arc::new(Gpu::open().unwrap());
    let scene = scene(TRAY);
    let mut frame = Frame::new(scene.grid);
    run(&scene).read_into(&mut frame).unwrap();
    let size = UVec2::new(128, 72);
    let view = camera::view(&scene, None, size, 2).unwrap();
    let display = Display::new(Arc::clone(&gpu));
    let mut renderer = GpuRenderer::on(Settings::new(Technique::ALL[0]), Arc::clone(&gpu));
    for exposure in [0.0, -2.5, 3.0] {
        let map = ToneMap::new(exposure);
        renderer
            .render_resident(&scene, &frame, &view, &|_| true)
            .unwrap();
        let (on, picture) = renderer.picture().unwrap();
        assert!(Arc::ptr_eq(on, &gpu));
        let shown = read(&gpu, &display.show(picture, size, &map));
        let mut image = Image::default();
        renderer
            .render(&scene, &frame, &view, &mut image, &|_| true)
            .unwrap();
        let saved = map.image(&image);
        let off = saved
            .chunks_exact(3)
            .zip(shown.chunks_exact(4))
            .flat_map(|(a, b)| (0..3).map(|c| a[c].abs_diff(b[c])).collect::<Vec<_>>());
        // A power function of a device may be off by a few units of the last place.
        let most = off.max().unwrap();
        assert!(most <= 1, "{most} at {exposure} stops");
        assert!(shown.chunks_exact(4).all(|pixel| pixel[3] == 255));
    }
    // Who shares a device does not take it along.
    drop((renderer, display));
    assert!(gpu.lost().is_none());
}

#[test]
fn a_player_leaves_pictures_on_the_device_and_fetches_one_to_save_it() {
    let folder = Folder::new();
    let gpu = Arc::new(Gpu::open().unwrap());
    let shared = Some(Arc::clone(&gpu));
    let choices = Choices::of_machine();
    let mut player =
        Player::with_renderers(choices, Recent::default(), nobody(), renderers::make, shared).unwrap();
    player.open(&folder.record("run.mrec", TRAY), Vec::new());
    let size = UVec2::new(64, 40);
    let mut now = 0.0;
    let mut update = |player: &mut Player| {
        now += 0.02;
        player.update(now, size);
        if let Some(session) = &mut player.session {
            session.clock.playing = false;
        }
    };
    let drawn = wait("a picture", || {
        update(&mut player);
        player.drawn.clone()
    });
    assert!(drawn.left.texture.is_some() && drawn.left.pixels.is_empty());
    player.screenshot(&folder.path(""));
    let file = folder.path(&format!("run_{:.3}s.png", drawn.left.time));
    wait("the file", || {
        update(&mut player);
        file.exists().then_some(())
    });
    // The device goes: the next picture is drawn on another, and comes here.
    gpu.device.destroy();
    player.session.as_mut().unwrap().camera.zoom(1.5);
    wait("a picture from another device", || {
        update(&mut player);
        let drawn = player.drawn.clone()?;
        (!drawn.left.pixels.is_empty()
            && drawn.left.texture.is_none()
            && drawn.view.position == player.session.as_ref()?.camera.position())
        .then_some(())
    });
}
