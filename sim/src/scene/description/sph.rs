//! Parameters of `solver.kind = "sph"`.

use glam::Vec3;
use serde::{Deserialize, Serialize};

/// Parameters of the particle solver.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sph {
    /// Distance between samples in metres.
    pub spacing: f32,
    /// Distance between particles in metres; default: two samples.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub particle: Option<f32>,
    /// How pressure is found.
    #[serde(default)]
    pub model: SphModel,
    /// Outline of the tank.
    #[serde(default)]
    pub vessel: Vessel,
    /// Kinematic viscosity in m²/s.
    #[serde(default = "water_viscosity")]
    pub viscosity: f32,
    /// What water does at walls and obstacles.
    #[serde(default)]
    pub walls: SphWalls,
    /// Surface tension in N/m (`mcg03`).
    #[serde(default)]
    pub surface_tension: f32,
    /// Square of the speed of sound of `mcg03` in m²/s²; default: 100 g times the depth of the water.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stiffness: Option<f32>,
    /// Gravity in m/s².
    #[serde(default = "down")]
    pub gravity: Vec3,
    /// Turns of gravity: between two of them it changes evenly, after the last it stays.
    #[serde(default, rename = "tilt", skip_serializing_if = "Vec::is_empty")]
    pub tilts: Vec<Tilt>,
    /// Share of a particle spacing that a particle may move in a sub-step.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub courant: Option<f32>,
    /// Longest sub-step in seconds; default: as long as is stable.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub step: Option<f32>,
    /// Most sub-steps a frame; a frame that needs more is refused. Default: 100000.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub most_steps: Option<f32>,
    /// How the surface is found among the particles.
    #[serde(default)]
    pub surface: SphSurface,
    /// Which particles a frame lists as droplets.
    #[serde(default)]
    pub droplets: SphDroplets,
    /// Where water pours in.
    #[serde(default, rename = "emitter", skip_serializing_if = "Vec::is_empty")]
    pub emitters: Vec<Emitter>,
    /// Where water is taken out.
    #[serde(default, rename = "drain", skip_serializing_if = "Vec::is_empty")]
    pub drains: Vec<Drain>,
}

fn water_viscosity() -> f32 {
    1e-6
}

fn down() -> Vec3 {
    Vec3::new(0.0, -9.81, 0.0)
}

/// How the particles' pressure is found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SphModel {
    /// Divergence-free SPH (Bender & Koschier 2015).
    #[default]
    Dfsph,
    /// State equation (Müller, Charypar & Gross 2003).
    Mcg03,
}

/// Outline of the tank, seen from above.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Vessel {
    /// The domain.
    #[default]
    Box,
    /// The largest circle in the domain.
    Round,
}

/// What water does at walls.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SphWalls {
    /// It slides along them.
    #[default]
    Slip,
    /// It sticks to them, as far as its viscosity reaches.
    Stick,
}

/// How the surface is found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SphSurface {
    /// To about a thousandth of a particle spacing.
    #[default]
    Fast,
    /// To the precision of the numbers, and with finer steps.
    Exact,
}

/// Which particles are droplets of a frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SphDroplets {
    /// Those thrown clear of the surface.
    #[default]
    Clear,
    /// All, so that pictures show them.
    All,
}

/// A turn of gravity.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Tilt {
    /// Seconds.
    pub time: f64,
    /// Gravity from then on, m/s².
    pub gravity: Vec3,
}

/// A round jet.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Emitter {
    /// Centre of its opening in metres.
    pub position: Vec3,
    /// Velocity of the water in m/s, at right angles to the opening.
    pub velocity: Vec3,
    /// Radius of the opening in metres.
    pub radius: f32,
    /// First moment, seconds.
    #[serde(default)]
    pub start: f64,
    /// Last moment, seconds; default: to the end.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub end: Option<f64>,
}

/// A box in which water is taken out.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Drain {
    /// Smallest X, Y, Z in metres.
    pub min: Vec3,
    /// Largest X, Y, Z in metres.
    pub max: Vec3,
}
