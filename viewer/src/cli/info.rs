//! `meniscus info`: what a recording holds.

use super::console::Console;
use super::failure::{Classify as _, Failure};
use super::format::{self, Align, Facts, Table};
use super::input;
use clap::Args;
use meniscus_sim::recording::{Damage, Reader, Statistics};
use meniscus_sim::solvers;
use serde::Serialize;
use std::path::{Path, PathBuf};

/// What `meniscus help info` says first.
pub(super) const ABOUT: &str = "Tell what a recording holds: scene, channels, frames, compression, conservation and damage.\n\nEvery \
    frame is read and its checksum checked, so this also verifies a file. Damaged or missing frames are warnings on \
    standard error, exit code 0, as long as the header can be read.";

/// Arguments of `meniscus info`.
#[derive(Clone, Debug, Args)]
#[command(after_help = "Examples:\n  meniscus info run.mrec\n  meniscus info run.mrec --json")]
pub struct InfoArgs {
    /// Recording
    #[arg(value_name = "RUN.mrec")]
    pub recording: PathBuf,
    /// Print one JSON object
    #[arg(long)]
    pub json: bool,
}

/// What a recording holds.
#[derive(Serialize)]
struct Info {
    file: PathBuf,
    producer: String,
    scene: String,
    solver: &'static str,
    /// Samples along X and Z.
    samples: [u32; 2],
    /// Distance between samples, m.
    spacing: f32,
    /// Frames, damaged ones included.
    frames: u64,
    damaged_frames: u64,
    /// Frames a second of simulated time.
    rate: f64,
    /// Time of the first and of the last frame, s.
    first_time: f64,
    duration: f64,
    /// Largest error of a recorded value that was asked for; 0 for lossless.
    tolerance: f32,
    channels: Vec<ChannelInfo>,
    objects: usize,
    header_bytes: u64,
    file_bytes: u64,
    raw_bytes: u64,
    /// `file_bytes / raw_bytes`.
    ratio: f64,
    /// Absent where the frames carry no totals.
    totals: Option<TotalsInfo>,
    /// Whether the recording was brought to its end; if not, it was cut or is still being written.
    closed: bool,
    damage: Vec<DamageInfo>,
}

#[derive(Serialize)]
struct ChannelInfo {
    name: &'static str,
    raw_bytes: u64,
    stored_bytes: u64,
    /// Largest difference between a stored and an original value.
    largest_error: f32,
}

#[derive(Serialize)]
struct TotalsInfo {
    /// Mass of the first and of the last frame, kg.
    first_mass: f64,
    last_mass: f64,
    /// Largest difference of a frame's mass from the first one's, kg.
    largest_mass_drift: f64,
    /// Energy of the first and of the last frame, J.
    first_energy: f64,
    last_energy: f64,
    clamps: u64,
}

#[derive(Serialize)]
struct DamageInfo {
    /// Absent where it is not known which frame is lost.
    frame: Option<usize>,
    offset: u64,
    length: u64,
    reason: String,
}

pub(super) fn run(args: &InfoArgs, console: &Console) -> Result<(), Failure> {
    let mut reader = Reader::open(&args.recording).or_input()?;
    let statistics = reader.statistics().or_run()?;
    input::warn_of_damage(&reader, console);
    let info = Info::new(&args.recording, &reader, &statistics);
    if args.json {
        console.json(&info)
    } else {
        console.result(info.text())
    }
}

