//! What moves the ground under shallow water.

use super::boundary::{SeriesPoint, optional_path};
use super::path_text;
use glam::Vec2;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// A motion of the ground; several add up.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub enum Bed {
    /// A rectangle rises or sinks.
    Patch {
        /// Smallest X and Z, metres.
        min: Vec2,
        /// Largest X and Z, metres.
        max: Vec2,
        /// How far it rises, metres.
        height: f32,
        /// When it begins, seconds.
        #[serde(default)]
        start: f64,
        /// How long it takes, seconds; 0 for at once.
        #[serde(default)]
        rise: f64,
        /// Time series of the share that has risen. A scene that is loaded holds its points instead.
        #[serde(
            default,
            skip_serializing_if = "Option::is_none",
            serialize_with = "optional_path"
        )]
        series: Option<PathBuf>,
        /// Time series of the share that has risen, in place of `start` and `rise`.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        points: Vec<SeriesPoint>,
    },
    /// The ground rises by an array of heights.
    Array {
        /// NumPy array of shape `(nz, nx)`, stretched over the domain.
        #[serde(serialize_with = "path_text")]
        file: PathBuf,
        /// Metres a unit.
        #[serde(default = "one")]
        scale: f32,
        /// When it begins, seconds.
        #[serde(default)]
        start: f64,
        /// How long it takes, seconds; 0 for at once.
        #[serde(default)]
        rise: f64,
        /// Time series of the share that has risen. A scene that is loaded holds its points instead.
        #[serde(
            default,
            skip_serializing_if = "Option::is_none",
            serialize_with = "optional_path"
        )]
        series: Option<PathBuf>,
        /// Time series of the share that has risen, in place of `start` and `rise`.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        points: Vec<SeriesPoint>,
    },
    /// A hump slides along a path.
    Slide {
        /// Height at the centre, metres; negative for a hollow.
        height: f32,
        /// Radius at which it ends, metres.
        radius: f32,
        /// Where its centre is when.
        path: Vec<PlanPoint>,
    },
}

/// A place on the map at a time.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PlanPoint {
    /// Seconds.
    pub time: f64,
    /// X and Z, metres.
    pub position: Vec2,
}

fn one() -> f32 {
    1.0
}
