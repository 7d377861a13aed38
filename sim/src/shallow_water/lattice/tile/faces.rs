//! The lattice's faces amid finite volumes.
//!
//! Each diagonal link goes by halves through both corners; as the corner cell sees it, less its own pressure, it has the
//! surface terms to both ends.

use crate::shallow_water::chunks::{in_chunks, of};
use crate::shallow_water::finite_volume::kernels::{LANES, Row};
use crate::shallow_water::lattice::kernels::{Cell, Constants, RowView, Star, surface};
use crate::shallow_water::real::Real;

/// Which faces of a row, to +X and to +Z, are the lattice's, and what goes through those.
#[derive(Clone)]
pub(super) struct Mixed<T> {
    pub(super) x: LatticeFaces<T>,
    pub(super) z: LatticeFaces<T>,
}

/// Faces of the lattice along one axis; fluxes of momentum in m³/s² less the pressure of the cell that sees them.
#[derive(Clone)]
pub(super) struct LatticeFaces<T> {
    /// 1 where the face is the lattice's.
    pub(super) on: Row<T>,
    pub(super) mass: Row<T>,
    pub(super) before: Row<T>,
    pub(super) behind: Row<T>,
    /// Of transverse momentum, which the bed of the corners beside the face makes different for the two cells.
    pub(super) across_before: Row<T>,
    pub(super) across_behind: Row<T>,
}

impl<T: Real> LatticeFaces<T> {
    const ZERO: Self = Self {
        on: [T::ZERO; LANES],
        mass: [T::ZERO; LANES],
        before: [T::ZERO; LANES],
        behind: [T::ZERO; LANES],
        across_before: [T::ZERO; LANES],
        across_behind: [T::ZERO; LANES],
    };
}

impl<T: Real> Mixed<T> {
    pub(super) const ZERO: Self = Self {
        x: LatticeFaces::ZERO,
        z: LatticeFaces::ZERO,
    };
}

/// The six cells around a face: before and behind it, each with its neighbours to both sides along the face.
struct Around<T> {
    before: [Cell<T>; 3],
    behind: [Cell<T>; 3],
}

/// Sums of the two populations that meet on each link through a face.
struct Meeting<T> {
    axis: T,
    /// On the diagonals from the cell before to both sides behind: to the first side and to the last.
    from: [T; 2],
    /// On those from both sides before to the cell behind.
    to: [T; 2],
}

/// Fluxes of momentum over e²: normal before and behind, across before and behind.
#[inline(always)]
fn fluxes<T: Real>(k: &Constants<T>, cells: &Around<T>, meeting: &Meeting<T>) -> [T; 4] {
    let diagonal = T::QUARTER * k.sixth;
    let s = |a, b| surface(diagonal, a, b);
    let ([lb, l, lf], [rb, r, rf]) = (cells.before, cells.behind);
    let Meeting { axis, from, to } = *meeting;
    let step = surface(k.sixth, l, r);
    // As the cell before sees them: it is the end of the first two and the corner of the others.
    let (lr, l_lb, l_lf) = (s(l, r), s(l, lb), s(l, lf));
    let seen = [
        from[0] + s(l, rb),
        from[1] + s(l, rf),
        to[0] + (l_lb + lr),
        to[1] + (l_lf + lr),
    ];
    let before = (axis + step) + T::HALF * ((seen[0] + seen[1]) + (seen[2] + seen[3]));
    let across_before = T::HALF * ((seen[1] - seen[0]) + (seen[2] - seen[3]));
    // As the cell behind sees them.
    let (rl, r_rb, r_rf) = (s(r, l), s(r, rb), s(r, rf));
    let seen = [
        from[0] + (r_rb + rl),
        from[1] + (r_rf + rl),
        to[0] + s(r, lb),
        to[1] + s(r, lf),
    ];
    let behind = (axis - step) + T::HALF * ((seen[0] + seen[1]) + (seen[2] + seen[3]));
    let across_behind = T::HALF * ((seen[1] - seen[0]) + (seen[2] - seen[3]));
    [before, behind, across_before, across_behind]
}

/// `N` faces of a row from column `first`: which are the lattice's, those all of whose cells are `calm`, and what goes
/// through them. Where a face is not, what stands in the other arrays is never read.
#[inline(always)]
fn set<T: Real, const N: usize>(
    k: &Constants<T>,
    first: usize,
    calm: [&[T; N]; 6],
    mass: &[T; N],
    of: impl Fn(usize) -> (Around<T>, Meeting<T>),
    out: &mut LatticeFaces<T>,
) {
    let (mut on, mut flux) = ([T::ZERO; N], [[T::ZERO; N]; 4]);
    let scale = k.speed * k.speed;
    for c in 0..N {
        on[c] = calm[0][c] * calm[1][c] * calm[2][c] * calm[3][c] * calm[4][c] * calm[5][c];
        let (cells, meeting) = of(c);
        let fluxes = fluxes(k, &cells, &meeting);
        for (flux, value) in flux.iter_mut().zip(fluxes) {
            flux[c] = scale * value;
        }
    }
    let columns = first..first + N;
    out.on[columns.clone()].copy_from_slice(&on);
    out.mass[columns.clone()].copy_from_slice(mass);
    let [before, behind, across_before, across_behind] = &flux;
    out.before[columns.clone()].copy_from_slice(before);
    out.behind[columns.clone()].copy_from_slice(behind);
    out.across_before[columns.clone()].copy_from_slice(across_before);
    out.across_behind[columns].copy_from_slice(across_behind);
}

