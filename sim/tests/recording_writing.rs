//! What the writer refuses, what it leaves behind when it is stopped, and that threads do not change a byte.

#![allow(clippy::unwrap_used, reason = "helpers of tests")]

mod recording_common;

use meniscus_sim::glam::{UVec2, Vec2, Vec3};
use meniscus_sim::recording::{Reader, RecordingError, Writer};
use meniscus_sim::rng::Rng;
use meniscus_sim::{Channels, Frame, Grid, GridSpec};
use recording_common::{bare_scene, bits, frame, report, scene};
use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Duration;

const SIZE: UVec2 = UVec2::new(96, 80);

fn record(path: &Path, tolerance: f32, frames: &[Frame]) -> Vec<u8> {
    let scene = scene(SIZE, tolerance);
    let mut writer = Writer::create(path, &scene, frames[0].channels()).unwrap();
    for (k, frame) in frames.iter().enumerate() {
        writer.push(frame, Some(report(k as u64))).unwrap();
    }
    writer.finish().unwrap();
    std::fs::read(path).unwrap()
}

#[test]
fn the_same_frames_give_the_same_bytes_for_any_number_of_threads() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("threads.mrec");
    let spec = scene(SIZE, 0.0).grid;
    let frames: Vec<Frame> = (0..12).map(|k| frame(spec, Channels::ALL, k)).collect();
    for tolerance in [0.0, 1e-4] {
        let recorded: Vec<Vec<u8>> = [1, 2, 5]
            .into_iter()
            .map(|threads| {
                let pool = rayon::ThreadPoolBuilder::new()
                    .num_threads(threads)
                    .build()
                    .unwrap();
                pool.install(|| record(&path, tolerance, &frames))
            })
            .collect();
        assert!(recorded[0] == recorded[1] && recorded[0] == recorded[2]);
    }
}

/// A simulation may push from every thread of a pool without starving the encoders.
#[test]
fn recordings_in_a_full_pool_do_not_wait_for_each_other() {
    use rayon::prelude::*;
    let folder = tempfile::tempdir().unwrap();
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    pool.install(|| {
        (0..3_u64).into_par_iter().for_each(|n| {
            let scene = bare_scene(SIZE, 0.0);
            let mut writer =
                Writer::create(folder.path().join(format!("{n}")), &scene, Channels::NONE).unwrap();
            for k in 0..20 {
                writer.push(&frame(scene.grid, Channels::NONE, k), None).unwrap();
            }
            assert_eq!(writer.finish().unwrap().frames, 20);
        });
    });
}

#[test]
fn unusual_numbers_keep_every_bit() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("unusual.mrec");
    let mut rng = Rng::new(9, 9);
    type Fill = Box<dyn FnMut(usize, usize) -> f32>;
    let mut noise = Rng::new(1, 1);
    let fills: Vec<(&str, Fill)> = vec![
        ("zero", Box::new(|_, _| 0.0)),
        (
            "negative zero",
            Box::new(|i, _| if i % 3 == 0 { -0.0 } else { 0.0 }),
        ),
        ("constant", Box::new(|_, _| 291.25)),
        ("noise", Box::new(move |_, _| noise.normal() as f32)),
        (
            "largest",
            Box::new(|i, j| if (i + j) % 2 == 0 { f32::MAX } else { f32::MIN }),
        ),
        (
            "smooth and huge",
            Box::new(|i, j| 1e38 * (0.1 * (i + j) as f32).sin()),
        ),
        ("denormal", Box::new(|i, j| f32::from_bits((i * 31 + j) as u32))),
        (
            "smooth and tiny",
            Box::new(|i, j| 1e-38 * (0.05 * (i * 2 + j) as f32).sin()),
        ),
        ("step", Box::new(|i, _| if i < 40 { 1e-30 } else { 1e30 })),
        (
            "any bits",
            Box::new(move |_, _| {
                loop {
                    let v = f32::from_bits(rng.next_u64() as u32);
                    if v.is_finite() {
                        break v;
                    }
                }
            }),
        ),
    ];
    for (name, mut fill) in fills {
        for size in [
            UVec2::new(70, 60),
            UVec2::new(2, 2),
            UVec2::new(2, 300),
            UVec2::new(3000, 2),
            UVec2::new(5, 997),
        ] {
            // A tolerance below what f32 resolves must not make it worse than lossless.
            for tolerance in [0.0, 1e-30] {
                let scene = bare_scene(size, tolerance);
                let mut original = Frame::new(scene.grid);
                original.elevation = Grid::from_fn(scene.grid, &mut fill);
                let mut writer = Writer::create(&path, &scene, Channels::NONE).unwrap();
                writer.push(&original, None).unwrap();
                writer.finish().unwrap();
                let mut out = Frame::new(scene.grid);
                Reader::open(&path).unwrap().read(0, &mut out).unwrap();
                if tolerance == 0.0 {
                    assert!(bits(&out) == bits(&original), "{name} {size}");
                } else {
                    let pairs = out.elevation.as_slice().iter().zip(original.elevation.as_slice());
                    assert!(
                        pairs.clone().all(|(a, b)| (a - b).abs() <= tolerance),
                        "{name} {size}"
                    );
                }
            }
        }
    }
}

