//! Mixing of momentum by eddies smaller than a cell (Smagorinsky 1963, doi:10.1175/1520-0493(1963)091<0099:GCEWTP>2.3.CO;2).
//!
//! The stress between two cells is h ν (∇u + ∇uᵀ) with the eddy viscosity ν = (C Δx)² |S|, |S|² = 2 S : S, and the depth
//! of the water that both share, so nothing drags on a step of the bed or on a shore. It acts on the momentum between
//! the steps of any scheme, and is explicit: C²|S|Δt ≤ ⅙ keeps it from overshooting, and since no signal crosses half a
//! cell in a step, |S|Δt stays below 2√2 and C = 0.2 is safe.

use super::finite_volume::{FiniteVolume, part};
use super::real::Real;
use super::storage::{GHOSTS, Layout};
use rayon::prelude::*;

/// The mixing of one solver.
#[derive(Clone, Debug)]
pub(crate) struct Eddies<T> {
    /// C², without unit.
    square: f64,
    /// Velocities along X and Z in padded arrays, m/s.
    velocity: [Vec<T>; 2],
}

impl<T: Real> Eddies<T> {
    /// With Smagorinsky's constant C.
    pub(super) fn new(constant: f64, layout: Layout) -> Self {
        Self {
            square: constant * constant,
            velocity: std::array::from_fn(|_| vec![T::ZERO; layout.len()]),
        }
    }

    /// Bytes held.
    pub(super) fn bytes(&self) -> usize {
        self.velocity.iter().map(|v| size_of_val(&v[..])).sum()
    }
}

/// A cell as the stresses see it.
#[derive(Clone, Copy)]
struct Cell<T> {
    h: T,
    z: T,
    u: T,
    v: T,
}

/// What cells are read from.
struct Water<'a, T> {
    layout: Layout,
    wraps: [bool; 2],
    dry: T,
    /// C² Δt/Δx.
    strength: T,
    h: &'a [T],
    z: &'a [T],
    u: &'a [T],
    v: &'a [T],
}

impl<T: Real> Water<'_, T> {
    /// The number beside `k` of `count`; itself at an edge without a neighbour.
    fn beside(k: usize, forth: bool, count: usize, wraps: bool) -> usize {
        match (forth, wraps) {
            (true, _) if k + 1 < count => k + 1,
            (true, true) => 0,
            (false, _) if k > 0 => k - 1,
            (false, true) => count - 1,
            _ => k,
        }
    }

    fn cell(&self, i: usize, j: usize) -> Cell<T> {
        let k = self.layout.at(i, j);
        Cell {
            h: self.h[k],
            z: self.z[k],
            u: self.u[k],
            v: self.v[k],
        }
    }

    /// Velocity of a cell, or of `own` where it is dry.
    fn velocity(&self, of: Cell<T>, own: Cell<T>) -> (T, T) {
        if of.h > self.dry {
            (of.u, of.v)
        } else {
            (own.u, own.v)
        }
    }

    /// Change of the momentum of cell `(i, j)` in the step, m²/s.
    fn change(&self, i: usize, j: usize) -> [T; 2] {
        let Layout { nx, nz, .. } = self.layout;
        let here = self.cell(i, j);
        let mut change = [T::ZERO; 2];
        if !(here.h > self.dry) {
            return change;
        }
        let columns = [false, true].map(|forth| Self::beside(i, forth, nx, self.wraps[0]));
        let rows = [false, true].map(|forth| Self::beside(j, forth, nz, self.wraps[1]));
        for forth in [false, true] {
            let n = usize::from(forth);
            if columns[n] != i {
                let there = self.cell(columns[n], j);
                let sides = rows.map(|j| [self.cell(i, j), self.cell(columns[n], j)]);
                let (normal, across) = self.stress(here, there, sides, forth, false);
                (change[0], change[1]) = (change[0] + normal, change[1] + across);
            }
            if rows[n] != j {
                let there = self.cell(i, rows[n]);
                let sides = columns.map(|i| [self.cell(i, j), self.cell(i, rows[n])]);
                let (normal, across) = self.stress(here, there, sides, forth, true);
                (change[0], change[1]) = (change[0] + across, change[1] + normal);
            }
        }
        change
    }

    /// What the face between two cells does to the momentum of `here`, normal to it and along it. `sides` are the pairs
    /// of cells beside both on either side; `along_z` says that the normal is Z.
    fn stress(
        &self,
        here: Cell<T>,
        there: Cell<T>,
        sides: [[Cell<T>; 2]; 2],
        forth: bool,
        along_z: bool,
    ) -> (T, T) {
        let shared = (here.h + here.z).smaller(there.h + there.z) - here.z.larger(there.z);
        if !(shared > self.dry && there.h > self.dry) {
            return (T::ZERO, T::ZERO);
        }
        // Components normal to the face and along it.
        let turned = |(u, v): (T, T)| if along_z { (v, u) } else { (u, v) };
        let sign = if forth { T::ONE } else { -T::ONE };
        let (own, other) = (turned((here.u, here.v)), turned((there.u, there.v)));
        let side = |pair: [Cell<T>; 2]| {
            let (a, b) = (
                turned(self.velocity(pair[0], here)),
                turned(self.velocity(pair[1], there)),
            );
            (a.0 + b.0, a.1 + b.1)
        };
        let (before, behind) = (side(sides[0]), side(sides[1]));
        // Differences over one cell.
        let (nn, an) = (sign * (other.0 - own.0), sign * (other.1 - own.1));
        let (na, aa) = (
            T::QUARTER * (behind.0 - before.0),
            T::QUARTER * (behind.1 - before.1),
        );
        let shear = na + an;
        let size = (T::TWO * (nn * nn + aa * aa) + shear * shear).sqrt();
        let stress = sign * (self.strength * shared * size);
        (stress * (nn + nn), stress * shear)
    }
}

