//! An output file that is claimed before the work, so that a path that cannot be written is found at once.

use super::failure::Failure;
use std::fs::{self, OpenOptions};
use std::path::{Path, PathBuf};

/// A path that can be written. What the claim itself created is removed again unless it is kept.
#[derive(Debug)]
pub(crate) struct Claim {
    path: PathBuf,
    created: bool,
}

impl Claim {
    /// Makes sure that `path` can be written, without changing a file that is there.
    ///
    /// # Errors
    /// [`Failure::Run`] that names the path and what is in the way; [`Failure::Input`] if it is a folder.
    pub(crate) fn new(path: &Path) -> Result<Self, Failure> {
        not_a_directory(path)?;
        let existed = path.exists();
        OpenOptions::new()
            .write(true)
            .create(true)
            .truncate(false)
            .open(path)
            .map_err(|error| {
                Failure::run(format_args!(
                    "{}: cannot be written: {error}; choose another place with -o",
                    path.display()
                ))
            })?;
        Ok(Self {
            path: path.to_owned(),
            created: !existed,
        })
    }

    /// The file is written and stays.
    pub(crate) fn keep(mut self) {
        self.created = false;
    }
}

impl Drop for Claim {
    fn drop(&mut self) {
        if self.created {
            // The file is empty or unfinished; that it cannot be removed changes nothing for the error under way.
            let _ = fs::remove_file(&self.path);
        }
    }
}

/// Refuses a directory as the name of an output file.
///
/// # Errors
/// [`Failure::Input`] that names it.
pub(crate) fn not_a_directory(output: &Path) -> Result<(), Failure> {
    if output.is_dir() {
        return Err(Failure::input(format_args!(
            "{}: is a directory; name a file to write with -o",
            output.display()
        )));
    }
    Ok(())
}

/// Refuses to write over a file that is also read.
///
/// # Errors
/// [`Failure::Input`] that names it.
pub(crate) fn differs(output: &Path, input: &Path) -> Result<(), Failure> {
    match (fs::canonicalize(output), fs::canonicalize(input)) {
        (Ok(a), Ok(b)) if a == b => Err(Failure::input(format_args!(
            "{}: is the input and would be overwritten; choose another name with -o",
            output.display()
        ))),
        _ => Ok(()),
    }
}
