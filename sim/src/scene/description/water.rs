//! The table `[water]`: the liquid, its optics and its state at time 0.

use super::path_text;
use crate::optics;
use glam::{Vec2, Vec3};
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// The water.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Water {
    /// Elevation of the surface at rest above datum, metres.
    pub level: f32,
    /// State at time 0.
    pub initial: Initial,
    /// Refractive index.
    pub index: f32,
    /// Absorption per metre for red, green, blue.
    pub absorption: Vec3,
    /// Scattering per metre for red, green, blue.
    pub scattering: Vec3,
}

impl Default for Water {
    fn default() -> Self {
        Self {
            level: 0.0,
            initial: Initial::Still,
            index: optics::WATER_INDEX,
            absorption: optics::WATER_ABSORPTION,
            scattering: optics::WATER_SCATTERING,
        }
    }
}

/// State of the water at time 0.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub enum Initial {
    /// At rest at `water.level`.
    #[default]
    Still,
    /// A dam: inside the rectangle (or beyond the line) the surface stands higher.
    Dam {
        /// Smallest X and Z of the reservoir, metres.
        min: Vec2,
        /// Largest X and Z of the reservoir, metres.
        max: Vec2,
        /// Elevation of the reservoir's surface above datum, metres.
        level: f32,
    },
    /// A smooth Gaussian hump: `height · exp(−|x − position|²/(2 radius²))`.
    Disturbance {
        /// Centre, metres.
        position: Vec2,
        /// Standard deviation, metres.
        radius: f32,
        /// Height at the centre above `water.level`, metres; negative for a trough.
        height: f32,
    },
    /// Elevation above datum from a `.npy` array of shape `(nz, nx)`, stretched over the domain.
    Array {
        /// The file, relative to the scene file.
        #[serde(serialize_with = "path_text")]
        file: PathBuf,
    },
}
