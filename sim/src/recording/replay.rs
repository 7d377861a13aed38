//! A recording as a source of frames.

use super::{Reader, RecordingError};
use crate::frame::Frame;
use crate::source::{FrameSource, Progress, SourceError};

/// Plays a recording from its first to its last frame.
#[derive(Debug)]
pub struct ReplaySource {
    reader: Reader,
    next: usize,
}

impl ReplaySource {
    /// Plays `reader` from frame 0.
    pub fn new(reader: Reader) -> Self {
        Self { reader, next: 0 }
    }

    /// The recording.
    pub fn reader(&self) -> &Reader {
        &self.reader
    }

    /// Number of the frame that is read next.
    pub fn position(&self) -> usize {
        self.next
    }

    /// Goes on with frame `k`; beyond the last one there are no more frames.
    pub fn seek(&mut self, k: usize) {
        self.next = k;
    }

    /// The recording again.
    pub fn into_reader(self) -> Reader {
        self.reader
    }
}

impl FrameSource for ReplaySource {
    /// Reads the next frame. A damaged one is reported once; the call after that reads the one behind it.
    fn read_into(&mut self, out: &mut Frame) -> Result<Progress, SourceError> {
        if self.next >= self.reader.len() {
            return Ok(Progress::End);
        }
        let k = self.next;
        // Also after an error: a caller that goes on must not meet the same frame for ever.
        self.next += 1;
        let report = self
            .reader
            .read(k, out)
            .map_err(|e: RecordingError| SourceError::from(e))?;
        Ok(Progress::Frame(report))
    }
}
