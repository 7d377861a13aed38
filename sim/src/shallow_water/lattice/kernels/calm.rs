//! Where the lattice is at home.

use super::{Cell, Constants, RowView, rise};
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

/// Whether the surface of no cell of a row differs too much from that of the next one, nor from that of the cell beside
/// it in `before`: what [`calm`] asks, but of links rather than of cells. Rows are depths and beds.
#[inline(always)]
pub(in super::super) fn level<T: Real>(k: &Constants<T>, before: (&[T], &[T]), row: (&[T], &[T])) -> bool {
    let m = row.0.len() - 1;
    let (h, he, hb) = (&row.0[..m], &row.0[1..=m], &before.0[..=m]);
    let (z, ze, zb) = (&row.1[..m], &row.1[1..=m], &before.1[..=m]);
    let fine = |a: Cell<T>, b: Cell<T>| rise(a, b).abs() <= k.jump * a.0.smaller(b.0);
    let mut rough = 0_u32;
    for c in 0..m {
        let here = (h[c], z[c]);
        rough |= u32::from(!(fine((hb[c], zb[c]), here) & fine(here, (he[c], ze[c]))));
    }
    (rough == 0) & fine((hb[m], zb[m]), (row.0[m], row.1[m]))
}
