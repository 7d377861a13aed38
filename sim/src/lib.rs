//! Water-surface solvers, scenes, terrain and recordings: everything of Meniscus that is not a picture.
//!
//! Every solver ends in the same thing, a heightfield [`Frame`]; every renderer begins with one and cannot tell
//! whether it came live from a [`Solver`] or from a recording, since both stand behind [`FrameSource`].
//!
//! The tour, in the order in which data flows:
//! [`scene`] reads what a scene file says and resolves the files it names; [`solvers`] builds the [`Solver`] it asks for;
//! [`source`] drives it to the frame times and delivers events; [`recording`] stores and replays frames;
//! [`export`] writes them for other programs; [`render`] is the seam to the renderer crates, and `stage` (a feature) what
//! they share.
//!
//! Units are SI throughout. Axes are right-handed with +Y up; grid rows run along +X, columns along +Z.

#[cfg(feature = "bodies")]
pub mod afloat;
#[cfg(feature = "bodies")]
pub mod bodies;
pub mod detail;
pub mod dispersion;
pub mod events;
#[cfg(feature = "export")]
pub mod export;
pub mod frame;
pub mod grid;
pub mod knobs;
pub mod layers;
pub mod mesh;
pub mod npy;
#[cfg(feature = "ocean")]
pub mod ocean;
pub mod optics;
#[cfg(feature = "procedural")]
pub mod procedural;
pub mod recording;
pub mod reduce;
pub mod render;
pub mod rng;
pub mod scene;
#[cfg(feature = "shallow-water")]
pub mod shallow_water;
pub mod solver;
pub mod solvers;
pub mod source;
#[cfg(feature = "sph")]
pub mod sph;
#[cfg(feature = "stage")]
pub mod stage;
pub mod stages;
pub mod terrain;
#[cfg(feature = "wave-equation")]
pub mod wave_equation;
#[cfg(feature = "wave-particles")]
pub mod wave_particles;

pub use frame::{BodyPose, Channels, Droplets, Frame};
pub use glam;
pub use grid::{Grid, GridSpec};
pub use scene::Scene;
pub use solver::{Solver, StepError, StepReport};
pub use source::{FrameSource, Progress, SourceError};
