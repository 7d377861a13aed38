//! `meniscus view`: the window.

use super::args::Overrides;
use super::console::Console;
use super::failure::Failure;
use super::input::Input;
#[cfg(feature = "view")]
use super::interrupt::Interrupt;
use clap::Args;
use std::path::PathBuf;

/// What `meniscus help view` says first.
pub(super) const ABOUT: &str = "Open the window: play a recording, run a scene live and touch its water, compare renderers.\n\n\
    It needs a build with the Cargo feature `view` and a display. F1 shows the keys; docs/viewer.md shows the window. \
    Pictures, recordings and tables that are saved from it are written to the current folder. With --verbose it tells \
    when it closes how long its thread was busy.";

/// Arguments of `meniscus view`.
#[derive(Clone, Debug, Args)]
#[command(
    after_help = "Examples:\n  meniscus view pond.mrec\n  meniscus view data/scenes/pool.toml --set solver.spacing=0.04"
)]
pub struct ViewArgs {
    /// Recording to play, or scene to run live
    #[arg(value_name = "RUN.mrec|SCENE.toml")]
    pub input: PathBuf,
    /// Changes to the keys of the scene
    #[command(flatten)]
    pub overrides: Overrides,
}

#[cfg(feature = "view")]
pub(super) fn run(args: &ViewArgs, console: &Console) -> Result<(), Failure> {
    // Wrong input ends as with every other command; what is opened in the window later is told there.
    let input = Input::open(&args.input, &args.overrides.set, console)?;
    let closed = crate::app::window::run(&args.input, &args.overrides.set, input, Interrupt::install()?)
        .map_err(Failure::run)?;
    console.detail(format!("panels: {}", closed.panels.text()));
    console.detail(format!("window: {}", closed.busy.text()));
    Ok(())
}

#[cfg(not(feature = "view"))]
pub(super) fn run(args: &ViewArgs, console: &Console) -> Result<(), Failure> {
    // A wrong input is told as such, so that a script sees the exit code that it sees where the window is.
    Input::open(&args.input, &args.overrides.set, console)?;
    let input = args.input.display();
    Err(Failure::run(format_args!(
        "the window is not in this build: it needs the Cargo feature `view` (cargo build --release --features view); \
         `meniscus render {input} -o OUT.png` draws a still, `-o OUT.gif` an animation, and `meniscus export` writes \
         recorded frames for ParaView and Blender"
    )))
}
