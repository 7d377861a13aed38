//! Writing a recording: encoding and writing happen off the caller's thread.
//!
//! `push` copies the frame and hands the copy to a pool of encoding threads; a writing thread takes the encoded frames
//! in order and gives each to the system in one call, so that a process that is killed loses the frames in flight and
//! leaves at most one of them half written. The pool is the writer's own: a simulation that waits for room in the
//! queue may itself occupy every thread of rayon's global pool.

use super::chunk::{self, CHUNK_HEADER, ChunkHeader, Kind};
use super::frame_payload::{self, Encoded};
use super::{FORMAT_VERSION, MAX_BODIES, MAX_DROPLETS, RecordingError, header, index};
use crate::frame::{Channels, Frame};
use crate::grid::{Grid, GridSpec};
use crate::scene::Scene;
use crate::solver::StepReport;
use std::fs::File;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;

/// Bytes of frames that may wait in the queue, unless a single one takes more.
const QUEUE_BYTES: usize = 256 << 20;

/// A recording in the making.
///
/// Dropping it without [`Self::finish`] writes the frames that were pushed but no index; the file can be read.
#[derive(Debug)]
pub struct Writer {
    path: PathBuf,
    spec: GridSpec,
    channels: Channels,
    tolerance: f32,
    recording: u32,
    pushed: u64,
    last_time: f64,
    pool: rayon::ThreadPool,
    ordered: Option<SyncSender<Receiver<Packed>>>,
    thread: Option<JoinHandle<Output>>,
    shared: Arc<Shared>,
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

/// An encoded chunk.
struct Packed {
    bytes: Vec<u8>,
    time: f64,
    encoded: Result<Encoded, String>,
}

/// What pusher, encoders and writing thread share.
#[derive(Debug, Default)]
struct Shared {
    state: Mutex<State>,
    changed: Condvar,
}

#[derive(Debug, Default)]
struct State {
    written: u64,
    failed: bool,
    error: Option<RecordingError>,
    /// Frames and buffers to use again.
    frames: Vec<Frame>,
    buffers: Vec<Vec<u8>>,
}

impl Shared {
    fn state(&self) -> MutexGuard<'_, State> {
        // No code panics while it holds the lock in a way that leaves the state half changed.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn fail(&self, error: RecordingError) {
        let mut state = self.state();
        if !state.failed {
            state.failed = true;
            state.error = Some(error);
        }
        self.changed.notify_all();
    }
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
        let threads = rayon::current_num_threads();
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .thread_name(|n| format!("meniscus-encode-{n}"))
            // Without a handler rayon would end the process; the writing thread notices the frame that never comes.
            .panic_handler(|_| {})
            .build()
            .map_err(|e| io(std::io::Error::other(e)))?;
        let frame_bytes = 4 * scene.grid.len() * frame_payload::planes(scene.grid, channels, 0, 0).len();
        let queue = (QUEUE_BYTES / frame_bytes.max(1)).clamp(1, threads + 2);
        let (ordered, incoming) = sync_channel::<Receiver<Packed>>(queue);
        let shared = Arc::new(Shared::default());
        let recording = output.recording;
        let theirs = Arc::clone(&shared);
        let thread = std::thread::Builder::new()
            .name("meniscus-record".to_owned())
            .spawn(move || {
                output.run(&incoming, &theirs);
                output
            })
            .map_err(io)?;
        Ok(Self {
            spec: scene.grid,
            channels,
            tolerance: scene.description.recording.tolerance,
            recording,
            pushed: 0,
            last_time: f64::NEG_INFINITY,
            pool,
            ordered: Some(ordered),
            thread: Some(thread),
            shared,
            path,
        })
    }

    /// Records a copy of `frame`, and the totals of its state where they are known. Returns when there is room for it
    /// in the queue. Channels that are not recorded are left out.
    ///
    /// # Errors
    /// [`RecordingError`] if the frame is refused (it holds NaN or infinity, lacks a channel, stands on another grid or
    /// goes back in time; the recording goes on), or if writing an earlier frame failed.
    pub fn push(&mut self, frame: &Frame, report: Option<StepReport>) -> Result<(), RecordingError> {
        self.check_running()?;
        self.check(frame)?;
        let (mut copy, mut bytes) = {
            let mut state = self.shared.state();
            (state.frames.pop(), state.buffers.pop().unwrap_or_default())
        };
        let copied = copy.get_or_insert_with(|| Frame::new(self.spec));
        copy_frame(frame, self.channels, copied);
        let (channels, tolerance, recording) = (self.channels, self.tolerance, self.recording);
        let sequence = self.pushed + 1;
        let shared = Arc::clone(&self.shared);
        let (result, promise) = sync_channel(1);
        self.pool.spawn_fifo(move || {
            let Some(frame) = copy else { return };
            bytes.clear();
            bytes.resize(CHUNK_HEADER, 0);
            let encoded = frame_payload::encode(&frame, channels, report, tolerance, &mut bytes);
            ChunkHeader::seal(&mut bytes, Kind::Frame, Some(recording), sequence, frame.time);
            let time = frame.time;
            shared.state().frames.push(frame);
            // The writing thread may have gone after an error; then nobody wants the frame.
            let _ = result.send(Packed { bytes, time, encoded });
        });
        let queued = self
            .ordered
            .as_ref()
            .is_some_and(|ordered| ordered.send(promise).is_ok());
        if !queued {
            return Err(self.failure());
        }
        self.pushed += 1;
        self.last_time = frame.time;
        Ok(())
    }

    /// Frames that were given to the system: they survive the end of this process, however it ends.
    pub fn written(&self) -> u64 {
        self.shared.state().written
    }

    /// Waits until every frame that was pushed has been given to the system.
    ///
    /// # Errors
    /// [`RecordingError`] if writing failed.
    pub fn flush(&mut self) -> Result<(), RecordingError> {
        let mut state = self.shared.state();
        while state.written < self.pushed && !state.failed {
            state = self
                .shared
                .changed
                .wait(state)
                .unwrap_or_else(PoisonError::into_inner);
        }
        drop(state);
        self.check_running()
    }

    /// Writes the frames that are still in the queue and the index, and waits for the disk.
    ///
    /// # Errors
    /// [`RecordingError`] if writing failed; the frames written before that can be read.
    pub fn finish(mut self) -> Result<Summary, RecordingError> {
        let output = self.join();
        self.check_running()?;
        let Some(output) = output else {
            return Err(self.failure());
        };
        output.finish()
    }

    /// Lets the writing thread end when it has written what is in the queue.
    fn join(&mut self) -> Option<Output> {
        drop(self.ordered.take());
        self.thread.take().and_then(|thread| thread.join().ok())
    }

    fn check_running(&self) -> Result<(), RecordingError> {
        if self.shared.state().failed {
            Err(self.failure())
        } else {
            Ok(())
        }
    }

    fn failure(&self) -> RecordingError {
        let error = self.shared.state().error.take();
        error.unwrap_or_else(|| RecordingError::Stopped {
            path: self.path.clone(),
        })
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
    if let Some(d) = &frame.droplets {
        let n = d.radius.len();
        if d.position.len() != n || d.velocity.len() != n {
            return Err("droplets have unequal numbers of positions, velocities and radii".to_owned());
        }
        if n > MAX_DROPLETS {
            return Err(format!("{n} droplets; at most {MAX_DROPLETS} can be recorded"));
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
    if let (Some(from), Some(to)) = (&frame.droplets, &mut out.droplets) {
        to.position.extend_from_slice(&from.position);
        to.velocity.extend_from_slice(&from.velocity);
        to.radius.extend_from_slice(&from.radius);
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

    /// Writes frames in the order in which they were pushed, until there are no more or one fails.
    fn run(&mut self, incoming: &Receiver<Receiver<Packed>>, shared: &Shared) {
        for promise in incoming {
            let packed = promise.recv().map_err(|_| "encoding was interrupted".to_owned());
            let result = packed.and_then(|p| p.encoded.map(|e| (p.bytes, p.time, e)));
            let outcome = match result {
                Ok((bytes, time, encoded)) => self.frame(&bytes, time, encoded).map(|()| bytes),
                Err(reason) => Err(RecordingError::io(
                    &self.path,
                    "write",
                    std::io::Error::other(reason),
                )),
            };
            match outcome {
                Ok(bytes) => {
                    let mut state = shared.state();
                    state.written += 1;
                    state.buffers.push(bytes);
                    shared.changed.notify_all();
                }
                Err(error) => return shared.fail(error),
            }
        }
    }

    fn frame(&mut self, bytes: &[u8], time: f64, encoded: Encoded) -> Result<(), RecordingError> {
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
