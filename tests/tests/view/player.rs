//! What the window does, without a window.

use crate::support::{BASIN, Driven, Folder, TRAY, player, pointer, wait};
use meniscus::app::model::drawing::Made;
use meniscus::app::model::live::Command;
use meniscus::app::model::nobody;
use meniscus::app::model::player::{Mode, Player, recording_name};
use meniscus::app::model::quality::Quality;
use meniscus::app::model::recent::Recent;
use meniscus::app::model::renderers::{self, Choices};
use meniscus::app::model::session::RecordingState;
use meniscus::app::model::touch::{Pointer, Tool};
use meniscus_render_gpu::device::Gpu;
use meniscus_sim::events::Action;
use meniscus_sim::glam::{UVec2, Vec2};
use meniscus_sim::knobs::{Turned, Value};
use meniscus_sim::recording::Reader;
use std::io::{Seek as _, SeekFrom, Write as _};
use std::sync::Arc;

#[test]
fn a_recording_plays_seeks_loops_and_stops_at_its_end() {
    let folder = Folder::new();
    let path = folder.record("run.mrec", TRAY);
    let mut driven = Driven::opened(&path);
    assert_eq!(driven.moment().frame.index, 0);
    let session = driven.player.session.as_mut().unwrap();
    assert_eq!(session.replay().unwrap().times().len(), 21);
    assert_eq!(session.clock.range, (0.0, 1.0));
    // Frame 7 is the nearest to 0.36 s.
    session.clock.seek(0.36);
    driven.until("frame 7", |p| {
        (p.session.as_ref()?.moment.as_ref()?.frame.index == 7).then_some(())
    });
    let session = driven.player.session.as_mut().unwrap();
    session.step(false);
    session.step(false);
    session.step(true);
    driven.until("frame 8", |p| {
        (p.session.as_ref()?.moment.as_ref()?.frame.index == 8).then_some(())
    });
    // Real time is kept: after half a second at double speed it stands at the end and stops.
    let session = driven.player.session.as_mut().unwrap();
    session.clock.set_speed(2.0);
    session.toggle();
    driven.pass(0.5);
    driven.until("the last frame", |p| {
        (p.session.as_ref()?.moment.as_ref()?.frame.index == 20).then_some(())
    });
    let session = driven.player.session.as_mut().unwrap();
    assert!(!session.clock.playing);
    session.clock.looping = true;
    session.toggle();
    driven.pass(1.3);
    let session = driven.player.session.as_mut().unwrap();
    assert!(session.clock.playing && session.clock.time < 1.0);
    // What was decoded stays bounded, and every frame that was shown is in the plots.
    let (kept, most) = session.replay().unwrap().kept();
    assert!(kept <= most);
    assert!(session.history.len() > 3);
    assert_eq!(driven.messages().matches("no graphics adapter").count(), 1);
}

#[test]
fn a_damaged_frame_is_told_and_the_others_play() {
    let folder = Folder::new();
    let path = folder.record("run.mrec", TRAY);
    let reader = Reader::open(&path).unwrap();
    let at = reader.header_bytes() + (reader.file_bytes() - reader.header_bytes()) / 2;
    drop(reader);
    let mut file = std::fs::OpenOptions::new().write(true).open(&path).unwrap();
    file.seek(SeekFrom::Start(at)).unwrap();
    file.write_all(&[0x55; 24]).unwrap();
    drop(file);
    let mut driven = Driven::opened(&path);
    let session = driven.player.session.as_mut().unwrap();
    session.clock.playing = true;
    for _ in 0..120 {
        driven.pass(0.01);
        std::thread::sleep(std::time::Duration::from_millis(2));
    }
    driven.until("the last frame", |p| {
        (p.session.as_ref()?.moment.as_ref()?.frame.index == 20).then_some(())
    });
    assert!(driven.messages().contains("damaged"), "{}", driven.messages());
}

