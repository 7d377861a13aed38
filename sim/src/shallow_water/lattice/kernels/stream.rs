//! The new state of a row from what arrives in it.

use super::{Between, Constants, RowView, Star, surface};
use crate::shallow_water::finite_volume::kernels::{Row, flag};
use crate::shallow_water::real::Real;

/// Moments that arrive in a cell: momentum over e and the second moments less those of rest at the old depth.
struct Arrived<T> {
    mx: T,
    mz: T,
    xx: T,
    zz: T,
    xz: T,
}

/// Depth and bed of a row before the step.
#[derive(Clone, Copy)]
pub(in super::super) struct Old<'a, T> {
    pub(in super::super) h: &'a [T],
    pub(in super::super) z: &'a [T],
}

/// What flows into `m` cells of a row, from column `first` of its views.
#[derive(Clone, Copy)]
pub(in super::super) struct Stage<'a, T> {
    h: [&'a [T]; 3],
    z: [&'a [T]; 3],
    /// Populations to +X of the cell before and of the cell, to −X of the cell and of the next.
    forth: [&'a [T]; 2],
    back: [&'a [T]; 2],
    up: [&'a [T]; 3],
    down: [&'a [T]; 3],
    /// Of the square before and of the one behind each cell, on both sides of the row.
    turns: [[&'a [T]; 2]; 2],
    /// Depth through the faces to the rows before and behind.
    faces: [&'a [T]; 2],
}

impl<'a, T: Real> Stage<'a, T> {
    #[inline(always)]
    pub(in super::super) fn new(
        first: usize,
        m: usize,
        old: Old<'a, T>,
        star: &'a Star<T>,
        [before, behind]: [&'a Between<T>; 2],
    ) -> Self {
        let (w, c, e) = (
            first - 1..first - 1 + m,
            first..first + m,
            first + 1..first + 1 + m,
        );
        let of = |x: &'a [T]| [&x[w.clone()], &x[c.clone()], &x[e.clone()]];
        let here = |x: &'a Vec<T>| &x[c.clone()];
        let turns = |b: &'a Between<T>| [&b.turn[w.clone()], &b.turn[c.clone()]];
        Self {
            h: of(old.h),
            z: of(old.z),
            forth: [&star.0[0][w.clone()], &star.0[0][c.clone()]],
            back: [&star.0[1][c.clone()], &star.0[1][e.clone()]],
            up: before.up.each_ref().map(here),
            down: behind.down.each_ref().map(here),
            turns: [turns(before), turns(behind)],
            faces: [here(&before.face), here(&behind.face)],
        }
    }

    /// The first `m` cells, with slices that the compiler knows to be so long.
    #[inline(always)]
    fn cut(&self, m: usize) -> Self {
        let [hw, h, he] = self.h;
        let [zw, z, ze] = self.z;
        let [fw, f] = self.forth;
        let [b, be] = self.back;
        let ([u0, u1, u2], [d0, d1, d2]) = (self.up, self.down);
        let [[t0, t1], [t2, t3]] = self.turns;
        let [first, last] = self.faces;
        Self {
            h: [&hw[..m], &h[..m], &he[..m]],
            z: [&zw[..m], &z[..m], &ze[..m]],
            forth: [&fw[..m], &f[..m]],
            back: [&b[..m], &be[..m]],
            up: [&u0[..m], &u1[..m], &u2[..m]],
            down: [&d0[..m], &d1[..m], &d2[..m]],
            turns: [[&t0[..m], &t1[..m]], [&t2[..m], &t3[..m]]],
            faces: [&first[..m], &last[..m]],
        }
    }

    /// Surface terms of the links to the cells before and behind.
    #[inline(always)]
    fn surfaces(&self, k: &Constants<T>, c: usize) -> [T; 2] {
        let ([hw, h, he], [zw, z, ze]) = (self.h, self.z);
        let here = (h[c], z[c]);
        [
            surface(k.sixth, (hw[c], zw[c]), here),
            surface(k.sixth, here, (he[c], ze[c])),
        ]
    }

    /// Depths that cross the faces to −X and +X, multiples of the quantum.
    #[inline(always)]
    fn faces_x(&self, k: &Constants<T>, c: usize, [sw, se]: [T; 2]) -> [T; 2] {
        let [[b_w, b], [l_w, l]] = self.turns;
        [
            k.round(((self.forth[0][c] - self.back[0][c]) - sw) + (l_w[c] + b_w[c])),
            k.round(((self.forth[1][c] - self.back[1][c]) - se) + (l[c] + b[c])),
        ]
    }

    #[inline(always)]
    fn arrived(&self, c: usize, [sw, se]: [T; 2]) -> Arrived<T> {
        let (px, nx) = (self.forth[0][c] - sw, self.back[1][c] + se);
        let [up_z, up_plus, up_minus] = self.up;
        let (pz, pp, np) = (up_z[c], up_plus[c], up_minus[c]);
        let [down_z, down_minus, down_plus] = self.down;
        let (nz, nn, pn) = (down_z[c], down_minus[c], down_plus[c]);
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

/// Depth that crosses the faces to +X of a row, multiples of the quantum, m: entries `1 ..= m` of `out`.
#[inline(always)]
pub(in super::super) fn faces_x<T: Real>(k: &Constants<T>, m: usize, stage: &Stage<'_, T>, out: &mut Row<T>) {
    let (out, stage) = (&mut out[1..=m], stage.cut(m));
    for c in 0..m {
        out[c] = stage.faces_x(k, c, stage.surfaces(k, c))[1];
    }
}

/// Second central moments beyond equilibrium after collision, as stored; `(u, v)` is the new
/// velocity over e.
#[inline(always)]
fn relax<T: Real>(k: &Constants<T>, old: T, new: T, (u, v): (T, T), a: &Arrived<T>) -> [T; 3] {
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
pub(in super::super) struct New<'a, T> {
    pub(in super::super) h: &'a mut [T],
    pub(in super::super) qx: &'a mut [T],
    pub(in super::super) qz: &'a mut [T],
    pub(in super::super) moments: [&'a mut [T]; 3],
}

/// What streaming found in some rows.
#[derive(Clone, Copy)]
pub(in super::super) struct Found<T: Real> {
    /// Whether anything moves or is stressed in the new state.
    pub(in super::super) moves: bool,
    /// Whether some of the water is thin or fast.
    pub(in super::super) restless: bool,
    /// Bits of [`flag`]: [`flag::ALIVE`] if a depth changed.
    pub(in super::super) flags: u32,
    deepest: T::Bits,
    fastest: T::Bits,
}

impl<T: Real> Found<T> {
    pub(in super::super) fn nothing() -> Self {
        Self {
            moves: false,
            restless: false,
            flags: 0,
            deepest: T::ZERO.bits(),
            fastest: T::ZERO.bits(),
        }
    }

    /// Fastest signal of the new state, m/s.
    pub(in super::super) fn signal(&self, k: &Constants<T>) -> T {
        k.speed * T::of_bits(self.fastest) + (k.gravity * T::of_bits(self.deepest)).sqrt()
    }
}

/// Streams cells that all have nothing but lattice faces. `limits` are the depth from which the quantum is too fine and
/// the momentum from which a run counts as unstable.
#[inline(always)]
pub(in super::super) fn stream<T: Real>(
    k: &Constants<T>,
    limits: [T; 2],
    stage: &Stage<'_, T>,
    new: New<'_, T>,
    found: &mut Found<T>,
) {
    let New { h, qx, qz, moments } = new;
    let m = h.len();
    let stage = stage.cut(m);
    let (qx, qz) = (&mut qx[..m], &mut qz[..m]);
    let [xx, zz, xz] = moments.map(|x| &mut x[..m]);
    let (mut moves, mut changes, mut restless) = (0_u32, 0_u32, 0_u32);
    let (mut deep, mut broken) = (0_u32, 0_u32);
    let froude = k.froude * k.gravity;
    let (mut deepest, mut fastest) = (found.deepest, found.fastest);
    for c in 0..m {
        let surfaces = stage.surfaces(k, c);
        let [west, east] = stage.faces_x(k, c, surfaces);
        let old = stage.h[1][c];
        let depth = (old - (east - west)) - (stage.faces[1][c] - stage.faces[0][c]);
        let a = stage.arrived(c, surfaces);
        let inverse = T::ONE / depth;
        let (u, v) = (a.mx * inverse, a.mz * inverse);
        let [kept_xx, kept_zz, kept_xz] = relax(k, old, depth, (u, v), &a);
        let (jx, jz) = (a.mx * k.speed, a.mz * k.speed);
        let motion = jx.abs() + jz.abs();
        let stress = (kept_xx.abs() + kept_zz.abs()) + kept_xz.abs();
        moves |= u32::from(motion + stress > T::ZERO);
        changes |= u32::from((depth - old).abs() > T::ZERO);
        // As `calm` asks.
        let square = jx * jx + jz * jz;
        restless |= u32::from(!((depth > k.thin) & (square <= froude * (depth * depth * depth))));
        deep |= u32::from(depth >= limits[0]);
        // Written so that NaN counts as broken.
        broken |= u32::from(!(motion < limits[1])) | u32::from(!(depth >= T::ZERO));
        deepest = deepest.max(depth.bits());
        fastest = fastest.max(u.abs().larger(v.abs()).bits());
        (xx[c], zz[c], xz[c]) = (kept_xx, kept_zz, kept_xz);
        (h[c], qx[c], qz[c]) = (depth, jx, jz);
    }
    *found = Found {
        moves: found.moves | (moves != 0),
        restless: found.restless | (restless != 0),
        flags: found.flags | (changes * flag::ALIVE) | (deep * flag::DEEP) | (broken * flag::BROKEN),
        deepest,
        fastest,
    };
}

/// Halves of the differences of velocity across the cells of a row, m/s: of u and v along X, then along Z.
#[derive(Clone, Copy)]
pub(in super::super) struct Shear<'a, T>(pub(in super::super) [&'a [T]; 4]);

/// The moments alone of `m` cells of a row from column `first`: streamed where a cell has nothing but lattice faces,
/// else, in calm water, what the slopes of the velocity ask for to first order (Chapman & Enskog's expansion about rest:
/// ∂ₜp = −2p ∇·u and the third moments h u, p v make −ω k_xx = (h − 2p) ∂ₓu − p ∂_z v and −ω k_xz = p (∂ₓv + ∂_z u)).
#[inline(always)]
pub(in super::super) fn stream_moments<T: Real>(
    k: &Constants<T>,
    first: usize,
    new: &[T],
    [pure, calm]: [&Row<T>; 2],
    shear: Shear<'_, T>,
    stage: &Stage<'_, T>,
    moments: [&mut [T]; 3],
) {
    let m = new.len();
    let stage = stage.cut(m);
    let [xx, zz, xz] = moments.map(|x| &mut x[..m]);
    let columns = first..first + m;
    let (pure, calm) = (&pure[columns.clone()], &calm[columns.clone()]);
    let [xu, xv, zu, zv] = shear.0.map(|s| &s[columns.clone()]);
    let twice = T::TWO * k.lambda;
    for c in 0..m {
        let (old, a) = (stage.h[1][c], stage.arrived(c, stage.surfaces(k, c)));
        let inverse = T::ONE / new[c];
        let streamed = relax(k, old, new[c], (a.mx * inverse, a.mz * inverse), &a);
        let p = k.half_gravity * old * old;
        let bulk = old - T::TWO * p;
        let (along_x, along_z) = (bulk * xu[c] - p * zv[c], bulk * zv[c] - p * xu[c]);
        let slopes = [
            twice * (k.guess.own * along_x + k.guess.other * along_z),
            twice * (k.guess.own * along_z + k.guess.other * along_x),
            twice * (k.guess.mixed * (p * (xv[c] + zu[c]))),
        ];
        let (whole, deep) = (pure[c] > T::ZERO, calm[c] > T::ZERO);
        let of = |streamed: T, slopes: T| {
            let guess = if deep { slopes } else { T::ZERO };
            if whole { streamed } else { guess }
        };
        xx[c] = of(streamed[0], slopes[0]);
        zz[c] = of(streamed[1], slopes[1]);
        xz[c] = of(streamed[2], slopes[2]);
    }
}

/// Whether momentum or stress is anywhere in a row.
#[inline(always)]
pub(in super::super) fn moves<T: Real>(row: &RowView<'_, T>) -> bool {
    let mut any = 0_u32;
    for plane in [row.qx, row.qz].into_iter().chain(row.moments) {
        for value in plane {
            any |= u32::from(value.abs() > T::ZERO);
        }
    }
    any != 0
}