#[test]
fn large_and_odd_grids_are_cut_into_bands() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("large.mrec");
    for size in [
        UVec2::new(1023, 700),
        UVec2::new(300_000, 2),
        UVec2::new(2, 200_000),
        UVec2::new(131_072, 5),
    ] {
        for tolerance in [0.0, 1e-3] {
            let scene = bare_scene(size, tolerance);
            let original = frame(scene.grid, Channels::NONE, 1);
            let mut writer = Writer::create(&path, &scene, Channels::NONE).unwrap();
            writer.push(&original, None).unwrap();
            writer.finish().unwrap();
            let mut out = Frame::new(scene.grid);
            Reader::open(&path).unwrap().read(0, &mut out).unwrap();
            let pairs = out.elevation.as_slice().iter().zip(original.elevation.as_slice());
            let largest = pairs
                .map(|(a, b)| (f64::from(*a) - f64::from(*b)).abs())
                .fold(0.0, f64::max);
            assert!(largest <= f64::from(tolerance), "{size}: {largest}");
        }
    }
}

#[test]
fn frames_that_cannot_be_recorded_are_refused_and_the_rest_goes_on() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("refused.mrec");
    let scene = scene(SIZE, 0.0);
    let channels = Channels::DEPTH | Channels::VELOCITY | Channels::DROPLETS;
    let mut writer = Writer::create(&path, &scene, channels).unwrap();
    let good = |k| frame(scene.grid, channels, k);
    writer.push(&good(1), None).unwrap();

    let mut bad = good(2);
    bad.velocity.as_mut().unwrap().as_mut_slice()[17].y = f32::NAN;
    let message = writer.push(&bad, None).unwrap_err().to_string();
    assert!(
        message.contains("NaN in channel `velocity` at sample 17"),
        "{message}"
    );

    let mut bad = good(2);
    bad.depth = None;
    let message = writer.push(&bad, None).unwrap_err().to_string();
    assert!(message.contains("lacks the channels depth"), "{message}");

    let other = GridSpec::new(Vec2::ZERO, 0.5, SIZE).unwrap();
    let error = writer.push(&frame(other, channels, 2), None).unwrap_err();
    assert!(matches!(error, RecordingError::Grid { frame: 1, .. }));

    let mut bad = good(2);
    bad.depth = Some(Grid::filled(other, 1.0));
    assert!(matches!(
        writer.push(&bad, None),
        Err(RecordingError::Lists { .. })
    ));

    let mut bad = good(2);
    bad.droplets.as_mut().unwrap().position.push(Vec3::ZERO);
    assert!(matches!(
        writer.push(&bad, None),
        Err(RecordingError::Lists { .. })
    ));

    for time in [f64::NAN, f64::INFINITY, 0.0] {
        let mut bad = good(2);
        bad.time = time;
        assert!(matches!(
            writer.push(&bad, None),
            Err(RecordingError::Time { .. })
        ));
    }

    // What is not recorded may be there.
    let mut more = good(2);
    more.foam = Some(Grid::filled(scene.grid, 0.5));
    writer.push(&more, None).unwrap();
    assert_eq!(writer.finish().unwrap().frames, 2);
    let mut reader = Reader::open(&path).unwrap();
    let mut out = Frame::new(scene.grid);
    reader.read(1, &mut out).unwrap();
    assert_eq!(bits(&out), bits(&good(2)));
}

#[test]
fn places_that_cannot_be_written_are_one_clear_error() {
    let folder = tempfile::tempdir().unwrap();
    let scene = bare_scene(SIZE, 0.0);
    let message = |path: &Path| {
        Writer::create(path, &scene, Channels::NONE)
            .unwrap_err()
            .to_string()
    };
    assert!(message(folder.path()).contains("a directory instead of a recording"));
    let missing = message(&folder.path().join("none/run.mrec"));
    assert!(
        missing.contains("cannot create") && missing.contains("create the folder first"),
        "{missing}"
    );
    if Path::new("/dev/full").exists() {
        let full = message(Path::new("/dev/full"));
        assert!(
            full.contains("/dev/full: cannot write") && full.contains("free space"),
            "{full}"
        );
    }
}

#[test]
fn a_scene_that_cannot_be_stored_leaves_an_existing_file_alone() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("kept.mrec");
    std::fs::write(&path, b"kept").unwrap();
    let mut scene = scene(SIZE, 0.0);
    scene.meshes[0].triangles[0][1] = 99;
    let message = Writer::create(&path, &scene, Channels::NONE)
        .unwrap_err()
        .to_string();
    assert!(
        message.contains("mesh 0: a triangle names a vertex that is not there"),
        "{message}"
    );
    scene.meshes.clear();
    scene.terrain.as_mut().unwrap().as_mut_slice()[3] = f32::INFINITY;
    assert!(Writer::create(&path, &scene, Channels::NONE).is_err());
    scene.terrain = None;
    scene.description.recording.tolerance = -1.0;
    assert!(Writer::create(&path, &scene, Channels::NONE).is_err());
    assert_eq!(std::fs::read(&path).unwrap(), b"kept");
}

