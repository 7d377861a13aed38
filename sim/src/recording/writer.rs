//! Writing a recording: encoding and writing happen off the caller's thread, one frame at a time.
//!
//! `push` copies the frame, hands the copy to the recording thread and returns. That thread encodes it with a pool (all
//! arrays and their bands at once) and gives the whole chunk to the system in one call; only then does it take the next
//! frame, for which the next `push` waits. A process that is killed therefore loses at most the one frame that it
//! pushed last. A longer queue would even out frames that take unequal time, at the price of that promise; it would not
//! make a long run shorter, since the pool works while the simulation does.
//!
//! The pool is the writer's own: a simulation that waits for the frame in flight may itself occupy every thread of
//! rayon's global pool.

use super::chunk::{self, CHUNK_HEADER, ChunkHeader, Kind};
use super::frame_payload::{self, Encoded};
use super::{FORMAT_VERSION, MAX_BODIES, MAX_DROPLETS, RecordingError, header, index};
use crate::events::Action;
use crate::frame::{Channels, Frame};
use crate::grid::{Grid, GridSpec};
use crate::scene::Scene;
use crate::solver::StepReport;
use std::fs::File;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread::JoinHandle;

/// A recording in the making.
///
/// Of the frames that were pushed, all but the last are with the system, whatever becomes of this process: the last one
/// is in flight until the next [`Self::push`], [`Self::flush`] or [`Self::finish`] returns. Dropping a writer without
/// [`Self::finish`] writes the frame in flight but no index; the file can be read.
#[derive(Debug)]
pub struct Writer {
    path: PathBuf,
    spec: GridSpec,
    channels: Channels,
    pushed: u64,
    last_time: f64,
    /// Whether the recording thread still owes an answer for the frame pushed last.
    in_flight: bool,
    failed: bool,
    /// A frame to copy the next one into.
    spare: Option<Frame>,
    written: Arc<AtomicU64>,
    jobs: Option<SyncSender<Job>>,
    done: Receiver<Result<Frame, RecordingError>>,
    thread: Option<JoinHandle<Output>>,
}

/// What was recorded.
#[derive(Clone, Debug, PartialEq)]
pub struct Summary {
    /// Frames written.
    pub frames: u64,
    /// Bytes in the file.
    pub file_bytes: u64,
    /// Bytes of the frames' values before packing.
    pub raw_bytes: u64,
    /// Largest difference between a stored and an original value.
    pub largest_error: f32,
}

/// A frame to be encoded and written.
#[derive(Debug)]
struct Job {
    frame: Frame,
    report: Option<StepReport>,
    acted: Vec<(f64, Action)>,
}

impl Writer {
    /// Creates the file, or empties it if there is one, and writes the header with the scene.
    ///
    /// # Errors
    /// [`RecordingError`] if the scene cannot be stored or the file not be created or written; a scene that cannot be
    /// stored leaves an existing file as it is.
    pub fn create(path: impl AsRef<Path>, scene: &Scene, channels: Channels) -> Result<Self, RecordingError> {
        let path = path.as_ref();
        if path.is_dir() {
            return Err(RecordingError::NotAFile {
                path: path.to_owned(),
                found: "a directory",
            });
        }
        let (start, recording) = file_start(path, scene, channels)?;
        let file = File::create(path).map_err(|e| RecordingError::io(path, "create", e))?;
        let mut output = Output::new(path, file, recording);
        output.put(&start)?;
        Self::start(output, scene, channels)
    }

