//! The shape of one wave particle, its constants, and its evaluation along a row of samples.
//!
//! A particle of amplitude a and radius r lifts the water by D = (a/2)(cos(π d/r) + 1) within d < r (Yuksel, House &
//! Keyser 2007, eq. 5) and moves its surface by −sin(π u/r) D along its direction, u being the distance ahead of its
//! centre (eq. 14).

use pulp::Simd;
use std::f64::consts::PI;

/// Volume of a particle over a r²: π/2 − 2/π.
pub const VOLUME: f64 = PI / 2.0 - 2.0 / PI;

/// ∫ C² du of the cross-section C of a crest of unit height made of particles of unit radius, ∫ C du being [`VOLUME`].
pub(super) const CREST_SQUARE: f64 = 0.695_678_8;

/// ∫ W² dA of a particle of unit amplitude and radius: 3π/8 − 2/π.
pub(super) const BUMP_SQUARE: f64 = 3.0 * PI / 8.0 - 2.0 / PI;

/// (1 + cos π√q)/2 over (1 − q)², a polynomial in q = d²/r². The factor makes value and slope vanish at the rim to the
/// last bit; what is left is smooth, so five terms are good to 8.4e-8 (fitted at Chebyshev points).
const BUMP: [f32; 5] = [
    0.999_999_9,
    -0.467_396_9,
    0.094_519_89,
    -0.011_026_32,
    0.000_753_753_3,
];

/// sin(πv) over v (1 − v²), a polynomial in v², good to 2.9e-7.
const SINE: [f32; 5] = [
    3.141_591_9,
    -2.026_081_8,
    0.523_734_6,
    -0.074_343_02,
    0.005_895_343,
];

/// Samples of the widest vectors: rows are padded by as many.
pub(super) const LANES: usize = 16;

/// Columns of the widest particle that is taken whole, not row by row.
pub(super) const WIDEST: usize = 16;

const COUNT: [f32; LANES] = [
    0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0, 11.0, 12.0, 13.0, 14.0, 15.0,
];

/// Height of a particle of unit amplitude at squared distance `q` (in squared radii), exact.
pub fn bump(q: f64) -> f64 {
    if q < 1.0 {
        0.5 * (1.0 + (PI * q.sqrt()).cos())
    } else {
        0.0
    }
}

/// Share of the height by which the surface moves along the particle's direction, `v` radii ahead of its centre.
pub fn lean(v: f64) -> f64 {
    -(PI * v.clamp(-1.0, 1.0)).sin()
}

/// Height of the cross-section of a crest of unit height at `u` radii from its ridge: particles without gaps along a
/// straight front, C(u) = ∫ W dv.
pub fn crest(u: f64) -> f64 {
    const STEPS: i32 = 64;
    let half = (1.0 - u * u).max(0.0).sqrt();
    let at = |k: i32| half * (f64::from(k) + 0.5) / f64::from(STEPS);
    (0..STEPS).map(|k| bump(u * u + at(k).powi(2))).sum::<f64>() * 2.0 * half / f64::from(STEPS)
}

/// One particle as a row of samples sees it. Lengths are in samples.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Stamp {
    /// Centre: sample before it along X and Z, and the rest.
    pub(super) column: i32,
    pub(super) row: i32,
    pub(super) fraction: [f32; 2],
    pub(super) radius: f32,
    /// Amplitude in metres.
    pub(super) amplitude: f32,
    /// Unit direction of travel.
    pub(super) direction: [f32; 2],
}

/// Rows of values to which particles are added; all as long, a multiple of the vectors' length. Those not wanted are
/// empty.
pub(super) struct Target<'a, T = f32> {
    /// Elevation above rest.
    pub(super) height: &'a mut [T],
    /// Height times direction, X and Z.
    pub(super) carried: [&'a mut [T]; 2],
    /// Horizontal displacement, X and Z.
    pub(super) moved: [&'a mut [T]; 2],
}

impl<'a> Target<'a> {
    /// The same as whole vectors.
    #[inline(always)]
    fn vectors<S: Simd>(self) -> Target<'a, S::f32s> {
        let of = |list: &'a mut [f32]| S::as_mut_simd_f32s(list).0;
        Target {
            height: of(self.height),
            carried: self.carried.map(of),
            moved: self.moved.map(of),
        }
    }
}

