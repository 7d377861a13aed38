//! Volume, momentum and energy of a state.

use super::kick::Synchronised;
use super::medium::Medium;
use super::state::State;
use crate::optics::WATER_DENSITY;
use crate::reduce;
use crate::scene::description::Edge;
use crate::solvers::GRAVITY;
use rayon::prelude::*;

/// Energies of a state in joules, relative to still water.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Energies {
    /// Kinetic plus potential energy, ½ρ∫(q²/depth + gη²), both at the time of the surface. The implicit scheme
    /// conserves it.
    pub physical: f64,
    /// The same with the product of the fluxes half a step before and after instead of the square in between: what
    /// leap-frog conserves exactly at a constant step without damping. It differs from `physical` by the order of
    /// (ω·step)².
    pub conserved: f64,
}

/// Totals of a state.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Totals {
    /// Volume above rest, m³.
    pub(super) volume: f64,
    /// kg m/s along X and Z.
    pub(super) momentum: [f64; 2],
    pub(super) energies: Energies,
}

/// Σ of some per-face or per-sample quantities of a row.
#[derive(Clone, Copy, Default)]
struct Sums {
    eta: f64,
    eta2: f64,
    qx: f64,
    qz: f64,
    /// q² over depth.
    kinetic: f64,
    /// The same with fluxes half a step apart.
    staggered: f64,
}

impl std::ops::Add for Sums {
    type Output = Self;
    fn add(self, o: Self) -> Self {
        Self {
            eta: self.eta + o.eta,
            eta2: self.eta2 + o.eta2,
            qx: self.qx + o.qx,
            qz: self.qz + o.qz,
            kinetic: self.kinetic + o.kinetic,
            staggered: self.staggered + o.staggered,
        }
    }
}

/// Volume above rest in m³.
pub(super) fn volume(medium: &Medium, state: &State) -> f64 {
    reduce::sum(state.eta.len(), |k| f64::from(state.eta[k])) * medium.spec.cell_area()
}

/// All totals.
pub(super) fn totals(medium: &Medium, state: &State) -> Totals {
    let h = medium.spec.height();
    let flux = Synchronised::new(medium, state);
    let mut rows = vec![Sums::default(); h];
    rows.par_iter_mut()
        .enumerate()
        .for_each_init(Vec::new, |scratch, (j, out)| {
            *out = row_sums(medium, state, &flux, j, scratch)
        });
    let s = reduce::reduce(h, Sums::default(), |j| rows[j], |a, b| a + b);
    let area = medium.spec.cell_area();
    let half = 0.5 * WATER_DENSITY * area;
    Totals {
        volume: s.eta * area,
        momentum: [WATER_DENSITY * area * s.qx, WATER_DENSITY * area * s.qz],
        energies: Energies {
            physical: half * (GRAVITY * s.eta2 + s.kinetic),
            conserved: half * (GRAVITY * s.eta2 + s.staggered),
        },
    }
}

/// Sums over row `j`, its faces along X, and the face row along Z before it (for the last row also the one after).
fn row_sums(
    medium: &Medium,
    state: &State,
    flux: &Synchronised<'_>,
    j: usize,
    scratch: &mut Vec<f32>,
) -> Sums {
    let (w, h) = (medium.spec.width(), medium.spec.height());
    let mut sums = Sums::default();
    for &eta in &state.eta[j * w..(j + 1) * w] {
        let eta = f64::from(eta);
        sums.eta += eta;
        sums.eta2 += eta * eta;
    }

    // Outermost faces count half: a wrapping one is stored twice, one of an open edge has half a cell behind it.
    let inverse = GRAVITY / f64::from(medium.spec.spacing);
    let edge_pull = |side: usize, k: usize| {
        if medium.edges[side] == Edge::Open {
            GRAVITY * f64::from(medium.depth[k]) / f64::from(medium.spec.spacing)
        } else {
            0.0
        }
    };
    flux.row_x(j, scratch);
    let at = j * (w + 1);
    let (mut q_sum, mut face) = (0.0, Faces::default());
    for (i, &q) in scratch.iter().enumerate() {
        let outer = i == 0 || i == w;
        let weight = if outer { 0.5 } else { 1.0 };
        let mut pull = f64::from(medium.pull_x[at + i]);
        if outer && !medium.wrap.x {
            pull = edge_pull(usize::from(i == w), j * w + i.min(w - 1));
        }
        q_sum += weight * f64::from(q);
        face.add(weight, state.qx[at + i], q, pull);
    }
    sums.qx = q_sum;

    let last = if j + 1 == h { h } else { j };
    let mut q_sum = 0.0;
    for row in j..=last {
        flux.row_z(row, scratch);
        let outer = row == 0 || row == h;
        let weight = if outer { 0.5 } else { 1.0 };
        for (i, &q) in scratch.iter().enumerate() {
            let mut pull = f64::from(medium.pull_z[row * w + i]);
            if outer && !medium.wrap.z {
                pull = edge_pull(2 + usize::from(row == h), j * w + i);
            }
            q_sum += weight * f64::from(q);
            face.add(weight, state.qz[row * w + i], q, pull);
        }
    }
    sums.qz = q_sum;
    sums.kinetic = inverse * face.kinetic;
    sums.staggered = inverse * face.staggered;
    sums
}

/// Kinetic sums over faces, in units of flux² over pull.
#[derive(Default)]
struct Faces {
    kinetic: f64,
    staggered: f64,
}

impl Faces {
    /// A face with its flux half a step before the surface and at its time. `pull` is c² over the spacing.
    fn add(&mut self, weight: f64, before: f32, now: f32, pull: f64) {
        if pull > 0.0 {
            let (before, now) = (f64::from(before), f64::from(now));
            self.kinetic += weight * now * now / pull;
            self.staggered += weight * before * (2.0 * now - before) / pull;
        }
    }
}
