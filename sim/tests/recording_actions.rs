//! What was done live is in the recording, and the run can be repeated from it.

#![allow(clippy::unwrap_used, missing_docs, reason = "test code")]

use glam::{Vec2, Vec3};
use meniscus_sim::events::Action;
use meniscus_sim::recording::{Reader, Writer};
use meniscus_sim::source::{FrameSource as _, LiveSource};
use meniscus_sim::{Channels, Frame, Scene, solvers};
use std::path::Path;

fn basin() -> Scene {
    let text = "name = 'basin'\ndomain.size = [6.0, 5.0]\nterrain = { kind = 'flat', height = -1.0 }\n\
        solver = { kind = 'shallow-water', spacing = 0.2 }\nrecording.rate = 10\n\
        object = [{ name = 'crate', shape = { kind = 'box', size = [0.8, 0.5, 0.8] }, position = [3, 0, 2.5], \
        density = 500, motion = { kind = 'free' } }]\n";
    Scene::from_toml(text, Path::new("basin.toml"), Path::new(""), &[]).unwrap()
}

fn live(scene: &Scene) -> LiveSource {
    LiveSource::new(scene, solvers::build(scene).unwrap(), Channels::ALL)
}

#[test]
fn a_recording_holds_what_was_done_live_and_repeats_it() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("live.mrec");
    let scene = basin();
    let mut source = live(&scene);
    let mut writer = Writer::create(&path, &scene, source.channels()).unwrap();
    let mut frame = Frame::new(scene.grid);
    let body = || "crate".to_owned();
    let (mut seen, mut kept) = (0, Vec::new());
    for k in 0..12 {
        source.read_into(&mut frame).unwrap();
        writer.push_acted(&frame, None, &source.acted()[seen..]).unwrap();
        seen = source.acted().len();
        kept.push(frame.clone());
        let position = Vec2::new(1.0 + 0.1 * k as f32, 2.0);
        let actions = match k {
            2 => vec![
                Action::Drop {
                    position,
                    radius: 0.6,
                    volume: 0.02,
                },
                Action::Push {
                    position,
                    radius: 0.7,
                    velocity: Vec2::new(0.3, -0.2),
                },
            ],
            4 => vec![Action::Drag {
                body: body(),
                grip: Vec3::ZERO,
                target: Vec3::new(4.0, 0.5, 2.0),
            }],
            6 => vec![
                Action::Release { body: body() },
                Action::Press {
                    position,
                    radius: 0.5,
                    depth: 0.05,
                },
            ],
            8 => vec![Action::Shove {
                body: body(),
                velocity: Vec3::X,
                spin: Vec3::Y,
            }],
            _ => Vec::new(),
        };
        for action in &actions {
            source.act(action).unwrap();
        }
    }
    writer.finish().unwrap();

    let mut reader = Reader::open(&path).unwrap();
    let acted: Vec<(f64, Action)> = (0..reader.len()).flat_map(|k| reader.acted(k).unwrap()).collect();
    assert_eq!(acted, source.acted());
    assert_eq!(acted.len(), 6);
    let mut again = live(&basin()).repeating(&acted);
    for k in 0..12 {
        again.read_into(&mut frame).unwrap();
        assert_eq!(frame, kept[k], "frame {k}");
        reader.read(k, &mut frame).unwrap();
        assert_eq!(frame.elevation, kept[k].elevation, "frame {k}");
    }
    // Without them it is another run.
    let mut other = live(&scene);
    for _ in 0..12 {
        other.read_into(&mut frame).unwrap();
    }
    assert_ne!(frame.elevation, kept[11].elevation);
}

#[test]
fn recordings_of_version_1_are_read() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("old.mrec");
    let scene = basin();
    let mut source = live(&scene);
    let mut writer = Writer::create(&path, &scene, source.channels()).unwrap();
    let mut frame = Frame::new(scene.grid);
    source.read_into(&mut frame).unwrap();
    writer.push(&frame, None).unwrap();
    writer.finish().unwrap();
    // Without actions the bytes are those of version 1 but for the number.
    let mut bytes = std::fs::read(&path).unwrap();
    bytes[8..12].copy_from_slice(&1_u32.to_le_bytes());
    let crc = crc32fast::hash(&bytes[..16]);
    bytes[16..20].copy_from_slice(&crc.to_le_bytes());
    std::fs::write(&path, bytes).unwrap();
    let mut reader = Reader::open(&path).unwrap();
    let mut read = Frame::new(scene.grid);
    reader.read(0, &mut read).unwrap();
    assert_eq!(read.elevation, frame.elevation);
    assert!(reader.acted(0).unwrap().is_empty());
}
