//! The books of everything that leaves or enters the water in flight other than from or to the grid.

use serde::{Deserialize, Serialize};

/// Totals since the start. What grid and droplets hold together changes by what stands here and by nothing else.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Ledger {
    /// Droplets that left the water.
    pub emitted: u64,
    /// Droplets that fell onto water or ground.
    pub landed: u64,
    /// Droplets that flew out over an edge that is not a wall.
    pub lost: u64,
    /// Droplets that breaking waves would have thrown while as many flew as are allowed.
    pub suppressed: u64,
    /// Volume that flew out, m³.
    pub lost_volume: f64,
    /// Momentum that flew out, kg m/s.
    pub lost_momentum: [f64; 2],
    /// Momentum given to the air, kg m/s.
    pub air_momentum: [f64; 2],
    /// Momentum given to walls and to dry ground, kg m/s.
    pub wall_momentum: [f64; 2],
    /// Momentum lost to the rounding of the grid's number type, kg m/s.
    pub rounded_momentum: [f64; 2],
    /// Energy that breaking gave to droplets, J: part of what the fronts dissipate.
    pub breaking_energy: f64,
    /// Energy lost to the air, J.
    pub air_energy: f64,
    /// Energy lost where droplets fell, J.
    pub impact_energy: f64,
    /// Energy that flew out, J.
    pub lost_energy: f64,
}

impl Ledger {
    /// Momentum that grid and droplets together have given away, kg m/s.
    pub fn momentum(&self) -> [f64; 2] {
        std::array::from_fn(|a| {
            self.lost_momentum[a] + self.air_momentum[a] + self.wall_momentum[a] + self.rounded_momentum[a]
        })
    }

    /// Energy that grid and droplets together have given away, J.
    pub fn energy(&self) -> f64 {
        self.air_energy + self.impact_energy + self.lost_energy - self.breaking_energy
    }
}
