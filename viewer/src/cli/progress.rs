//! Progress of long work: a bar on a terminal, a plain line now and then elsewhere.

use super::format;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::io::Write as _;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

/// Plain lines come no more often than this.
const LINE_INTERVAL: Duration = Duration::from_secs(1);

/// Steps of a bar a unit of work, so that it moves while one long frame is drawn.
const STEPS: f64 = 1000.0;

/// Shows how much of a piece of work is done; what is shown ends with it.
#[derive(Debug)]
pub struct Progress {
    display: Display,
}

#[derive(Debug)]
enum Display {
    Hidden,
    Bar {
        bar: ProgressBar,
        unit: &'static str,
        total: u64,
        /// Where the console looks for the bar that is on the screen.
        on_screen: Arc<Mutex<Option<ProgressBar>>>,
    },
    Lines {
        task: String,
        unit: &'static str,
        total: u64,
        started: Instant,
        /// When the last line was written.
        last: Mutex<Instant>,
    },
}

impl Progress {
    pub(super) fn hidden() -> Self {
        Self {
            display: Display::Hidden,
        }
    }

    pub(super) fn bar(
        task: &str,
        total: u64,
        unit: &'static str,
        on_screen: Arc<Mutex<Option<ProgressBar>>>,
    ) -> Self {
        let bar = ProgressBar::with_draw_target(
            Some((total as f64 * STEPS) as u64),
            ProgressDrawTarget::stderr_with_hz(10),
        );
        // The template is a constant; should it ever be refused, the default style is as good.
        if let Ok(style) = ProgressStyle::with_template(
            "{prefix} [{bar:30}] {percent:>3}% {msg}, {elapsed} gone, {eta} left",
        ) {
            bar.set_style(style.progress_chars("=> "));
        }
        bar.set_prefix(task.to_owned());
        *on_screen.lock().unwrap_or_else(PoisonError::into_inner) = Some(bar.clone());
        let progress = Self {
            display: Display::Bar {
                bar,
                unit,
                total,
                on_screen,
            },
        };
        progress.set(0.0);
        progress
    }

    pub(super) fn lines(task: &str, total: u64, unit: &'static str) -> Self {
        let now = Instant::now();
        Self {
            display: Display::Lines {
                task: task.to_owned(),
                unit,
                total,
                started: now,
                last: Mutex::new(now),
            },
        }
    }

    /// `done` units of work are done; a part of a unit counts. May be called from any thread, as often as it suits.
    pub fn set(&self, done: f64) {
        match &self.display {
            Display::Hidden => {}
            Display::Bar { bar, unit, total, .. } => {
                bar.set_position((done * STEPS) as u64);
                bar.set_message(counted(done, *total, unit));
            }
            Display::Lines {
                task,
                unit,
                total,
                started,
                last,
            } => {
                let mut last = last.lock().unwrap_or_else(PoisonError::into_inner);
                if last.elapsed() < LINE_INTERVAL {
                    return;
                }
                *last = Instant::now();
                // Standard error may be closed, which is no reason to stop the work.
                let _ = writeln!(
                    std::io::stderr(),
                    "{}",
                    line(task, done, *total, unit, started.elapsed())
                );
            }
        }
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        if let Display::Bar { bar, on_screen, .. } = &self.display {
            *on_screen.lock().unwrap_or_else(PoisonError::into_inner) = None;
            bar.finish_and_clear();
        }
    }
}

/// `3 of 10 frames`.
fn counted(done: f64, total: u64, unit: &str) -> String {
    format!("{} of {}", done.floor() as u64, format::count(total, unit))
}

/// `rendering: 45% (4 of 10 frames), 12 s left`.
fn line(task: &str, done: f64, total: u64, unit: &str, elapsed: Duration) -> String {
    let share = if total == 0 {
        1.0
    } else {
        (done / total as f64).clamp(0.0, 1.0)
    };
    let left = if share > 0.0 {
        let left = elapsed.as_secs_f64() * (1.0 - share) / share;
        format!(", {} left", format::seconds(left.round()))
    } else {
        String::new()
    };
    format!(
        "{task}: {:.0}% ({}){left}",
        (share * 100.0).floor(),
        counted(done, total, unit)
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_tells_share_count_and_time_left() {
        let after = |done, seconds| line("rendering", done, 10, "frame", Duration::from_secs(seconds));
        assert_eq!(after(2.5, 10), "rendering: 25% (2 of 10 frames), 30.0 s left");
        assert_eq!(after(0.0, 10), "rendering: 0% (0 of 10 frames)");
        assert_eq!(after(10.0, 10), "rendering: 100% (10 of 10 frames), 0 s left");
    }
}
