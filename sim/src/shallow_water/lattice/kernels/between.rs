//! What two neighbouring rows give each other.

use super::{Constants, Star, surface};
use crate::shallow_water::real::Real;

/// What goes between a row and the next: populations as they arrive, with the surface terms of their links, and depths
/// that cross. All in metres; entries are those of the columns.
#[derive(Clone)]
pub(in super::super) struct Between<T> {
    /// In the next row: +Z, +X+Z and −X+Z.
    pub(in super::super) up: [Vec<T>; 3],
    /// In the row: −Z, −X−Z and +X−Z.
    pub(in super::super) down: [Vec<T>; 3],
    /// Depth that crosses the face to the next row, a multiple of the quantum.
    pub(in super::super) face: Vec<T>,
    /// What the two diagonals between this column and the next contribute to the face to +X, in either row.
    pub(super) turn: Vec<T>,
}

impl<T: Real> Between<T> {
    /// For rows of `n` cells.
    pub(in super::super) fn new(n: usize) -> Self {
        let row = || vec![T::ZERO; n];
        Self {
            up: [row(), row(), row()],
            down: [row(), row(), row()],
            face: row(),
            turn: row(),
        }
    }
}

/// Fills `m` columns of `out` from column `first` (`turn` from the one before), which views must surround by one cell. Rows are
/// depths and beds.
///
/// Half of a diagonal link goes through each of the corners beside it.
#[inline(always)]
pub(in super::super) fn between<T: Real>(
    k: &Constants<T>,
    first: usize,
    m: usize,
    rows: [(&[T], &[T]); 2],
    [f, g]: [&Star<T>; 2],
    out: &mut Between<T>,
) {
    let [(hr, zr), (hn, zn)] = rows;
    let diagonal = T::QUARTER * k.sixth;
    let half = |x: T| T::HALF * x;
    let (hw, h, he) = (
        &hr[first - 1..first - 1 + m],
        &hr[first..first + m],
        &hr[first + 1..=first + m],
    );
    let (zw, z, ze) = (
        &zr[first - 1..first - 1 + m],
        &zr[first..first + m],
        &zr[first + 1..=first + m],
    );
    let (nhw, nh, nhe) = (
        &hn[first - 1..first - 1 + m],
        &hn[first..first + m],
        &hn[first + 1..=first + m],
    );
    let (nzw, nz, nze) = (
        &zn[first - 1..first - 1 + m],
        &zn[first..first + m],
        &zn[first + 1..=first + m],
    );
    let (f, g) = (&f.0, &g.0);
    let (f2, f4w, f4) = (
        &f[2][first..first + m],
        &f[4][first - 1..first - 1 + m],
        &f[4][first..first + m],
    );
    let (f7, f7e) = (&f[7][first..first + m], &f[7][first + 1..=first + m]);
    let (g3, g5, g5e) = (
        &g[3][first..first + m],
        &g[5][first..first + m],
        &g[5][first + 1..=first + m],
    );
    let (g6w, g6) = (&g[6][first - 1..first - 1 + m], &g[6][first..first + m]);
    // The square before the first column.
    let square = {
        let s2 = surface(diagonal, (hw[0], zw[0]), (nh[0], nz[0]));
        let s3 = surface(diagonal, (h[0], z[0]), (nhw[0], nzw[0]));
        half((f4w[0] - g5[0]) - s2) - half((f7[0] - g6w[0]) - s3)
    };
    out.turn[first - 1] = square;
    let [u0, u1, u2] = out.up.each_mut().map(|x| &mut x[first..first + m]);
    let [d0, d1, d2] = out.down.each_mut().map(|x| &mut x[first..first + m]);
    let (face, turn) = (&mut out.face[first..first + m], &mut out.turn[first..first + m]);
    for c in 0..m {
        let (aw, a, ae) = ((hw[c], zw[c]), (h[c], z[c]), (he[c], ze[c]));
        let (bw, b, be) = ((nhw[c], nzw[c]), (nh[c], nz[c]), (nhe[c], nze[c]));
        let s1 = surface(k.sixth, a, b);
        // Links to +X+Z from this column and the one before, to −X+Z from the next and this one.
        let (s2, s2w) = (surface(diagonal, a, be), surface(diagonal, aw, b));
        let (s3, s3w) = (surface(diagonal, ae, b), surface(diagonal, a, bw));
        u0[c] = f2[c] - s1;
        u1[c] = f4w[c] - s2w;
        u2[c] = f7e[c] - s3;
        d0[c] = g3[c] + s1;
        d1[c] = g5e[c] + s2;
        d2[c] = g6w[c] + s3w;
        let (l2, l2w) = (half((f4[c] - g5e[c]) - s2), half((f4w[c] - g5[c]) - s2w));
        let (l3, l3w) = (half((f7e[c] - g6[c]) - s3), half((f7[c] - g6w[c]) - s3w));
        face[c] = k.round(((f2[c] - g3[c]) - s1) + ((l2 + l3) + (l2w + l3w)));
        turn[c] = l2 - l3;
    }
}
