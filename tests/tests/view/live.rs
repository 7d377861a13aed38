//! A live run that is acted upon, recorded and repeated.

use crate::support::{BASIN, Folder, GLASS, TRAY, run, scene, wait};
use meniscus::app::model::live::{Command, Live, News, PICTURE};
use meniscus::app::model::nobody;
use meniscus::app::model::touch::Tool;
use meniscus_sim::events::Action;
use meniscus_sim::glam::{Vec2, Vec3};
use meniscus_sim::recording::Reader;
use meniscus_sim::rng::Rng;
use meniscus_sim::{Frame, FrameSource as _, Progress};
use std::path::Path;
use std::sync::Arc;

/// Waits for frame `index`.
fn reach(live: &Live, index: u64) {
    wait("a frame", || {
        let news = live.news();
        let failed = news
            .iter()
            .find(|n| matches!(n, News::Failed(_) | News::Refused(_)));
        assert!(failed.is_none(), "{failed:?}");
        news.iter()
            .any(|n| matches!(n, News::Made(made, ..) if *made >= index))
            .then_some(())
    });
}

/// What a scene takes besides drops, presses and pushes.
#[derive(Clone, Copy)]
struct Takes {
    bodies: bool,
    tilts: bool,
}

fn random_action(rng: &mut Rng, extent: f32, takes: Takes) -> Action {
    let mut place = || Vec2::new(rng.uniform_f32(), rng.uniform_f32()) * extent;
    let (position, velocity) = (place(), (place() - 0.5 * extent) * 0.1);
    let kinds = 3 + if takes.bodies { 3 } else { 0 } + u64::from(takes.tilts);
    let pick = rng.next_u64() % kinds;
    let radius = (0.08 + 0.1 * rng.uniform_f32()) * extent;
    match pick {
        0 => Action::Drop {
            position,
            radius,
            // Particles are poured whole.
            volume: if takes.tilts { 1.0 } else { 0.02 } * radius.powi(3),
        },
        1 => Action::Press {
            position,
            radius,
            depth: 0.02 * radius,
        },
        2 => Action::Push {
            position,
            radius,
            velocity,
        },
        3 => Action::Drag {
            body: "crate".into(),
            grip: Vec3::new(0.3, 0.1, 0.2),
            target: Vec3::new(position.x, 0.3, position.y),
        },
        4 => Action::Release { body: "crate".into() },
        5 => Action::Shove {
            body: "crate".into(),
            velocity: Vec3::new(velocity.x, 0.1, velocity.y),
            spin: Vec3::new(0.0, 0.5, 0.0),
        },
        _ => {
            let lean = 4.0 * (position / extent - 0.5);
            Action::Tilt {
                gravity: Vec3::new(lean.x, -9.5, lean.y),
            }
        }
    }
}

/// Repeats the run in `path` from what was recorded as done; all frames must be the same to the bit.
fn repeats(path: &Path, actions: usize) {
    let mut reader = Reader::open(path).unwrap();
    assert!(reader.is_complete());
    let acted: Vec<(f64, Action)> = (0..reader.len()).flat_map(|k| reader.acted(k).unwrap()).collect();
    assert_eq!(acted.len(), actions);
    let scene = reader.scene().clone();
    let mut again = run(&scene).repeating(&acted);
    let (mut recorded, mut frame) = (Frame::new(scene.grid), Frame::new(scene.grid));
    for k in 0..reader.len() {
        reader.read(k, &mut recorded).unwrap();
        loop {
            assert!(matches!(again.read_into(&mut frame), Ok(Progress::Frame(_))));
            if frame.time >= recorded.time {
                break;
            }
        }
        recorded.index = frame.index;
        assert!(recorded == frame, "frame {k} at {} s differs", frame.time);
    }
}

/// Runs a scene with `actions` random inputs between frames and records it from frame `from` on.
fn played(text: &str, actions: usize, from: u64) {
    let folder = Folder::new();
    let path = folder.path("run.mrec");
    let scene = Arc::new(scene(text));
    let takes = Takes {
        bodies: !scene.description.objects.is_empty(),
        tilts: Tool::Tilt.idle(&scene).is_none(),
    };
    let extent = scene.grid.extent().x;
    let live = Live::new(scene, nobody()).unwrap();
    let mut rng = Rng::new(2026, from);
    reach(&live, 0);
    let mut sent = 0;
    let mut frame = 0;
    while sent < actions {
        if frame == from {
            live.tell(Command::Record(path.clone()));
        }
        // None, one or several before the next frame.
        for _ in 0..rng.next_u64() % 4 {
            if sent < actions {
                live.tell(Command::Act(random_action(&mut rng, extent, takes)));
                sent += 1;
            }
        }
        live.tell(Command::Step);
        frame += 1;
        reach(&live, frame);
    }
    live.tell(Command::StopRecording);
    let frames = wait("the recording", || {
        live.news().into_iter().find_map(|news| match news {
            News::Recorded(_, summary) => Some(summary.frames),
            _ => None,
        })
    });
    assert_eq!(frames, frame - from + 1);
    drop(live);
    repeats(&path, actions);
}

