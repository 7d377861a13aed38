//! Totals of a state: what a report says about it.

use super::finite_volume::FiniteVolume;
use super::real::Real;
use crate::reduce;
use crate::solvers::GRAVITY;

/// Density of water, kg/m³.
const DENSITY: f64 = 1000.0;

/// Sums over all cells.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Totals {
    /// kg.
    pub(crate) mass: f64,
    /// kg m/s.
    pub(crate) momentum: [f64; 2],
    /// J; potential energy relative to still water at a level.
    pub(crate) energy: f64,
    /// Largest |u|/√(g h) of cells deeper than a film.
    pub(crate) froude: f64,
}

/// Sums the state row by row; `level` is the still surface relative to bed 0, m.
///
/// The depths are multiples of one quantum, so in single precision the mass is exact: no rounding happens before the
/// volume reaches 2^53 quanta.
pub(crate) fn totals<T: Real>(core: &FiniteVolume<T>, level: f64, cell_area: f64) -> Totals {
    let (layout, fields, bed) = (core.layout(), core.fields(), core.bed());
    let film = core.film();
    let row = |j: usize| {
        let mut sum = Totals::default();
        let (mut kinetic, mut potential) = (0.0, 0.0);
        for k in layout.row(j) {
            let (h, z) = (fields.h[k].to_f64(), bed[k].to_f64());
            // The column's potential energy less that of the column that still water would leave here.
            let (eta, ground) = (h + z - level, (z - level).max(0.0));
            potential += eta * eta - ground * ground;
            if h <= 0.0 {
                continue;
            }
            let (qx, qz) = (fields.qx[k].to_f64(), fields.qz[k].to_f64());
            let square = qx * qx + qz * qz;
            sum.mass += h;
            sum.momentum[0] += qx;
            sum.momentum[1] += qz;
            kinetic += square / h;
            if h > film {
                sum.froude = sum.froude.max(square / (h * h * h));
            }
        }
        sum.energy = 0.5 * (kinetic + GRAVITY * potential);
        sum
    };
    let sum = reduce::fold_blocks(layout.nz, row, |a, b| Totals {
        mass: a.mass + b.mass,
        momentum: [a.momentum[0] + b.momentum[0], a.momentum[1] + b.momentum[1]],
        energy: a.energy + b.energy,
        froude: a.froude.max(b.froude),
    })
    .unwrap_or_default();
    let weight = DENSITY * cell_area;
    Totals {
        mass: weight * sum.mass,
        momentum: sum.momentum.map(|q| weight * q),
        energy: weight * sum.energy,
        froude: (sum.froude / GRAVITY).sqrt(),
    }
}
