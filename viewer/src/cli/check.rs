//! `meniscus check`: a scene and everything that it names, without running it.

use super::args::SceneArgs;
use super::console::Console;
use super::failure::Failure;
use super::format::{self, Facts};
use super::plan::channel_bytes;
use super::{input, live};
use clap::Args;
use meniscus_sim::{Channels, Scene};
use serde::Serialize;
use std::path::{Path, PathBuf};

/// What `meniscus help check` says first.
pub(super) const ABOUT: &str = "Check a scene and every file it names, without running it.\n\nEvery problem is one line \
    `FILE:LINE: KEY: what is wrong; what would be right` on standard error, and the exit code is 2. A scene without \
    problems is summed up: samples, largest stable step, memory, frames.";

/// Arguments of `meniscus check`.
#[derive(Clone, Debug, Args)]
#[command(after_help = "Example:\n  meniscus check data/scenes/ripple-tank.toml --set solver.spacing=0.01")]
pub struct CheckArgs {
    /// The scene
    #[command(flatten)]
    pub scene: SceneArgs,
    /// Print one JSON object, also where there are problems
    #[arg(long)]
    pub json: bool,
}

/// What the check found.
#[derive(Serialize)]
struct Report<'a> {
    file: PathBuf,
    ok: bool,
    problems: Vec<Found>,
    /// Absent where there are problems.
    scene: Option<&'a Facet>,
}

/// A problem; the same as a line of text.
#[derive(Serialize)]
struct Found {
    file: PathBuf,
    line: Option<u32>,
    key: String,
    message: String,
    remedy: String,
}

/// What a scene without problems would be.
#[derive(Serialize)]
struct Facet {
    name: String,
    solver: &'static str,
    /// Samples along X and Z.
    samples: [u32; 2],
    /// Distance between samples, m.
    spacing: f32,
    /// Largest stable step of the initial state, s; absent where the method has no limit.
    largest_stable_step: Option<f64>,
    /// Bytes that the solver holds.
    solver_bytes: u64,
    /// Seconds to simulate.
    duration: f64,
    /// Frames of a recording.
    frames: u64,
    /// Optional channels of a recording.
    channels: Vec<&'static str>,
    /// Bytes of a recording before compression.
    raw_bytes: u64,
    objects: usize,
    cameras: Vec<String>,
    events: usize,
}

pub(super) fn run(args: &CheckArgs, console: &Console) -> Result<(), Failure> {
    let path = &args.scene.scene;
    let result = input::scene(path, &args.scene.overrides.set)
        .and_then(|scene| examine(&scene, console))
        .map_err(|failure| failure.in_scene(path, &args.scene.overrides.set));
    if args.json {
        console.json(&Report::new(path, &result))?;
    }
    let facet = result?;
    if args.json {
        return Ok(());
    }
    console.result(facet.text())
}

/// Builds the solver and asks it.
fn examine(scene: &Scene, console: &Console) -> Result<Facet, Failure> {
    let solver = live::solver(scene)?;
    let renderer = live::renderer(live::DEFAULT_RENDERER)?;
    let choices = live::choose_channels(scene, live::offers(scene, solver.as_ref()), renderer.as_ref());
    for choice in choices.iter().filter(|choice| choice.refused()) {
        console.warn(format!(
            "channel `{}` is left out: {}",
            choice.name, choice.reason
        ));
    }
    let active = choices.iter().filter(|choice| choice.active);
    let frames = live::frame_count(scene, scene.description.duration);
    let frame_bytes = active
        .clone()
        .map(|choice| channel_bytes(scene, solver.as_ref(), choice.channel))
        .sum::<u64>()
        + channel_bytes(scene, solver.as_ref(), Channels::NONE);
    let step = solver.report().largest_stable_step;
    Ok(Facet {
        name: scene.description.name.clone(),
        solver: solver.name(),
        samples: scene.grid.size.to_array(),
        spacing: scene.grid.spacing,
        largest_stable_step: step.is_finite().then_some(step),
        solver_bytes: solver.bytes(),
        duration: scene.description.duration,
        frames,
        channels: active.map(|choice| choice.name).collect(),
        raw_bytes: frames.saturating_mul(frame_bytes),
        objects: scene.meshes.len(),
        cameras: scene
            .description
            .cameras
            .iter()
            .map(|camera| camera.name.clone())
            .collect(),
        events: scene.description.events.len(),
    })
}

impl<'a> Report<'a> {
    fn new(file: &Path, result: &'a Result<Facet, Failure>) -> Self {
        let problems = match result {
            Ok(_) => Vec::new(),
            Err(Failure::Scene(error)) => error
                .problems
                .iter()
                .map(|problem| Found {
                    file: problem.file.clone(),
                    line: problem.line,
                    key: problem.key.clone(),
                    message: problem.message.clone(),
                    remedy: problem.remedy.clone(),
                })
                .collect(),
            // A solver that cannot be built: the message says which key and what would be right.
            Err(failure) => vec![Found {
                file: file.to_owned(),
                line: None,
                key: String::new(),
                message: failure.to_string(),
                remedy: String::new(),
            }],
        };
        Self {
            file: file.to_owned(),
            ok: result.is_ok(),
            problems,
            scene: result.as_ref().ok(),
        }
    }
}

impl Facet {
    fn text(&self) -> String {
        let [width, height] = self.samples;
        let channels = std::iter::once("elevation").chain(self.channels.iter().copied());
        let cameras = if self.cameras.is_empty() {
            "automatic".to_owned()
        } else {
            self.cameras.join(", ")
        };
        let step = self
            .largest_stable_step
            .map_or_else(|| "no limit".to_owned(), format::seconds);
        Facts::default()
            .add("scene", format!("{}, no problems", self.name))
            .add("solver", self.solver)
            .add("samples", format!("{width} x {height}, {} m apart", self.spacing))
            .add("stable step", step)
            .add(
                "memory",
                format!("{} for the solver", format::bytes(self.solver_bytes)),
            )
            .add(
                "duration",
                format!(
                    "{}, {}",
                    format::seconds(self.duration),
                    format::count(self.frames, "frame")
                ),
            )
            .add("channels", channels.collect::<Vec<_>>().join(", "))
            .add(
                "recording",
                format!("{} before compression", format::bytes(self.raw_bytes)),
            )
            .add("objects", self.objects.to_string())
            .add("cameras", cameras)
            .add("events", self.events.to_string())
            .render()
    }
}
