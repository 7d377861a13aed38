//! `meniscus demo`: the main job, end to end.

use super::console::Console;
use super::failure::Failure;
use clap::Args;
use std::path::PathBuf;

/// What `meniscus help demo` says first.
pub(super) const ABOUT: &str = "Flood a valley of real terrain, run a wave solver over it with rain and a travelling push, write the \
    recording, render stills and a short animation, and print what it cost. About a minute on two cores; needs no \
    GPU and no network.";

/// Arguments of `meniscus demo`.
#[derive(Clone, Debug, Args)]
#[command(after_help = "Example:\n  meniscus demo --out demo")]
pub struct DemoArgs {
    /// Folder for the recording and the pictures; made where it is missing
    #[arg(long, value_name = "DIR", default_value = "meniscus-demo")]
    pub out: PathBuf,
}

pub(super) fn run(args: &DemoArgs, console: &Console) -> Result<(), Failure> {
    let _ = (args, console);
    Err(Failure::run(
        "the demo is not part of this version; `meniscus record` and `meniscus render` do its work step by step",
    ))
}