/// A particle ready to be added. Every operation is one of IEEE 754 on single lanes and none is contracted, so the result is
/// the same for vectors of any length.
struct Brush<S: Simd> {
    simd: S,
    amplitude: S::f32s,
    direction: [S::f32s; 2],
    begin: S::f32s,
    inverse: S::f32s,
}

impl<S: Simd> Brush<S> {
    /// For columns of which the first is `begin` samples after the centre.
    #[inline(always)]
    fn new(simd: S, stamp: &Stamp, begin: f32, inverse: f32) -> Self {
        Self {
            simd,
            amplitude: simd.splat_f32s(stamp.amplitude),
            direction: stamp.direction.map(|u| simd.splat_f32s(u)),
            begin: simd.splat_f32s(begin),
            inverse: simd.splat_f32s(inverse),
        }
    }

    /// Distance ahead of the centre along X, in radii, of the columns of vector `number`.
    #[inline(always)]
    fn columns(&self, number: usize) -> S::f32s {
        let simd = self.simd;
        let count = S::as_simd_f32s(&COUNT).0[0];
        let first = simd.splat_f32s((number * S::F32_LANES) as f32);
        let x = simd.add_f32s(self.begin, simd.add_f32s(first, count));
        simd.mul_f32s(x, self.inverse)
    }

    /// In Estrin's order: shorter chains than Horner's.
    #[inline(always)]
    fn polynomial(&self, c: &[f32; 5], x: S::f32s) -> S::f32s {
        let simd = self.simd;
        let c = c.map(|c| simd.splat_f32s(c));
        let linear = |a, b| simd.add_f32s(a, simd.mul_f32s(b, x));
        let x2 = simd.mul_f32s(x, x);
        let low = simd.add_f32s(linear(c[0], c[1]), simd.mul_f32s(linear(c[2], c[3]), x2));
        simd.add_f32s(low, simd.mul_f32s(c[4], simd.mul_f32s(x2, x2)))
    }

    /// Adds vector `number` of a row `z` radii behind the centre, whose columns are `x`.
    #[inline(always)]
    fn add(&self, x: S::f32s, z: f32, number: usize, target: &mut Target<'_, S::f32s>) {
        let simd = self.simd;
        let (one, zero) = (simd.splat_f32s(1.0), simd.splat_f32s(0.0));
        let z = simd.splat_f32s(z);
        let q = simd.add_f32s(simd.mul_f32s(z, z), simd.mul_f32s(x, x));
        let rest = simd.max_f32s(simd.sub_f32s(one, q), zero);
        let shape = self.polynomial(&BUMP, simd.sub_f32s(one, rest));
        let height = simd.mul_f32s(self.amplitude, simd.mul_f32s(rest, rest));
        let height = simd.mul_f32s(height, shape);
        let sum = |to: &mut S::f32s, value| *to = simd.add_f32s(*to, value);
        sum(&mut target.height[number], height);
        let [ux, uz] = self.direction;
        let [cx, cz] = &mut target.carried;
        if !cx.is_empty() {
            sum(&mut cx[number], simd.mul_f32s(height, ux));
            sum(&mut cz[number], simd.mul_f32s(height, uz));
        }
        let [mx, mz] = &mut target.moved;
        if !mx.is_empty() {
            let v = simd.add_f32s(simd.mul_f32s(x, ux), simd.mul_f32s(z, uz));
            let v2 = simd.mul_f32s(v, v);
            let lean = simd.mul_f32s(v, simd.sub_f32s(v2, one));
            let moved = simd.mul_f32s(height, simd.mul_f32s(lean, self.polynomial(&SINE, v2)));
            sum(&mut mx[number], simd.mul_f32s(moved, ux));
            sum(&mut mz[number], simd.mul_f32s(moved, uz));
        }
    }
}

/// Adds a particle to the rows of `target`, which begin at column `first` and stand `dz` samples behind its centre.
/// Samples outside of the particle get exact zeros, so `target` may reach beyond it.
#[inline(always)]
pub(super) fn add_row<S: Simd>(simd: S, stamp: &Stamp, first: i32, dz: f32, target: Target<'_>) {
    let inverse = 1.0 / stamp.radius;
    let begin = (first - stamp.column) as f32 - stamp.fraction[0];
    let brush = Brush::new(simd, stamp, begin, inverse);
    let mut target = target.vectors::<S>();
    for number in 0..target.height.len() {
        brush.add(brush.columns(number), dz * inverse, number, &mut target);
    }
}

