//! Collision and streaming of the six-moment lattice, one row at a time.
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

use super::super::finite_volume::kernels::{LANES, Row};
use super::super::real::Real;

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
pub(super) struct Star<T>(pub(super) [Row<T>; DIRECTIONS]);

/// What goes over the links from one row to itself and to the next, and through its faces. Links 0 and 1 lead from
/// cell `c` to +X and +Z, 2 from `c` to +X+Z, 3 from `c + 1` to −X+Z.
#[derive(Clone)]
pub(super) struct Links<T> {
    /// Depth that crosses each link, m.
    mass: [Row<T>; 4],
    /// S of each link, m.
    pub(super) surface: [Row<T>; 4],
    /// Depth that crosses the face to +Z, a multiple of the quantum, m.
    pub(super) face_z: Row<T>,
}

impl<T: Real> Star<T> {
    pub(super) const ZERO: Self = Self([[T::ZERO; LANES]; DIRECTIONS]);
}

impl<T: Real> Links<T> {
    pub(super) const ZERO: Self = Self {
        mass: [[T::ZERO; LANES]; 4],
        surface: [[T::ZERO; LANES]; 4],
        face_z: [T::ZERO; LANES],
    };
}

/// Populations beyond rest from the six numbers.
#[inline(always)]
pub(super) fn collided<T: Real>(k: &Constants<T>, row: RowView<'_, T>, out: &mut Star<T>) {
    let n = row.h.len();
    let (qx, qz) = (&row.qx[..n], &row.qz[..n]);
    let [xx, zz, xz] = row.moments.map(|m| &m[..n]);
    let [o0, o1, o2, o3, o4, o5, o6, o7] = out.0.each_mut().map(|o| &mut o[..n]);
    for i in 0..n {
        let h = row.h[i];
        let (mx, mz) = (k.lambda * qx[i], k.lambda * qz[i]);
        let inverse = T::ONE / h;
        let (u, v) = (mx * inverse, mz * inverse);
        let (a, b, c) = (k.unfold * xx[i], k.unfold * zz[i], k.unfold * xz[i]);
        let p = k.half_gravity * h * h;
        // Raw moments of second order and above, less those of rest.
        let (m20, m02, m11) = (a + mx * u, b + mz * v, c + mx * v);
        let twice = c + c;
        let m21 = u * twice + v * (p + m20);
        let m12 = v * twice + u * (p + m02);
        let m22 = (u * u * (p + b) + v * v * (p + a)) + u * v * ((twice + twice) + mx * v);
        let (even_x, odd_x) = (T::HALF * (m20 - m22), T::HALF * (mx - m12));
        let (even_z, odd_z) = (T::HALF * (m02 - m22), T::HALF * (mz - m21));
        let (even, odd) = (T::QUARTER * (m22 + m11), T::QUARTER * (m21 + m12));
        let (skew_even, skew_odd) = (T::QUARTER * (m22 - m11), T::QUARTER * (m12 - m21));
        (o0[i], o1[i]) = (even_x + odd_x, even_x - odd_x);
        (o2[i], o3[i]) = (even_z + odd_z, even_z - odd_z);
        (o4[i], o5[i]) = (even + odd, even - odd);
        (o6[i], o7[i]) = (skew_even + skew_odd, skew_even - skew_odd);
    }
}

