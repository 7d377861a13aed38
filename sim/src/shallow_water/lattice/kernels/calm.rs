//! Where the lattice is at home.

use super::{Constants, RowView, rise};
use crate::shallow_water::finite_volume::kernels::Row;
use crate::shallow_water::real::Real;

/// 1 for the cells of a row in which the lattice is at home, deep, slow and without a jump of the surface beside them:
/// entries `1 .. n − 1`.
#[inline(always)]
pub(in super::super) fn calm<T: Real>(k: &Constants<T>, rows: [RowView<'_, T>; 3], out: &mut Row<T>) {
    let [before, here, behind] = rows;
    let n = here.h.len();
    let m = n - 2;
    let (hw, h, he) = (&here.h[..m], &here.h[1..=m], &here.h[2..n]);
    let (zw, z, ze) = (&here.z[..m], &here.z[1..=m], &here.z[2..n]);
    let (qx, qz) = (&here.qx[1..=m], &here.qz[1..=m]);
    let (hb, zb) = (&before.h[1..=m], &before.z[1..=m]);
    let (hf, zf) = (&behind.h[1..=m], &behind.z[1..=m]);
    let out = &mut out[1..=m];
    let limit = k.froude * k.gravity;
    for c in 0..m {
        let d = h[c];
        let rise = |h: T, y: T| ((h - d) + (y - z[c])).abs();
        let along_x = rise(hw[c], zw[c]).larger(rise(he[c], ze[c]));
        let along_z = rise(hb[c], zb[c]).larger(rise(hf[c], zf[c]));
        let square = qx[c] * qx[c] + qz[c] * qz[c];
        let fine = (d > k.thin) & (square <= limit * (d * d * d)) & (along_x.larger(along_z) <= k.jump * d);
        out[c] = if fine { T::ONE } else { T::ZERO };
    }
}

/// Whether any of the cells of a row is thin or fast, or its surface differs too much from that of the next cell:
/// what [`calm`] asks, but of links rather than of cells. Rows hold depth, bed and momentum.
#[inline(always)]
pub(in super::super) fn settled<T: Real>(k: &Constants<T>, h: &[T], z: &[T], qx: &[T], qz: &[T]) -> bool {
    let n = h.len();
    let (z, qx, qz) = (&z[..n], &qx[..n], &qz[..n]);
    let mut rough = 0_u32;
    let limit = k.froude * k.gravity;
    for c in 0..n {
        let d = h[c];
        let square = qx[c] * qx[c] + qz[c] * qz[c];
        rough |= u32::from(!((d > k.thin) & (square <= limit * (d * d * d))));
    }
    let m = n - 1;
    (rough == 0) & level_with(k, (&h[..m], &z[..m]), (&h[1..], &z[1..]))
}

/// Whether the surface of no cell of one row differs too much from that of the cell beside it in the other; rows of
/// depth and bed.
#[inline(always)]
pub(in super::super) fn level_with<T: Real>(k: &Constants<T>, a: (&[T], &[T]), b: (&[T], &[T])) -> bool {
    let n = a.0.len();
    let (ha, za, hb, zb) = (a.0, &a.1[..n], &b.0[..n], &b.1[..n]);
    let mut rough = 0_u32;
    for c in 0..n {
        let step = rise((ha[c], za[c]), (hb[c], zb[c])).abs();
        rough |= u32::from(!(step <= k.jump * ha[c].smaller(hb[c])));
    }
    rough == 0
}