#[test]
fn a_writer_that_is_dropped_leaves_every_frame() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("dropped.mrec");
    let scene = bare_scene(SIZE, 0.0);
    let mut writer = Writer::create(&path, &scene, Channels::NONE).unwrap();
    for k in 0..30 {
        writer.push(&frame(scene.grid, Channels::NONE, k), None).unwrap();
    }
    writer.flush().unwrap();
    assert_eq!(writer.written(), 30);
    // Readable while it is being written.
    assert_eq!(Reader::open(&path).unwrap().len(), 30);
    drop(writer);
    let mut reader = Reader::open(&path).unwrap();
    assert!(reader.len() == 30 && !reader.is_complete() && reader.damage().is_empty());
    let mut out = Frame::new(scene.grid);
    for k in 0..30 {
        reader.read(k, &mut out).unwrap();
        assert_eq!(bits(&out), bits(&frame(scene.grid, Channels::NONE, k as u64)));
    }
}

const KILLED: &str = "MENISCUS_TEST_RECORD_UNTIL_KILLED";

/// Sides of the grids of the processes that are killed: writing takes from a fraction of the time between two frames to
/// nearly all of it.
const SIDES: [u32; 3] = [24, 96, 280];

/// Run by the test below in a process of its own; does nothing else. A line tells each frame that was handed over; it
/// is written at once, so that it outlives the process.
#[test]
fn record_until_killed() {
    let Ok(order) = std::env::var(KILLED) else { return };
    let (side, path) = order.split_once(' ').unwrap();
    let scene = bare_scene(UVec2::splat(side.parse().unwrap()), 0.0);
    let mut writer = Writer::create(path, &scene, Channels::ALL).unwrap();
    let frames: Vec<Frame> = (0..4).map(|k| frame(scene.grid, Channels::ALL, k)).collect();
    let mut out = std::io::stdout().lock();
    for k in 0..u64::MAX {
        writer.push(&numbered(&frames, k), Some(report(k))).unwrap();
        out.write_all(format!("handed over {}\n", k + 1).as_bytes())
            .unwrap();
        out.flush().unwrap();
    }
}

/// Frame `k` of an endless run that goes round `frames`.
fn numbered(frames: &[Frame], k: u64) -> Frame {
    let mut frame = frames[k as usize % frames.len()].clone();
    (frame.index, frame.time) = (k, k as f64 / 30.0);
    frame
}

#[test]
fn a_killed_process_loses_at_most_the_frame_in_flight() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("killed.mrec");
    let mut rng = Rng::new(12, 0);
    let (mut lost, mut torn) = (0, 0);
    for round in 0..24 {
        let side = SIDES[round % SIDES.len()];
        let mut child = Command::new(std::env::current_exe().unwrap())
            .args([
                "record_until_killed",
                "--exact",
                "--nocapture",
                "--test-threads=1",
            ])
            .env(KILLED, format!("{side} {}", path.display()))
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        let mut lines = BufReader::new(child.stdout.take().unwrap()).lines();
        // Some frames, then any moment between two of them.
        let mut handed_over = 0;
        let after = 1 + rng.next_u64() % 6;
        while handed_over < after {
            let line = lines.next().expect("the child ended by itself").unwrap();
            handed_over = count(&line).unwrap_or(handed_over);
        }
        std::thread::sleep(Duration::from_micros(rng.next_u64() % 20_000));
        child.kill().unwrap();
        child.wait().unwrap();
        // What it told before it died is still in the pipe; the last line may be cut.
        handed_over = lines
            .map_while(Result::ok)
            .filter_map(|line| count(&line))
            .max()
            .unwrap_or(handed_over);

        let mut reader = Reader::open(&path).unwrap();
        let found = reader.len() as u64;
        assert!(
            found + 1 >= handed_over,
            "{side}²: {found} frames of {handed_over} handed over"
        );
        // At most the frame that was being given to the system is half there, and no frame is missing before another.
        assert!(reader.damage().len() <= 1 && reader.damage().iter().all(|d| d.frame.is_none()));
        lost += u64::from(found < handed_over);
        torn += reader.damage().len();
        let spec = reader.scene().grid;
        let frames: Vec<Frame> = (0..4).map(|k| frame(spec, Channels::ALL, k)).collect();
        let mut out = Frame::new(spec);
        for k in 0..reader.len() {
            assert_eq!(reader.read(k, &mut out).unwrap(), Some(report(k as u64)));
            assert_eq!(bits(&out), bits(&numbered(&frames, k as u64)));
        }
    }
    println!("24 processes killed: {lost} lost the frame in flight, {torn} left one half written");
}

/// The number of a whole line `handed over N`.
fn count(line: &str) -> Option<u64> {
    line.strip_prefix("handed over ")?.parse().ok()
}
