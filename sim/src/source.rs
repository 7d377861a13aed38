//! Frames from a live solver or a recording, indistinguishable to whoever consumes them.

mod live;

pub use live::LiveSource;

use crate::frame::{Frame, NonFiniteFrame};
use crate::solver::{StepError, StepReport};

/// What reading a frame did.
#[derive(Clone, Debug, PartialEq)]
pub enum Progress {
    /// A frame was read; totals of the state where the source knows them.
    Frame(Option<StepReport>),
    /// There are no more frames; `out` is unchanged.
    End,
}

/// Why no frame could be read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SourceError {
    /// The solver failed.
    #[error(transparent)]
    Step(#[from] StepError),
    /// An event could not be applied.
    #[error(transparent)]
    Event(#[from] crate::events::EventError),
    /// The recording could not be read.
    #[error(transparent)]
    Recording(#[from] crate::recording::RecordingError),
    /// The solver handed out a value that is not a number.
    #[error(transparent)]
    NonFinite(#[from] NonFiniteFrame),
}

/// A sequence of frames in order of time.
pub trait FrameSource {
    /// Reads the next frame into `out`, reusing its allocations.
    ///
    /// # Errors
    /// [`SourceError`]; a damaged frame of a recording is reported once and skipped by the next call.
    fn read_into(&mut self, out: &mut Frame) -> Result<Progress, SourceError>;
}
