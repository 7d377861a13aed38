//! Collision and streaming of nine populations, one row at a time.
//!
//! The scheme is that of Ojeda & Susín (2013, eq. 1–4) with the bed force on each link. Lengths are metres, velocities
//! are relative to the lattice speed e = Δx/Δt, so that a population has the unit of a depth; g̃ = g/e².
//!
//! Held is not fᵢ but φᵢ = fᵢ − λᵢ g̃h²/6, what it has beyond water at rest of the same depth (λ = 1 along the axes, ¼
//! along diagonals); the rest population follows from the depth. The force of the bed on a link from x to x',
//! −g̃ h̄ Cᵢ (z' − z) with h̄ = (h + h')/2 and C = λ/3, and the difference of the two rest parts then make one term,
//! λᵢ (g̃/6) (h + h') (η' − η): exactly 0 under a level surface, in any precision and at any altitude.

use super::super::chunks::{CHUNK, in_chunks, of};
use super::super::finite_volume::kernels as volumes;
use super::super::real::Real;
use std::ops::Range;

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
    /// Gravity, m/s².
    pub(super) gravity: T,
    /// Depth up to which a cell takes no part, m.
    pub(super) thin: T,
    /// Momentum per area from which a run counts as unstable, m²/s.
    pub(super) momentum_limit: T,
}

/// Populations after collision of one row.
pub(super) struct Star<T> {
    pub(super) phi: [Vec<T>; DIRECTIONS],
    /// 1 where the cell takes part, 0 where it is dry or a film.
    pub(super) open: Vec<T>,
}

