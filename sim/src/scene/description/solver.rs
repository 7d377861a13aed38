//! The table `[solver]`: which method moves the water.

use super::{Ocean, Procedural, ShallowWater, Sph, WaveEquation, WaveParticles};
use serde::{Deserialize, Serialize};

/// The method that moves the water.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case")]
pub enum Solver {
    /// Linear wave equation on a grid.
    WaveEquation(WaveEquation),
    /// Sums of directional sines and Gerstner waves, in closed form.
    Procedural(Procedural),
    /// Shallow-water equations.
    ShallowWater(ShallowWater),
    /// Sums of many waves of measured spectra with random phases.
    Ocean(Ocean),
    /// Wave particles.
    WaveParticles(WaveParticles),
    /// Water in a tank as particles.
    Sph(Sph),
}

impl Solver {
    /// Distance between samples in metres.
    pub fn spacing(&self) -> f32 {
        match self {
            Self::WaveEquation(s) => s.spacing,
            Self::Procedural(s) => s.spacing,
            Self::ShallowWater(s) => s.spacing,
            Self::Ocean(s) => s.spacing,
            Self::WaveParticles(s) => s.spacing,
            Self::Sph(s) => s.spacing,
        }
    }
}
