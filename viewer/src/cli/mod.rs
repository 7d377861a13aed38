//! The command line: what it accepts, and how each command ends.
//!
//! Results go to standard output, progress, notes and errors to standard error. Exit codes: 0 done, 1 the run failed,
//! 2 the input is wrong, 130 after Ctrl-C. `docs/command-line.md` describes both for users.

pub(crate) mod args;
mod check;
mod claim;
mod console;
mod cost;
mod demo;
#[cfg(feature = "export")]
mod export;
mod failure;
mod format;
mod frames;
mod info;
pub(crate) mod input;
mod interrupt;
mod listing;
pub(crate) mod live;
mod log;
mod memory;
mod picture;
mod plan;
mod progress;
pub(crate) mod progressive;
mod record;
pub(crate) mod render;
mod resume;
mod study;
mod view;
mod volume;

pub use args::{FrameRange, GlobalArgs, ImageSize, Overrides, SceneArgs};
pub use check::CheckArgs;
pub use console::{Console, Verbosity};
pub use cost::{Cost, Stopwatch};
pub use demo::DemoArgs;
#[cfg(feature = "export")]
pub use export::ExportArgs;
pub use failure::Failure;
pub use info::InfoArgs;
pub use interrupt::Interrupt;
pub use listing::ListArgs;
pub use plan::PlanArgs;
pub use progress::Progress;
pub use record::{RecordArgs, Recorded, record_scene};
pub use render::{Drawn, RenderArgs, Rendered};
pub use study::StudyArgs;
pub use view::ViewArgs;
pub use volume::VolumeAccount;

use clap::{Parser, Subcommand};
use std::ffi::OsString;
use std::io::Write as _;

/// The `meniscus` command.
#[derive(Debug, Parser)]
#[command(
    name = "meniscus",
    version,
    about = "Simulate, record, render, export and compare water surfaces",
    long_about = "Simulate, record, render, export and compare water surfaces.\n\n\
        A scene file says what water there is and which method moves it. `record` runs it into a recording, which \
        `render`, `export` and `info` read; `render` also takes the scene itself and runs it live. `study` measures \
        the error of every method against its run time.",
    after_help = "Exit codes: 0 done, 1 the run failed, 2 the input is wrong, 130 after Ctrl-C.\n\n\
        Examples:\n  \
        meniscus demo\n  \
        meniscus check data/scenes/ripple-tank.toml\n  \
        meniscus record data/scenes/ripple-tank.toml -o run.mrec\n  \
        meniscus render run.mrec --at 1.5 -o wave.png\n  \
        meniscus help record",
    arg_required_else_help = true,
    max_term_width = 110
)]
pub struct Cli {
    /// What to do
    #[command(subcommand)]
    pub command: Command,
    /// Arguments of every command
    #[command(flatten)]
    pub global: GlobalArgs,
}

/// What the command line can do, in the order of `meniscus help`.
#[derive(Debug, Subcommand)]
#[non_exhaustive]
pub enum Command {
    /// Flood a real valley, record it and render pictures: the main job, end to end, in about a minute
    #[command(long_about = demo::ABOUT)]
    Demo(DemoArgs),
    /// Run a scene and record its frames
    #[command(long_about = record::ABOUT)]
    Record(RecordArgs),
    /// Tell what a recording holds: scene, channels, frames, compression, conservation, damage
    #[command(long_about = info::ABOUT)]
    Info(InfoArgs),
    /// Draw frames of a recording, or of a scene that is run live, as PNG, EXR, GIF or MP4
    #[command(long_about = render::ABOUT)]
    Render(RenderArgs),
    /// Open the window: play a recording, run a scene live, compare renderers
    #[command(long_about = view::ABOUT)]
    View(ViewArgs),
    /// Write the frames of a recording for NumPy, ParaView or Blender
    #[cfg(feature = "export")]
    #[command(long_about = export::ABOUT)]
    Export(ExportArgs),
    /// Tell what a scene would run and hold in memory, and what is left out and why
    #[command(long_about = plan::ABOUT)]
    Plan(PlanArgs),
    /// Measure error against run time; tables, CSV, JSON, SVG and one HTML page
    #[command(long_about = study::ABOUT)]
    Study(StudyArgs),
    /// Check a scene and every file it names, without running it
    #[command(long_about = check::ABOUT)]
    Check(CheckArgs),
    /// List the renderers of this build
    #[command(after_help = listing::RENDERERS_EXAMPLE)]
    Renderers(ListArgs),
    /// List the solvers of this build
    #[command(after_help = listing::SOLVERS_EXAMPLE)]
    Solvers(ListArgs),
}

/// Runs the command that `args` (with the program's name first) asks for, and says how it ended.
pub fn run(args: impl IntoIterator<Item = impl Into<OsString> + Clone>) -> u8 {
    let cli = match Cli::try_parse_from(args) {
        Ok(cli) => cli,
        Err(error) => return usage(&error),
    };
    let console = Console::new(match (cli.global.quiet, cli.global.verbose) {
        (true, _) => Verbosity::Quiet,
        (false, 0) => Verbosity::Normal,
        (false, _) => Verbosity::Detailed,
    });
    log::install(cli.global.verbose, console.bar());
    let result = threads(cli.global.threads).and_then(|()| dispatch(&cli.command, &console));
    match result {
        Ok(()) => 0,
        Err(failure) => {
            console.error(&failure);
            failure.exit_code()
        }
    }
}

fn dispatch(command: &Command, console: &Console) -> Result<(), Failure> {
    match command {
        Command::Demo(args) => demo::run(args, console),
        Command::Record(args) => record::run(args, console),
        Command::Info(args) => info::run(args, console),
        Command::Render(args) => render::run(args, console),
        Command::View(args) => view::run(args, console),
        #[cfg(feature = "export")]
        Command::Export(args) => export::run(args, console),
        Command::Plan(args) => plan::run(args, console),
        Command::Study(args) => study::run(args, console),
        Command::Check(args) => check::run(args, console),
        Command::Renderers(args) => listing::renderers(args, console),
        Command::Solvers(args) => listing::solvers(args, console),
    }
}

/// Shows what the parser has to say: help and version on standard output, wrong usage on standard error.
fn usage(error: &clap::Error) -> u8 {
    let text = error.render();
    // Whoever reads may have gone, as in `meniscus help | head -1`.
    let _ = if error.use_stderr() {
        write!(std::io::stderr(), "{text}")
    } else {
        write!(std::io::stdout(), "{text}")
    };
    u8::try_from(error.exit_code()).unwrap_or(2)
}

/// Sets the number of threads that everything computes with.
fn threads(count: Option<u16>) -> Result<(), Failure> {
    let Some(count) = count else { return Ok(()) };
    rayon::ThreadPoolBuilder::new()
        .num_threads(usize::from(count))
        .build_global()
        .map_err(|error| Failure::run(format_args!("cannot start {count} threads: {error}")))
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory as _;

    #[test]
    fn the_command_line_is_well_formed() {
        Cli::command().debug_assert();
    }

    #[test]
    fn every_command_has_an_example() {
        for command in Cli::command().get_subcommands() {
            let name = command.get_name();
            let help = command
                .get_after_help()
                .map(ToString::to_string)
                .unwrap_or_default();
            assert!(
                help.contains(&format!("meniscus {name}")),
                "no example in `meniscus help {name}`"
            );
        }
    }
}
