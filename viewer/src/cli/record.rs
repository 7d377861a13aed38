//! `meniscus record`: runs a scene and records its frames.

use super::args::{SceneArgs, time};
use super::claim;
use super::console::Console;
use super::cost::{Cost, Stopwatch};
use super::failure::{Classify as _, Failure};
use super::format::{self, Facts};
use super::interrupt::Interrupt;
use super::volume::VolumeAccount;
use super::{input, live};
use clap::Args;
use meniscus_sim::recording::Writer;
use meniscus_sim::{Frame, FrameSource as _, Progress, Scene};
use serde::Serialize;
use std::path::{Path, PathBuf};

/// What `meniscus help record` says first.
pub(super) const ABOUT: &str = "Run a scene and record its frames.\n\nRecorded are the channels that `recording.channels` of the scene \
    names, else those that the `whitted` renderer needs, as far as the solver offers them. The file can be read \
    at any moment: after Ctrl-C, a failed step or a crash it holds every frame finished by then.";

/// Arguments of `meniscus record`.
#[derive(Clone, Debug, Args)]
#[command(after_help = "Examples:\n  \
        meniscus record data/scenes/ripple-tank.toml -o run.mrec\n  \
        meniscus record data/scenes/ripple-tank.toml --set solver.spacing=0.03125 -o fine.mrec")]
pub struct RecordArgs {
    /// The scene
    #[command(flatten)]
    pub scene: SceneArgs,
    /// Recording to write; a file of that name is replaced
    #[arg(short, long = "out", value_name = "RUN.mrec")]
    pub out: PathBuf,
    /// Seconds to simulate, in place of the scene's `duration`
    #[arg(long, value_name = "S", value_parser = time, allow_negative_numbers = true)]
    pub duration: Option<f64>,
    /// Print the summary as one JSON object
    #[arg(long)]
    pub json: bool,
}

/// What recording a scene gave and cost.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Recorded {
    /// The recording.
    pub file: PathBuf,
    /// Name of the scene.
    pub scene: String,
    /// Name of the solver.
    pub solver: &'static str,
    /// Optional channels in every frame.
    pub channels: Vec<&'static str>,
    /// Frames written.
    pub frames: u64,
    /// Seconds simulated: the time of the last frame.
    pub simulated_seconds: f64,
    /// Bytes of the frames before compression.
    pub raw_bytes: u64,
    /// Bytes of the file.
    pub file_bytes: u64,
    /// `file_bytes / raw_bytes`.
    pub ratio: f64,
    /// What became of the water.
    #[serde(flatten)]
    pub volume: VolumeAccount,
    /// Sub-steps that the solver took.
    pub substeps: u64,
    /// How often a limiter of last resort fired.
    pub clamps: u64,
    /// Processor and wall seconds, from the first frame to the closed file.
    #[serde(flatten)]
    pub cost: Cost,
    /// Seconds simulated a second on the clock.
    pub real_time_factor: f64,
}

pub(super) fn run(args: &RecordArgs, console: &Console) -> Result<(), Failure> {
    let interrupt = Interrupt::install()?;
    let mut overrides = args.scene.overrides.set.clone();
    // As an override, so that the recording's header tells the duration that was run.
    overrides.extend(args.duration.map(|seconds| format!("duration={seconds:?}")));
    claim::writable(&args.out)?;
    claim::differs(&args.out, &args.scene.scene)?;
    let scene = input::scene(&args.scene.scene, &overrides)?;
    let recorded = record_scene(&scene, &args.out, console, interrupt)
        .map_err(|failure| failure.in_scene(&args.scene.scene, &overrides))?;
    if args.json {
        console.json(&recorded)
    } else {
        console.result(recorded.text())
    }
}

