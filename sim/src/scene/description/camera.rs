//! The tables `[[camera]]`: named views.

use glam::Vec3;
use serde::{Deserialize, Serialize};

/// A named view.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Camera {
    /// Name for `--camera`.
    pub name: String,
    /// Eye position in metres.
    pub position: Vec3,
    /// Point looked at in metres.
    pub target: Vec3,
    /// Full vertical angle of view in degrees.
    #[serde(default = "default_fov")]
    pub fov: f32,
    /// Exposure in stops, applied by tone mapping.
    #[serde(default)]
    pub exposure: f32,
}

fn default_fov() -> f32 {
    40.0
}
