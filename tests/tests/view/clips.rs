//! Clips are what is seen.

use crate::support::{Driven, Folder, TRAY};
use meniscus::app::model::clip::{Clip, SIZES};
use meniscus::app::model::renderers;
use meniscus_render_cpu::tonemap::ToneMap;
use meniscus_sim::Frame;
use meniscus_sim::knobs::{Turned, Value};
use meniscus_sim::recording::Reader;
use meniscus_sim::render::Image;
use std::path::Path;

#[test]
fn a_clip_has_the_frames_that_were_asked_for() {
    let folder = Folder::new();
    let mut driven = Driven::opened(&folder.record("run.mrec", TRAY));
    driven.player.clip = Clip {
        first: 2,
        last: 4,
        size: 0,
        kind: 2,
        samples: 1,
    };
    driven.player.write_clip(&folder.path(""));
    assert!(driven.player.clipping().is_some());
    driven.until("the clip", |p| p.clipping().is_none().then_some(()));
    for k in 0..=5 {
        let file = folder.path(&format!("run_{k:06}.png"));
        assert_eq!(file.exists(), (2..=4).contains(&k), "{}", driven.messages());
    }
    let drawn = image::open(folder.path("run_000003.png")).unwrap();
    assert_eq!((drawn.width(), drawn.height()), (480, 270));
}

/// Frame 10 of a recording by `whitted` with these knobs turned, as a clip shows it.
fn drawn(recording: &Path, driven: &Driven, turned: &Turned) -> Vec<u8> {
    let mut reader = Reader::open(recording).unwrap();
    let scene = reader.scene().clone();
    let mut frame = Frame::new(scene.grid);
    reader.read(10, &mut frame).unwrap();
    let session = driven.player.session.as_ref().unwrap();
    let mut renderer = renderers::build("whitted").unwrap();
    renderer.turn(turned);
    let mut image = Image::default();
    renderer
        .render(
            &scene,
            &frame,
            &session.camera.view(SIZES[0], 1),
            &mut image,
            &|_| true,
        )
        .unwrap();
    ToneMap::new(session.exposure).image(&image)
}

#[test]
fn a_clip_follows_the_knobs_that_were_turned() {
    let folder = Folder::new();
    let recording = folder.record("run.mrec", TRAY);
    let mut driven = Driven::opened(&recording);
    driven.player.renderer = "whitted".to_owned();
    let haze = Value::Number {
        now: 0.1,
        range: (0.1, 1000.0),
        unit: "km",
    };
    let fewer = Value::Whole {
        now: 1,
        range: (1, 8),
    };
    let turned = Turned::from([("visual range", haze), ("interfaces", fewer)]);
    // Both are knobs that this renderer has, and neither is as it was.
    for knob in driven.player.knobs().iter() {
        assert!(
            turned.get(knob.name).is_none_or(|value| *value != knob.value),
            "{knob:?}"
        );
    }
    driven.player.turned.insert("whitted".to_owned(), turned.clone());
    let listed = driven.player.knobs();
    assert_eq!(
        listed
            .iter()
            .filter(|knob| turned.get(knob.name) == Some(&knob.value))
            .count(),
        2
    );
    let session = driven.player.session.as_mut().unwrap();
    session.exposure = -0.5;
    session.camera.orbit(meniscus_sim::glam::Vec2::new(0.1, 0.05));
    driven.player.clip = Clip {
        first: 10,
        last: 10,
        size: 0,
        kind: 2,
        samples: 1,
    };
    driven.player.write_clip(&folder.path(""));
    driven.until("the clip", |p| p.clipping().is_none().then_some(()));
    let clip = image::open(folder.path("run_000010.png")).unwrap().to_rgb8();
    let seen = drawn(&recording, &driven, &turned);
    assert!(*clip.as_raw() == seen, "{}", driven.messages());
    // It would have been another picture with the knobs as they are by default.
    let plain = drawn(&recording, &driven, &Turned::new());
    let apart = plain
        .iter()
        .zip(&seen)
        .filter(|(a, b)| a.abs_diff(**b) > 2)
        .count();
    assert!(apart > seen.len() / 20, "{apart} of {}", seen.len());
}
