//! Shallow-water equations: well-balanced finite volumes in f32 or f64.

mod actions;
pub mod analytic;
mod boundary;
pub mod cases;
mod checkpoint;
mod edges;
pub(crate) mod exchange;
mod finite_volume;
mod floats;
mod from_scene;
pub mod monai;
mod real;
mod settings;
mod solver;
mod splash;
pub mod stability;
mod storage;
mod totals;

pub use checkpoint::{Checkpoint, CheckpointError, SplashMemory, TileMemory};
pub use edges::{Condition, Edges, Series};
pub use settings::{DEFAULT_COURANT, Initial, LARGEST_COURANT, Precision, Settings, SetupError, position};
pub use solver::ShallowWater;
pub use splash::{Ledger, SplashSettings};
