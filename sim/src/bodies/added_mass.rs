//! The water that a body takes along when it is accelerated.
//!
//! A floating body is half of the double body that it makes with its mirror image in the surface. The double body is
//! replaced by the ellipsoid with the same waterplane (area and second moments) and volume, for which the potential
//! flow is known in closed form (H. Lamb, Hydrodynamics, 6th ed. 1932, §§ 114, 115, 121; the integrals are Carlson's
//! R_D). A body below the surface is the ellipsoid itself.
//!
//! Near the bed the water below the hull must escape through a gap; that flow is the one of shallow-water theory
//! (D. Lannes, Ann. PDE 3:11, 2017, for a body at rest in the mean), and for an elliptic plate also closed.

use super::water::WATER_DENSITY;
use crate::solvers::GRAVITY;
use std::f64::consts::PI;

/// Narrowest gap below a hull that is taken into account, in mean half-lengths of the waterplane.
const NARROWEST_GAP: f64 = 0.05;

/// The wet part of a body as the ellipsoid sees it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct WetShape {
    /// Submerged volume, m³.
    pub(super) volume: f64,
    /// Horizontal half-axes of the ellipse with the footprint's second moments, m.
    pub(super) half_axes: [f64; 2],
    /// Share of the footprint that reaches through the surface, 0 to 1.
    pub(super) piercing: f64,
    /// Depth of the water, m, may be infinite.
    pub(super) depth: f64,
    /// Whether the water itself carries the long waves that the body makes.
    pub(super) radiates: bool,
}

/// Added mass along the principal axes: first and second half-axis and up, kg, and the added inertia about them, kg m².
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct AddedMass {
    pub(super) along: [f64; 3],
    pub(super) about: [f64; 3],
}

impl AddedMass {
    /// Of a wet shape; nothing for one without extent.
    pub(super) fn of(shape: &WetShape) -> Self {
        let [a, b] = shape.half_axes;
        let volume = shape.volume;
        if !(volume > 0.0 && a > 0.0 && b > 0.0) {
            return Self::default();
        }
        // A half ellipsoid holds 2/3 π a b c, a whole one twice that.
        let c = 3.0 * volume / (4.0 * PI * a * b) * (1.0 + shape.piercing);
        let [x, z, y] = demagnetising([a, b, c]);
        let mass = WATER_DENSITY * volume;
        let along = |share: f64| mass * share / (2.0 - share);
        let heave = (along(y) - Self::carried(shape, along(y))).max(0.0);
        let about = |p: f64, q: f64, share_p: f64, share_q: f64| {
            let (difference, sum) = (p * p - q * q, p * p + q * q);
            let under = 2.0 * difference + sum * (share_p - share_q);
            if difference.abs() < 1e-9 * sum {
                0.0
            } else {
                mass / 5.0 * difference * difference * (share_q - share_p) / under
            }
        };
        Self {
            along: [along(x), along(z), heave + Self::below(shape)],
            about: [about(b, c, z, y), about(c, a, y, x), about(a, b, x, z)],
        }
    }

    /// What the columns' own waves already are of the added mass in heave where the water is deep beside the body, kg.
    ///
    /// A bobbing waterplane is a source of long waves, whose field near it is in phase with its acceleration:
    /// ρ A² / (2π H) (ln(2 / kR) − γ + ¼) for a disc of area A and radius R, from the fundamental solution of the
    /// Helmholtz equation averaged over the disc, at the body's own frequency. In deep water no such wave exists, and
    /// the ellipsoid's added mass is the whole of it.
    fn carried(shape: &WetShape, heave: f64) -> f64 {
        const EULER: f64 = 0.577_215_664_901_532_9;
        if !shape.radiates || !shape.depth.is_finite() || shape.depth <= 0.0 {
            return 0.0;
        }
        let [a, b] = shape.half_axes;
        let (area, radius) = (PI * a * b * shape.piercing, (a * b).sqrt());
        let frequency = (WATER_DENSITY * GRAVITY * area / (WATER_DENSITY * shape.volume + heave)).sqrt();
        let phase = (frequency / (GRAVITY * shape.depth).sqrt() * radius).max(1e-9);
        let near = ((2.0 / phase).ln() - EULER + 0.25).max(0.0);
        let deep = deepness(shape.volume.cbrt(), shape.depth, true);
        deep * WATER_DENSITY * area * area / (2.0 * PI * shape.depth) * near
    }

    /// The water that has to leave the gap below a floating hull, beyond what the water itself accounts for, kg.
    fn below(shape: &WetShape) -> f64 {
        if !shape.depth.is_finite() {
            return 0.0;
        }
        let [a, b] = shape.half_axes;
        let draft = shape.volume / (PI * a * b);
        let gap = (shape.depth - draft).max(NARROWEST_GAP * (a * b).sqrt());
        let carried = if shape.radiates {
            1.0 / shape.depth.max(gap)
        } else {
            0.0
        };
        shape.piercing * plate(a, b) * (1.0 / gap - carried)
    }
}

/// How little of the waves that a body of this size makes the water carries itself, 0 to 1: shallow water carries
/// those of bodies that are long beside its depth.
pub(super) fn deepness(size: f64, depth: f64, radiates: bool) -> f64 {
    if radiates {
        (1.0 - 0.5 * size / depth.max(1e-9)).max(0.0)
    } else {
        1.0
    }
}

