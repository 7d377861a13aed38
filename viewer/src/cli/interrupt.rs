//! Ctrl-C: the first asks for an orderly end, the second ends at once.

use super::failure::Failure;
use std::io::Write as _;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, Ordering};

/// Exit code after Ctrl-C, as shells have it: 128 + SIGINT.
const EXIT_CODE: i32 = 130;

/// Whether Ctrl-C was pressed in this process.
static PRESSED: AtomicBool = AtomicBool::new(false);

/// Whether the handler could be installed; it can be installed once a process.
static INSTALLED: OnceLock<bool> = OnceLock::new();

/// Whether somebody asked for an orderly end. Only commands that finish something on Ctrl-C make one; for all others
/// the system ends the process.
#[derive(Clone, Copy, Debug)]
pub struct Interrupt(());

impl Interrupt {
    /// From now on the first Ctrl-C only sets a flag and the second ends the process with code 130.
    ///
    /// # Errors
    /// [`Failure::Run`] if the system refuses the handler.
    pub fn install() -> Result<Self, Failure> {
        if *INSTALLED.get_or_init(|| ctrlc::set_handler(pressed).is_ok()) {
            Ok(Self(()))
        } else {
            Err(Failure::run(
                "cannot install the handler for Ctrl-C; another one is installed in this process",
            ))
        }
    }

    /// Whether Ctrl-C was pressed.
    pub fn pressed(self) -> bool {
        PRESSED.load(Ordering::Relaxed)
    }

    /// The flag itself, for parts that look at it while they work.
    pub fn flag(self) -> &'static AtomicBool {
        &PRESSED
    }

    /// Ends the command if Ctrl-C was pressed; `kept` says what is finished and stays.
    ///
    /// # Errors
    /// [`Failure::Interrupted`] with `kept`.
    pub fn check(self, kept: impl FnOnce() -> String) -> Result<(), Failure> {
        if self.pressed() {
            Err(Failure::Interrupted(kept()))
        } else {
            Ok(())
        }
    }
}

/// Runs on a thread of its own, so that it may write and exit.
fn pressed() {
    if PRESSED.swap(true, Ordering::Relaxed) {
        std::process::exit(EXIT_CODE);
    }
    // Standard error may be closed; the flag is what counts.
    let _ = writeln!(
        std::io::stderr(),
        "finishing what is in hand; press Ctrl-C again to stop at once"
    );
}
