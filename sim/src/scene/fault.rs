//! What the errors of all files that a scene names have in common, and how such files are read.

use std::io;
use std::path::{Path, PathBuf};

/// An error that says apart what is wrong and what would be right, so that it can become a
/// [`Problem`](super::Problem). Its `Display` is both, with file and line where they are known.
pub(crate) trait Fault {
    /// What is wrong, without the file.
    fn what(&self) -> String;
    /// What would be right.
    fn remedy(&self) -> String;
    /// The file, if the error knows it.
    fn file(&self) -> Option<&Path> {
        None
    }
    /// Line in the file, from 1.
    fn line(&self) -> Option<u32> {
        None
    }
    /// Present if the file could not be read at all: then the fault is in what names it.
    fn read_error(&self) -> Option<&ReadError>;
}

/// Implements `Display` and `Error` for a [`Fault`].
macro_rules! display_fault {
    ($type:ty) => {
        impl std::fmt::Display for $type {
            fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                use $crate::scene::Fault as _;
                if let Some(file) = self.file() {
                    write!(f, "{}:", file.display())?;
                    if let Some(line) = self.line() {
                        write!(f, "{line}:")?;
                    }
                    f.write_str(" ")?;
                }
                write!(f, "{}; {}", self.what(), self.remedy())
            }
        }

        impl std::error::Error for $type {
            fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
                use $crate::scene::Fault as _;
                self.read_error()
                    .and_then(|e| e.source.as_ref())
                    .map(|e| e as &_)
            }
        }
    };
}
pub(crate) use display_fault;

/// Why a file could not be read.
#[derive(Debug)]
pub struct ReadError {
    /// The file.
    pub path: PathBuf,
    /// What is wrong with it.
    pub reason: String,
    /// What the system said, if it was the system that refused.
    pub source: Option<io::Error>,
}

impl Fault for ReadError {
    fn what(&self) -> String {
        format!("cannot read {}: {}", self.path.display(), self.reason)
    }

    fn remedy(&self) -> String {
        match self.source.as_ref().map(io::Error::kind) {
            Some(io::ErrorKind::NotFound) => "check the name; it is relative to the scene file".into(),
            Some(io::ErrorKind::PermissionDenied) => "allow reading it".into(),
            Some(_) => "check the file and its disk".into(),
            None => "name a file of the right kind".into(),
        }
    }

    fn read_error(&self) -> Option<&ReadError> {
        Some(self)
    }
}

display_fault!(ReadError);

/// Reads a whole file of at most `limit` bytes. Only plain files: a directory or a pipe is refused.
pub(crate) fn read_file(path: &Path, limit: u64) -> Result<Vec<u8>, ReadError> {
    let refuse = |reason: String, source: Option<io::Error>| ReadError {
        path: path.to_path_buf(),
        reason,
        source,
    };
    let system = |e: io::Error| {
        let reason = match e.kind() {
            io::ErrorKind::NotFound => "there is no such file".to_string(),
            _ => e.to_string(),
        };
        refuse(reason, Some(e))
    };
    let metadata = std::fs::metadata(path).map_err(system)?;
    if metadata.is_dir() {
        return Err(refuse("it is a directory".into(), None));
    }
    if !metadata.is_file() {
        return Err(refuse("it is not a plain file".into(), None));
    }
    if metadata.len() > limit {
        let reason = format!(
            "it has {} bytes, more than the {limit} that such a file may have",
            metadata.len()
        );
        return Err(refuse(reason, None));
    }
    std::fs::read(path).map_err(system)
}

/// Reads a text file; a byte that is not UTF-8 is told with its line.
pub(crate) fn read_text(path: &Path, limit: u64) -> Result<String, ReadError> {
    String::from_utf8(read_file(path, limit)?).map_err(|e| {
        let at = e.utf8_error().valid_up_to();
        let line = 1 + e.as_bytes()[..at].iter().filter(|&&b| b == b'\n').count();
        ReadError {
            path: path.to_path_buf(),
            reason: format!("it is not a text file: byte {at} (line {line}) is not UTF-8"),
            source: None,
        }
    })
}