#[test]
fn wrong_files_are_told_and_what_was_open_stays() {
    let folder = Folder::new();
    let path = folder.record("run.mrec", TRAY);
    let mut driven = Driven::opened(&path);
    let bad = folder.write("bad.toml", "name = 3\n");
    for file in [
        bad,
        folder.path("absent.mrec"),
        folder.write("text.mrec", "hello"),
    ] {
        driven.player.open(&file, Vec::new());
        assert_eq!(driven.player.opening(), Some(file.as_path()));
        let before = driven.player.messages.list().len();
        driven.until("a message", |p| (p.messages.list().len() > before).then_some(()));
        assert_eq!(driven.player.opening(), None);
    }
    let said = driven.messages();
    assert!(
        said.contains("bad.toml:1") && said.contains("absent.mrec") && said.contains("text.mrec"),
        "{said}"
    );
    assert_eq!(driven.player.session.as_ref().unwrap().path, path);
}

#[test]
fn pictures_follow_what_is_set_and_get_better_at_rest() {
    let folder = Folder::new();
    let mut driven = Driven::opened(&folder.record("run.mrec", TRAY));
    let first = driven.picture();
    assert!(!first.at_rest && first.left.size.x < 48);
    driven.pass(0.5);
    let rest = driven.until("a picture at rest", |p| p.drawn.clone().filter(|d| d.at_rest));
    assert!(rest.left.size.x > first.left.size.x);
    // Nothing changes, so nothing is drawn.
    driven.pass(1.0);
    assert_eq!(driven.player.drawn.as_ref().unwrap().number, rest.number);
    assert!(!driven.player.moves());
    driven
        .player
        .session
        .as_mut()
        .unwrap()
        .camera
        .orbit(Vec2::new(0.1, 0.05));
    let turned = driven.picture();
    assert!(turned.number > rest.number && turned.view != rest.view);
    driven.player.quality = Quality::Full;
    assert_eq!(driven.picture().left.size.to_array(), [48, 32]);
}

#[test]
fn two_renderers_are_compared_with_error_and_time_of_each() {
    let folder = Folder::new();
    let mut driven = Driven::opened(&folder.record("run.mrec", TRAY));
    let names: Vec<&str> = driven
        .player
        .choices
        .list
        .iter()
        .filter(|c| !c.gpu)
        .map(|c| c.name)
        .collect();
    driven.player.compare.on = true;
    driven.player.compare.mode = Mode::Difference;
    driven.player.compare.renderer = names[0].to_owned();
    // A picture of the first alone may still be on its way.
    let pair = |p: &mut Player, second: &str| {
        let drawn = p.drawn.clone()?;
        let there = drawn.right.as_ref().is_some_and(|right| right.renderer == second);
        there.then_some(drawn)
    };
    let same = driven.until("a pair", |p| pair(p, names[0]));
    let difference = same.difference.as_ref().unwrap();
    assert_eq!(difference.flip.largest, 0.0);
    assert_eq!(difference.pixels.len(), same.left.pixels.len());
    // The other one has noise: at rest its passes are averaged, and the noise falls.
    driven.player.compare.renderer = names[1].to_owned();
    let first = driven.until("another pair", |p| pair(p, names[1]));
    let right = first.right.as_ref().unwrap();
    assert_eq!((first.left.renderer, right.renderer), (names[0], names[1]));
    assert!(right.seconds > 0.0 && first.difference.as_ref().unwrap().flip.mean > 0.0);
    driven.pass(0.5);
    let noise = |p: &Player, passes: u32| {
        let right = p.drawn.as_ref()?.right.as_ref()?;
        (right.passes >= passes).then(|| (right.passes, right.noise.unwrap()))
    };
    let (passes, few) = driven.until("passes", |p| noise(p, 4));
    let (_, more) = driven.until("more passes", |p| noise(p, 4 * passes));
    assert!(more < few, "{more} after {few}");
}

