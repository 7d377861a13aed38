//! The shape of one wave particle, its constants, and its evaluation along a row of samples.
//!
//! A particle of amplitude a and radius r lifts the water by D = (a/2)(cos(π d/r) + 1) within d < r (Yuksel, House &
//! Keyser 2007, eq. 5) and moves its surface by −sin(π u/r) D along its direction, u being the distance ahead of its
//! centre (eq. 14).

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

/// Samples that are evaluated together: as many as the widest common vector registers hold.
pub(super) const LANES: usize = 8;

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

/// Rows of values to which particles are added; all as long, a multiple of [`LANES`]. Those not wanted are empty.
pub(super) struct Target<'a> {
    /// Elevation above rest.
    pub(super) height: &'a mut [f32],
    /// Height times direction, X and Z.
    pub(super) carried: [&'a mut [f32]; 2],
    /// Horizontal displacement, X and Z.
    pub(super) moved: [&'a mut [f32]; 2],
}

#[inline(always)]
fn polynomial(c: &[f32; 5], x: f32) -> f32 {
    // Estrin's order: shorter chains than Horner's.
    let x2 = x * x;
    (c[0] + c[1] * x) + (c[2] + c[3] * x) * x2 + c[4] * (x2 * x2)
}

/// Adds a particle to the rows of `target`, which begin at column `first` and stand `dz` samples behind its centre.
/// Samples outside of the particle get exact zeros, so `target` may reach beyond it.
#[inline(always)]
pub(super) fn add_row(stamp: &Stamp, first: i32, dz: f32, target: &mut Target<'_>) {
    let inverse = 1.0 / stamp.radius;
    let offset = (first - stamp.column) as f32 - stamp.fraction[0];
    let z = dz * inverse;
    let q0 = z * z;
    let [ux, uz] = stamp.direction;
    let mut begin = offset;
    let (carry, shift) = (!target.carried[0].is_empty(), !target.moved[0].is_empty());
    let chunks = target.height.len() / LANES;
    for chunk in 0..chunks {
        let span = chunk * LANES..(chunk + 1) * LANES;
        let mut x = [0.0_f32; LANES];
        let mut height = [0.0_f32; LANES];
        for k in 0..LANES {
            x[k] = (begin + k as f32) * inverse;
            let rest = (1.0 - (q0 + x[k] * x[k])).max(0.0);
            height[k] = stamp.amplitude * (rest * rest) * polynomial(&BUMP, 1.0 - rest);
        }
        for (out, h) in target.height[span.clone()].iter_mut().zip(&height) {
            *out += h;
        }
        if carry {
            let [cx, cz] = &mut target.carried;
            for (out, h) in cx[span.clone()].iter_mut().zip(&height) {
                *out += h * ux;
            }
            for (out, h) in cz[span.clone()].iter_mut().zip(&height) {
                *out += h * uz;
            }
        }
        if shift {
            for k in 0..LANES {
                let v = x[k] * ux + z * uz;
                let v2 = v * v;
                height[k] *= -v * (1.0 - v2) * polynomial(&SINE, v2);
            }
            let [mx, mz] = &mut target.moved;
            for (out, d) in mx[span.clone()].iter_mut().zip(&height) {
                *out += d * ux;
            }
            for (out, d) in mz[span].iter_mut().zip(&height) {
                *out += d * uz;
            }
        }
        begin += LANES as f32;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
        let mut target = Target {
            height,
            carried: [cx, cz],
            moved: [mx, mz],
        };
        add_row(&stamp, 0, 2.3, &mut target);
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
