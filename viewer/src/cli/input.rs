//! Opening what a command is given: a scene file or a recording.

use super::console::Console;
use super::failure::{Classify as _, Failure};
use meniscus_sim::Scene;
use meniscus_sim::recording::Reader;
use std::path::Path;

/// What `render` and `view` can be given.
pub(crate) enum Input {
    /// A scene, to be run live.
    Scene(Box<Scene>),
    /// A recording.
    Recording(Box<Reader>),
}

impl Input {
    /// Opens a scene if the name ends in `.toml`, else a recording. `overrides` can change the keys of a scene only.
    ///
    /// # Errors
    /// [`Failure::Input`] or [`Failure::Scene`]: it cannot be read or used.
    pub(crate) fn open(path: &Path, overrides: &[String], console: &Console) -> Result<Self, Failure> {
        if path
            .extension()
            .is_some_and(|extension| extension.eq_ignore_ascii_case("toml"))
        {
            return Ok(Self::Scene(Box::new(scene(path, overrides)?)));
        }
        if !overrides.is_empty() {
            return Err(Failure::input(format_args!(
                "--set: {} is taken as a recording, whose scene is fixed; record it again with --set, or give the scene \
                 file (a name that ends in .toml)",
                path.display()
            )));
        }
        recording(path, console).map(|reader| Self::Recording(Box::new(reader)))
    }
}

/// A scene with every file that it names.
///
/// # Errors
/// [`Failure::Scene`] with everything that is wrong.
pub(crate) fn scene(path: &Path, overrides: &[String]) -> Result<Scene, Failure> {
    Ok(Scene::load(path, overrides)?)
}

/// A recording; what is known to be damaged in it is told as warnings.
///
/// # Errors
/// [`Failure::Input`] if it cannot be read.
pub(crate) fn recording(path: &Path, console: &Console) -> Result<Reader, Failure> {
    let reader = Reader::open(path).or_input()?;
    warn_of_damage(&reader, console);
    Ok(reader)
}

/// Tells what is known to be damaged in a recording.
pub(crate) fn warn_of_damage(reader: &Reader, console: &Console) {
    for damage in reader.damage() {
        let frame = damage
            .frame
            .map_or_else(String::new, |frame| format!("frame {frame}: "));
        console.warn(format!(
            "{}: {frame}{} (at byte {}); the other frames can be read",
            reader.path().display(),
            damage.reason,
            damage.offset
        ));
    }
}