/// Runs `scene` for its duration and writes its frames to `out`.
///
/// # Errors
/// [`Failure::Solver`] if none can be built, [`Failure::Run`] if a step is refused or the file cannot be written,
/// [`Failure::Interrupted`] after Ctrl-C. In all cases the frames finished by then are in the file.
pub fn record_scene(
    scene: &Scene,
    out: &Path,
    console: &Console,
    interrupt: Interrupt,
) -> Result<Recorded, Failure> {
    let solver = live::solver(scene)?;
    let name = solver.name();
    let offers = live::offers(scene, solver.as_ref());
    let choices = live::choose_channels(scene, offers, live::renderer(live::DEFAULT_RENDERER)?.as_ref());
    for choice in choices.iter().filter(|choice| choice.refused()) {
        console.warn(format!(
            "channel `{}` is left out: {}",
            choice.name, choice.reason
        ));
    }
    let channels = live::active(&choices);
    let size = scene.grid.size;
    console.detail(format!(
        "solver {name}, {} x {} samples, channels: {channels}",
        size.x, size.y
    ));

    let total = live::frame_count(scene, scene.description.duration);
    let stopwatch = Stopwatch::start();
    let mut source = live::source(scene, solver, channels).until(scene.description.duration);
    let mut writer = Writer::create(out, scene, channels).or_run()?;
    let mut frame = Frame::new(scene.grid);
    let mut tally = Tally::default();
    let progress = console.progress("recording", total, "frame");
    let stopped = loop {
        match source.read_into(&mut frame) {
            Ok(Progress::Frame(report)) => {
                // The writer reports what went wrong on its own thread; finishing it tells the same again.
                if let Err(error) = writer.push(&frame, report) {
                    break Some(Failure::Run(error.into()));
                }
                tally.add(&frame, report);
            }
            Ok(Progress::End) => break None,
            Err(error) => {
                break Some(live::run_failed(
                    error,
                    scene,
                    tally.frames,
                    &kept(tally.frames, out),
                ));
            }
        }
        progress.set(tally.frames as f64);
        if interrupt.pressed() && tally.frames < total {
            break Some(Failure::Interrupted(format!(
                "{} of {} are in {}",
                tally.frames,
                format::count(total, "frame"),
                out.display()
            )));
        }
    };
    drop(progress);
    let finished = writer.finish();
    if let Some(failure) = stopped {
        return Err(failure);
    }
    let summary = finished.or_run()?;
    let cost = stopwatch.cost();
    Ok(Recorded {
        file: out.to_owned(),
        scene: scene.description.name.clone(),
        solver: name,
        channels: channels.iter().map(|(name, _)| name).collect(),
        frames: tally.frames,
        simulated_seconds: tally.last_time,
        raw_bytes: summary.raw_bytes,
        file_bytes: summary.file_bytes,
        ratio: summary.file_bytes as f64 / summary.raw_bytes.max(1) as f64,
        volume: VolumeAccount::of(scene, tally.masses, tally.last_time),
        substeps: tally.substeps,
        clamps: tally.clamps,
        cost,
        real_time_factor: tally.last_time / cost.wall_seconds.max(1e-9),
    })
}

/// What remains of a run that stopped.
fn kept(frames: u64, out: &Path) -> String {
    format!(" ({} kept in {})", format::count(frames, "frame"), out.display())
}

/// Totals over the frames of a run.
#[derive(Default)]
struct Tally {
    frames: u64,
    last_time: f64,
    substeps: u64,
    clamps: u64,
    /// Mass of the water in the first and the latest frame, kg.
    masses: Option<(f64, f64)>,
}

impl Tally {
    fn add(&mut self, frame: &Frame, report: Option<meniscus_sim::StepReport>) {
        self.frames += 1;
        self.last_time = frame.time;
        if let Some(report) = report {
            self.substeps += u64::from(report.substeps);
            self.clamps += report.clamps;
            let first = self.masses.map_or(report.mass, |(first, _)| first);
            self.masses = Some((first, report.mass));
        }
    }
}

impl Recorded {
    /// The summary for people.
    pub fn text(&self) -> String {
        let mut facts = Facts::default();
        facts
            .add("recording", self.file.display().to_string())
            .add("scene", format!("{} ({})", self.scene, self.solver))
            .add(
                "frames",
                format!(
                    "{}, {} simulated",
                    self.frames,
                    format::seconds(self.simulated_seconds)
                ),
            )
            .add("channels", list(&self.channels))
            .add(
                "size",
                format!(
                    "{}, {:.3} of {} raw",
                    format::bytes(self.file_bytes),
                    self.ratio,
                    format::bytes(self.raw_bytes)
                ),
            )
            .add("volume", self.volume.text())
            .add("sub-steps", self.substeps.to_string());
        if self.clamps > 0 {
            facts.add(
                "clamps",
                format!("{} (limiters of last resort fired)", self.clamps),
            );
        }
        facts.add("time", self.cost.text()).add(
            "real time",
            format!("{} x", format::three_digits(self.real_time_factor)),
        );
        facts.render()
    }
}

/// `elevation` and the optional channels.
fn list(channels: &[&str]) -> String {
    std::iter::once("elevation")
        .chain(channels.iter().copied())
        .collect::<Vec<_>>()
        .join(", ")
}