    fn start(mut output: Output, scene: &Scene, channels: Channels) -> Result<Self, RecordingError> {
        let path = output.path.clone();
        let io = |e| RecordingError::io(&path, "create", e);
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(rayon::current_num_threads())
            .thread_name(|n| format!("meniscus-encode-{n}"))
            .build()
            .map_err(|e| io(std::io::Error::other(e)))?;
        let encoding = Encoding {
            channels,
            tolerance: scene.description.recording.tolerance,
            recording: output.recording,
        };
        let written = Arc::new(AtomicU64::new(0));
        let count = Arc::clone(&written);
        // Each holds the one frame in flight, so that no sender ever waits.
        let (jobs, incoming) = sync_channel::<Job>(1);
        let (outgoing, done) = sync_channel(1);
        let thread = std::thread::Builder::new()
            .name("meniscus-record".to_owned())
            .spawn(move || {
                let mut bytes = Vec::new();
                for (sequence, job) in (1..).zip(incoming) {
                    let encoded = pool.install(|| encoding.chunk(&job, sequence, &mut bytes));
                    let frame = job.frame;
                    let result = output.frame(&bytes, frame.time, encoded);
                    let failed = result.is_err();
                    count.fetch_add(u64::from(!failed), Ordering::Release);
                    // A writer that is being dropped no longer listens.
                    let _ = outgoing.send(result.map(|()| frame));
                    if failed {
                        break;
                    }
                }
                output
            })
            .map_err(io)?;
        Ok(Self {
            spec: scene.grid,
            channels,
            pushed: 0,
            last_time: f64::NEG_INFINITY,
            in_flight: false,
            failed: false,
            spare: None,
            written,
            jobs: Some(jobs),
            done,
            thread: Some(thread),
            path,
        })
    }

    /// Records a copy of `frame`, and the totals of its state where they are known. Returns when every frame pushed
    /// before has been given to the system; this one is then in flight. Channels that are not recorded are left out.
    ///
    /// # Errors
    /// [`RecordingError`] if the frame is refused (it holds NaN or infinity, lacks a channel, stands on another grid or
    /// goes back in time; the recording goes on), or if writing an earlier frame failed.
    pub fn push(&mut self, frame: &Frame, report: Option<StepReport>) -> Result<(), RecordingError> {
        self.push_acted(frame, report, &[])
    }

    /// As [`Self::push`], with what was done live since the frame before: the new part of
    /// [`crate::source::LiveSource::acted`]. A reader gives it back, so that the run can be repeated.
    ///
    /// # Errors
    /// As [`Self::push`]; more than 4 MiB of actions are too many for a frame.
    pub fn push_acted(
        &mut self,
        frame: &Frame,
        report: Option<StepReport>,
        acted: &[(f64, Action)],
    ) -> Result<(), RecordingError> {
        self.check(frame)?;
        self.flush()?;
        let mut copy = self.spare.take().unwrap_or_else(|| Frame::new(self.spec));
        copy_frame(frame, self.channels, &mut copy);
        let job = Job {
            frame: copy,
            report,
            acted: acted.to_vec(),
        };
        if self.jobs.as_ref().is_none_or(|jobs| jobs.send(job).is_err()) {
            return Err(self.stopped());
        }
        self.in_flight = true;
        self.pushed += 1;
        self.last_time = frame.time;
        tracing::trace!("frame {} handed to the recording", self.pushed - 1);
        Ok(())
    }

    /// Frames that were given to the system: they survive the end of this process, however it ends.
    pub fn written(&self) -> u64 {
        self.written.load(Ordering::Acquire)
    }

    /// Waits until every frame that was pushed has been given to the system.
    ///
    /// # Errors
    /// [`RecordingError`] if writing failed.
    pub fn flush(&mut self) -> Result<(), RecordingError> {
        if self.failed {
            return Err(self.stopped());
        }
        if !std::mem::take(&mut self.in_flight) {
            return Ok(());
        }
        match self.done.recv() {
            Ok(Ok(frame)) => {
                self.spare = Some(frame);
                Ok(())
            }
            Ok(Err(error)) => {
                self.failed = true;
                Err(error)
            }
            Err(_) => Err(self.stopped()),
        }
    }

    /// Writes the frame in flight and the index, and waits for the disk.
    ///
    /// # Errors
    /// [`RecordingError`] if writing failed; the frames written before that can be read.
    pub fn finish(mut self) -> Result<Summary, RecordingError> {
        self.flush()?;
        self.join().ok_or_else(|| self.stopped())?.finish()
    }

