//! The lattice's faces amid finite volumes.
//!
//! Each diagonal link goes by halves through both corners; as the corner cell sees it, less its own pressure, it has the
//! surface terms to both ends.

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

impl<T: Real> LatticeFaces<T> {
    /// Face `c`, of the lattice if all `calm` are 1.
    #[inline(always)]
    fn set(
        &mut self,
        k: &Constants<T>,
        c: usize,
        calm: [T; 6],
        mass: T,
        of: impl FnOnce() -> (Around<T>, Meeting<T>),
    ) {
        let on = calm[0] * calm[1] * calm[2] * calm[3] * calm[4] * calm[5];
        self.on[c] = on;
        if !(on > T::ZERO) {
            return;
        }
        self.mass[c] = mass;
        let (cells, meeting) = of();
        let scale = k.speed * k.speed;
        let [before, behind, across_before, across_behind] = fluxes(k, &cells, &meeting).map(|f| scale * f);
        (self.before[c], self.behind[c]) = (before, behind);
        (self.across_before[c], self.across_behind[c]) = (across_before, across_behind);
    }
}

#[inline(always)]
fn cell<T: Real>(row: &RowView<'_, T>, c: usize) -> Cell<T> {
    (row.h[c], row.z[c])
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
    let [fb, f, ff] = stars.map(|s| &s.0);
    for c in 1..n - 2 {
        let d = c + 1;
        let all = [
            calm[0][c], calm[1][c], calm[2][c], calm[0][d], calm[1][d], calm[2][d],
        ];
        out.set(k, c, all, mass[c], || {
            let cells = Around {
                before: rows.each_ref().map(|r| cell(r, c)),
                behind: rows.each_ref().map(|r| cell(r, d)),
            };
            let meeting = Meeting {
                axis: f[0][c] + f[1][d],
                from: [f[6][c] + fb[7][d], f[4][c] + ff[5][d]],
                to: [fb[4][c] + f[5][d], ff[6][c] + f[7][d]],
            };
            (cells, meeting)
        });
    }
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
    let [f, g] = stars.map(|s| &s.0);
    for c in 1..n - 1 {
        let (w, e) = (c - 1, c + 1);
        let all = [
            calm[0][w], calm[0][c], calm[0][e], calm[1][w], calm[1][c], calm[1][e],
        ];
        out.set(k, c, all, mass[c], || {
            let cells = Around {
                before: [w, c, e].map(|i| cell(&rows[0], i)),
                behind: [w, c, e].map(|i| cell(&rows[1], i)),
            };
            let meeting = Meeting {
                axis: f[2][c] + g[3][c],
                from: [f[7][c] + g[6][w], f[4][c] + g[5][e]],
                to: [f[4][w] + g[5][c], f[7][e] + g[6][c]],
            };
            (cells, meeting)
        });
    }
}
