//! Shallow-water equations: well-balanced finite volumes in f32 or f64.

mod actions;
mod boundary;
mod checkpoint;
mod finite_volume;
mod real;
mod settings;
mod solver;
mod storage;
mod totals;

pub use checkpoint::{Checkpoint, CheckpointError};
pub use settings::{BuildError, DEFAULT_COURANT, Initial, LARGEST_COURANT, Precision, Settings, position};
pub use solver::ShallowWater;

/// Standard gravity of this solver, m/s².
pub const GRAVITY: f64 = 9.81;