/// Links of a row and to the next one: entries `0 .. n − 1`; the faces to +Z: entries `1 .. n − 1`.
#[inline(always)]
pub(super) fn links<T: Real>(
    k: &Constants<T>,
    rows: [RowView<'_, T>; 2],
    stars: [&Star<T>; 2],
    out: &mut Links<T>,
) {
    let n = rows[0].h.len();
    let m = n - 1;
    let diagonal = T::QUARTER * k.sixth;
    // Cells before (a), to +X (b), to +Z (d) and across (e) of each link.
    let (ha, hb) = (&rows[0].h[..m], &rows[0].h[1..=m]);
    let (hd, he) = (&rows[1].h[..m], &rows[1].h[1..=m]);
    let (za, zb) = (&rows[0].z[..m], &rows[0].z[1..=m]);
    let (zd, ze) = (&rows[1].z[..m], &rows[1].z[1..=m]);
    let [s0, s1, s2, s3] = out.surface.each_mut().map(|s| &mut s[..m]);
    for c in 0..m {
        let (a, b, d, e) = (ha[c], hb[c], hd[c], he[c]);
        s0[c] = k.sixth * (a + b) * ((b - a) + (zb[c] - za[c]));
        s1[c] = k.sixth * (a + d) * ((d - a) + (zd[c] - za[c]));
        s2[c] = diagonal * (a + e) * ((e - a) + (ze[c] - za[c]));
        s3[c] = diagonal * (b + d) * ((d - b) + (zd[c] - zb[c]));
    }
    let [s0, s1, s2, s3] = out.surface.each_ref().map(|s| &s[..m]);
    let [l0, l1, l2, l3] = out.mass.each_mut().map(|s| &mut s[..m]);
    let (f, g) = (&stars[0].0, &stars[1].0);
    let (f0, f1, f2, f4, f7) = (&f[0][..m], &f[1][1..=m], &f[2][..m], &f[4][..m], &f[7][1..=m]);
    let (g3, g5, g6) = (&g[3][..m], &g[5][1..=m], &g[6][..m]);
    for c in 0..m {
        l0[c] = (f0[c] - f1[c]) - s0[c];
        l1[c] = (f2[c] - g3[c]) - s1[c];
        l2[c] = T::HALF * ((f4[c] - g5[c]) - s2[c]);
        l3[c] = T::HALF * ((f7[c] - g6[c]) - s3[c]);
    }
    // Half of a diagonal link goes through each of the corners beside it.
    let w = m - 1;
    let (l1, face) = (&out.mass[1][1..=w], &mut out.face_z[1..=w]);
    let (l2, l2_west) = (&out.mass[2][1..=w], &out.mass[2][..w]);
    let (l3, l3_west) = (&out.mass[3][1..=w], &out.mass[3][..w]);
    for c in 0..w {
        face[c] = k.round(l1[c] + ((l2[c] + l3_west[c]) + (l2_west[c] + l3[c])));
    }
}

/// Depth that crosses the faces to +X of a row, multiples of the quantum, m: entries `0 .. n − 1`.
#[inline(always)]
pub(super) fn faces_x<T: Real>(k: &Constants<T>, n: usize, links: [&Links<T>; 2], out: &mut Row<T>) {
    let m = n - 1;
    let [b, l] = links;
    let out = &mut out[..m];
    let l0 = &l.mass[0][..m];
    let (l2, l3) = (&l.mass[2][..m], &l.mass[3][..m]);
    let (b2, b3) = (&b.mass[2][..m], &b.mass[3][..m]);
    for c in 0..m {
        out[c] = k.round(l0[c] + ((l2[c] - b3[c]) + (b2[c] - l3[c])));
    }
}

/// Moments that arrive in a cell: momentum over e and the second moments less those of rest at the old depth.
struct Arrived<T> {
    mx: T,
    mz: T,
    xx: T,
    zz: T,
    xz: T,
}

/// What comes over the eight links of a row's cells: populations as they were sent and the surface terms of the links.
struct Arrivals<'a, T> {
    sent: [&'a [T]; DIRECTIONS],
    surface: [&'a [T]; DIRECTIONS],
}

impl<'a, T: Real> Arrivals<'a, T> {
    /// For the `m` cells from column `c` of the middle row.
    #[inline(always)]
    fn new(stars: [&'a Star<T>; 3], links: [&'a Links<T>; 2], c: usize, m: usize) -> Self {
        let [sb, s, sf] = stars.map(|s| &s.0);
        let (b, l) = (&links[0].surface, &links[1].surface);
        let (west, here, east) = (c - 1..c - 1 + m, c..c + m, c + 1..c + 1 + m);
        Self {
            sent: [
                &s[0][west.clone()],
                &s[1][east.clone()],
                &sb[2][here.clone()],
                &sf[3][here.clone()],
                &sb[4][west.clone()],
                &sf[5][east.clone()],
                &sf[6][west.clone()],
                &sb[7][east],
            ],
            surface: [
                &l[0][west.clone()],
                &l[0][here.clone()],
                &b[1][here.clone()],
                &l[1][here.clone()],
                &b[2][west.clone()],
                &l[2][here.clone()],
                &l[3][west],
                &b[3][here],
            ],
        }
    }

    #[inline(always)]
    fn at(&self, c: usize) -> Arrived<T> {
        let (f, s) = (&self.sent, &self.surface);
        let (px, nx) = (f[0][c] - s[0][c], f[1][c] + s[1][c]);
        let (pz, nz) = (f[2][c] - s[2][c], f[3][c] + s[3][c]);
        let (pp, nn) = (f[4][c] - s[4][c], f[5][c] + s[5][c]);
        let (pn, np) = (f[6][c] + s[6][c], f[7][c] - s[7][c]);
        let (plus, minus) = (pp + nn, pn + np);
        let (forth, across) = (pp - nn, pn - np);
        Arrived {
            mx: (px - nx) + (forth + across),
            mz: (pz - nz) + (forth - across),
            xx: (px + nx) + (plus + minus),
            zz: (pz + nz) + (plus + minus),
            xz: plus - minus,
        }
    }
}

/// Second central moments beyond equilibrium after collision, as stored.
#[inline(always)]
fn relax<T: Real>(k: &Constants<T>, old: T, new: T, a: &Arrived<T>) -> [T; 3] {
    let inverse = T::ONE / new;
    let (u, v) = (a.mx * inverse, a.mz * inverse);
    let rise = k.half_gravity * (new - old) * (new + old);
    // Water that moves is damped more: the lattice's viscosity falls with the speed, and an undamped one grows noise.
    let pressure = k.half_gravity * new;
    let calm = pressure / (pressure + k.sluggish * (u * u + v * v));
    let (xx, zz, xz) = (a.xx - rise - a.mx * u, a.zz - rise - a.mz * v, a.xz - a.mx * v);
    [
        calm * (k.keep.own * xx + k.keep.other * zz),
        calm * (k.keep.own * zz + k.keep.other * xx),
        calm * (k.keep.mixed * xz),
    ]
}

/// Where the new state of a row goes.
pub(super) struct New<'a, T> {
    pub(super) h: &'a mut [T],
    pub(super) qx: &'a mut [T],
    pub(super) qz: &'a mut [T],
    pub(super) moments: [&'a mut [T]; 3],
}

/// Streams one row whose cells all have nothing but lattice faces: cells 1 .. n − 1 of the views. The largest depth and
/// the largest speed along an axis go to `most`.
#[inline(always)]
pub(super) fn stream<T: Real>(
    k: &Constants<T>,
    h0: &[T],
    stars: [&Star<T>; 3],
    links: [&Links<T>; 2],
    face_x: &Row<T>,
    new: New<'_, T>,
    most: [&mut Row<T>; 2],
) {
    let n = h0.len();
    let m = n - 2;
    let New { h, qx, qz, moments } = new;
    let (h, qx, qz) = (&mut h[..m], &mut qx[..m], &mut qz[..m]);
    let [xx, zz, xz] = moments.map(|x| &mut x[..m]);
    let [deepest, fastest] = most.map(|x| &mut x[..m]);
    let arrivals = Arrivals::new(stars, links, 1, m);
    let h0 = &h0[1..=m];
    let (west, east) = (&face_x[..m], &face_x[1..=m]);
    let (first, last) = (&links[0].face_z[1..=m], &links[1].face_z[1..=m]);
    for i in 0..m {
        let old = h0[i];
        let depth = (old - (east[i] - west[i])) - (last[i] - first[i]);
        let a = arrivals.at(i);
        let kept = relax(k, old, depth, &a);
        (xx[i], zz[i], xz[i]) = (kept[0], kept[1], kept[2]);
        h[i] = depth;
        qx[i] = a.mx * k.speed;
        qz[i] = a.mz * k.speed;
        deepest[i] = deepest[i].larger(depth);
        fastest[i] = fastest[i].larger(qx[i].abs().larger(qz[i].abs()) / depth);
    }
}

/// Halves of the differences of velocity across the cells of a row, m/s: of u and v along X, then along Z.
#[derive(Clone, Copy)]
pub(super) struct Shear<'a, T>(pub(super) [&'a [T]; 4]);

