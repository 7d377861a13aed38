//! Parameters of `solver.kind = "wave-particles"`.

use super::one;
use glam::Vec2;
use serde::{Deserialize, Serialize};

/// Parameters of wave particles.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WaveParticles {
    /// Distance between samples in metres.
    pub spacing: f32,
    /// Wave speed in m/s, the same everywhere; default: √(g · depth), with the mean depth of the terrain's water where
    /// there is one, else with `depth`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub speed: Option<f32>,
    /// Depth in metres that sets the speed where there is no terrain.
    #[serde(default = "one")]
    pub depth: f32,
    /// How fronts decay as they spread.
    #[serde(default)]
    pub law: AmplitudeLaw,
    /// Concentric fronts that a disturbance becomes under the energy law.
    #[serde(default = "default_train")]
    pub train: f32,
    /// Radius in metres of the particles that objects make; default: four samples.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub radius: Option<f32>,
    /// Distance between the particles of a front, in radii, at which they split.
    #[serde(default = "half")]
    pub split: f32,
    /// Amplitude in metres below which a particle is dropped instead of split.
    #[serde(default = "default_smallest")]
    pub smallest: f32,
    /// Most particles.
    #[serde(default = "default_limit")]
    pub limit: f32,
    /// Share of the horizontal motion of the surface, 0 to 1.
    #[serde(default = "one")]
    pub horizontal: f32,
    /// Fronts that the scene begins with or that come later.
    #[serde(default, rename = "front", skip_serializing_if = "Vec::is_empty")]
    pub fronts: Vec<WaveFront>,
}

fn half() -> f32 {
    0.5
}

fn default_train() -> f32 {
    6.0
}

fn default_smallest() -> f32 {
    1e-5
}

fn default_limit() -> f32 {
    1e6
}

/// How the amplitude of a front falls as the front grows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum AmplitudeLaw {
    /// A front keeps its volume, so that its height falls as 1/R (Yuksel, House & Keyser 2007).
    #[default]
    Volume,
    /// A front keeps its energy, so that its height falls as 1/√R.
    Energy,
}

/// A front of waves that starts as a straight line or as an arc.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WaveFront {
    /// When it starts, seconds.
    #[serde(default)]
    pub time: f64,
    /// Its middle, metres.
    pub position: Vec2,
    /// Where its middle travels, degrees from +X towards +Z.
    pub direction: f32,
    /// Its length, metres.
    pub width: f32,
    /// Angle that it spans, degrees: 0 for a straight front, 360 for a ring, negative for one that runs together.
    #[serde(default)]
    pub spread: f32,
    /// Height of its crest, metres; negative for a trough.
    pub height: f32,
    /// Radius of its particles, metres: half the thickness of the crest.
    pub radius: f32,
}
