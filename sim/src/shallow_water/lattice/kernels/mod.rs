//! Collision and streaming of the six-moment lattice, one row at a time: [`collided`] makes the populations of a row,
//! [`between`] what two rows give each other, [`stream`] the new state of a row.
//!
//! Nine populations relax to the central-moment equilibrium of order three and four in every step, so depth, momentum
//! and the second central moments are all that is left of them (after Geier, Greiner & Korvink 2006,
//! doi:10.1103/PhysRevE.73.066705): six numbers a cell. Units: lengths in metres, velocities over the lattice speed
//! e = Δx/Δt, so that a population has the unit of a depth; g̃ = g/e², p = g̃h²/2. The equilibrium has k₂₀ = k₀₂ = p,
//! k₂₂ = p/3 and no other central moments: at rest it is that of Ojeda & Susín (2013, eq. 2), which the bed force on
//! links balances exactly.
//!
//! Populations are held beyond rest, φᵢ = fᵢ − λᵢ g̃h²/6 (λ = 1 along the axes, ¼ along diagonals). The bed force on a
//! link and the difference of the rest parts of its ends then make one term S = λ (g̃/6)(h + h')(η' − η), which is
//! exactly 0 under a level surface. A link from x to x' moves the depth φᵢ − φ'ᵢ' − S.

mod between;
mod calm;
mod collide;
mod stream;

pub(super) use between::{Between, between};
pub(super) use calm::{calm, level};
pub(super) use collide::collided;
pub(super) use stream::{Found, New, Old, Shear, Stage, faces_x, moves, stream, stream_moments};

use crate::shallow_water::real::Real;

/// Directions: +X, −X, +Z, −Z, then +X+Z, −X−Z, +X−Z, −X+Z; each stands beside its opposite.
pub(super) const DIRECTIONS: usize = 8;

/// What the kernels need to know besides the state.
#[derive(Clone, Copy, Debug)]
pub(super) struct Constants<T> {
    pub(super) gravity: T,
    /// Δt/Δx = 1/e, s/m.
    pub(super) lambda: T,
    /// e, m/s.
    pub(super) speed: T,
    /// g̃/2, 1/m.
    pub(super) half_gravity: T,
    /// g̃/6, 1/m.
    pub(super) sixth: T,
    /// From a stored moment, a stress over Δt, to one in metres.
    pub(super) unfold: T,
    /// The share of a sum and of a difference of normal moments that collision leaves, and of the mixed one, with the
    /// way back to stored moments.
    pub(super) keep: Keep<T>,
    /// The same with the share over ω that a known stress leaves.
    pub(super) guess: Keep<T>,
    /// Half of what multiplies |u|²/(g h) in the damping of moving water.
    pub(super) sluggish: T,
    /// Adding and subtracting this rounds to a multiple of the quantum.
    pub(super) rounder: T,
    /// Depth up to which a cell is thin, m.
    pub(super) thin: T,
    /// Largest |u|²/(g h) of a slow cell.
    pub(super) froude: T,
    /// Largest step of the surface beside a calm cell, in depths.
    pub(super) jump: T,
}

/// What collision leaves of the second moments beyond equilibrium.
#[derive(Clone, Copy, Debug)]
pub(super) struct Keep<T> {
    /// Of a normal moment, of itself.
    pub(super) own: T,
    /// Of a normal moment, of the other one.
    pub(super) other: T,
    /// Of the mixed moment.
    pub(super) mixed: T,
}

impl<T: Real> Constants<T> {
    #[inline(always)]
    pub(super) fn round(&self, x: T) -> T {
        (x + self.rounder) - self.rounder
    }
}

/// State of one row.
#[derive(Clone, Copy)]
pub(super) struct RowView<'a, T> {
    pub(super) h: &'a [T],
    pub(super) z: &'a [T],
    pub(super) qx: &'a [T],
    pub(super) qz: &'a [T],
    /// Second central moments beyond equilibrium after collision, over Δt: xx, zz, xz, m³/s³.
    pub(super) moments: [&'a [T]; 3],
}

/// Populations beyond rest of one row after collision, m.
#[derive(Clone)]
pub(super) struct Star<T>(pub(super) [Vec<T>; DIRECTIONS]);

impl<T: Real> Star<T> {
    /// For rows of `n` cells.
    pub(super) fn new(n: usize) -> Self {
        Self(std::array::from_fn(|_| vec![T::ZERO; n]))
    }
}

/// Depth and bed of a cell, m.
pub(super) type Cell<T> = (T, T);

/// By how much the surface of `b` stands higher than that of `a`, m.
#[inline(always)]
fn rise<T: Real>(a: Cell<T>, b: Cell<T>) -> T {
    (b.0 - a.0) + (b.1 - a.1)
}

/// The surface term S of a link from `a` to `b`; `weight` is λ g̃/6.
#[inline(always)]
pub(super) fn surface<T: Real>(weight: T, a: Cell<T>, b: Cell<T>) -> T {
    weight * (a.0 + b.0) * rise(a, b)
}