/// The moments alone of `m` cells of a row from column `first`: streamed where a cell has nothing but lattice faces,
/// else, in calm water, what the slopes of the velocity ask for to first order (Chapman & Enskog's expansion about rest:
/// ∂ₜp = −2p ∇·u and the third moments h u, p v make −ω k_xx = (h − 2p) ∂ₓu − p ∂_z v and −ω k_xz = p (∂ₓv + ∂_z u)).
#[inline(always)]
#[expect(
    clippy::too_many_arguments,
    reason = "everything that a cell of either kind needs"
)]
pub(super) fn stream_moments<T: Real>(
    k: &Constants<T>,
    first: usize,
    depths: [&[T]; 2],
    pure: &Row<T>,
    calm: &Row<T>,
    shear: Shear<'_, T>,
    stars: [&Star<T>; 3],
    links: [&Links<T>; 2],
    moments: [&mut [T]; 3],
) {
    let [old, new] = depths;
    let m = new.len();
    let [xx, zz, xz] = moments.map(|x| &mut x[..m]);
    let arrivals = Arrivals::new(stars, links, first, m);
    let columns = first..first + m;
    let (old, pure, calm) = (
        &old[columns.clone()],
        &pure[columns.clone()],
        &calm[columns.clone()],
    );
    let [xu, xv, zu, zv] = shear.0.map(|s| &s[columns.clone()]);
    let twice = T::TWO * k.lambda;
    for i in 0..m {
        let a = arrivals.at(i);
        let streamed = relax(k, old[i], new[i], &a);
        let p = k.half_gravity * old[i] * old[i];
        let bulk = old[i] - T::TWO * p;
        let (along_x, along_z) = (bulk * xu[i] - p * zv[i], bulk * zv[i] - p * xu[i]);
        let slopes = [
            twice * (k.guess.own * along_x + k.guess.other * along_z),
            twice * (k.guess.own * along_z + k.guess.other * along_x),
            twice * (k.guess.mixed * (p * (xv[i] + zu[i]))),
        ];
        let (whole, deep) = (pure[i] > T::ZERO, calm[i] > T::ZERO);
        let of = |c: usize| {
            let guess = if deep { slopes[c] } else { T::ZERO };
            if whole { streamed[c] } else { guess }
        };
        (xx[i], zz[i], xz[i]) = (of(0), of(1), of(2));
    }
}

/// 1 for the cells of a row in which the lattice is at home, deep, slow and without a jump of the surface beside them:
/// entries `1 .. n − 1`.
#[inline(always)]
pub(super) fn calm<T: Real>(k: &Constants<T>, rows: [RowView<'_, T>; 3], out: &mut Row<T>) {
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