/// What goes over the links of one row; the entry of a link is the column of the leftmost of its ends.
pub(super) struct Links<T> {
    /// Depth that crosses, a multiple of the quantum, m.
    mass: [Vec<T>; LINKS],
    /// Population that arrives at the far end, m.
    forth: [Vec<T>; LINKS],
    /// Population that arrives at the near end, m.
    back: [Vec<T>; LINKS],
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
            forth: planes(),
            back: planes(),
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

/// 1 for the cells of the middle row that take part: those deeper than a film, and films beside water that stands
/// higher than they do by as much. In the outermost columns, which nobody reads, only the former.
#[inline(always)]
pub(super) fn openings<T: Real>(thin: T, rows: [RowView<'_, T>; 3], out: &mut [T]) {
    let last = out.len() - 1;
    for c in [0, last] {
        out[c] = if rows[1].h[c] > thin { T::ONE } else { T::ZERO };
    }
    in_chunks!(1..last, openings_chunk(thin, rows, out));
}

#[inline(always)]
fn openings_chunk<T: Real, const N: usize>(
    first: usize,
    thin: T,
    [before, here, behind]: [RowView<'_, T>; 3],
    out: &mut [T],
) {
    let (h, z) = (of::<T, N>(here.h, first), of::<T, N>(here.z, first));
    let mut open = [T::ZERO; N];
    let mut own = [T::ZERO; N];
    for c in 0..N {
        open[c] = if h[c] > thin { T::ONE } else { T::ZERO };
        own[c] = (h[c] + z[c]) + thin;
    }
    for (row, first) in [
        (before, first),
        (behind, first),
        (here, first - 1),
        (here, first + 1),
    ] {
        let (h, z) = (of::<T, N>(row.h, first), of::<T, N>(row.z, first));
        for c in 0..N {
            let floods = (h[c] > thin) & (h[c] + z[c] > own[c]);
            open[c] = if floods { T::ONE } else { open[c] };
        }
    }
    out[first..first + N].copy_from_slice(&open);
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
    in_chunks!(0..here.h.len(), collide_chunk(k, here, phi, out));
}

#[inline(always)]
fn collide_chunk<T: Real, const N: usize>(
    first: usize,
    k: &Constants<T>,
    here: RowView<'_, T>,
    phi: [&[T]; DIRECTIONS],
    out: &mut Star<T>,
) {
    let [h, qx, qz, open] = [here.h, here.qx, here.qz, &out.open].map(|x| of::<T, N>(x, first));
    let phi = phi.map(|p| of::<T, N>(p, first));
    let mut star = [[T::ZERO; N]; DIRECTIONS];
    let (third, twelfth) = (T::from_f64(1.0 / 3.0), T::from_f64(1.0 / 12.0));
    for c in 0..N {
        let (mx, mz) = (k.lambda * qx[c], k.lambda * qz[c]);
        let mut p: [T; DIRECTIONS] = std::array::from_fn(|i| phi[i][c]);
        let [px, pz] = momentum(&p);
        let (dx, dz) = (mx - px, mz - pz);
        let (sum, difference) = (twelfth * (dx + dz), twelfth * (dx - dz));
        let given = [third * dx, third * dz, sum, difference];
        for (pair, given) in given.into_iter().enumerate() {
            p[2 * pair] += given;
            p[2 * pair + 1] += -given;
        }
        let e = equilibrium(h[c], mx, mz);
        for i in 0..DIRECTIONS {
            star[i][c] = open[c] * (p[i] + k.rate * (e[i] - p[i]));
        }
    }
    for (into, from) in out.phi.iter_mut().zip(&star) {
        into[first..first + N].copy_from_slice(from);
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
        // A closed link returns what was sent over it.
        let arrive = |open: T, sent: T, own: T| open * sent + (T::ONE - open) * own;
        let mass = &mut out.mass[l][..m];
        let (forth, back) = (&mut out.forth[l][..m], &mut out.back[l][..m]);
        for c in 0..m {
            let rise = (hb[c] - ha[c]) + (zb[c] - za[c]);
            let open = oa[c] * ob[c];
            let surface = weight * (ha[c] + hb[c]) * rise;
            let net = open * ((fa[c] - fb[c]) - surface);
            mass[c] = (net + k.rounder) - k.rounder;
            forth[c] = arrive(open, fa[c] - surface, fb[c]);
            back[c] = arrive(open, fb[c] + surface, fa[c]);
        }
    }
}

/// The largest values of what was gathered, one in each lane.
#[derive(Clone, Debug)]
pub(super) struct Lanes<T> {
    /// max(|u|, |v|) + √(g h) of cells that take part, m/s.
    pub(super) signal: [T; CHUNK],
    /// |(u, v)|²/h of the same, m/s²: g times the squared Froude number.
    pub(super) froude: [T; CHUNK],
    pub(super) deepest: [T; CHUNK],
    pub(super) least: [T; CHUNK],
    /// Not 0 where a value is not finite or beyond its limit.
    pub(super) broken: [u32; CHUNK],
}

impl<T: Real> Lanes<T> {
    pub(super) fn new() -> Self {
        Self {
            signal: [T::ZERO; CHUNK],
            froude: [T::ZERO; CHUNK],
            deepest: [T::ZERO; CHUNK],
            least: [T::from_f64(1e30); CHUNK],
            broken: [0; CHUNK],
        }
    }

    /// Takes in `N` cells of which `h`, `qx` and `qz` are depth and momentum.
    #[inline(always)]
    fn look<const N: usize>(&mut self, k: &Constants<T>, h: &[T; N], qx: &[T; N], qz: &[T; N]) {
        for c in 0..N {
            let inverse = T::ONE / h[c].larger(T::TINY);
            let (u, v) = (qx[c] * inverse, qz[c] * inverse);
            let signal = u.abs().larger(v.abs()) + (k.gravity * h[c].larger(T::ZERO)).sqrt();
            let froude = (u * u + v * v) * inverse;
            let takes_part = h[c] > k.thin;
            self.signal[c] = self.signal[c].larger(if takes_part { signal } else { T::ZERO });
            self.froude[c] = self.froude[c].larger(if takes_part { froude } else { T::ZERO });
            self.deepest[c] = self.deepest[c].larger(h[c]);
            self.least[c] = self.least[c].smaller(h[c]);
            let sum = (qx[c].abs() + qz[c].abs()) + h[c];
            // Written so that NaN counts as broken.
            self.broken[c] |= u32::from(!(sum < k.momentum_limit));
        }
    }

    /// Takes in a row.
    #[inline(always)]
    pub(super) fn look_along(&mut self, k: &Constants<T>, h: &[T], qx: &[T], qz: &[T]) {
        in_chunks!(0..h.len(), look_chunk(k, [h, qx, qz], self));
    }
}

#[inline(always)]
fn look_chunk<T: Real, const N: usize>(
    first: usize,
    k: &Constants<T>,
    [h, qx, qz]: [&[T]; 3],
    found: &mut Lanes<T>,
) {
    found.look::<N>(k, of(h, first), of(qx, first), of(qz, first));
}

/// The new depth, momentum and populations of some columns of a row, and a look at them. `before` are the depths before
/// the step and which cells take part.
#[inline(always)]
pub(super) fn gather<T: Real>(
    k: &Constants<T>,
    friction: &volumes::Constants<T>,
    columns: Range<usize>,
    before: (&[T], &[T]),
    links: [&Links<T>; 2],
    into: &mut New<'_, T>,
    found: &mut Lanes<T>,
) {
    in_chunks!(columns, gather_chunk(k, friction, before, links, into, found));
}

/// Rows for the new state.
pub(super) struct New<'a, T> {
    /// Depth and momentum.
    pub(super) fields: [&'a mut [T]; 3],
    pub(super) phi: [&'a mut [T]; DIRECTIONS],
}

#[inline(always)]
fn gather_chunk<T: Real, const N: usize>(
    first: usize,
    k: &Constants<T>,
    friction: &volumes::Constants<T>,
    (old, open): (&[T], &[T]),
    [lb, l]: [&Links<T>; 2],
    into: &mut New<'_, T>,
    found: &mut Lanes<T>,
) {
    let (old, open): (&[T; N], &[T; N]) = (of(old, first), of(open, first));
    let mut depth = [T::ZERO; N];
    {
        // Of the column itself and of the one before.
        let [east, north, d2] = [0, 1, 2].map(|link| of::<T, N>(&l.mass[link], first));
        let [east_w, d3] = [0, 3].map(|link| of::<T, N>(&l.mass[link], first - 1));
        let [south, d3_b] = [1, 3].map(|link| of::<T, N>(&lb.mass[link], first));
        let d2_b = of::<T, N>(&lb.mass[2], first - 1);
        for c in 0..N {
            let out = (east[c] - east_w[c]) + (north[c] - south[c]);
            let diagonal = (d2[c] - d2_b[c]) + (d3[c] - d3_b[c]);
            depth[c] = (old[c] - out) - diagonal;
        }
    }
    let arriving: [&[T; N]; DIRECTIONS] = [
        of(&l.forth[0], first - 1),
        of(&l.back[0], first),
        of(&lb.forth[1], first),
        of(&l.back[1], first),
        of(&lb.forth[2], first - 1),
        of(&l.back[2], first),
        of(&l.back[3], first - 1),
        of(&lb.forth[3], first),
    ];
    let mut arrived = [[T::ZERO; N]; DIRECTIONS];
    let (mut qx, mut qz) = ([T::ZERO; N], [T::ZERO; N]);
    for c in 0..N {
        let a: [T; DIRECTIONS] = std::array::from_fn(|i| arriving[i][c]);
        let [mx, mz] = momentum(&a);
        // The rest part of the new depth is no longer that of the old one.
        let rest = k.sixth * ((depth[c] - old[c]) * (depth[c] + old[c]));
        for (i, a) in a.iter().enumerate() {
            let part = if i < 4 { rest } else { T::QUARTER * rest };
            arrived[i][c] = open[c] * (*a - part);
        }
        qx[c] = open[c] * (mx * k.speed);
        qz[c] = open[c] * (mz * k.speed);
    }
    if friction.friction > T::ZERO {
        volumes::rub(friction, &depth, &mut qx, &mut qz);
    }
    found.look(k, &depth, &qx, &qz);
    for (into, from) in into.fields.iter_mut().zip([&depth, &qx, &qz]) {
        into[first..first + N].copy_from_slice(from);
    }
    for (into, from) in into.phi.iter_mut().zip(&arrived) {
        into[first..first + N].copy_from_slice(from);
    }
}
