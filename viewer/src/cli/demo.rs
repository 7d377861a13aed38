//! `meniscus demo`: the main job, end to end, on real terrain.

use super::args::{FrameRange, ImageSize, Overrides};
use super::console::Console;
use super::cost::{Cost, Stopwatch};
use super::failure::Failure;
use super::format::{self, Align, Table};
use super::interrupt::Interrupt;
use super::record::{Recorded, record_scene};
use super::render::{RenderArgs, Rendered, draw};
use super::{input, live};
use clap::Args;
use glam::UVec2;
use std::fs;
use std::path::{Path, PathBuf};

/// What `meniscus help demo` says first.
pub(super) const ABOUT: &str = "Break a dam in a valley of real terrain, with rain and a travelling push, write the \
    recording, render stills and a short animation, and print what it cost. About a minute on two cores; needs no \
    GPU and no network.";

/// Arguments of `meniscus demo`.
#[derive(Clone, Debug, Args)]
#[command(after_help = "Example:\n  meniscus demo --out demo")]
pub struct DemoArgs {
    /// Folder for the recording and the pictures; made where it is missing
    #[arg(long, value_name = "DIR", default_value = "meniscus-demo")]
    pub out: PathBuf,
}

/// The scene with what it names: part of the program, so that the demo runs from any folder.
const INPUTS: [(&str, &[u8]); 3] = [
    (
        "scenes/valley.toml",
        include_bytes!("../../../data/scenes/valley.toml"),
    ),
    (
        "terrain/jacksboro.png",
        include_bytes!("../../../data/terrain/jacksboro.png"),
    ),
    ("sky/sky.exr", include_bytes!("../../../data/sky/sky.exr")),
];

/// A still: its file, camera and time in seconds.
const STILLS: [(&str, &str, f64); 3] = [
    ("gap.png", "gap", 60.0),
    ("ridge.png", "ridge", 36.0),
    ("lake.png", "lake", 100.0),
];
const STILL_SIZE: UVec2 = UVec2::new(1280, 720);
const STILL_SAMPLES: u32 = 6;

/// The animation: the whole run, so many times faster than the water moves.
const ANIMATION: (&str, &str) = ("gap.gif", "gap");
const ANIMATION_SIZE: UVec2 = UVec2::new(480, 270);
const ANIMATION_SAMPLES: u32 = 2;
const ANIMATION_SPEED: f64 = 30.0;

pub(super) fn run(args: &DemoArgs, console: &Console) -> Result<(), Failure> {
    let interrupt = Interrupt::install()?;
    let stopwatch = Stopwatch::start();
    let scene_file = unpack(&args.out)?;
    let scene = input::scene(&scene_file, &[])?;
    let recording = args.out.join("valley.mrec");
    let recorded = record_scene(&scene, &recording, console, interrupt)?;
    let mut pictures = Vec::new();
    for (file, camera, time) in STILLS {
        let still = RenderArgs {
            at: Some(time),
            size: ImageSize(STILL_SIZE),
            spp: STILL_SAMPLES,
            noise: None,
            time_limit: None,
            passes: None,
            resume: false,
            auxiliary: false,
            ..picture(&recording, &args.out.join(file), camera)
        };
        pictures.push(draw(&still, console, interrupt)?);
    }
    let (file, camera) = ANIMATION;
    let animation = RenderArgs {
        frames: Some(FrameRange::ALL),
        size: ImageSize(ANIMATION_SIZE),
        spp: ANIMATION_SAMPLES,
        speed: ANIMATION_SPEED,
        ..picture(&recording, &args.out.join(file), camera)
    };
    pictures.push(draw(&animation, console, interrupt)?);
    console.result(summary(&scene_file, &recorded, &pictures, stopwatch.cost()))
}

/// Writes the scene and the files that it names below `out`; returns the scene's path.
fn unpack(out: &Path) -> Result<PathBuf, Failure> {
    let folder = out.join("data");
    for (name, bytes) in INPUTS {
        let file = folder.join(name);
        let failed = |error: std::io::Error| {
            Failure::run(format_args!(
                "{}: {error}; name a folder that can be written with --out",
                file.display()
            ))
        };
        if let Some(parent) = file.parent() {
            fs::create_dir_all(parent).map_err(failed)?;
        }
        fs::write(&file, bytes).map_err(failed)?;
    }
    Ok(folder.join(INPUTS[0].0))
}

/// What all pictures of the demo have in common.
fn picture(recording: &Path, out: &Path, camera: &str) -> RenderArgs {
    RenderArgs {
        input: recording.to_owned(),
        overrides: Overrides::default(),
        at: None,
        frames: None,
        renderer: live::DEFAULT_RENDERER.to_owned(),
        size: ImageSize(STILL_SIZE),
        camera: Some(camera.to_owned()),
        spp: 1,
        noise: None,
        time_limit: None,
        passes: None,
        resume: false,
        auxiliary: false,
        speed: 1.0,
        exposure: None,
        out: out.to_owned(),
        json: false,
    }
}

fn summary(scene: &Path, recorded: &Recorded, pictures: &[Rendered], whole: Cost) -> String {
    let mut table = Table::new(&[
        ("step", Align::Left),
        ("result", Align::Left),
        ("bytes", Align::Right),
        ("clock", Align::Right),
        ("processor", Align::Right),
    ]);
    let processor = |cost: &Cost| {
        cost.cpu_seconds
            .map_or_else(|| "unknown".to_owned(), format::seconds)
    };
    let size =
        |file: &Path| fs::metadata(file).map_or_else(|_| "gone".to_owned(), |m| format::bytes(m.len()));
    table.row(vec![
        format!(
            "simulate and record {}",
            format::seconds(recorded.simulated_seconds)
        ),
        recorded.file.display().to_string(),
        size(&recorded.file),
        format::seconds(recorded.cost.wall_seconds),
        processor(&recorded.cost),
    ]);
    for rendered in pictures {
        let Some(first) = rendered.pictures.first() else {
            continue;
        };
        let [width, height] = rendered.size;
        let what = match rendered.pictures.len() {
            1 => format!("draw {width} x {height}, {} samples", rendered.samples),
            n => format!(
                "draw {n} frames of {width} x {height}, {} samples",
                rendered.samples
            ),
        };
        table.row(vec![
            what,
            first.file.display().to_string(),
            size(&first.file),
            format::seconds(rendered.cost.wall_seconds),
            processor(&rendered.cost),
        ]);
    }
    format!(
        "{}\nwater      {}; {} at the open edges and by rain\nrecorded   {:.3} of {} raw, {} sub-steps\ntotal      {}\n\n\
         The scene is yours to change: {}\n",
        table.render(),
        recorded.scene,
        recorded.volume.text(),
        recorded.ratio,
        format::bytes(recorded.raw_bytes),
        recorded.substeps,
        whole.text(),
        scene.display(),
    )
}