/// The middle is drawn only when nothing moves, and is the middle.
#[test]
fn a_reference_tile_is_drawn_at_rest_and_held_against_the_picture() {
    let folder = Folder::new();
    let mut driven = Driven::opened(&folder.record("run.mrec", TRAY));
    driven.player.quality = Quality::Full;
    driven.player.compare.on = true;
    driven.player.compare.mode = Mode::Tile;
    let names: Vec<String> = driven
        .player
        .choices
        .list
        .iter()
        .filter(|c| !c.gpu)
        .map(|c| c.name.to_owned())
        .collect();
    driven.player.compare.renderer.clone_from(&names[0]);
    assert!(driven.picture().right.is_none());
    driven.pass(0.5);
    let tile = |p: &mut Player| p.drawn.clone().filter(|d| d.right.is_some());
    let same = driven.until("a tile", tile);
    let right = same.right.as_ref().unwrap();
    assert_eq!(right.size.to_array(), [16, 10]);
    let difference = same.difference.as_ref().unwrap();
    assert_eq!(difference.pixels.len(), 160);
    // Samples lie elsewhere in the pixels, so it is not the same to the bit; a pixel aside it is less so.
    let apart = |x: usize, y: usize| -> u32 {
        let of = |k: usize, c: usize| {
            let whole = same.left.pixels[(y + k / 16) * 48 + x + k % 16][c];
            u32::from(whole.abs_diff(right.pixels[k][c]))
        };
        (0..160).map(|k| of(k, 0) + of(k, 1) + of(k, 2)).sum()
    };
    let there = apart(16, 11);
    for (x, y) in [(15, 11), (17, 11), (16, 10), (16, 12)] {
        assert!(there < apart(x, y), "{there} against {} at {x}, {y}", apart(x, y));
    }
    // One with noise gets better while nothing moves, and goes when something does.
    driven.player.compare.renderer.clone_from(&names[1]);
    driven.pass(0.5);
    driven.until("passes", |p| {
        let right = p.drawn.as_ref()?.right.as_ref()?;
        (right.renderer == names[1] && right.passes >= 4).then_some(())
    });
    driven
        .player
        .session
        .as_mut()
        .unwrap()
        .camera
        .orbit(Vec2::new(0.2, 0.0));
    driven.pass(0.02);
    driven.until("a picture alone", |p| {
        p.drawn.as_ref()?.right.is_none().then_some(())
    });
}

/// The renderer lists what can be changed; what is changed shows in the next picture, and the defaults come back.
#[test]
fn knobs_of_a_renderer_are_listed_by_it_and_change_the_picture() {
    let folder = Folder::new();
    let player = Player::new(
        Choices::with_adapter(Some("card".into())),
        Recent::default(),
        nobody(),
    )
    .unwrap();
    let mut driven = Driven::new(player);
    driven.player.open(&folder.record("run.mrec", TRAY), Vec::new());
    driven.player.quality = Quality::Half;
    driven.until("the first frame", |p| {
        let session = p.session.as_mut()?;
        session.clock.playing = false;
        session.moment.clone()
    });
    let name = driven.player.renderer.clone();
    let before = driven.picture();
    let listed = renderers::knobs(&name, &Turned::new());
    let switch = listed.iter().find(|k| k.name == "absorption").unwrap();
    assert!(switch.remakes && switch.value == Value::Switch(true));
    let whitted = renderers::knobs("whitted", &Turned::new());
    assert!(whitted.iter().any(|knob| knob.name == "interfaces"));
    assert!(renderers::knobs("no such renderer", &Turned::new()).is_empty());
    let turned = Turned::from([(switch.name, Value::Switch(false))]);
    driven.player.turned.insert(name.clone(), turned);
    let clear = driven.picture();
    assert_ne!(before.left.pixels, clear.left.pixels);
    driven.player.turned.remove(&name);
    assert_eq!(driven.picture().left.pixels, before.left.pixels);
}