    /// Lets the recording thread end when it has written the frame in flight.
    fn join(&mut self) -> Option<Output> {
        drop(self.jobs.take());
        self.thread.take().and_then(|thread| thread.join().ok())
    }

    fn stopped(&mut self) -> RecordingError {
        self.failed = true;
        RecordingError::Stopped {
            path: self.path.clone(),
        }
    }

    fn check(&self, frame: &Frame) -> Result<(), RecordingError> {
        let number = self.pushed;
        if frame.spec() != &self.spec {
            return Err(RecordingError::Grid {
                frame: number,
                expected: Box::new(self.spec),
                found: Box::new(*frame.spec()),
            });
        }
        let missing = self.channels - frame.channels();
        if !missing.is_empty() {
            return Err(RecordingError::MissingChannels {
                frame: number,
                missing,
            });
        }
        if !frame.time.is_finite() || frame.time < self.last_time {
            return Err(RecordingError::Time {
                frame: number,
                time: frame.time,
                previous: self.last_time,
            });
        }
        check_lists(frame).map_err(|reason| RecordingError::Lists {
            frame: number,
            reason,
        })?;
        frame.check_finite()?;
        Ok(())
    }
}

impl Drop for Writer {
    fn drop(&mut self) {
        self.join();
    }
}

/// How the frames of a recording are encoded.
#[derive(Clone, Copy, Debug)]
struct Encoding {
    channels: Channels,
    tolerance: f32,
    recording: u32,
}

impl Encoding {
    /// Encodes a frame as the whole chunk in `bytes`.
    fn chunk(self, job: &Job, sequence: u64, bytes: &mut Vec<u8>) -> Result<Encoded, String> {
        let Job { frame, report, acted } = job;
        bytes.clear();
        bytes.resize(CHUNK_HEADER, 0);
        let encoded = frame_payload::encode(frame, self.channels, *report, self.tolerance, bytes)?;
        frame_payload::encode_actions(acted, bytes)?;
        ChunkHeader::seal(bytes, Kind::Frame, Some(self.recording), sequence, frame.time);
        Ok(encoded)
    }
}

/// Checks the lengths of what is in a frame.
fn check_lists(frame: &Frame) -> Result<(), String> {
    let spec = *frame.spec();
    let fits = |found: Option<&GridSpec>| found.is_none_or(|found| *found == spec);
    let grids = [
        ("depth", fits(frame.depth.as_ref().map(Grid::spec))),
        ("velocity", fits(frame.velocity.as_ref().map(Grid::spec))),
        ("displacement", fits(frame.displacement.as_ref().map(Grid::spec))),
        ("foam", fits(frame.foam.as_ref().map(Grid::spec))),
    ];
    if let Some((name, _)) = grids.iter().find(|(_, fits)| !fits) {
        return Err(format!(
            "channel `{name}` stands on another grid than `elevation`"
        ));
    }
    for (name, list) in [("droplets", &frame.droplets), ("particles", &frame.particles)] {
        let Some(d) = list else {
            continue;
        };
        let n = d.radius.len();
        if d.position.len() != n || d.velocity.len() != n {
            return Err(format!(
                "{name} have unequal numbers of positions, velocities and radii"
            ));
        }
        if n > MAX_DROPLETS {
            return Err(format!("{n} {name}; at most {MAX_DROPLETS} can be recorded"));
        }
    }
    match frame.bodies.as_ref().map(Vec::len) {
        Some(n) if n > MAX_BODIES => Err(format!("{n} bodies; at most {MAX_BODIES} can be recorded")),
        _ => Ok(()),
    }
}

