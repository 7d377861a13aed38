//! Every scene of the repository from file to picture: what is replayed is what was run, in numbers and in pixels.
#![allow(clippy::unwrap_used)] // a test may panic

use glam::UVec2;
use meniscus_render_cpu::{camera, renderers};
use meniscus_sim::recording::{Reader, Writer};
use meniscus_sim::render::Image;
use meniscus_sim::source::LiveSource;
use meniscus_sim::{Frame, FrameSource as _, Progress, Scene, solvers};
use std::path::PathBuf;

/// Frames of each scene that are run.
const FRAMES: u64 = 3;

fn scenes() -> Vec<PathBuf> {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../data/scenes");
    let mut files: Vec<PathBuf> = std::fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .collect();
    files.retain(|file| file.extension().is_some_and(|e| e == "toml"));
    files.sort();
    assert!(files.len() >= 6, "the scenes of the repository are missing");
    files
}

fn picture(scene: &Scene, frame: &Frame) -> Image {
    let mut renderer = renderers::build("whitted").unwrap();
    let view = camera::view(scene, None, UVec2::new(64, 36), 1).unwrap();
    let mut image = Image::default();
    renderer
        .render(scene, frame, &view, &mut image, &|_| true)
        .unwrap();
    image
}

#[test]
fn a_recording_replays_what_was_run_and_draws_the_same() {
    let folder = tempfile::tempdir().unwrap();
    for file in scenes() {
        // Lossless, so that equality is exact; the scene's own tolerance is held elsewhere.
        let scene =
            Scene::load(&file, &["recording.tolerance=0.0".to_owned()]).unwrap_or_else(|e| panic!("{e}"));
        let name = &scene.description.name;
        let solver = solvers::build(&scene).unwrap_or_else(|e| panic!("{name}: {e}"));
        let channels = renderers::build("whitted").unwrap().needs(&scene) & solver.offers();
        let path = folder.path().join("run.mrec");
        let mut writer = Writer::create(&path, &scene, channels).unwrap();
        let mut live = LiveSource::new(&scene, solver, channels);
        let mut frame = Frame::new(scene.grid);
        let mut frames = Vec::new();
        for _ in 0..FRAMES {
            let Progress::Frame(report) = live.read_into(&mut frame).unwrap() else {
                panic!("{name} ended early")
            };
            writer.push(&frame, report).unwrap();
            frames.push(frame.clone());
        }
        writer.finish().unwrap();

        let mut reader = Reader::open(&path).unwrap();
        assert_eq!(reader.len() as u64, FRAMES, "{name}");
        let mut replayed = Frame::new(scene.grid);
        for (k, frame) in frames.iter().enumerate() {
            reader.read(k as _, &mut replayed).unwrap();
            assert!(
                replayed == *frame,
                "{name}: frame {k} was not replayed bit for bit"
            );
        }
        // The recording alone is enough to draw from: no file of the scene is opened again.
        let recorded = reader.scene().clone();
        let last = frames.last().unwrap();
        let (live, replay) = (picture(&scene, last), picture(&recorded, &replayed));
        assert!(
            live == replay,
            "{name}: the live run and its recording draw differently"
        );
        assert!(
            live.pixels
                .iter()
                .all(|p| p.is_finite() && p.min_element() >= 0.0),
            "{name}"
        );
        let brightest = live.pixels.iter().map(|p| p.max_element()).fold(0.0, f32::max);
        assert!(brightest > 0.05, "{name}: the picture is black");
    }
}

#[test]
fn frames_do_not_depend_on_the_number_of_threads() {
    for file in scenes() {
        let scene = Scene::load(&file, &[]).unwrap();
        let run = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new()
                .num_threads(threads)
                .build()
                .unwrap();
            pool.install(|| {
                let solver = solvers::build(&scene).unwrap();
                let channels = solver.offers();
                let mut live = LiveSource::new(&scene, solver, channels);
                let mut frame = Frame::new(scene.grid);
                for _ in 0..FRAMES {
                    live.read_into(&mut frame).unwrap();
                }
                frame
            })
        };
        assert!(run(1) == run(3), "{}", scene.description.name);
    }
}