#[test]
fn a_second_recording_is_shown_at_the_same_time() {
    let folder = Folder::new();
    let slow = folder.record("slow.mrec", TRAY);
    let fast = folder.record("fast.mrec", &TRAY.replace("rate = 20.0", "rate = 40.0"));
    let mut driven = Driven::opened(&slow);
    driven.player.session.as_mut().unwrap().clock.seek(0.5);
    driven.player.open_other(&fast);
    let drawn = driven.until("both", |p| {
        let drawn = p.drawn.clone()?;
        let right = drawn.right.as_ref()?;
        ((right.time - 0.5).abs() < 1e-9 && (drawn.left.time - 0.5).abs() < 1e-9).then_some(drawn)
    });
    assert!(driven.player.compare.other && driven.player.compare.on);
    // The same water, recorded twice as often.
    assert!(drawn.difference.as_ref().unwrap().flip.mean < 0.05);
    // A scene is no recording.
    driven.player.open_other(&folder.write("scene.toml", TRAY));
    driven.until("a message", |p| {
        p.messages
            .list()
            .iter()
            .any(|m| m.text.contains("record the scene first"))
            .then_some(())
    });
}

/// No graphics adapter works.
fn broken(name: &str, _: Option<&Arc<Gpu>>) -> Result<Made, String> {
    if name.starts_with("gpu") {
        Err("the device was lost".to_owned())
    } else {
        renderers::make(name, None)
    }
}

#[test]
fn when_the_adapter_fails_the_processor_draws_and_says_so() {
    let folder = Folder::new();
    let choices = Choices::with_adapter(Some("card".into()));
    let player = Player::with_renderers(choices, Recent::default(), nobody(), broken, None).unwrap();
    let mut driven = Driven::new(player);
    driven.player.open(&folder.record("run.mrec", TRAY), Vec::new());
    let drawn = wait("a picture", || {
        driven.pass(0.01);
        driven.player.drawn.clone()
    });
    let fallback = driven.player.choices.fallback();
    assert_eq!(
        (drawn.left.renderer, driven.player.renderer.as_str()),
        (fallback, fallback)
    );
    let said = driven.messages();
    assert!(said.contains("lost") && said.contains("reduced size"), "{said}");
}

#[test]
fn a_live_run_is_touched_recorded_and_opened_again() {
    let folder = Folder::new();
    let scene = folder.write("basin.toml", BASIN);
    let mut driven = Driven::opened(&scene);
    let session = driven.player.session.as_mut().unwrap();
    let mass = session.moment.as_ref().unwrap().report.unwrap().mass;
    let name = recording_name(session, &folder.path(""));
    driven.player.session.as_mut().unwrap().record(Some(name.clone()));
    driven.until("recording", |p| {
        (p.session.as_ref()?.recording != RecordingState::Off).then_some(())
    });
    // The pointer rests in the middle of the picture and pours.
    let session = driven.player.session.as_mut().unwrap();
    session.touch.tool = Tool::Pour;
    session.place_probe(Some(Vec2::new(1.0, 1.0)));
    let pointer = |driven: &mut Driven, down: bool| {
        let camera = driven.player.session.as_ref().unwrap().camera;
        let (eye, direction) = camera.ray(Vec2::new(0.35, 0.6), UVec2::new(48, 32)).unwrap();
        let now = driven.now;
        driven.player.touch(&Pointer {
            eye,
            direction,
            pressed: false,
            down,
            now,
        });
    };
    for k in 1..=8 {
        driven.now += 0.06;
        pointer(&mut driven, k < 8);
        driven.player.session.as_mut().unwrap().step(false);
        driven.until("a frame", |p| {
            (p.session.as_ref()?.moment.as_ref()?.frame.index >= k).then_some(())
        });
    }
    let poured = driven.moment().report.unwrap().mass - mass;
    assert!(poured > 1.0, "{poured} kg were poured");
    let session = driven.player.session.as_mut().unwrap();
    assert!(session.history.rows().filter(|row| row.probe.is_some()).count() >= 8);
    session.record(None);
    driven.until("the recording", |p| p.session.as_ref()?.recorded.clone());
    driven.player.open(&name, Vec::new());
    driven.until("the recording", |p| {
        p.session
            .as_ref()?
            .replay()
            .map(|r| r.times().len())
            .filter(|n| *n >= 9)
    });
    assert_eq!(driven.player.recent.list().len(), 2);
}

