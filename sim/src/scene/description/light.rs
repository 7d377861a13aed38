//! The table `[light]`: sun and sky.

use super::{one, path_text};
use crate::optics;
use glam::Vec3;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// Sun and sky.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Light {
    /// The sun; absent: none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sun: Option<Sun>,
    /// The sky.
    pub sky: Sky,
}

/// The sun.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sun {
    /// Height above the horizon in degrees, −90 to 90.
    pub elevation: f32,
    /// Azimuth in degrees from −Z (north) towards +X (east).
    pub azimuth: f32,
    /// Linear RGB irradiance on a surface that faces the sun.
    #[serde(default = "default_sun_irradiance")]
    pub irradiance: Vec3,
    /// Angular radius of the disc in degrees.
    #[serde(default = "default_sun_radius")]
    pub radius: f32,
}

fn default_sun_irradiance() -> Vec3 {
    Vec3::new(3.2, 3.0, 2.6)
}

fn default_sun_radius() -> f32 {
    optics::SUN_ANGULAR_RADIUS.to_degrees()
}

/// The sky.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub enum Sky {
    /// The same radiance from everywhere.
    Uniform {
        /// Linear RGB radiance.
        radiance: Vec3,
    },
    /// A picture of the surroundings.
    Picture {
        /// The file (EXR, PNG, JPEG or BMP), relative to the scene file.
        #[serde(serialize_with = "path_text")]
        file: PathBuf,
        /// What the picture shows where.
        #[serde(default)]
        layout: SkyLayout,
        /// Turn about +Y in degrees.
        #[serde(default)]
        rotation: f32,
        /// Factor on its radiance.
        #[serde(default = "one")]
        scale: f32,
    },
    /// Hosek & Wilkie's daylight for the position of the sun.
    Daylight {
        /// Turbidity, 1 (clear) to 10 (hazy).
        #[serde(default = "default_turbidity")]
        turbidity: f32,
        /// Factor on its radiance.
        #[serde(default = "one")]
        scale: f32,
    },
}

/// How a picture shows the surroundings.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SkyLayout {
    /// Equirectangular, twice as wide as high.
    #[default]
    Panorama,
    /// The six faces of a cube: a cross of 4 by 3 or 3 by 4 squares, or a row or column of +X, −X, +Y, −Y, +Z, −Z.
    Cube,
    /// A landscape of any shape that stands on the horizon, once in each quarter of it.
    Horizon,
}

impl Default for Sky {
    fn default() -> Self {
        Self::Uniform {
            radiance: Vec3::new(0.55, 0.70, 0.95),
        }
    }
}

fn default_turbidity() -> f32 {
    2.5
}
