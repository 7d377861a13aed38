//! One plane wave over the samples of a grid, as phasors.

use crate::dispersion::Dispersion;
use crate::grid::GridSpec;
use crate::scene::description;
use glam::DVec2;
use std::f64::consts::TAU;

/// A wave of phase θ = k·x − ωt + φ: elevation a cos θ, displacement −lean sin θ and surface velocity flow cos θ
/// along its direction.
///
/// e^{iθ} over a grid is the product of one factor a row and one a column. The columns' factors never change, so a
/// frame costs a sine and cosine a row and one complex product a sample.
#[derive(Clone, Debug)]
pub(super) struct Wave {
    pub(super) amplitude: f64,
    /// Wave vector, rad/m along X and Z.
    pub(super) vector: DVec2,
    /// rad/s.
    pub(super) frequency: f64,
    /// Phase at the origin at time 0, rad.
    phase: f64,
    /// Amplitude of the displacement along the direction, metres.
    pub(super) lean: f64,
    /// Amplitude of the horizontal velocity of the surface along the direction, m/s.
    pub(super) flow: f64,
    /// Energy a square metre, J/m², of the wave alone, averaged over its phase.
    pub(super) energy: f64,
    /// cos and sin of the phase that a column adds to the first one.
    pub(super) column: [Vec<f32>; 2],
    /// Σ e^{iθ} over the grid for a phase of 0 at its first sample: real and imaginary part.
    sum: DVec2,
}

impl Wave {
    pub(super) fn new(
        spec: &GridSpec,
        wave: &description::Wave,
        depth: Option<f64>,
        capillarity: f64,
    ) -> Self {
        let number = TAU / f64::from(wave.wavelength);
        let angle = f64::from(wave.direction).to_radians();
        let direction = DVec2::new(angle.cos(), angle.sin());
        let vector = number * direction;
        let water = Dispersion {
            depth: depth.unwrap_or(f64::INFINITY),
            surface_tension: capillarity,
        };
        let frequency = water.omega(number);
        let amplitude = f64::from(wave.amplitude);
        let orbit = amplitude / (number * water.depth).tanh();
        let spacing = f64::from(spec.spacing);
        let turn = |n: usize, k: f64| DVec2::from_angle((k * spacing * n as f64).rem_euclid(TAU));
        let columns: Vec<DVec2> = (0..spec.width()).map(|i| turn(i, vector.x)).collect();
        let rows: DVec2 = (0..spec.height()).map(|j| turn(j, vector.y)).sum();
        let column_sum: DVec2 = columns.iter().sum();
        Self {
            amplitude,
            vector,
            frequency,
            phase: f64::from(wave.phase).to_radians(),
            lean: f64::from(wave.steepness) * orbit,
            flow: frequency * orbit,
            energy: 0.5 * crate::optics::WATER_DENSITY * water.stiffness(number) * amplitude * amplitude,
            column: [
                columns.iter().map(|c| c.x as f32).collect(),
                columns.iter().map(|c| c.y as f32).collect(),
            ],
            sum: column_sum.rotate(rows),
        }
    }

    /// Phase in rad at `position` (metres) and `time`.
    pub(super) fn phase_at(&self, position: DVec2, time: f64) -> f64 {
        // The two large parts are reduced apart, so that neither costs the other digits.
        (self.vector.dot(position) + self.phase).rem_euclid(TAU) - (self.frequency * time).rem_euclid(TAU)
    }

    /// Share of the horizontal motion that bends the surface: the displacement's largest slope. At 1 the crest has
    /// a cusp.
    pub(super) fn fold(&self) -> f64 {
        self.lean.abs() * self.vector.length()
    }

    /// Unit vector of travel.
    pub(super) fn direction(&self) -> DVec2 {
        self.vector.normalize_or_zero()
    }

    /// Σ cos θ over the grid at `time`.
    pub(super) fn sum_at(&self, spec: &GridSpec, time: f64) -> f64 {
        let (sin, cos) = self.phase_at(spec.origin.as_dvec2(), time).sin_cos();
        cos * self.sum.x - sin * self.sum.y
    }
}