#[test]
fn a_body_is_dragged_and_let_go() {
    let folder = Folder::new();
    let mut driven = Driven::opened(&folder.write("basin.toml", BASIN));
    let session = driven.player.session.as_mut().unwrap();
    session.touch.tool = Tool::Drag;
    session.camera.target = meniscus_sim::glam::Vec3::new(2.0, 0.2, 2.0);
    let camera = session.camera;
    let at = |x, pressed, down, now| pointer(&camera, x, pressed, down, now);
    let before = driven.moment().frame.bodies.as_ref().unwrap()[0].position;
    driven.player.touch(&at(0.5, true, true, 1.0));
    assert_eq!(
        driven.player.session.as_ref().unwrap().touch.holds(),
        Some("crate")
    );
    for k in 1..=10 {
        driven
            .player
            .touch(&at(0.5 + 0.02 * k as f32, false, true, 1.0 + 0.1 * f64::from(k)));
        driven.player.session.as_mut().unwrap().step(false);
        driven.until("a frame", |p| {
            (p.session.as_ref()?.moment.as_ref()?.frame.index >= k as u64).then_some(())
        });
    }
    let after = driven.moment().frame.bodies.as_ref().unwrap()[0].position;
    assert!((after - before).length() > 0.05, "{before} to {after}");
    driven.player.touch(&at(0.7, false, false, 3.0));
    assert_eq!(driven.player.session.as_ref().unwrap().touch.holds(), None);
    assert!(!driven.messages().contains("cannot"), "{}", driven.messages());
}

#[test]
fn a_failed_step_leaves_the_last_good_frame_and_says_what_to_do() {
    let folder = Folder::new();
    // The paper's lattice refuses water that is faster than its own waves.
    let basin = TRAY.replace("\"wave-equation\"", "\"shallow-water\"\nscheme = \"bgk\"");
    let mut driven = Driven::opened(&folder.write("tray.toml", &basin));
    let session = driven.player.session.as_mut().unwrap();
    let live = session.live().unwrap();
    live.tell(Command::Act(Action::Push {
        position: Vec2::splat(1.0),
        radius: 0.5,
        velocity: Vec2::new(6.0, 0.0),
    }));
    session.clock.playing = true;
    driven.until("a failure", |p| p.session.as_ref()?.failed.clone());
    let said = driven.messages();
    assert!(
        said.contains("last good frame stays") && said.contains("reset"),
        "{said}"
    );
    let session = driven.player.session.as_mut().unwrap();
    assert!(!session.clock.playing && session.moment.is_some());
    session.toggle();
    assert!(!session.clock.playing);
    session.rewind();
    driven.until("a new run", |p| {
        p.session.as_ref()?.failed.is_none().then_some(())
    });
    let session = driven.player.session.as_mut().unwrap();
    session.step(false);
    driven.until("a frame", |p| {
        (p.session.as_ref()?.clock.time > 0.0).then_some(())
    });
}

#[test]
fn plans_and_screenshots_are_had_from_the_window() {
    let folder = Folder::new();
    let mut driven = Driven::opened(&folder.record("run.mrec", TRAY));
    let items = driven.until("a plan", |p| p.plan().map(<[_]>::to_vec));
    assert!(items.iter().any(|item| item.active) && items.iter().any(|item| !item.active));
    driven.until("a picture", |p| p.drawn.clone());
    for _ in 0..2 {
        driven.player.screenshot(&folder.path(""));
    }
    let saved = image::open(folder.path("run_0.000s-2.png")).unwrap();
    assert_eq!(saved.width(), driven.player.drawn.as_ref().unwrap().left.size.x);
    let mut empty = Driven::new(player());
    empty.player.screenshot(&folder.path(""));
    assert!(empty.messages().contains("no picture yet"));
}
