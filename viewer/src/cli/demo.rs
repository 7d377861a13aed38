//! `meniscus demo`: the main job, end to end.

use super::console::Console;
use super::failure::Failure;
use clap::Args;
use std::path::PathBuf;

/// Arguments of `meniscus demo`.
#[derive(Clone, Debug, Args)]
#[command(
    long_about = "Flood a valley of real terrain, run a wave solver over it with rain and a travelling push, write the \
        recording, render stills and a short animation, and print what it cost. About a minute on two cores; needs no \
        GPU and no network.",
    after_help = "Example:\n  meniscus demo --out demo"
)]
pub struct DemoArgs {
    /// Folder for the recording and the pictures; made where it is missing
    #[arg(long, value_name = "DIR", default_value = "meniscus-demo")]
    pub out: PathBuf,
}
