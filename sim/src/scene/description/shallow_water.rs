//! Parameters of `solver.kind = "shallow-water"`.

use serde::{Deserialize, Serialize};

/// Parameters of the shallow-water solver.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ShallowWater {
    /// Distance between samples in metres.
    pub spacing: f32,
    /// Discretisation.
    #[serde(default)]
    pub scheme: ShallowWaterScheme,
    /// Relaxation time of the scheme `bgk` in steps; default 0.6.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub relaxation: Option<f32>,
    /// Manning's roughness in s/m^⅓; 0 for none.
    #[serde(default)]
    pub manning: f32,
    /// Smagorinsky's constant of the eddy viscosity; 0 for none.
    #[serde(default)]
    pub smagorinsky: f32,
    /// Courant number of the sub-steps, in (0, 1).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub courant: Option<f32>,
    /// Depth in metres below which water is treated as a film; default: 1e-5 of the largest depth.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub film_depth: Option<f32>,
    /// Droplets thrown by breaking waves, and foam; absent: neither is computed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub splash: Option<Splash>,
}

/// Droplets and foam of breaking waves.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Splash {
    /// Whether breaking waves throw droplets.
    pub droplets: bool,
    /// Whether there is foam.
    pub foam: bool,
    /// Slope of the surface above which a running front breaks.
    pub slope: f32,
    /// Share of the water that rises in a breaking front which leaves as droplets.
    pub amount: f32,
    /// Mean radius of a droplet in metres; default: a tenth of the spacing, at most a twentieth of the depth.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub droplet_radius: Option<f32>,
    /// Time in which thin foam fades to 1/e, seconds; dense foam thins out faster.
    pub foam_life: f32,
}

impl Default for Splash {
    fn default() -> Self {
        Self {
            droplets: true,
            foam: true,
            slope: 0.36,
            amount: 0.05,
            droplet_radius: None,
            foam_life: 4.0,
        }
    }
}

/// Discretisation of the shallow-water equations.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ShallowWaterScheme {
    /// Chosen for the scene.
    #[default]
    Auto,
    /// Well-balanced MUSCL-Hancock finite volumes.
    FiniteVolume,
    /// Lattice Boltzmann with six moments in calm, deep water and finite volumes elsewhere.
    Lattice,
    /// Lattice Boltzmann with nine velocities and one relaxation time.
    Bgk,
}
