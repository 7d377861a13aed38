//! What a command spent: processor time of all its threads and wall time.

use super::format;
use serde::Serialize;
use std::time::Instant;

/// Processor seconds of this process so far, all threads together; `None` where the system does not say.
pub fn cpu_seconds() -> Option<f64> {
    #[cfg(unix)]
    {
        let t = rustix::time::clock_gettime(rustix::time::ClockId::ProcessCPUTime);
        Some(t.tv_sec as f64 + t.tv_nsec as f64 * 1e-9)
    }
    #[cfg(not(unix))]
    {
        None
    }
}

/// Processor and wall seconds of a piece of work.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Cost {
    /// Seconds of processor time, all threads together; absent where the system does not say.
    pub cpu_seconds: Option<f64>,
    /// Seconds on the clock.
    pub wall_seconds: f64,
}

impl Cost {
    /// For people.
    pub(crate) fn text(&self) -> String {
        let wall = format::seconds(self.wall_seconds);
        match self.cpu_seconds {
            Some(cpu) => format!("{wall} on the clock, {} of processor time", format::seconds(cpu)),
            None => format!("{wall} on the clock"),
        }
    }
}

/// Measures a [`Cost`] from its making on.
#[derive(Clone, Copy, Debug)]
pub struct Stopwatch {
    cpu: Option<f64>,
    wall: Instant,
}

impl Stopwatch {
    /// Starts.
    pub fn start() -> Self {
        Self {
            cpu: cpu_seconds(),
            wall: Instant::now(),
        }
    }

    /// What was spent since the start.
    pub fn cost(&self) -> Cost {
        Cost {
            cpu_seconds: self.cpu.zip(cpu_seconds()).map(|(start, now)| now - start),
            wall_seconds: self.wall.elapsed().as_secs_f64(),
        }
    }
}