/// Depths and beds of `N` cells of a row.
#[inline(always)]
fn cells<'a, T, const N: usize>(row: &RowView<'a, T>, first: usize) -> (&'a [T; N], &'a [T; N]) {
    (of(row.h, first), of(row.z, first))
}

#[inline(always)]
fn cell<T: Real, const N: usize>((h, z): (&[T; N], &[T; N]), c: usize) -> Cell<T> {
    (h[c], z[c])
}

/// The faces to +X of the middle row.
#[inline(always)]
pub(super) fn along_x<T: Real>(
    k: &Constants<T>,
    n: usize,
    rows: [RowView<'_, T>; 3],
    stars: [&Star<T>; 3],
    mass: &Row<T>,
    calm: [&Row<T>; 3],
    out: &mut LatticeFaces<T>,
) {
    in_chunks!(1..n - 2, along_x_chunk(k, rows, stars, mass, calm, out));
}

#[inline(always)]
fn along_x_chunk<T: Real, const N: usize>(
    first: usize,
    k: &Constants<T>,
    rows: [RowView<'_, T>; 3],
    [fb, f, ff]: [&Star<T>; 3],
    mass: &Row<T>,
    calm: [&Row<T>; 3],
    out: &mut LatticeFaces<T>,
) {
    let next = first + 1;
    let [a, b, c] = calm.map(|row| of::<T, N>(row, first));
    let [d, e, g] = calm.map(|row| of::<T, N>(row, next));
    let before = rows.each_ref().map(|row| cells::<T, N>(row, first));
    let behind = rows.each_ref().map(|row| cells::<T, N>(row, next));
    let [f0, f4, f6] = [0, 4, 6].map(|i| of::<T, N>(&f.0[i], first));
    let [f1, f5, f7] = [1, 5, 7].map(|i| of::<T, N>(&f.0[i], next));
    let (fb4, fb7) = (of::<T, N>(&fb.0[4], first), of::<T, N>(&fb.0[7], next));
    let (ff6, ff5) = (of::<T, N>(&ff.0[6], first), of::<T, N>(&ff.0[5], next));
    let face = |c: usize| {
        let around = Around {
            before: before.map(|row| cell(row, c)),
            behind: behind.map(|row| cell(row, c)),
        };
        let meeting = Meeting {
            axis: f0[c] + f1[c],
            from: [f6[c] + fb7[c], f4[c] + ff5[c]],
            to: [fb4[c] + f5[c], ff6[c] + f7[c]],
        };
        (around, meeting)
    };
    set(k, first, [a, b, c, d, e, g], of(mass, first), face, out);
}

/// The faces between two rows.
#[inline(always)]
pub(super) fn along_z<T: Real>(
    k: &Constants<T>,
    n: usize,
    rows: [RowView<'_, T>; 2],
    stars: [&Star<T>; 2],
    mass: &[T],
    calm: [&Row<T>; 2],
    out: &mut LatticeFaces<T>,
) {
    in_chunks!(1..n - 1, along_z_chunk(k, rows, stars, mass, calm, out));
}

#[inline(always)]
fn along_z_chunk<T: Real, const N: usize>(
    first: usize,
    k: &Constants<T>,
    rows: [RowView<'_, T>; 2],
    [f, g]: [&Star<T>; 2],
    mass: &[T],
    calm: [&Row<T>; 2],
    out: &mut LatticeFaces<T>,
) {
    // The column before, the column, the next.
    let three = [first - 1, first, first + 1];
    let [a, b, c] = three.map(|at| of::<T, N>(calm[0], at));
    let [d, e, h] = three.map(|at| of::<T, N>(calm[1], at));
    let before = three.map(|at| cells::<T, N>(&rows[0], at));
    let behind = three.map(|at| cells::<T, N>(&rows[1], at));
    let [f2, f7, f4] = [2, 7, 4].map(|i| of::<T, N>(&f.0[i], first));
    let (f4w, f7e) = (of::<T, N>(&f.0[4], first - 1), of::<T, N>(&f.0[7], first + 1));
    let [g3, g5, g6] = [3, 5, 6].map(|i| of::<T, N>(&g.0[i], first));
    let (g6w, g5e) = (of::<T, N>(&g.0[6], first - 1), of::<T, N>(&g.0[5], first + 1));
    let face = |c: usize| {
        let around = Around {
            before: before.map(|column| cell(column, c)),
            behind: behind.map(|column| cell(column, c)),
        };
        let meeting = Meeting {
            axis: f2[c] + g3[c],
            from: [f7[c] + g6w[c], f4[c] + g5e[c]],
            to: [f4w[c] + g5[c], f7e[c] + g6[c]],
        };
        (around, meeting)
    };
    set(k, first, [a, b, c, d, e, h], of(mass, first), face, out);
}