/// Adds a particle of less than `N`/2 samples radius, which `N` columns therefore hold, to the rows `rows` (numbered as its
/// centre's): `target` gives the `N` samples of a row from a column on. The same sum as [`add_row`], without finding the
/// ends of every row.
#[inline(always)]
pub(super) fn add_small<const N: usize, S: Simd, T: Rows>(
    simd: S,
    stamp: &Stamp,
    rows: std::ops::Range<i32>,
    target: &mut T,
) {
    let inverse = 1.0 / stamp.radius;
    let before = (stamp.fraction[0] - stamp.radius).ceil();
    let brush = Brush::new(simd, stamp, before - stamp.fraction[0], inverse);
    let vectors = N / S::F32_LANES;
    let mut columns = [simd.splat_f32s(0.0); WIDEST];
    for (number, columns) in columns[..vectors].iter_mut().enumerate() {
        *columns = brush.columns(number);
    }
    let first = stamp.column + before as i32;
    let from = stamp
        .row
        .saturating_add((stamp.fraction[1] - stamp.radius).ceil() as i32);
    let to = stamp
        .row
        .saturating_add((stamp.fraction[1] + stamp.radius).floor() as i32 + 1);
    for j in from.max(rows.start)..to.min(rows.end) {
        let dz = (j - stamp.row) as f32 - stamp.fraction[1];
        let mut target = target.samples::<N>(j, first).vectors::<S>();
        for (number, columns) in columns[..vectors].iter().enumerate() {
            brush.add(*columns, dz * inverse, number, &mut target);
        }
    }
}

/// Rows of a grid that particles are added to.
pub(super) trait Rows {
    /// `N` samples of row `row` from column `first` on, which may lie up to [`WIDEST`] before the first one or end as far
    /// after the last.
    fn samples<const N: usize>(&mut self, row: i32, first: i32) -> Target<'_>;
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Row<'a>(&'a Stamp, Target<'a>);

    impl pulp::WithSimd for Row<'_> {
        type Output = ();

        fn with_simd<S: Simd>(self, simd: S) {
            add_row(simd, self.0, 0, 2.3, self.1);
        }
    }

    #[test]
    fn a_row_is_the_cosine_bump_and_the_sine_lean() {
        let stamp = Stamp {
            column: 11,
            row: 3,
            fraction: [0.37, 0.2],
            radius: 6.3,
            amplitude: 1.0,
            direction: [0.6, 0.8],
        };
        let mut rows = vec![[0.0_f32; 32]; 5];
        let [height, cx, cz, mx, mz] = &mut rows[..] else {
            panic!()
        };
        let target = Target {
            height,
            carried: [cx, cz],
            moved: [mx, mz],
        };
        pulp::Arch::new().dispatch(Row(&stamp, target));
        for i in 0..32 {
            let (x, z) = (i as f64 - f64::from(11.0 + 0.37_f32), 2.3);
            let d = bump((x * x + z * z) / (6.3 * 6.3));
            let l = d * lean((0.6 * x + 0.8 * z) / 6.3);
            let expected = [d, 0.6 * d, 0.8 * d, 0.6 * l, 0.8 * l];
            for (row, value) in rows.iter().zip(expected) {
                assert!(
                    (f64::from(row[i]) - value).abs() < 5e-7,
                    "{i}: {} {value}",
                    row[i]
                );
            }
        }
    }

    #[test]
    fn constants_are_their_integrals() {
        let n = 2000;
        let radial = |f: &dyn Fn(f64) -> f64| {
            let at = |k: i32| (f64::from(k) + 0.5) / f64::from(n);
            (0..n).map(|k| 2.0 * PI * at(k) * f(at(k))).sum::<f64>() / f64::from(n)
        };
        assert!((radial(&|s| bump(s * s)) - VOLUME).abs() < 1e-6);
        assert!((VOLUME - 0.93418).abs() < 5e-6, "the figure of the method page");
        assert!((radial(&|s| bump(s * s).powi(2)) - BUMP_SQUARE).abs() < 1e-6);
        let line = |f: &dyn Fn(f64) -> f64| {
            let at = |k: i32| (2.0 * f64::from(k) + 1.0) / f64::from(n) - 1.0;
            (0..n).map(|k| f(at(k))).sum::<f64>() * 2.0 / f64::from(n)
        };
        assert!((line(&|u| crest(u).powi(2)) - CREST_SQUARE).abs() < 2e-5);
        assert!((line(&crest) - VOLUME).abs() < 2e-5);
        assert!((crest(0.0) - 1.0).abs() < 1e-3);
    }
}
