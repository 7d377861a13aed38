//! Time stands until something of what was opened can be seen.

use crate::support::{Driven, Folder, TRAY, wait};
use meniscus::app::model::drawing::Made;
use meniscus::app::model::nobody;
use meniscus::app::model::player::Player;
use meniscus::app::model::recent::Recent;
use meniscus::app::model::renderers::{self, Choices};
use meniscus_render_gpu::device::Gpu;
use meniscus_sim::glam::UVec2;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// Whether the shaders are made at last.
static MADE: AtomicBool = AtomicBool::new(false);

/// Takes as long as it is told to make a renderer.
fn slow(name: &str, _: Option<&Arc<Gpu>>) -> Result<Made, String> {
    while !MADE.load(Ordering::Acquire) {
        std::thread::sleep(Duration::from_millis(2));
    }
    renderers::make(name, None)
}

#[test]
fn time_stands_until_the_first_picture_is_there() {
    let folder = Folder::new();
    for path in [folder.record("run.mrec", TRAY), folder.write("tray.toml", TRAY)] {
        MADE.store(false, Ordering::Release);
        let choices = Choices::with_adapter(None);
        let player = Player::with_renderers(choices, Recent::default(), nobody(), slow, None).unwrap();
        let mut driven = Driven::new(player);
        driven.player.open(&path, Vec::new());
        driven.until("the first frame", |p| p.session.as_ref()?.moment.clone());
        for _ in 0..20 {
            driven.now += 0.05;
            driven.player.update(driven.now, UVec2::new(48, 32));
            std::thread::sleep(Duration::from_millis(5));
        }
        let clock = &driven.player.session.as_ref().unwrap().clock;
        assert!(
            driven.player.waits() && clock.playing && clock.time == 0.0,
            "{clock:?}"
        );
        assert_eq!(driven.moment().frame.index, 0);
        MADE.store(true, Ordering::Release);
        wait("frame 5", || {
            driven.pass(0.02);
            (driven.moment().frame.index >= 5).then_some(())
        });
    }
}

/// Nothing works.
fn none(_: &str, _: Option<&Arc<Gpu>>) -> Result<Made, String> {
    Err("the device was lost".to_owned())
}

#[test]
fn what_cannot_be_drawn_at_all_plays_nevertheless() {
    let folder = Folder::new();
    let choices = Choices::with_adapter(None);
    let player = Player::with_renderers(choices, Recent::default(), nobody(), none, None).unwrap();
    let mut driven = Driven::new(player);
    driven.player.open(&folder.record("run.mrec", TRAY), Vec::new());
    wait("the end", || {
        driven.pass(0.02);
        (driven.player.session.as_ref()?.clock.time >= 1.0).then_some(())
    });
    assert!(driven.messages().contains("lost"), "{}", driven.messages());
}
