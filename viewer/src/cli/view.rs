//! `meniscus view`: the window, which this version does not have yet.

use super::args::Overrides;
use super::console::Console;
use super::failure::Failure;
use super::input::Input;
use clap::Args;
use std::path::PathBuf;

/// What `meniscus help view` says first.
pub(super) const ABOUT: &str = "Open the window on a recording or a live scene.\n\nThe window comes in a later version. Until then \
    this checks its input and ends with exit code 1; `meniscus render` draws stills and animations, and \
    `meniscus export` hands frames to ParaView and Blender.";

/// Arguments of `meniscus view`.
#[derive(Clone, Debug, Args)]
#[command(after_help = "Example:\n  meniscus view pond.mrec")]
pub struct ViewArgs {
    /// Recording to play, or scene to run live
    #[arg(value_name = "RUN.mrec|SCENE.toml")]
    pub input: PathBuf,
    /// Changes to the keys of the scene
    #[command(flatten)]
    pub overrides: Overrides,
}

pub(super) fn run(args: &ViewArgs, console: &Console) -> Result<(), Failure> {
    // A wrong input is told as such, so that a script sees the exit code that it will see when the window is there.
    Input::open(&args.input, &args.overrides.set, console)?;
    let input = args.input.display();
    Err(Failure::run(format_args!(
        "the window is not part of this version; `meniscus render {input} -o OUT.png` draws a still, \
         `-o OUT.gif` an animation, and `meniscus export` writes recorded frames for ParaView and Blender"
    )))
}