impl Info {
    fn new(file: &Path, reader: &Reader, statistics: &Statistics) -> Self {
        let scene = reader.scene();
        let raw_bytes = statistics.raw_bytes();
        Self {
            file: file.to_owned(),
            producer: reader.producer().to_owned(),
            scene: scene.description.name.clone(),
            solver: solvers::name_of(&scene.description.solver),
            samples: scene.grid.size.to_array(),
            spacing: scene.grid.spacing,
            frames: statistics.frames as u64,
            damaged_frames: statistics.damaged as u64,
            rate: reader.rate(),
            first_time: statistics.first_time,
            duration: statistics.last_time - statistics.first_time,
            tolerance: reader.tolerance(),
            channels: statistics
                .channels
                .iter()
                .map(|channel| ChannelInfo {
                    name: channel.name,
                    raw_bytes: channel.raw_bytes,
                    stored_bytes: channel.stored_bytes,
                    largest_error: channel.largest_error,
                })
                .collect(),
            objects: scene.meshes.len(),
            header_bytes: statistics.header_bytes,
            file_bytes: statistics.file_bytes,
            raw_bytes,
            ratio: statistics.file_bytes as f64 / raw_bytes.max(1) as f64,
            totals: statistics.totals.map(|totals| TotalsInfo {
                first_mass: totals.first_mass,
                last_mass: totals.last_mass,
                largest_mass_drift: totals.largest_mass_drift,
                first_energy: totals.first_energy,
                last_energy: totals.last_energy,
                clamps: totals.clamps,
            }),
            closed: reader.is_complete(),
            damage: reader.damage().iter().map(DamageInfo::new).collect(),
        }
    }

    fn text(&self) -> String {
        let [width, height] = self.samples;
        let tolerance = if self.tolerance > 0.0 {
            format!("within {}", self.tolerance)
        } else {
            "lossless".to_owned()
        };
        let mut facts = Facts::default();
        facts
            .add(
                "recording",
                format!("{}, by {}", self.file.display(), self.producer),
            )
            .add("scene", format!("{} ({})", self.scene, self.solver))
            .add("samples", format!("{width} x {height}, {} m apart", self.spacing))
            .add(
                "frames",
                format!(
                    "{}, {} a second, {}",
                    self.frames,
                    self.rate,
                    format::seconds(self.duration)
                ),
            )
            .add("objects", self.objects.to_string())
            .add(
                "size",
                format!(
                    "{}, {:.3} of {} raw, {tolerance}",
                    format::bytes(self.file_bytes),
                    self.ratio,
                    format::bytes(self.raw_bytes)
                ),
            )
            .add("header", format::bytes(self.header_bytes));
        if let Some(totals) = &self.totals {
            facts
                .add(
                    "mass",
                    format!(
                        "{:.6e} kg at first, {:.6e} kg at last, at most {:.1e} kg from the first",
                        totals.first_mass, totals.last_mass, totals.largest_mass_drift
                    ),
                )
                .add(
                    "energy",
                    format!(
                        "{:.4e} J at first, {:.4e} J at last",
                        totals.first_energy, totals.last_energy
                    ),
                );
            if totals.clamps > 0 {
                facts.add(
                    "clamps",
                    format!("{} (limiters of last resort fired)", totals.clamps),
                );
            }
        }
        let state = match (self.closed, self.damaged_frames) {
            (true, 0) => "whole".to_owned(),
            (false, 0) => "not closed (still being written, or cut); all frames found are whole".to_owned(),
            (_, damaged) => format!("damaged: {} cannot be read", format::count(damaged, "frame")),
        };
        facts.add("state", state);
        let mut table = Table::new(&[
            ("channel", Align::Left),
            ("raw", Align::Right),
            ("stored", Align::Right),
            ("ratio", Align::Right),
            ("largest error", Align::Right),
        ]);
        for channel in &self.channels {
            table.row(vec![
                channel.name.into(),
                format::bytes(channel.raw_bytes),
                format::bytes(channel.stored_bytes),
                format!(
                    "{:.3}",
                    channel.stored_bytes as f64 / channel.raw_bytes.max(1) as f64
                ),
                format::three_digits(f64::from(channel.largest_error)),
            ]);
        }
        if table.is_empty() {
            return facts.render();
        }
        format!("{}\n{}", facts.render(), table.render())
    }
}

impl DamageInfo {
    fn new(damage: &Damage) -> Self {
        Self {
            frame: damage.frame,
            offset: damage.offset,
            length: damage.length,
            reason: damage.reason.clone(),
        }
    }
}
