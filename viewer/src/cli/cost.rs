//! What a command spent: processor time of all its threads and wall time.

use super::format;
use crate::study::measure::process_cpu_seconds;
use serde::Serialize;
use std::time::Instant;

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
            cpu: process_cpu_seconds(),
            wall: Instant::now(),
        }
    }

    /// What was spent since the start.
    pub fn cost(&self) -> Cost {
        Cost {
            cpu_seconds: self
                .cpu
                .zip(process_cpu_seconds())
                .map(|(start, now)| now - start),
            wall_seconds: self.wall.elapsed().as_secs_f64(),
        }
    }
}
