//! What is recorded comes back: every bit without tolerance, within the tolerance else, for every channel.

#![allow(clippy::unwrap_used, reason = "helpers of tests")]

mod recording_common;

use meniscus_sim::glam::UVec2;
use meniscus_sim::mesh::TriangleMesh;
use meniscus_sim::recording::{Reader, ReplaySource, Writer};
use meniscus_sim::{Channels, Frame, FrameSource, GridSpec, Progress};
use recording_common::{bits, frame, report, scene};

const SIZE: UVec2 = UVec2::new(61, 47);

fn record(path: &std::path::Path, channels: Channels, tolerance: f32, count: u64) -> meniscus_sim::Scene {
    let scene = scene(SIZE, tolerance);
    let mut writer = Writer::create(path, &scene, channels).unwrap();
    for k in 0..count {
        writer
            .push(&frame(scene.grid, channels, k), Some(report(k)))
            .unwrap();
    }
    let summary = writer.finish().unwrap();
    assert_eq!(summary.frames, count);
    assert_eq!(summary.file_bytes, std::fs::metadata(path).unwrap().len());
    scene
}

#[test]
fn lossless_recordings_come_back_bit_for_bit() {
    let folder = tempfile::tempdir().unwrap();
    let mut sets: Vec<Channels> = Channels::ALL.iter().map(|(_, c)| c).collect();
    sets.extend([Channels::NONE, Channels::ALL]);
    for channels in sets {
        let path = folder.path().join("lossless.mrec");
        let scene = record(&path, channels, 0.0, 5);
        let mut reader = Reader::open(&path).unwrap();
        assert_eq!(reader.scene(), &scene);
        assert_eq!(
            (reader.channels(), reader.tolerance(), reader.len()),
            (channels, 0.0, 5)
        );
        assert!(reader.is_complete() && reader.damage().is_empty());
        // In any order, into the same frame.
        let mut out = Frame::new(GridSpec::new(Default::default(), 1.0, UVec2::ONE).unwrap());
        for k in [3, 0, 4, 1, 2, 2] {
            let totals = reader.read(k, &mut out).unwrap();
            assert_eq!(totals, Some(report(k as u64)));
            assert_eq!(
                bits(&out),
                bits(&frame(scene.grid, channels, k as u64)),
                "{channels} {k}"
            );
            assert_eq!(reader.time(k), out.time);
        }
    }
}

#[test]
fn materials_that_are_not_whole_are_not_written() {
    let folder = tempfile::tempdir().unwrap();
    let write = |spoil: fn(&mut TriangleMesh)| {
        let mut scene = scene(SIZE, 0.0);
        spoil(&mut scene.meshes[0]);
        Writer::create(folder.path().join("painted.mrec"), &scene, Channels::NONE).map(drop)
    };
    assert!(write(|_| ()).is_ok());
    for spoil in [
        |mesh: &mut TriangleMesh| mesh.material_of[0] = 2,
        |mesh: &mut TriangleMesh| mesh.texcoords.clear(),
        |mesh: &mut TriangleMesh| mesh.materials[1].color.x = f32::NAN,
    ] {
        assert!(write(spoil).is_err());
    }
}

#[test]
fn quantised_recordings_stay_within_the_tolerance() {
    let folder = tempfile::tempdir().unwrap();
    for tolerance in [1e-2_f32, 1e-4] {
        let path = folder.path().join("quantised.mrec");
        let scene = record(&path, Channels::ALL, tolerance, 4);
        let mut reader = Reader::open(&path).unwrap();
        assert_eq!(reader.tolerance(), tolerance);
        let mut out = Frame::new(scene.grid);
        let mut largest = 0.0_f64;
        for k in 0..4 {
            reader.read(k, &mut out).unwrap();
            let original = frame(scene.grid, Channels::ALL, k as u64);
            assert_eq!(out.bodies, original.bodies);
            for (out, original) in [
                (&out.droplets, &original.droplets),
                (&out.particles, &original.particles),
            ] {
                assert_eq!(out.as_ref().unwrap().radius, original.as_ref().unwrap().radius);
            }
            assert_eq!(out.time, original.time);
            let (a, b) = (bits(&out), bits(&original));
            assert_eq!(a.len(), b.len());
            for (a, b) in a.iter().zip(&b).skip(4) {
                let error = (f64::from(f32::from_bits(*a)) - f64::from(f32::from_bits(*b))).abs();
                largest = largest.max(error);
            }
            assert!(out.depth.as_ref().unwrap().as_slice().iter().all(|&d| d >= 0.0));
        }
        assert!(largest <= f64::from(tolerance), "{largest}");
        let statistics = reader.statistics().unwrap();
        let stored = statistics
            .channels
            .iter()
            .map(|c| c.largest_error)
            .fold(0.0, f32::max);
        assert!(
            largest <= f64::from(stored) && stored <= tolerance,
            "{largest} {stored}"
        );
    }
}

#[test]
fn a_replay_is_a_source_of_the_same_frames() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("replay.mrec");
    let scene = record(&path, Channels::DEPTH, 0.0, 3);
    let mut source = ReplaySource::new(Reader::open(&path).unwrap());
    let mut out = Frame::new(scene.grid);
    for k in 0..3 {
        assert_eq!(
            source.read_into(&mut out).unwrap(),
            Progress::Frame(Some(report(k)))
        );
        assert_eq!(bits(&out), bits(&frame(scene.grid, Channels::DEPTH, k)));
    }
    assert_eq!(source.read_into(&mut out).unwrap(), Progress::End);
}