impl<T: Real> FiniteVolume<T> {
    /// Mixes the momentum of neighbouring cells for `dt` seconds, if eddies were asked for.
    pub(crate) fn mix_eddies(&mut self, dt: f64) {
        let Some(mut eddies) = self.eddies.take() else {
            return;
        };
        let layout = self.layout;
        let film = T::from_f64(self.film());
        let awake = self.awake_rows();
        let now = &mut self.now;
        let [u, v] = &mut eddies.velocity;
        let stride = layout.stride;
        u.par_chunks_mut(stride)
            .zip(v.par_chunks_mut(stride))
            .enumerate()
            .for_each(|(r, (u, v))| {
                let at = r * stride..(r + 1) * stride;
                let (h, qx, qz) = (&now.h[at.clone()], &now.qx[at.clone()], &now.qz[at]);
                for c in 0..stride {
                    let thick = h[c].larger(film);
                    let inverse = (h[c] + h[c]) / (h[c] * h[c] + thick * thick);
                    (u[c], v[c]) = (qx[c] * inverse, qz[c] * inverse);
                }
            });
        let water = Water {
            layout,
            wraps: self.boundary.wraps(),
            dry: film,
            strength: T::from_f64(eddies.square * dt / self.spacing),
            h: &now.h,
            z: &self.bed,
            u,
            v,
        };
        let interior = layout.interior();
        now.qx[interior.clone()]
            .par_chunks_mut(stride)
            .zip(now.qz[interior].par_chunks_mut(stride))
            .enumerate()
            .filter(|(j, _)| awake[*j])
            .for_each(|(j, (qx, qz))| {
                for i in 0..layout.nx {
                    let at = GHOSTS + i;
                    let change = water.change(i, j);
                    qx[at] += change[0];
                    qz[at] += change[1];
                }
            });
        self.touched = true;
        self.eddies = Some(eddies);
    }

    /// Whether any tile on each row is awake.
    fn awake_rows(&self) -> Vec<bool> {
        let bands = self.tiles.len() / self.tiles_x;
        let mut awake = vec![false; self.layout.nz];
        for (band, tiles) in self.tiles.chunks(self.tiles_x).enumerate() {
            let rows = part(self.layout.nz, bands, band)..part(self.layout.nz, bands, band + 1);
            awake[rows].fill(tiles.iter().any(|tile| tile.awake));
        }
        awake
    }
}
