//! `meniscus view`: the window.

use super::args::Overrides;
use super::console::Console;
use super::failure::Failure;
use super::input::Input;
#[cfg(feature = "view")]
use super::interrupt::Interrupt;
use clap::Args;
use std::path::{Path, PathBuf};

/// What `meniscus help view` says first.
pub(super) const ABOUT: &str = "Open the window: play a recording, run a scene live and touch its water, compare renderers.\n\n\
    It needs a build with the Cargo feature `view` and a display. F1 shows the keys; docs/viewer.md shows the window. \
    Pictures, recordings and tables that are saved from it are written to the current folder. With --verbose it tells \
    when it closes how long its thread was busy.";

/// Arguments of `meniscus view`.
#[derive(Clone, Debug, Args)]
#[command(
    after_help = "Examples:\n  meniscus view\n  meniscus view pond.mrec\n  meniscus view data/scenes/pool.toml --set solver.spacing=0.04"
)]
pub struct ViewArgs {
    /// Recording to play, or scene to run live; left out, the window lists what can be opened
    #[arg(value_name = "RUN.mrec|SCENE.toml")]
    pub input: Option<PathBuf>,
    /// Changes to the keys of the scene
    #[command(flatten)]
    pub overrides: Overrides,
}

/// What is given, read: wrong input ends as with every other command.
fn given<'a>(args: &'a ViewArgs, console: &Console) -> Result<Option<(&'a Path, Input)>, Failure> {
    let set = &args.overrides.set;
    match &args.input {
        Some(path) => Ok(Some((path, Input::open(path, set, console)?))),
        None if set.is_empty() => Ok(None),
        None => Err(Failure::input(
            "--set: there is no scene whose keys it could change; name the scene file",
        )),
    }
}

#[cfg(feature = "view")]
pub(super) fn run(args: &ViewArgs, console: &Console) -> Result<(), Failure> {
    let given = given(args, console)?.map(|(path, input)| (path, args.overrides.set.as_slice(), input));
    let closed = crate::app::window::run(given, Interrupt::install()?).map_err(Failure::run)?;
    console.detail(format!("panels: {}", closed.panels.text()));
    console.detail(format!("window: {}", closed.busy.text()));
    let [whole, panels] = closed.processor;
    console.detail(format!("processor: {}", whole.text()));
    console.detail(format!("processor, panels: {}", panels.text()));
    Ok(())
}

#[cfg(not(feature = "view"))]
pub(super) fn run(args: &ViewArgs, console: &Console) -> Result<(), Failure> {
    // A wrong input is told as such, so that a script sees the exit code that it sees where the window is.
    let given = given(args, console)?;
    let input = given.map_or_else(|| "RUN.mrec".to_owned(), |(path, _)| path.display().to_string());
    Err(Failure::run(format_args!(
        "the window is not in this build: it needs the Cargo feature `view` (cargo build --release --features view); \
         `meniscus render {input} -o OUT.png` draws a still, `-o OUT.gif` an animation, and `meniscus export` writes \
         recorded frames for ParaView and Blender"
    )))
}
