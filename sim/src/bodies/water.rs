//! What a body asks of the water it is in: any solver that can answer two questions can float bodies.

use glam::DVec3;

/// Density of water, kg/m³, the same as in every solver's totals.
pub const WATER_DENSITY: f64 = 1000.0;

/// Water as bodies see it.
///
/// Answering is enough for one-way coupling (bodies float on it and leave it as it is): an ocean of summed waves, a
/// field of wave particles, a recorded frame. Solvers that take something back implement
/// [`super::Columns`] besides.
pub trait Water: Sync {
    /// Surface and bed at (`x`, `z`) in metres, right now.
    fn column(&self, x: f64, z: f64) -> Column;

    /// Velocity of the water in m/s at a place below the surface. Methods that average over the depth ignore `at.y`.
    fn velocity(&self, at: DVec3) -> DVec3;

    /// How fast that velocity changes, m/s²: the water that goes along with a body is carried by it. Zero for columns
    /// that bodies push themselves, whose velocity is not that of the open water.
    fn acceleration(&self, _: DVec3) -> DVec3 {
        DVec3::ZERO
    }

    /// Distance in metres over which the surface is resolved: hulls are divided to about this. 0 if it is exact
    /// everywhere.
    fn resolution(&self) -> f64 {
        0.0
    }

    /// Whether the water radiates the waves that bodies make, as shallow-water equations do for long ones. Bodies
    /// then leave those to it, see [`super::loads`].
    fn radiates(&self) -> bool {
        false
    }
}

/// The water at one place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Column {
    /// Height of the surface above datum in metres; where there is no water, at most `bed`.
    pub surface: f64,
    /// Height of the bed above datum in metres; −∞ for deep water.
    pub bed: f64,
}

impl Column {
    /// Depth in metres, 0 where dry, infinite for deep water.
    pub fn depth(self) -> f64 {
        (self.surface - self.bed).max(0.0)
    }
}

/// Water at rest: for tests, and for scenes whose solver has no say in where bodies float.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StillWater {
    /// Height of the surface above datum in metres.
    pub level: f64,
    /// Height of the bed above datum in metres; −∞ for deep water.
    pub bed: f64,
}

impl Water for StillWater {
    fn column(&self, _: f64, _: f64) -> Column {
        Column {
            surface: self.level,
            bed: self.bed,
        }
    }

    fn velocity(&self, _: DVec3) -> DVec3 {
        DVec3::ZERO
    }
}
