//! Where a command writes: results to standard output, everything else to standard error.

use super::failure::Failure;
use super::progress::Progress;
use indicatif::ProgressBar;
use serde::Serialize;
use std::io::{self, IsTerminal as _, Write as _};
use std::sync::{Arc, Mutex, PoisonError};

/// How much standard error shows beside warnings and errors.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Verbosity {
    /// Nothing.
    Quiet,
    /// Progress and notes.
    Normal,
    /// Also what was chosen and how long stages took.
    Detailed,
}

/// The two output streams of a command.
#[derive(Debug)]
pub struct Console {
    verbosity: Verbosity,
    terminal: bool,
    /// The bar that is on the screen, so that a line written meanwhile does not tear it.
    bar: Arc<Mutex<Option<ProgressBar>>>,
}

impl Console {
    /// The console of this process.
    pub fn new(verbosity: Verbosity) -> Self {
        Self {
            verbosity,
            terminal: io::stderr().is_terminal(),
            bar: Arc::default(),
        }
    }

    /// The bar that is on the screen, for others who write to standard error.
    pub(super) fn bar(&self) -> Arc<Mutex<Option<ProgressBar>>> {
        Arc::clone(&self.bar)
    }

    /// Writes a result to standard output.
    ///
    /// # Errors
    /// [`Failure::ClosedPipe`] if nobody reads any more, [`Failure::Run`] if it cannot be written.
    pub fn result(&self, text: impl AsRef<str>) -> Result<(), Failure> {
        let text = text.as_ref();
        let mut out = io::stdout().lock();
        let mut write = || {
            out.write_all(text.as_bytes())?;
            if !text.ends_with('\n') {
                out.write_all(b"\n")?;
            }
            out.flush()
        };
        write().map_err(|error| match error.kind() {
            io::ErrorKind::BrokenPipe => Failure::ClosedPipe,
            _ => Failure::run(format_args!(
                "cannot write the result to standard output: {error}"
            )),
        })
    }

    /// Writes one JSON object to standard output.
    ///
    /// # Errors
    /// As [`Self::result`].
    pub fn json(&self, value: &impl Serialize) -> Result<(), Failure> {
        let text = serde_json::to_string_pretty(value)
            .map_err(|error| Failure::run(format_args!("cannot write the result as JSON: {error}")))?;
        self.result(text)
    }

    /// Tells what goes on; silent with `--quiet`.
    pub fn note(&self, text: impl AsRef<str>) {
        if self.verbosity >= Verbosity::Normal {
            self.line(text.as_ref());
        }
    }

    /// Tells a detail; only with `--verbose`.
    pub fn detail(&self, text: impl AsRef<str>) {
        if self.verbosity >= Verbosity::Detailed {
            self.line(text.as_ref());
        }
    }

    /// Warns, also with `--quiet`.
    pub fn warn(&self, text: impl AsRef<str>) {
        self.line(&format!("warning: {}", text.as_ref()));
    }

    /// Reports how a command failed.
    pub fn error(&self, failure: &Failure) {
        let kind = match failure {
            Failure::Interrupted(_) => "",
            _ => "error: ",
        };
        for line in failure.lines() {
            self.line(&format!("{kind}{line}"));
        }
    }

    /// Begins to show progress over `total` units of work called `unit` (`frame`).
    pub fn progress(&self, task: &str, total: u64, unit: &'static str) -> Progress {
        match self.verbosity {
            Verbosity::Quiet => Progress::hidden(),
            _ if self.terminal => Progress::bar(task, total, unit, Arc::clone(&self.bar)),
            _ => Progress::lines(task, total, unit),
        }
    }

    /// A line to standard error. Nothing can be done where that is closed, and it is no reason to stop.
    fn line(&self, text: &str) {
        let write = || {
            let _ = writeln!(io::stderr(), "{text}");
        };
        match &*self.bar.lock().unwrap_or_else(PoisonError::into_inner) {
            Some(bar) => bar.suspend(write),
            None => write(),
        }
    }
}
