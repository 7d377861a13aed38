//! Why bodies cannot be made or moved.

use super::mass::MassError;

/// Why a scene's objects cannot be made into bodies.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum BodyError {
    /// The mesh is no body.
    #[error("object `{name}`: {source}; {}", .source.remedy())]
    Mass {
        /// Name of the object.
        name: String,
        /// What is wrong with its mesh.
        source: MassError,
    },
    /// It starts in the ground.
    #[error("object `{name}` starts {depth:.3} m deep in the ground; raise `position` by that much")]
    Buried {
        /// Name of the object.
        name: String,
        /// How deep its deepest corner is below the ground, m.
        depth: f64,
    },
    /// It starts outside of the domain.
    #[error("object `{name}` starts outside of the domain; move `position` into it")]
    Outside {
        /// Name of the object.
        name: String,
    },
    /// It does not fit into the domain.
    #[error(
        "object `{name}` measures {size:.3} m and the domain only {domain:.3} m; enlarge the domain or shrink it"
    )]
    TooLarge {
        /// Name of the object.
        name: String,
        /// Its length along the axis, m.
        size: f64,
        /// Length of the domain, m.
        domain: f64,
    },
    /// A velocity is impossible.
    #[error("object `{name}`: {what} is {value}; write at most {limit:e}")]
    Fast {
        /// Name of the object.
        name: String,
        /// Which velocity, with its unit.
        what: &'static str,
        /// Its magnitude.
        value: f64,
        /// The largest allowed.
        limit: f64,
    },
    /// A saved state is not one of these bodies.
    #[error("the saved state of the bodies cannot be used: {0}")]
    Saved(String),
}

/// Why a step failed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MotionError {
    /// A body's state is no longer finite.
    #[error("body `{name}` went out of control at t = {time} s; {remedy}")]
    Lost {
        /// Name of the body.
        name: String,
        /// Simulated time, s.
        time: f64,
        /// What to change.
        remedy: &'static str,
    },
    /// The step would take too many sub-steps.
    #[error("a step of {dt} s needs {needed} sub-steps of the bodies; advance by less, or use larger bodies")]
    TooLong {
        /// The step, s.
        dt: f64,
        /// Sub-steps that it needs.
        needed: u64,
    },
}