/// Copies time, index and `channels` of `frame`, reusing what `out` has allocated.
fn copy_frame(frame: &Frame, channels: Channels, out: &mut Frame) {
    fn copy<T: Copy>(from: Option<&Grid<T>>, to: Option<&mut Grid<T>>) {
        if let (Some(from), Some(to)) = (from, to) {
            to.as_mut_slice().copy_from_slice(from.as_slice());
        }
    }
    out.prepare(*frame.spec(), channels);
    out.time = frame.time;
    out.index = frame.index;
    copy(Some(&frame.elevation), Some(&mut out.elevation));
    copy(frame.depth.as_ref(), out.depth.as_mut());
    copy(frame.velocity.as_ref(), out.velocity.as_mut());
    copy(frame.displacement.as_ref(), out.displacement.as_mut());
    copy(frame.foam.as_ref(), out.foam.as_mut());
    for (from, to) in [
        (&frame.droplets, &mut out.droplets),
        (&frame.particles, &mut out.particles),
    ] {
        if let (Some(from), Some(to)) = (from, to) {
            to.position.extend_from_slice(&from.position);
            to.velocity.extend_from_slice(&from.velocity);
            to.radius.extend_from_slice(&from.radius);
        }
    }
    if let (Some(from), Some(to)) = (&frame.bodies, &mut out.bodies) {
        to.extend_from_slice(from);
    }
}

/// Preamble and header chunk, and the recording's number.
fn file_start(path: &Path, scene: &Scene, channels: Channels) -> Result<(Vec<u8>, u32), RecordingError> {
    let mut chunk = vec![0; CHUNK_HEADER];
    header::encode(scene, channels, &mut chunk).map_err(|reason| RecordingError::Scene {
        path: path.to_owned(),
        reason,
    })?;
    let recording = ChunkHeader::seal(&mut chunk, Kind::Header, None, 0, 0.0);
    let mut bytes = chunk::preamble(FORMAT_VERSION).to_vec();
    bytes.extend_from_slice(&chunk);
    Ok((bytes, recording))
}

/// The file and what has been written to it.
#[derive(Debug)]
struct Output {
    path: PathBuf,
    file: File,
    recording: u32,
    /// Bytes of whole chunks.
    length: u64,
    /// Offset and time of each frame.
    entries: Vec<(u64, f64)>,
    raw_bytes: u64,
    largest_error: f32,
}

impl Output {
    fn new(path: &Path, file: File, recording: u32) -> Self {
        Self {
            path: path.to_owned(),
            file,
            recording,
            length: 0,
            entries: Vec::new(),
            raw_bytes: 0,
            largest_error: 0.0,
        }
    }

    /// Writes whole chunks; after an error the file ends with the last whole one before.
    fn put(&mut self, bytes: &[u8]) -> Result<(), RecordingError> {
        if let Err(error) = self.file.write_all(bytes) {
            // A device cannot be shortened; then there is nothing to keep either.
            let _ = self.file.set_len(self.length);
            return Err(RecordingError::io(&self.path, "write", error));
        }
        self.length += bytes.len() as u64;
        Ok(())
    }

    /// Writes the chunk of a frame.
    fn frame(
        &mut self,
        bytes: &[u8],
        time: f64,
        encoded: Result<Encoded, String>,
    ) -> Result<(), RecordingError> {
        let encoded = encoded
            .map_err(|reason| RecordingError::io(&self.path, "write", std::io::Error::other(reason)))?;
        let offset = self.length;
        self.put(bytes)?;
        self.entries.push((offset, time));
        self.raw_bytes += encoded.raw_bytes;
        self.largest_error = self.largest_error.max(encoded.max_error);
        Ok(())
    }

    fn finish(mut self) -> Result<Summary, RecordingError> {
        let index = index::encode(&self.entries, self.recording, self.length);
        self.put(&index)?;
        match self.file.sync_all() {
            // What cannot be synchronised (a pipe, a device) has nothing to lose.
            Err(e) if e.kind() != std::io::ErrorKind::InvalidInput => {
                return Err(RecordingError::io(&self.path, "write", e));
            }
            _ => {}
        }
        Ok(Summary {
            frames: self.entries.len() as u64,
            file_bytes: self.length,
            raw_bytes: self.raw_bytes,
            largest_error: self.largest_error,
        })
    }
}
