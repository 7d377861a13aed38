//! One row of cells at a time: velocities, reconstruction, faces, draining, update.
//!
//! The scheme is MUSCL-Hancock (van Leer 1979; Toro, *Shock-Capturing Methods for Free-Surface Shallow Flows*, 2001,
//! §9.4) without directional splitting, over hydrostatically reconstructed beds (Audusse, Bouchut, Bristeau, Klein &
//! Perthame 2004, doi:10.1137/S1064827503431090, §2.3 and §5). Symbols: `h` depth, `z` bed, `η = h + z`, `(u, v)` velocity
//! along X and Z, `λ = Δt/Δx`.
//!
//! Heights enter only as differences between neighbours, so that a lake in a high valley costs no digits. All depths,
//! beds and mass fluxes are multiples of one quantum: their sums are exact, which makes water conserved to the last
//! bit and a lake at rest exactly still.

mod drain;
mod faces;
mod reconstruct;
mod update;

pub(crate) use drain::{drain_x, drain_z, shares};
pub(crate) use faces::{faces_x, faces_z};
pub(crate) use reconstruct::{reconstruct, rub_half};
pub(crate) use update::{State, finish, flag, rub, update};

use crate::shallow_water::real::Real;

/// Cells of a row that a tile can hold, its halo included.
pub(crate) const LANES: usize = 272;

/// One value for each cell of a tile's row.
pub(crate) type Row<T> = [T; LANES];

/// What the kernels need to know besides the state.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Constants<T> {
    /// Gravity, m/s².
    pub(crate) gravity: T,
    /// Δt/Δx, s/m.
    pub(crate) lambda: T,
    /// Adding and subtracting this rounds to a multiple of the quantum.
    pub(crate) rounder: T,
    /// The quantum of depth, m.
    pub(crate) quantum: T,
    /// Depth below which velocities fade, m.
    pub(crate) film: T,
    /// Depth up to which a cell counts as dry, m.
    pub(crate) dry: T,
    /// Depth from which the quantum is too fine, m.
    pub(crate) depth_limit: T,
    /// Momentum per area from which a run counts as unstable, m²/s.
    pub(crate) momentum_limit: T,
    /// g n² Δt for Manning's roughness n; 0 without friction.
    pub(crate) friction: T,
}

impl<T: Real> Constants<T> {
    #[inline(always)]
    pub(crate) fn round(&self, x: T) -> T {
        (x + self.rounder) - self.rounder
    }
}

/// Depth, bed and velocity of one row; all of one length.
#[derive(Clone, Copy)]
pub(crate) struct RowView<'a, T> {
    pub(crate) h: &'a [T],
    pub(crate) z: &'a [T],
    pub(crate) u: &'a [T],
    pub(crate) v: &'a [T],
}

/// Velocities of a row.
#[derive(Clone)]
pub(crate) struct Velocities<T> {
    pub(crate) u: Row<T>,
    pub(crate) v: Row<T>,
}

/// A row at the half step: the centre value of each quantity and half its difference across the cell.
#[derive(Clone)]
pub(crate) struct Cells<T> {
    pub(crate) h: Row<T>,
    pub(crate) u: Row<T>,
    pub(crate) v: Row<T>,
    /// Along X.
    pub(crate) x: Halves<T>,
    /// Along Z.
    pub(crate) z: Halves<T>,
}

/// Halves of the differences across each cell along one axis.
#[derive(Clone)]
pub(crate) struct Halves<T> {
    /// Of the surface.
    pub(crate) e: Row<T>,
    /// Of the bed.
    pub(crate) z: Row<T>,
    pub(crate) u: Row<T>,
    pub(crate) v: Row<T>,
}

/// Fluxes through a row of faces. Along X, entry `c` is the face between cells `c` and `c + 1`; along Z, the face
/// between cell `c` of this row and of the next.
#[derive(Clone)]
pub(crate) struct Faces<T> {
    /// Depth that crosses the face in the step, a multiple of the quantum, m.
    pub(crate) mass: Row<T>,
    /// Flux of normal momentum less the pressure of the cell before the face, m³/s².
    pub(crate) before: Row<T>,
    /// The same less the pressure of the cell behind the face.
    pub(crate) behind: Row<T>,
    /// Flux of transverse momentum, m³/s².
    pub(crate) across: Row<T>,
}

impl<T: Real> Velocities<T> {
    pub(crate) const ZERO: Self = Self {
        u: [T::ZERO; LANES],
        v: [T::ZERO; LANES],
    };
}

impl<T: Real> Halves<T> {
    const ZERO: Self = Self {
        e: [T::ZERO; LANES],
        z: [T::ZERO; LANES],
        u: [T::ZERO; LANES],
        v: [T::ZERO; LANES],
    };
}

impl<T: Real> Cells<T> {
    pub(crate) const ZERO: Self = Self {
        h: [T::ZERO; LANES],
        u: [T::ZERO; LANES],
        v: [T::ZERO; LANES],
        x: Halves::ZERO,
        z: Halves::ZERO,
    };
}

impl<T: Real> Faces<T> {
    pub(crate) const ZERO: Self = Self {
        mass: [T::ZERO; LANES],
        before: [T::ZERO; LANES],
        behind: [T::ZERO; LANES],
        across: [T::ZERO; LANES],
    };
}

/// u = q/h, fading to 0 in films (after Kurganov & Petrova 2007, eq. 2.17).
#[inline(always)]
pub(crate) fn velocities<T: Real>(k: &Constants<T>, h: &[T], qx: &[T], qz: &[T], out: &mut Velocities<T>) {
    let n = h.len();
    let (qx, qz) = (&qx[..n], &qz[..n]);
    let (u, v) = (&mut out.u[..n], &mut out.v[..n]);
    for c in 0..n {
        let film = h[c].larger(k.film);
        let inverse = (h[c] + h[c]) / (h[c] * h[c] + film * film);
        u[c] = qx[c] * inverse;
        v[c] = qz[c] * inverse;
    }
}
