//! The tables `[terrain]` and `[ground]`: where the ground is and what it looks like.

use super::{one_wide, path_text};
use glam::{DVec2, Vec2, Vec3};
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// The ground.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub enum Terrain {
    /// Level ground.
    Flat {
        /// Height above datum, metres.
        height: f32,
    },
    /// A 16-bit (or 8-bit) grey PNG; X runs right, Z runs down the image.
    Image {
        /// The file, relative to the scene file.
        #[serde(serialize_with = "path_text")]
        file: PathBuf,
        /// Distance between pixels along X and Z, metres; unequal distances are resampled to the smaller.
        pixel_size: Vec2,
        /// Metres a grey step.
        #[serde(default = "one_wide")]
        scale: f64,
        /// Height of grey 0 above datum, metres.
        #[serde(default)]
        offset: f64,
        /// First pixel and size in pixels of the part to use: `[x, y, width, height]`; default: all.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        crop: Option<[u32; 4]>,
        /// Where the first sample stands, metres (X, Z).
        #[serde(default)]
        origin: Vec2,
    },
    /// A NumPy array of shape `(nz, nx)`.
    Npy {
        /// The file, relative to the scene file.
        #[serde(serialize_with = "path_text")]
        file: PathBuf,
        /// Distance between samples along X and Z, metres.
        pixel_size: Vec2,
        /// Metres a unit.
        #[serde(default = "one_wide")]
        scale: f64,
        /// Height of value 0 above datum, metres.
        #[serde(default)]
        offset: f64,
        /// Where the first sample stands, metres (X, Z).
        #[serde(default)]
        origin: Vec2,
    },
    /// An ESRI ASCII grid; its first row is the northern one and becomes the smallest Z.
    AsciiGrid {
        /// The file, relative to the scene file.
        #[serde(serialize_with = "path_text")]
        file: PathBuf,
        /// Metres a unit of height.
        #[serde(default = "one_wide")]
        scale: f64,
        /// Height of value 0 above datum, metres.
        #[serde(default)]
        offset: f64,
        /// Height above datum that samples without data get, metres; absent: a grid with such samples is refused.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        nodata_height: Option<f64>,
        /// Easting and northing in the grid's own metres that become X = 0, Z = 0; default: those of the first (north
        /// western) sample.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        map_origin: Option<DVec2>,
    },
    /// Scattered `x y z` soundings, interpolated by natural neighbours.
    Soundings {
        /// The file, relative to the scene file.
        #[serde(serialize_with = "path_text")]
        file: PathBuf,
        /// What x and y are.
        #[serde(default)]
        coordinates: Coordinates,
        /// Spacing of the grid that they are interpolated to, metres.
        spacing: f32,
        /// Metres a unit of height.
        #[serde(default = "one_wide")]
        scale: f64,
        /// Height of value 0 above datum, metres.
        #[serde(default)]
        offset: f64,
        /// The first two numbers of a sounding that becomes X = 0, Z = 0, and about which longitude and latitude are
        /// projected; default: (0, 0) for metres, the centre of the soundings for longitude and latitude.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        map_origin: Option<DVec2>,
    },
}

/// What the first two numbers of a sounding are.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Coordinates {
    /// X and Z in metres.
    #[default]
    Metres,
    /// Longitude and latitude in degrees; projected to metres about their centre, north towards −Z.
    LongitudeLatitude,
}

/// How the ground is drawn.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct GroundLook {
    /// Linear albedo of level ground, 0 to 1.
    pub albedo: Vec3,
    /// Linear albedo of steep ground, 0 to 1.
    pub steep_albedo: Vec3,
    /// Linear albedo of ground below and just above the water, 0 to 1.
    pub shore_albedo: Vec3,
    /// Size of a checkerboard on the ground in metres; 0 for none (for tests of refraction).
    pub checker: f32,
}

impl Default for GroundLook {
    fn default() -> Self {
        Self {
            albedo: Vec3::new(0.16, 0.19, 0.07),
            steep_albedo: Vec3::new(0.24, 0.21, 0.18),
            shore_albedo: Vec3::new(0.36, 0.31, 0.23),
            checker: 0.0,
        }
    }
}
