//! Looks at output files before the work, so that a name that cannot be written is found at once.

use super::failure::Failure;
use std::fs;
use std::path::Path;

/// Refuses a file that cannot be written, or a new one in a folder that is missing or cannot be written. Nothing is
/// changed or left behind.
///
/// # Errors
/// [`Failure::Run`] that names the file and what is in the way; [`Failure::Input`] if the file is a directory.
pub(crate) fn writable(output: &Path) -> Result<(), Failure> {
    not_a_directory(output)?;
    let folder = match output.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    let probed = if output.exists() {
        fs::OpenOptions::new().write(true).open(output).map(drop)
    } else {
        tempfile::tempfile_in(folder).map(drop)
    };
    probed.map_err(|error| {
        Failure::run(format_args!(
            "{}: cannot be written: {}; create the folder, or choose another place with -o",
            output.display(),
            // A probe names itself in its errors.
            error
                .raw_os_error()
                .map_or(error, std::io::Error::from_raw_os_error)
        ))
    })
}

/// Refuses a directory as the name of an output file.
///
/// # Errors
/// [`Failure::Input`] that names it.
fn not_a_directory(output: &Path) -> Result<(), Failure> {
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
