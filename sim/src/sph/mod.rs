//! Water in a tank as particles (smoothed particle hydrodynamics), and its surface as a heightfield.
//!
//! After Cords 2007, section 3, with a better solver beside his: [`Settings::model`] is `dfsph` (divergence-free SPH,
//! incompressible) or `mcg03` (state equation). A step sorts the particles into cells (`cells`), lists neighbours with
//! what every pass needs of a pair (`neighbours`), adds images beyond flat walls (`mirrors`) and what other boundaries fill
//! (`boundary`, `obstacle`, `distance_field`), damps what is not resolved (`noise`), and finds viscosity (`viscosity`) and
//! pressure (`mcg03` with `slabs` and `eight`; `dfsph` with `correction`, `pressure` and `complementarity`). `extract` makes
//! heightfield frames of the particles (with `bins`, `candidates` and `crossing`; `covered`: where bodies stand in it);
//! `solver` drives both for a scene (`from_scene`), with what pours in (`jets`), what acts on the water (`actions`), and
//! bodies that it moves (`floating`, `floats`).

mod actions;
mod bins;
mod boundary;
mod candidates;
pub mod cases;
mod cells;
mod complementarity;
mod correction;
mod counting;
mod covered;
mod crossing;
mod dfsph;
mod distance_field;
mod eight;
mod extract;
mod floating;
mod floats;
mod fluid;
mod from_scene;
mod jets;
mod kernel;
mod led;
mod mcg03;
mod mirrors;
mod neighbours;
mod noise;
mod obstacle;
mod pressure;
mod settings;
mod slabs;
mod solver;
mod viscosity;

pub use boundary::{Boundary, Ground, Outline};
pub use distance_field::DistanceField;
pub use extract::{Extractor, Root};
pub use floating::Float;
pub use fluid::{Fluid, Stepped};
pub use obstacle::{Obstacle, Solid};
pub use settings::{Model, Settings};
pub use solver::Sph;
