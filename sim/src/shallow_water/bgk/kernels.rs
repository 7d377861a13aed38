//! Collision and streaming of nine populations, one row at a time.
//!
//! The scheme is that of Ojeda & Susín (2013, eq. 1–4) with the bed force on each link. Lengths are metres, velocities
//! are relative to the lattice speed e = Δx/Δt, so that a population has the unit of a depth; g̃ = g/e².
//!
//! Held is not fᵢ but φᵢ = fᵢ − λᵢ g̃h²/6, what it has beyond water at rest of the same depth (λ = 1 along the axes, ¼
//! along diagonals); the rest population follows from the depth. The force of the bed on a link from x to x',
//! −g̃ h̄ Cᵢ (z' − z) with h̄ = (h + h')/2 and C = λ/3, and the difference of the two rest parts then make one term,
//! λᵢ (g̃/6) (h + h') (η' − η): exactly 0 under a level surface, in any precision and at any altitude.

use super::super::real::Real;

/// Directions: +X, −X, +Z, −Z, then +X+Z, −X−Z, +X−Z, −X+Z; each stands beside its opposite.
pub(super) const DIRECTIONS: usize = 8;
/// Links that a row owns: from each cell to +X and to +Z, and both diagonals of the square between the cell, its
/// neighbours to +X and +Z and the one across.
const LINKS: usize = 4;

/// What the kernels need to know besides the state.
#[derive(Clone, Copy, Debug)]
pub(super) struct Constants<T> {
    /// Δt/Δx = 1/e, s/m.
    pub(super) lambda: T,
    /// e, m/s.
    pub(super) speed: T,
    /// g̃/6, 1/m.
    pub(super) sixth: T,
    /// 1/τ.
    pub(super) rate: T,
    /// Adding and subtracting this rounds to a multiple of the quantum.
    pub(super) rounder: T,
}

/// Populations after collision of one row.
pub(super) struct Star<T> {
    pub(super) phi: [Vec<T>; DIRECTIONS],
    /// 1 where the cell takes part, 0 where it is dry or a film.
    pub(super) open: Vec<T>,
}

/// What goes over the links of one row.
pub(super) struct Links<T> {
    /// Depth that crosses, a multiple of the quantum, m.
    mass: [Vec<T>; LINKS],
    /// λ (g̃/6) (h + h') (η' − η), m.
    surface: [Vec<T>; LINKS],
    /// 1 where the link is open.
    open: [Vec<T>; LINKS],
}

impl<T: Real> Star<T> {
    pub(super) fn new(n: usize) -> Self {
        Self {
            phi: std::array::from_fn(|_| vec![T::ZERO; n]),
            open: vec![T::ZERO; n],
        }
    }
}

impl<T: Real> Links<T> {
    pub(super) fn new(n: usize) -> Self {
        let planes = || std::array::from_fn(|_| vec![T::ZERO; n]);
        Self {
            mass: planes(),
            surface: planes(),
            open: planes(),
        }
    }
}

/// Depth, bed and momentum of one padded row.
#[derive(Clone, Copy)]
pub(super) struct RowView<'a, T> {
    pub(super) h: &'a [T],
    pub(super) z: &'a [T],
    pub(super) qx: &'a [T],
    pub(super) qz: &'a [T],
}

/// Equilibrium populations beyond rest (Ojeda & Susín 2013, eq. 2 without its terms in g), from depth and momentum
/// over e.
#[inline(always)]
pub(super) fn equilibrium<T: Real>(h: T, mx: T, mz: T) -> [T; DIRECTIONS] {
    let of = T::from_f64;
    let inverse = T::ONE / h.larger(T::TINY);
    let (xx, zz, xz) = (mx * mx * inverse, mz * mz * inverse, mx * mz * inverse);
    let (third, sixth, twelfth) = (of(1.0 / 3.0), of(1.0 / 6.0), of(1.0 / 12.0));
    let square = xx + zz;
    let (along_x, along_z) = (T::HALF * xx - sixth * square, T::HALF * zz - sixth * square);
    let (even, cross) = (twelfth * square, T::QUARTER * xz);
    let (sum, difference) = (twelfth * (mx + mz), twelfth * (mx - mz));
    [
        along_x + third * mx,
        along_x - third * mx,
        along_z + third * mz,
        along_z - third * mz,
        (even + cross) + sum,
        (even + cross) - sum,
        (even - cross) + difference,
        (even - cross) - difference,
    ]
}