#[test]
fn a_run_with_a_hundred_random_inputs_repeats_to_the_bit() {
    played(TRAY, 100, 0);
}

#[test]
fn so_does_one_with_bodies_that_is_recorded_from_its_middle_on() {
    played(BASIN, 100, 17);
}

#[test]
fn so_does_a_vessel_that_is_tilted_too() {
    played(GLASS, 100, 5);
}

#[test]
fn a_run_that_nobody_touches_is_the_one_that_is_recorded_without_a_window() {
    let folder = Folder::new();
    let path = folder.path("run.mrec");
    let live = Live::new(Arc::new(scene(TRAY)), nobody()).unwrap();
    reach(&live, 0);
    live.tell(Command::Record(path.clone()));
    live.tell(Command::Speed(16.0));
    live.tell(Command::Run(true));
    reach(&live, 20);
    // The window closes while it runs and records.
    drop(live);
    repeats(&path, 0);
    let mut ours = Reader::open(&path).unwrap();
    let mut theirs = Reader::open(folder.record("plain.mrec", TRAY)).unwrap();
    assert!(ours.len() >= 21);
    let (mut a, mut b) = (Frame::new(ours.scene().grid), Frame::new(ours.scene().grid));
    for k in 0..theirs.len() {
        ours.read(k, &mut a).unwrap();
        theirs.read(k, &mut b).unwrap();
        assert!(a == b, "frame {k}");
    }
}

#[test]
fn a_reset_begins_the_same_run_again_and_ends_a_recording() {
    let folder = Folder::new();
    let path = folder.path("run.mrec");
    let live = Live::new(Arc::new(scene(TRAY)), nobody()).unwrap();
    reach(&live, 0);
    let first = wait("the first frame", || live.take());
    live.tell(Command::Record(path.clone()));
    for _ in 0..5 {
        live.tell(Command::Step);
    }
    reach(&live, 5);
    live.tell(Command::Reset);
    let mut news = Vec::new();
    wait("a new beginning", || {
        news.extend(live.news());
        let at = news.iter().position(|n| matches!(n, News::Began))?;
        news[at..]
            .iter()
            .any(|n| matches!(n, News::Made(0, ..)))
            .then_some(())
    });
    assert!(
        news.iter()
            .any(|n| matches!(n, News::Recorded(_, summary) if summary.frames == 6))
    );
    let again = wait("the first frame", || live.take());
    assert_eq!(again.frame, first.frame);
    assert!(Reader::open(&path).unwrap().is_complete());
}

#[test]
fn what_a_solver_cannot_do_is_refused_and_the_run_goes_on() {
    let live = Live::new(Arc::new(scene(TRAY)), nobody()).unwrap();
    reach(&live, 0);
    live.tell(Command::Act(Action::Release {
        body: "nobody".into(),
    }));
    live.tell(Command::Record("/no/such/folder/run.mrec".into()));
    live.tell(Command::Step);
    let mut news = Vec::new();
    wait("the frame", || {
        news.extend(live.news());
        news.iter().any(|n| matches!(n, News::Made(1, ..))).then_some(())
    });
    let refused: Vec<String> = news
        .into_iter()
        .filter_map(|n| match n {
            News::Refused(text) => Some(text),
            _ => None,
        })
        .collect();
    assert_eq!(refused.len(), 2, "{refused:?}");
    assert!(
        refused[0].contains("release") && refused[1].starts_with("recording"),
        "{refused:?}"
    );
}

#[test]
fn a_run_keeps_to_its_speed() {
    let live = Live::new(Arc::new(scene(TRAY)), nobody()).unwrap();
    reach(&live, 0);
    live.tell(Command::Speed(1.0));
    live.tell(Command::Run(true));
    let start = std::time::Instant::now();
    reach(&live, 6);
    // Six frames of a twentieth of a second; a busy machine may take longer, never shorter.
    assert!(
        start.elapsed().as_secs_f64() >= 0.3 * 0.98,
        "{:?}",
        start.elapsed()
    );
    // With a limit on its sub-steps it is slower, however fast the machine: what takes n of them lasts n sixtieths of a second.
    live.tell(Command::Speed(1e3));
    live.tell(Command::MostSubsteps(1));
    drop(live.news());
    let start = std::time::Instant::now();
    let mut taken = 0;
    wait("limited frames", || {
        for news in live.news() {
            if let News::Made(_, _, report, ..) = news {
                taken += report.substeps;
            }
        }
        (taken > 30).then_some(())
    });
    // The latest frame need not have been waited for, nor the one that was in hand.
    let least = f64::from(taken / 2) * PICTURE;
    assert!(
        start.elapsed().as_secs_f64() >= least,
        "{taken} in {:?}",
        start.elapsed()
    );
    live.tell(Command::Run(false));
    std::thread::sleep(std::time::Duration::from_millis(120));
    drop(live.news());
    std::thread::sleep(std::time::Duration::from_millis(200));
    assert!(live.news().iter().all(|n| !matches!(n, News::Made(..))));
}
