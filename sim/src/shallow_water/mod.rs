//! Shallow-water equations in f32 or f64: well-balanced finite volumes, and lattice Boltzmann schemes around them.

mod actions;
pub mod analytic;
mod bed;
mod bgk;
mod boundary;
pub mod cases;
mod checkpoint;
mod chunks;
mod eddies;
mod edges;
pub(crate) mod exchange;
mod finite_volume;
mod floats;
mod from_scene;
mod lattice;
pub mod monai;
mod real;
mod scheme;
mod settings;
mod solver;
mod splash;
pub mod stability;
mod storage;
mod totals;

pub use bed::BedMotion;
pub use checkpoint::{Checkpoint, CheckpointError, LatticeMemory, SplashMemory, TileMemory};
pub use edges::{Condition, Edges, Series};
pub use settings::{
    DEFAULT_COURANT, DEFAULT_RELAXATION, Initial, LARGEST_COURANT, LARGEST_SMAGORINSKY, LatticeSettings,
    Method, Precision, Settings, SetupError, position,
};
pub use solver::ShallowWater;
pub use splash::{Ledger, SplashSettings};
