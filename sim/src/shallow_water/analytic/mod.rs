//! Closed-form solutions of the shallow-water equations, to measure the solver against.
//!
//! All follow the collection of Delestre, Lucas, Ksinant, Darboux, Laguerre, Vo, James & Cordier, *SWASHES: a
//! compilation of shallow water analytic solutions for hydraulic and environmental studies*, 2013,
//! doi:10.1002/fld.3741, cited below as SWASHES with the section; originals are named beside it.

mod bump;
mod dam_break;
mod macdonald;
mod roots;
mod thacker;

pub use bump::{Bump, BumpFlow};
pub use dam_break::{Ritter, Stoker};
pub use macdonald::MacDonald;
pub use thacker::{ThackerPlanar, ThackerRadial};

/// State of the water at a point of a line or a plane.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Water {
    /// Depth, m; 0 where it is dry.
    pub depth: f64,
    /// Velocity along X and Z, m/s; 0 where it is dry.
    pub velocity: [f64; 2],
}

impl Water {
    /// No water.
    pub const DRY: Self = Self {
        depth: 0.0,
        velocity: [0.0; 2],
    };

    /// Water that moves along X only.
    pub fn along_x(depth: f64, speed: f64) -> Self {
        Self {
            depth,
            velocity: [speed, 0.0],
        }
    }
}