/// Momentum over e of populations.
#[inline(always)]
pub(super) fn momentum<T: Real>(phi: &[T; DIRECTIONS]) -> [T; 2] {
    let [a, b, c, d] = [phi[0] - phi[1], phi[2] - phi[3], phi[4] - phi[5], phi[6] - phi[7]];
    [a + (c + d), b + (c - d)]
}

/// Collision (eq. 1): φ − (φ − φᵉ)/τ. Momentum that came to the water from outside since the last step is shared out
/// first as the equilibrium shares it.
#[inline(always)]
pub(super) fn collide<T: Real>(
    k: &Constants<T>,
    here: RowView<'_, T>,
    phi: [&[T]; DIRECTIONS],
    out: &mut Star<T>,
) {
    let n = here.h.len();
    let (qx, qz) = (&here.qx[..n], &here.qz[..n]);
    let phi = phi.map(|p| &p[..n]);
    let open = &out.open[..n];
    let [o0, o1, o2, o3, o4, o5, o6, o7] = out.phi.each_mut().map(|o| &mut o[..n]);
    let (third, twelfth) = (T::from_f64(1.0 / 3.0), T::from_f64(1.0 / 12.0));
    for c in 0..n {
        let (h, mx, mz) = (here.h[c], k.lambda * qx[c], k.lambda * qz[c]);
        let mut p: [T; DIRECTIONS] = std::array::from_fn(|i| phi[i][c]);
        let [px, pz] = momentum(&p);
        let (dx, dz) = (mx - px, mz - pz);
        let (sum, difference) = (twelfth * (dx + dz), twelfth * (dx - dz));
        p[0] += third * dx;
        p[1] += -third * dx;
        p[2] += third * dz;
        p[3] += -third * dz;
        p[4] += sum;
        p[5] += -sum;
        p[6] += difference;
        p[7] += -difference;
        let e = equilibrium(h, mx, mz);
        let star = |i: usize| open[c] * (p[i] + k.rate * (e[i] - p[i]));
        (o0[c], o1[c], o2[c], o3[c]) = (star(0), star(1), star(2), star(3));
        (o4[c], o5[c], o6[c], o7[c]) = (star(4), star(5), star(6), star(7));
    }
}

