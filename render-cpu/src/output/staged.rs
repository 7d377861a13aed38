//! A file that appears under its name only when it is whole.

use super::OutputError;
use std::ffi::OsString;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

/// A file under a temporary name beside its final one; removed unless [`Staged::commit`] is called.
#[derive(Debug)]
pub(super) struct Staged {
    path: PathBuf,
    part: PathBuf,
    done: bool,
}

impl Staged {
    /// Reserves the temporary name: `NAME.PID.part`, extension kept at the end for programs that go by it.
    pub(super) fn new(path: &Path) -> Result<Self, OutputError> {
        let Some(name) = path.file_name() else {
            let source = std::io::Error::new(std::io::ErrorKind::InvalidInput, "the path names no file");
            return Err(OutputError::io(path, "creating", source));
        };
        let mut part = OsString::from(".");
        part.push(path.file_stem().unwrap_or(name));
        part.push(format!(".{}.part", std::process::id()));
        if let Some(extension) = path.extension() {
            part.push(".");
            part.push(extension);
        }
        Ok(Self {
            path: path.to_owned(),
            part: path.with_file_name(part),
            done: false,
        })
    }

    pub(super) fn part(&self) -> &Path {
        &self.part
    }

    pub(super) fn create(&self) -> Result<BufWriter<File>, OutputError> {
        File::create(&self.part)
            .map(BufWriter::new)
            .map_err(|e| OutputError::io(&self.path, "creating", e))
    }

    /// Flushes what was written and gives the file its name.
    pub(super) fn commit(mut self, mut writer: impl Write) -> Result<(), OutputError> {
        writer
            .flush()
            .map_err(|e| OutputError::io(&self.path, "writing", e))?;
        drop(writer);
        self.rename()
    }

    /// Gives the file its name.
    pub(super) fn rename(&mut self) -> Result<(), OutputError> {
        std::fs::rename(&self.part, &self.path).map_err(|e| OutputError::io(&self.path, "renaming", e))?;
        self.done = true;
        Ok(())
    }
}

impl Drop for Staged {
    fn drop(&mut self) {
        if !self.done {
            // Nothing can be done about a failure here, and the file is only litter.
            let _ = std::fs::remove_file(&self.part);
        }
    }
}
