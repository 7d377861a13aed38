//! The new state: fluxes, bed force, friction, and a look at what came of it.

use super::{Cells, Constants, Faces};
use crate::shallow_water::real::Real;

/// Bits that [`update`] returns.
pub(crate) mod flag {
    /// Some cell changed or carries momentum.
    pub(crate) const ALIVE: u32 = 1;
    /// Some depth passed the limit of the quantum.
    pub(crate) const DEEP: u32 = 2;
    /// Some value is not finite or beyond its limit.
    pub(crate) const BROKEN: u32 = 4;
}

/// The state of one row, or the place for it.
pub(crate) struct State<'a, T> {
    pub(crate) h: &'a [T],
    pub(crate) qx: &'a [T],
    pub(crate) qz: &'a [T],
}

/// Adds the fluxes and the bed force to one row: cells 3 .. n − 3 of the views go to `h`, `qx`, `qz`.
#[inline(always)]
#[expect(
    clippy::too_many_arguments,
    reason = "outputs must be separate references for the loop to vectorise"
)]
pub(crate) fn update<T: Real>(
    k: &Constants<T>,
    old: State<'_, T>,
    cells: &Cells<T>,
    x: &Faces<T>,
    z: (&Faces<T>, &Faces<T>),
    h: &mut [T],
    qx: &mut [T],
    qz: &mut [T],
) -> u32 {
    let m = h.len();
    let (qx, qz) = (&mut qx[..m], &mut qz[..m]);
    let (h0, qx0, qz0) = (&old.h[3..m + 3], &old.qx[3..m + 3], &old.qz[3..m + 3]);
    let (hc, xe, ze) = (&cells.h[3..m + 3], &cells.x.e[3..m + 3], &cells.z.e[3..m + 3]);
    let (wm, em) = (&x.mass[2..m + 2], &x.mass[3..m + 3]);
    let (wp, ep) = (&x.behind[2..m + 2], &x.before[3..m + 3]);
    let (wa, ea) = (&x.across[2..m + 2], &x.across[3..m + 3]);
    let (fm, lm) = (&z.0.mass[3..m + 3], &z.1.mass[3..m + 3]);
    let (fp, lp) = (&z.0.behind[3..m + 3], &z.1.before[3..m + 3]);
    let (fa, la) = (&z.0.across[3..m + 3], &z.1.across[3..m + 3]);
    let two_g = k.gravity + k.gravity;
    for c in 0..m {
        // ½ g (h₊ + h₋)(η₊ − η₋): the bed force and the cell's own pressure in one, exactly 0 under a level surface.
        let slope_x = two_g * hc[c] * xe[c];
        let slope_z = two_g * hc[c] * ze[c];
        h[c] = (h0[c] + (wm[c] - em[c])) + (fm[c] - lm[c]);
        qx[c] = qx0[c] + k.lambda * ((wp[c] - ep[c]) - slope_x + (fa[c] - la[c]));
        qz[c] = qz0[c] + k.lambda * ((fp[c] - lp[c]) - slope_z + (wa[c] - ea[c]));
    }
    finish(k, (h0, qx0, qz0), h, qx, qz)
}

/// What follows the fluxes in a row: films settle, friction acts, and the new state is looked at; bits of [`flag`].
#[inline(always)]
pub(crate) fn finish<T: Real>(
    k: &Constants<T>,
    old: (&[T], &[T], &[T]),
    h: &[T],
    qx: &mut [T],
    qz: &mut [T],
) -> u32 {
    let mut thin = 0_u32;
    for c in 0..h.len() {
        thin |= u32::from(h[c] < k.film);
    }
    if thin != 0 {
        settle_films(k, h, qx, qz);
    }
    if k.friction > T::ZERO {
        rub(k, h, qx, qz);
    }
    inspect(k, old, (h, qx, qz))
}

/// What a row's update found, as bits of [`flag`].
#[inline(always)]
pub(crate) fn inspect<T: Real>(k: &Constants<T>, old: (&[T], &[T], &[T]), new: (&[T], &[T], &[T])) -> u32 {
    let m = new.0.len();
    let (h0, qx0, qz0) = (&old.0[..m], &old.1[..m], &old.2[..m]);
    let (h, qx, qz) = (&new.0[..m], &new.1[..m], &new.2[..m]);
    let (mut alive, mut deep, mut broken) = (0_u32, 0_u32, 0_u32);
    for c in 0..m {
        let motion = (qx[c].abs() + qz[c].abs()) + (qx0[c].abs() + qz0[c].abs());
        alive |= u32::from(motion + (h[c] - h0[c]).abs() > T::ZERO);
        deep |= u32::from(h[c] >= k.depth_limit);
        // Written so that NaN counts as broken.
        broken |= u32::from(!(motion < k.momentum_limit)) | u32::from(!(h[c] >= T::ZERO));
    }
    (alive * flag::ALIVE) | (deep * flag::DEEP) | (broken * flag::BROKEN)
}

/// Momentum of films made consistent with their faded velocity; none where it is dry.
#[inline(always)]
fn settle_films<T: Real>(k: &Constants<T>, h: &[T], qx: &mut [T], qz: &mut [T]) {
    let m = h.len();
    let (qx, qz) = (&mut qx[..m], &mut qz[..m]);
    for c in 0..m {
        let film = h[c].larger(k.film);
        let square = h[c] * h[c];
        let factor = (square + square) / (square + film * film);
        let factor = if h[c] > k.dry { factor } else { T::ZERO };
        qx[c] = qx[c] * factor;
        qz[c] = qz[c] * factor;
    }
}

/// Manning's friction, implicit and solved exactly: |q| (1 + K|q|) = |q*| with K = g n² Δt / h^(7/3).
#[inline(always)]
pub(crate) fn rub<T: Real>(k: &Constants<T>, h: &[T], qx: &mut [T], qz: &mut [T]) {
    let m = h.len();
    let (qx, qz) = (&mut qx[..m], &mut qz[..m]);
    for c in 0..m {
        let depth = h[c].larger(k.dry);
        let inverse = T::ONE / depth;
        let size = (qx[c] * qx[c] + qz[c] * qz[c]).sqrt();
        let rate = k.friction * inverse * inverse * depth.inverse_cube_root();
        let factor = T::TWO / (T::ONE + (T::ONE + T::FOUR * rate * size).sqrt());
        qx[c] = qx[c] * factor;
        qz[c] = qz[c] * factor;
    }
}
