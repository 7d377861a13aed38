//! `meniscus export`: frames of a recording for other programs.

use super::args::FrameRange;
use super::claim;
use super::console::Console;
use super::cost::{Cost, Stopwatch};
use super::failure::Failure;
use super::format;
use super::input;
use super::interrupt::Interrupt;
use clap::Args;
use clap::builder::{PossibleValuesParser, TypedValueParser as _};
use meniscus_sim::export::{self, ExportError, Format, Update};
use meniscus_sim::recording::{RecordingError, ReplaySource};
use meniscus_sim::{Frame, FrameSource, Progress, SourceError};
use serde::Serialize;
use std::fs;
use std::ops::Range;
use std::path::{Path, PathBuf};

/// What `meniscus help export` says first.
pub(super) const ABOUT: &str = "Write the frames of a recording for NumPy, ParaView or Blender.\n\n\
    `npz` writes one archive of arrays: time[f], x[nx], z[nz], elevation[f,nz,nx], ground[nz,nx] and each recorded \
    channel. `vtk` writes OUT.pvd and a folder OUT of structured grids. `obj`, `ply` and `glb` write the surface as a mesh, \
    one file a frame, with the frame's number in its name. Damaged frames are left out with a warning. An \
    extension that is missing is appended.";

/// Arguments of `meniscus export`.
#[derive(Clone, Debug, Args)]
#[command(after_help = "Examples:\n  \
    meniscus export run.mrec --format npz -o run.npz\n  \
    meniscus export run.mrec --format glb --frames 0..40 -o meshes/wave.glb")]
pub struct ExportArgs {
    /// Recording
    #[arg(value_name = "RUN.mrec")]
    pub recording: PathBuf,
    /// What to write
    #[arg(long, value_name = "FORMAT", value_parser = formats())]
    pub format: Format,
    /// Write these frames only: 12, 10..20 (20 left out), 10..=20, 10.. or ..20
    #[arg(long, value_name = "A..B")]
    pub frames: Option<FrameRange>,
    /// File to write, or pattern of the files' names
    #[arg(short, long = "out", value_name = "OUT")]
    pub out: PathBuf,
    /// Print what was written as one JSON object
    #[arg(long)]
    pub json: bool,
}

/// Reads the name of a format, and lists the names in help and errors.
fn formats() -> impl clap::builder::TypedValueParser<Value = Format> {
    PossibleValuesParser::new(Format::ALL.map(Format::name))
        .try_map(|name| Format::from_name(&name).ok_or("unknown format"))
}

/// `out` with the extension of its format, which is appended where it is missing, as NumPy does. A device or a pipe
/// keeps its name.
fn named(format: Format, out: &Path) -> PathBuf {
    let (extension, also) = match format {
        Format::Vtk => ("pvd", "vtk"),
        other => (other.name(), other.name()),
    };
    let has = |extension: &str| {
        out.extension()
            .is_some_and(|found| found.eq_ignore_ascii_case(extension))
    };
    if has(extension) || fs::metadata(out).is_ok_and(|found| !found.is_file() && !found.is_dir()) {
        out.to_owned()
    } else if has(also) {
        out.with_extension(extension)
    } else {
        let mut name = out.as_os_str().to_owned();
        name.push(".");
        name.push(extension);
        name.into()
    }
}

/// What was written.
#[derive(Serialize)]
struct Exported<'a> {
    input: &'a Path,
    format: &'static str,
    frames: u64,
    /// Damaged frames that were left out.
    damaged_frames: u64,
    /// The file to open.
    entry: PathBuf,
    /// Number of files.
    files: u64,
    bytes: u64,
    #[serde(flatten)]
    cost: Cost,
}

pub(super) fn run(args: &ExportArgs, console: &Console) -> Result<(), Failure> {
    let interrupt = Interrupt::install()?;
    let out = named(args.format, &args.out);
    claim::writable(&out)?;
    claim::differs(&out, &args.recording)?;
    let reader = input::recording(&args.recording, console)?;
    let frames = args.frames.unwrap_or(FrameRange::ALL).within(reader.len() as u64);
    let frames = frames.map_err(|message| Failure::input(format_args!("--frames: {message}")))?;
    let scene = reader.scene().clone();
    let total = frames.end - frames.start;
    let mut source = Part::new(ReplaySource::new(reader), frames);

    let stopwatch = Stopwatch::start();
    let progress = console.progress("exporting", total, "frame");
    let mut update = |update: Update<'_>| match update {
        Update::Frame { done, .. } => {
            progress.set(done as f64);
            done == total || !interrupt.pressed()
        }
        Update::Damaged { error, .. } => {
            let passable = matches!(error, SourceError::Recording(RecordingError::DamagedFrame { .. }));
            if passable {
                console.warn(format!("left out: {error}"));
            }
            passable
        }
    };
    let written = export::write(args.format, &scene, &mut source, &out, &mut update);
    drop(progress);
    let summary = written.map_err(|error| classify(error, total))?;
    let exported = Exported {
        input: &args.recording,
        format: args.format.name(),
        frames: summary.frames,
        damaged_frames: summary.damaged,
        entry: summary.entry,
        files: summary.files,
        bytes: summary.bytes,
        cost: stopwatch.cost(),
    };
    if args.json {
        console.json(&exported)
    } else {
        console.result(exported.text())
    }
}

fn classify(error: ExportError, total: u64) -> Failure {
    match error {
        ExportError::Interrupted { done } => Failure::Interrupted(format!(
            "{done} of {} were read; files that were whole by then stay",
            format::count(total, "frame")
        )),
        ExportError::Destination { .. } | ExportError::Empty => Failure::Input(error.into()),
        _ => Failure::Run(error.into()),
    }
}

impl Exported<'_> {
    fn text(&self) -> String {
        format!(
            "{}: {} as {}, {} in {}; {}",
            self.entry.display(),
            format::count(self.frames, "frame"),
            self.format,
            format::bytes(self.bytes),
            format::count(self.files, "file"),
            self.cost.text()
        )
    }
}

/// Some frames of a recording.
struct Part {
    replay: ReplaySource,
    end: u64,
}

impl Part {
    fn new(mut replay: ReplaySource, frames: Range<u64>) -> Self {
        replay.seek(usize::try_from(frames.start).unwrap_or(usize::MAX));
        Self {
            replay,
            end: frames.end,
        }
    }
}

impl FrameSource for Part {
    fn read_into(&mut self, out: &mut Frame) -> Result<Progress, SourceError> {
        if self.replay.position() as u64 >= self.end {
            return Ok(Progress::End);
        }
        self.replay.read_into(out)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_extension_is_that_of_the_format() {
        for (format, out, expected) in [
            (Format::Npz, "run.npz", "run.npz"),
            (Format::Npz, "run.NPZ", "run.NPZ"),
            (Format::Npz, "run", "run.npz"),
            (Format::Npz, "run.v2", "run.v2.npz"),
            (Format::Vtk, "run", "run.pvd"),
            (Format::Vtk, "run.vtk", "run.pvd"),
            (Format::Obj, "d/wave.obj", "d/wave.obj"),
        ] {
            assert_eq!(named(format, Path::new(out)), Path::new(expected));
        }
    }
}
