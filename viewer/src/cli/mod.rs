//! The command line: what it accepts, and how each command ends.
//!
//! Results go to standard output, progress, notes and errors to standard error. Exit codes: 0 done, 1 the run failed,
//! 2 the input is wrong, 130 after Ctrl-C. `docs/command-line.md` describes both for users.

mod args;
mod console;
mod cost;
mod failure;
mod format;
mod interrupt;
mod log;
mod memory;
mod progress;

pub use args::{FrameRange, GlobalArgs, ImageSize, Overrides, SceneArgs};
pub use console::{Console, Verbosity};
pub use cost::{Cost, Stopwatch, cpu_seconds};
pub use failure::Failure;
pub use interrupt::Interrupt;
pub use progress::Progress;

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
        meniscus check data/scenes/pond.toml\n  \
        meniscus record data/scenes/pond.toml -o pond.mrec\n  \
        meniscus render pond.mrec --at 2.5 -o pond.png\n  \
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
            let help = command.get_after_help().map(ToString::to_string).unwrap_or_default();
            assert!(help.contains(&format!("meniscus {name}")), "no example in `meniscus help {name}`");
        }
    }
}
