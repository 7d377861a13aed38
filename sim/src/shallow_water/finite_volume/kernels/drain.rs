//! Draining: no cell gives more water than it has.

use super::{Constants, Faces, Row};
use crate::shallow_water::real::Real;

/// The share of its outgoing fluxes that each cell of a row can pay for with the water it has; says whether any cell
/// cannot pay all (Bollermann, Noelle & Lukáčová 2011, doi:10.4208/cicp.220210.020710a, the draining time).
#[inline(always)]
pub(crate) fn shares<T: Real>(
    k: &Constants<T>,
    h: &[T],
    x: &Faces<T>,
    z: (&Faces<T>, &Faces<T>),
    out: &mut Row<T>,
) -> bool {
    let n = h.len();
    let m = n - 4;
    // Cells 2 ..= m + 1, whose four faces are all known.
    let h = &h[2..m + 2];
    let (west, east) = (&x.mass[1..=m], &x.mass[2..m + 2]);
    let (first, last) = (&z.0.mass[2..m + 2], &z.1.mass[2..m + 2]);
    let out = &mut out[2..m + 2];
    let mut short = 0_u32;
    for c in 0..m {
        let need = (T::ZERO.larger(-west[c]) + T::ZERO.larger(east[c]))
            + (T::ZERO.larger(-first[c]) + T::ZERO.larger(last[c]));
        short |= u32::from(need > h[c]);
        out[c] = need;
    }
    if short == 0 {
        return false;
    }
    for c in 0..m {
        let need = out[c];
        // Rounding the shares may add half a quantum at each of four faces.
        let spare = (h[c] - T::TWO * k.quantum).larger(T::ZERO);
        out[c] = if need > h[c] { spare / need } else { T::ONE };
    }
    true
}

/// Scales the faces along X of a row by the share of the cell that the water leaves.
#[inline(always)]
pub(crate) fn drain_x<T: Real>(k: &Constants<T>, n: usize, share: &Row<T>, faces: &mut Faces<T>) {
    let m = n - 5;
    drain(k, &share[2..m + 2], &share[3..m + 3], faces, 2, m);
}

/// Scales the faces along Z between two rows by the share of the cell that the water leaves.
#[inline(always)]
pub(crate) fn drain_z<T: Real>(k: &Constants<T>, n: usize, share: (&Row<T>, &Row<T>), faces: &mut Faces<T>) {
    let m = n - 4;
    drain(k, &share.0[2..m + 2], &share.1[2..m + 2], faces, 2, m);
}

#[inline(always)]
fn drain<T: Real>(k: &Constants<T>, left: &[T], right: &[T], faces: &mut Faces<T>, start: usize, m: usize) {
    let (mass, across) = (
        &mut faces.mass[start..start + m],
        &mut faces.across[start..start + m],
    );
    let (before, behind) = (
        &mut faces.before[start..start + m],
        &mut faces.behind[start..start + m],
    );
    for c in 0..m {
        let share = if mass[c] > T::ZERO { left[c] } else { right[c] };
        let all = share >= T::ONE;
        mass[c] = if all { mass[c] } else { k.round(mass[c] * share) };
        across[c] = across[c] * share;
        before[c] = before[c] * share;
        behind[c] = behind[c] * share;
    }
}
