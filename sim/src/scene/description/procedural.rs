//! Parameters of `solver.kind = "procedural"`.

use serde::{Deserialize, Serialize};

/// Parameters of procedural waves.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Procedural {
    /// Distance between samples in metres.
    pub spacing: f32,
    /// Water depth for the dispersion relation in metres; absent: deep water.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub depth: Option<f32>,
    /// The waves.
    #[serde(default, rename = "wave")]
    pub waves: Vec<Wave>,
}

/// One plane wave.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Wave {
    /// Amplitude (half the height) in metres.
    pub amplitude: f32,
    /// Wavelength in metres.
    pub wavelength: f32,
    /// Direction of travel in degrees from +X towards +Z.
    #[serde(default)]
    pub direction: f32,
    /// Phase at the origin at time 0, degrees.
    #[serde(default)]
    pub phase: f32,
    /// Steepness of a Gerstner (trochoidal) wave: share of the horizontal displacement, 0 for a sine, 1 for the full
    /// orbital motion.
    #[serde(default)]
    pub steepness: f32,
}
