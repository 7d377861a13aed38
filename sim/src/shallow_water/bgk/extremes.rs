//! What decides whether a step may be taken: the largest values of a state.

use super::kernels::{Constants, Lanes};
use crate::shallow_water::finite_volume::FiniteVolume;
use crate::shallow_water::real::Real;
use crate::shallow_water::storage::{Fields, Layout};
use crate::solvers::GRAVITY;
use rayon::prelude::*;

/// The largest values of a state. They do not depend on the order in which cells are looked at.
#[derive(Clone, Copy, Debug)]
pub(super) struct Largest {
    /// max(|u|, |v|) + √(g h) of the cells that take part, m/s.
    pub(super) signal: f64,
    /// Largest Froude number of these.
    pub(super) froude: f64,
    /// Smallest depth, m.
    pub(super) least: f64,
    /// Largest depth, m.
    pub(super) deepest: f64,
    /// Whether some value is not finite or beyond its limit.
    pub(super) broken: bool,
}

impl Largest {
    /// Of no cells.
    pub(super) const NOTHING: Self = Self {
        signal: 0.0,
        froude: 0.0,
        least: f64::INFINITY,
        deepest: 0.0,
        broken: false,
    };

    pub(super) fn of<T: Real>(lanes: &Lanes<T>) -> Self {
        let largest = |lanes: &[T]| lanes.iter().fold(0.0_f64, |a, x| a.max(x.to_f64()));
        Self {
            signal: largest(&lanes.signal),
            froude: (largest(&lanes.froude) / GRAVITY).sqrt(),
            least: lanes.least.iter().fold(f64::INFINITY, |a, x| a.min(x.to_f64())),
            deepest: largest(&lanes.deepest),
            broken: lanes.broken.iter().any(|b| *b != 0),
        }
    }

    pub(super) fn and(self, other: Self) -> Self {
        Self {
            signal: self.signal.max(other.signal),
            froude: self.froude.max(other.froude),
            least: self.least.min(other.least),
            deepest: self.deepest.max(other.deepest),
            broken: self.broken || other.broken,
        }
    }
}

/// The largest values of the present state, to the bits that a step finds of its new state.
pub(super) fn survey<T: Real>(k: &Constants<T>, water: &FiniteVolume<T>) -> Largest {
    let now = &water.now;
    let arch = pulp::Arch::new();
    (0..water.layout.nz)
        .into_par_iter()
        .map(|j| {
            let row = water.layout.row(j);
            let mut found = Lanes::new();
            arch.dispatch(|| {
                found.look_along(k, &now.h[row.clone()], &now.qx[row.clone()], &now.qz[row.clone()])
            });
            Largest::of(&found)
        })
        .reduce(|| Largest::NOTHING, Largest::and)
}

/// Smallest depth in m and where it stands.
pub(super) fn shallowest<T: Real>(layout: Layout, fields: &Fields<T>) -> (f64, [usize; 2]) {
    let (depth, at) = most(layout, |k| -fields.h[k].to_f64());
    (-depth, at)
}

/// Largest Froude number of the cells deeper than `thin`, and where it stands.
pub(super) fn fastest<T: Real>(layout: Layout, fields: &Fields<T>, thin: f64) -> (f64, [usize; 2]) {
    most(layout, |k| {
        let h = fields.h[k].to_f64();
        let speed = fields.qx[k].to_f64().hypot(fields.qz[k].to_f64()) / h;
        if h > thin {
            speed / (GRAVITY * h).sqrt()
        } else {
            0.0
        }
    })
}

/// The largest of values, and the first sample along X and Z that has it.
fn most(layout: Layout, value: impl Fn(usize) -> f64) -> (f64, [usize; 2]) {
    let mut found = (f64::NEG_INFINITY, [0, 0]);
    for j in 0..layout.nz {
        for (i, k) in layout.row(j).enumerate() {
            let value = value(k);
            if value > found.0 {
                found = (value, [i, j]);
            }
        }
    }
    found
}