/// Links of one row of cells and to the next row.
#[inline(always)]
pub(super) fn links<T: Real>(
    k: &Constants<T>,
    rows: [RowView<'_, T>; 2],
    stars: [&Star<T>; 2],
    out: &mut Links<T>,
) {
    let n = rows[0].h.len();
    let diagonal = T::QUARTER * k.sixth;
    // Row and column of both ends, direction of the population that leaves the first, weight.
    let list = [
        ((0, 0), (0, 1), 0, k.sixth),
        ((0, 0), (1, 0), 2, k.sixth),
        ((0, 0), (1, 1), 4, diagonal),
        ((0, 1), (1, 0), 7, diagonal),
    ];
    for (l, &((ra, ca), (rb, cb), direction, weight)) in list.iter().enumerate() {
        let m = n - 1;
        let (ha, hb) = (&rows[ra].h[ca..ca + m], &rows[rb].h[cb..cb + m]);
        let (za, zb) = (&rows[ra].z[ca..ca + m], &rows[rb].z[cb..cb + m]);
        let (sa, sb) = (stars[ra], stars[rb]);
        let (oa, ob) = (&sa.open[ca..ca + m], &sb.open[cb..cb + m]);
        let (fa, fb) = (&sa.phi[direction][ca..ca + m], &sb.phi[direction ^ 1][cb..cb + m]);
        let mass = &mut out.mass[l][..m];
        let surface = &mut out.surface[l][..m];
        let open = &mut out.open[l][..m];
        for c in 0..m {
            let rise = (hb[c] - ha[c]) + (zb[c] - za[c]);
            open[c] = oa[c] * ob[c];
            surface[c] = weight * (ha[c] + hb[c]) * rise;
            let net = open[c] * ((fa[c] - fb[c]) - surface[c]);
            mass[c] = (net + k.rounder) - k.rounder;
        }
    }
}

/// Gathers what arrives in one row: new depth, momentum and populations of cells `1 .. n − 1`.
#[inline(always)]
pub(super) fn gather<T: Real>(
    k: &Constants<T>,
    h: &[T],
    stars: [&Star<T>; 3],
    links: [&Links<T>; 2],
    new: [&mut [T]; 3],
    phi: [&mut [T]; DIRECTIONS],
) {
    let n = h.len();
    let m = n - 2;
    let [sb, s, sf] = stars;
    let [lb, l] = links;
    // Link number, column offset, row, and the star row and column that the arriving population comes from.
    let west = |x: &'_ [T], c: usize| x[c - 1];
    let [nh, nx, nz] = new.map(|v| &mut v[1..=m]);
    let [p0, p1, p2, p3, p4, p5, p6, p7] = phi.map(|v| &mut v[1..=m]);
    for c in 1..=m {
        let at = c - 1;
        let out = (l.mass[0][c] - west(&l.mass[0], c)) + (l.mass[1][c] - lb.mass[1][c]);
        let diagonal = (l.mass[2][c] - west(&lb.mass[2], c)) + (west(&l.mass[3], c) - lb.mass[3][c]);
        let old = h[c];
        let depth = (old - out) - diagonal;
        // A closed link returns what was sent over it.
        let arrive = |open: T, sent: T, own: T| open * sent + (T::ONE - open) * own;
        let mut a = [
            arrive(
                west(&l.open[0], c),
                s.phi[0][c - 1] - west(&l.surface[0], c),
                s.phi[1][c],
            ),
            arrive(l.open[0][c], s.phi[1][c + 1] + l.surface[0][c], s.phi[0][c]),
            arrive(lb.open[1][c], sb.phi[2][c] - lb.surface[1][c], s.phi[3][c]),
            arrive(l.open[1][c], sf.phi[3][c] + l.surface[1][c], s.phi[2][c]),
            arrive(
                west(&lb.open[2], c),
                sb.phi[4][c - 1] - west(&lb.surface[2], c),
                s.phi[5][c],
            ),
            arrive(l.open[2][c], sf.phi[5][c + 1] + l.surface[2][c], s.phi[4][c]),
            arrive(
                west(&l.open[3], c),
                sf.phi[6][c - 1] + west(&l.surface[3], c),
                s.phi[7][c],
            ),
            arrive(lb.open[3][c], sb.phi[7][c + 1] - lb.surface[3][c], s.phi[6][c]),
        ];
        let [mx, mz] = momentum(&a);
        // The rest part of the new depth is no longer that of the old one.
        let rest = k.sixth * ((depth - old) * (depth + old));
        for (i, a) in a.iter_mut().enumerate() {
            let part = if i < 4 { rest } else { T::QUARTER * rest };
            *a = s.open[c] * (*a - part);
        }
        nh[at] = depth;
        nx[at] = s.open[c] * (mx * k.speed);
        nz[at] = s.open[c] * (mz * k.speed);
        (p0[at], p1[at], p2[at], p3[at]) = (a[0], a[1], a[2], a[3]);
        (p4[at], p5[at], p6[at], p7[at]) = (a[4], a[5], a[6], a[7]);
    }
}
