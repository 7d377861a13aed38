//! What became of the waves: made, and lost in which way.

use super::kernel::{BUMP_SQUARE, CREST_SQUARE, VOLUME};
use super::particle::Particle;
use crate::optics::WATER_DENSITY;
use crate::solvers::GRAVITY;
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;

/// Volumes in m³ and energies in J since the start. With the volume law, what was made is what is there and what was
/// lost. With the energy law the volume of a front changes on its way, and the volumes are those shown at each moment.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Ledger {
    /// Volume of all waves made.
    pub made: f64,
    /// Volume that should have been made where there is no water.
    pub missed: f64,
    /// Volume of the waves dropped as too small.
    pub culled: f64,
    /// Energy of the waves dropped as too small.
    pub culled_energy: f64,
    /// Volume of the waves that left through open edges.
    pub left: f64,
    /// Volume of the waves dropped because they found no way out of a cusp between walls.
    pub stranded: f64,
    /// Particles dropped in such a way.
    pub strandings: u64,
}

impl Ledger {
    pub(super) fn cull(&mut self, p: &Particle, time: f64, speed: f64) {
        self.culled += VOLUME * p.radius * p.radius * p.shown(time, speed);
        self.culled_energy += energy(p, time, speed);
    }

    pub(super) fn leave(&mut self, volume: f64) {
        self.left += volume;
    }

    pub(super) fn strand(&mut self, volume: f64) {
        self.stranded += volume;
        self.strandings += 1;
    }

    pub(super) fn add(&mut self, o: &Self) {
        self.made += o.made;
        self.missed += o.missed;
        self.culled += o.culled;
        self.culled_energy += o.culled_energy;
        self.left += o.left;
        self.stranded += o.stranded;
        self.strandings += o.strandings;
    }
}

/// A particle's share of the energy that its front would have if no other front crossed it, J: ρ g ∫ η² of a crest of
/// height a r/Δ, half of it kinetic. Where the front is still at its focus its particles lie on each other and what
/// there is is potential energy alone.
pub(super) fn energy(p: &Particle, time: f64, speed: f64) -> f64 {
    let least = p.angle * p.radius * CREST_SQUARE / (PI * BUMP_SQUARE);
    let spacing = p.spacing_at(time, speed).abs().max(least);
    let amplitude = p.shown(time, speed);
    if spacing > 0.0 {
        WATER_DENSITY * GRAVITY * amplitude * amplitude * p.radius.powi(3) * CREST_SQUARE / spacing
    } else {
        0.0
    }
}
