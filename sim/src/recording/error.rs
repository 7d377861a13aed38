//! What can go wrong with a recording.

use crate::frame::{Channels, NonFiniteFrame};
use crate::grid::GridSpec;
use std::path::PathBuf;

/// Why a recording cannot be written or read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RecordingError {
    /// The system refused to open, read or write the file.
    #[error("{path}: cannot {action} the recording: {source}; {remedy}")]
    Io {
        /// The file.
        path: PathBuf,
        /// What was attempted: `open`, `create`, `read`, `write`.
        action: &'static str,
        /// What the system said.
        source: std::io::Error,
        /// What to do.
        remedy: &'static str,
    },
    /// The path names a directory, a device or something else that is not a regular file.
    #[error("{path}: {found} instead of a recording; name a .mrec file")]
    NotAFile {
        /// The path.
        path: PathBuf,
        /// What it is.
        found: &'static str,
    },
    /// The file has no bytes.
    #[error("{path}: the file is empty; record again, or name another file")]
    Empty {
        /// The file.
        path: PathBuf,
    },
    /// The file does not begin as a recording does.
    #[error("{path}: not a recording ({found}); name a .mrec file")]
    NotARecording {
        /// The file.
        path: PathBuf,
        /// What its first bytes look like.
        found: &'static str,
    },
    /// The file was written by a newer program.
    #[error(
        "{path}: recording of format version {version}, this program reads versions up to {supported}; \
         use a newer meniscus"
    )]
    Newer {
        /// The file.
        path: PathBuf,
        /// Version of the file.
        version: u32,
        /// Newest version that can be read.
        supported: u32,
    },
    /// The file ends before its header does, so that no frame can be in it.
    #[error("{path}: the file ends inside its header, at byte {length}; no frame was recorded, record again")]
    TruncatedHeader {
        /// The file.
        path: PathBuf,
        /// Bytes in the file.
        length: u64,
    },
    /// The header is damaged; nothing can be read without the scene that it holds.
    #[error(
        "{path}: damaged header at byte {offset}: {reason}; restore the file from a copy or record again"
    )]
    DamagedHeader {
        /// The file.
        path: PathBuf,
        /// Where the damaged part begins.
        offset: u64,
        /// What does not fit.
        reason: String,
    },
    /// One frame is damaged or lost; the others can be read.
    #[error("{path}: frame {frame} is damaged at byte {offset}: {reason}; the other frames can be read")]
    DamagedFrame {
        /// The file.
        path: PathBuf,
        /// Number of the frame, from 0.
        frame: usize,
        /// Where it begins, or where it should have been.
        offset: u64,
        /// What does not fit.
        reason: String,
    },
    /// There is no frame of that number.
    #[error("{path}: there is no frame {frame}; the recording has {len} frames, numbered from 0")]
    NoSuchFrame {
        /// The file.
        path: PathBuf,
        /// The number asked for.
        frame: usize,
        /// How many frames there are.
        len: usize,
    },
    /// Decoding would take more memory than allowed.
    #[error("{path}: {what} needs {needed} bytes, more than the limit of {limit}; {remedy}")]
    TooLarge {
        /// The file.
        path: PathBuf,
        /// What is too large.
        what: &'static str,
        /// Bytes needed.
        needed: u64,
        /// Bytes allowed.
        limit: u64,
        /// What to do.
        remedy: &'static str,
    },
    /// The scene cannot be stored.
    #[error("{path}: the scene cannot be recorded: {reason}")]
    Scene {
        /// The file.
        path: PathBuf,
        /// What does not fit, and what would be right.
        reason: String,
    },
    /// A frame holds NaN or infinity.
    #[error(transparent)]
    NonFinite(#[from] NonFiniteFrame),
    /// A frame has an impossible time.
    #[error(
        "frame {frame} has time {time} s after a frame of {previous} s; times must be finite and not decrease"
    )]
    Time {
        /// Number of the frame, from 0.
        frame: u64,
        /// Its time in seconds.
        time: f64,
        /// Time of the frame before it in seconds.
        previous: f64,
    },
    /// A frame stands on another grid than the scene.
    #[error(
        "frame {frame} stands on the grid {found:?}, the recording on {expected:?}; record the solver's own grid"
    )]
    Grid {
        /// Number of the frame, from 0.
        frame: u64,
        /// Grid of the recording.
        expected: Box<GridSpec>,
        /// Grid of the frame.
        found: Box<GridSpec>,
    },
    /// A frame lacks channels that are to be recorded.
    #[error("frame {frame} lacks the channels {missing}; extract them, or leave them out of the recording")]
    MissingChannels {
        /// Number of the frame, from 0.
        frame: u64,
        /// What is missing.
        missing: Channels,
    },
    /// A frame has lists that are longer than allowed or of unequal length.
    #[error("frame {frame}: {reason}")]
    Lists {
        /// Number of the frame, from 0.
        frame: u64,
        /// What does not fit, and what would be right.
        reason: String,
    },
    /// Writing failed earlier; the error was reported then.
    #[error("{path}: recording stopped after an earlier error; the frames written before it can be read")]
    Stopped {
        /// The file.
        path: PathBuf,
    },
}

impl RecordingError {
    /// An error of the system, with the remedy that fits it.
    pub(crate) fn io(path: &std::path::Path, action: &'static str, source: std::io::Error) -> Self {
        use std::io::ErrorKind as Kind;
        let remedy = match source.kind() {
            Kind::NotFound if action == "create" => "create the folder first",
            Kind::NotFound => "check the name",
            Kind::PermissionDenied | Kind::ReadOnlyFilesystem => {
                "choose a place that you may use, or change its rights"
            }
            Kind::StorageFull | Kind::QuotaExceeded | Kind::FileTooLarge => {
                "free space or record elsewhere; the frames written so far can be read"
            }
            Kind::IsADirectory => "name a file in it",
            _ if action == "write" => "check the disk; the frames written so far can be read",
            _ => "check the disk and the path",
        };
        Self::Io {
            path: path.to_owned(),
            action,
            source,
            remedy,
        }
    }
}