/// ρ π a³ b³ / (4 (a² + b²)): added mass times gap of an elliptic plate over a gap, kg m.
fn plate(a: f64, b: f64) -> f64 {
    WATER_DENSITY * PI * (a * b).powi(3) / (4.0 * (a * a + b * b))
}

/// Lamb's α₀, β₀, γ₀ of an ellipsoid: how its surface pressure is shared between its axes. They sum to 2.
fn demagnetising([a, b, c]: [f64; 3]) -> [f64; 3] {
    // Flat and needle-like limits are regular but lose digits; a thousandth of the longest axis is flat enough.
    let least = 1e-3 * a.max(b).max(c);
    let [a, b, c] = [a, b, c].map(|v| v.max(least));
    let share = |p: f64, q: f64, r: f64| 2.0 / 3.0 * (p * q * r) * carlson_rd(q * q, r * r, p * p);
    [share(a, b, c), share(b, c, a), share(c, a, b)]
}

/// Carlson's symmetric elliptic integral R_D(x, y, z) by duplication (B. C. Carlson, Numer. Algorithms 10, 1995).
fn carlson_rd(mut x: f64, mut y: f64, mut z: f64) -> f64 {
    let (mut sum, mut factor) = (0.0, 1.0);
    for _ in 0..60 {
        let mean = (x + y + 3.0 * z) / 5.0;
        let spread = [x, y, z]
            .map(|v| (1.0 - v / mean).abs())
            .into_iter()
            .fold(0.0, f64::max);
        if spread < 1e-3 {
            let (dx, dy, dz) = (1.0 - x / mean, 1.0 - y / mean, 1.0 - z / mean);
            let (xy, zz) = (dx * dy, dz * dz);
            let e2 = xy - 6.0 * zz;
            let e3 = (3.0 * xy - 8.0 * zz) * dz;
            let e4 = 3.0 * (xy - zz) * zz;
            let e5 = xy * zz * dz;
            let series = 1.0 - 3.0 / 14.0 * e2 + e3 / 6.0 + 9.0 / 88.0 * e2 * e2
                - 3.0 / 22.0 * e4
                - 9.0 / 52.0 * e2 * e3
                + 3.0 / 26.0 * e5;
            return 3.0 * sum + factor * series / (mean * mean.sqrt());
        }
        let (sx, sy, sz) = (x.sqrt(), y.sqrt(), z.sqrt());
        let lambda = sx * sy + sy * sz + sz * sx;
        sum += factor / (sz * (z + lambda));
        factor *= 0.25;
        x = 0.25 * (x + lambda);
        y = 0.25 * (y + lambda);
        z = 0.25 * (z + lambda);
    }
    3.0 * sum
}

#[cfg(test)]
mod tests {
    use super::*;

    fn deep(volume: f64, half_axes: [f64; 2], piercing: f64) -> AddedMass {
        AddedMass::of(&WetShape {
            volume,
            half_axes,
            piercing,
            depth: f64::INFINITY,
            radiates: false,
        })
    }

    #[test]
    fn spheres_take_half_their_displacement_along() {
        let ball = deep(4.0 / 3.0 * PI, [1.0, 1.0], 0.0);
        let half = deep(2.0 / 3.0 * PI, [1.0, 1.0], 1.0);
        for k in 0..3 {
            assert!((ball.along[k] / (WATER_DENSITY * 2.0 / 3.0 * PI) - 1.0).abs() < 1e-6);
            assert!((half.along[k] / (WATER_DENSITY / 3.0 * PI) - 1.0).abs() < 1e-6);
            assert!(ball.about[k].abs() < 1e-6 * ball.along[k]);
        }
    }

    #[test]
    fn a_flat_disc_has_the_added_mass_and_inertia_of_theory() {
        // Disc broadside in unbounded water: 8/3 ρ R³ along, 16/45 ρ R⁵ about a diameter; half of each on one side.
        let disc = deep(2.0 / 3.0 * PI * 2e-3, [1.0, 1.0], 1.0);
        assert!(
            (disc.along[2] / (WATER_DENSITY * 4.0 / 3.0) - 1.0).abs() < 5e-3,
            "{disc:?}"
        );
        assert!(
            (disc.about[0] / (WATER_DENSITY * 8.0 / 45.0) - 1.0).abs() < 2e-2,
            "{disc:?}"
        );
        assert!(disc.about[2].abs() < 1e-9);
    }

    #[test]
    fn long_bodies_approach_plane_flow() {
        // A long half cylinder: ρ π b²/2 a length, and nearly nothing lengthwise.
        let (a, b) = (200.0, 1.0);
        let volume = 2.0 / 3.0 * PI * a * b * b;
        let long = deep(volume, [a, b], 1.0);
        assert!(
            (long.along[2] / (WATER_DENSITY * volume) - 1.0).abs() < 2e-3,
            "{long:?}"
        );
        assert!(long.along[0] < 1e-2 * long.along[2]);
    }

    #[test]
    fn coefficients_sum_to_two_for_any_axes() {
        for axes in [[1.0, 1.0, 1.0], [3.0, 0.2, 1.0], [1e4, 1.0, 1e-3]] {
            assert!(
                (demagnetising(axes).iter().sum::<f64>() - 2.0).abs() < 1e-9,
                "{axes:?}"
            );
        }
    }
}
