//! The surface at any point and time, exact: the sum of all waves. [`super::snapshot`] answers from samples.

use super::Ocean;
use super::lattice::wave_number;
use super::patch::{Field, Patch, per_wave_number};
use glam::{DMat2, DVec2, DVec3};
use rustfft::num_complex::Complex32;
use std::f64::consts::TAU;

/// The surface at a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfacePoint {
    /// Elevation above datum in metres.
    pub height: f64,
    /// Unit normal into the air; downwards where the surface has folded over.
    pub normal: DVec3,
    /// Velocity of the water there, m/s.
    pub velocity: DVec3,
    /// Area that the surface element has left, 1 at rest, at most 0 where the surface folds.
    pub jacobian: f64,
}

/// Sums of all waves at a sample's own place.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Sums {
    pub(super) height: f64,
    pub(super) slope: DVec2,
    pub(super) displacement: DVec2,
    /// ∂Dx/∂x, ∂Dz/∂z, ∂Dx/∂z.
    pub(super) stretch: [f64; 3],
    pub(super) velocity: DVec2,
    pub(super) rise: f64,
}

impl Sums {
    fn deformation(&self, choppiness: f64) -> DMat2 {
        let [xx, zz, xz] = self.stretch.map(|s| choppiness * s);
        DMat2::from_cols(DVec2::new(1.0 + xx, xz), DVec2::new(xz, 1.0 + zz))
    }

    pub(super) fn point(&self, level: f64, choppiness: f64) -> SurfacePoint {
        let f = self.deformation(choppiness);
        let along_x = DVec3::new(f.x_axis.x, self.slope.x, f.x_axis.y);
        let along_z = DVec3::new(f.y_axis.x, self.slope.y, f.y_axis.y);
        SurfacePoint {
            height: level + self.height,
            normal: along_z.cross(along_x).try_normalize().unwrap_or(DVec3::Y),
            velocity: DVec3::new(self.velocity.x, self.rise, self.velocity.y),
            jacobian: f.determinant(),
        }
    }
}

/// Steps of Newton's iteration for the sample that stands over a place.
const STEPS: usize = 40;

/// Finds the sums whose displaced place is `x`: x₀ + choppiness · D(x₀) = x. Where the surface folds, one of the layers.
pub(super) fn displaced_to(x: DVec2, choppiness: f64, close: f64, sums: impl Fn(DVec2) -> Sums) -> Sums {
    let mut from = x;
    let mut here = sums(from);
    if choppiness == 0.0 {
        return here;
    }
    let miss = |from: DVec2, s: &Sums| from + choppiness * s.displacement - x;
    let mut error = miss(from, &here);
    for _ in 0..STEPS {
        if error.length() <= close {
            break;
        }
        let f = here.deformation(choppiness);
        // Near a fold Newton's step runs away; the plain iteration x₀ ← x − D(x₀) does not.
        let mut step = if f.determinant() > 0.1 {
            f.inverse() * error
        } else {
            error
        };
        // Halved until it brings the place nearer.
        for _ in 0..6 {
            let next = from - step;
            let sums = sums(next);
            let miss = miss(next, &sums);
            if miss.length() < error.length() {
                (from, here, error) = (next, sums, miss);
                break;
            }
            step *= 0.5;
        }
    }
    here
}

impl Patch {
    /// Adds this patch's waves at `x` (metres from the patch's first sample) and `time` (as in
    /// [`Patch::turn`]), summed in double precision.
    fn add_exact(&self, x: DVec2, time: f64, sums: &mut Sums, depth: f64) {
        let l = self.lattice();
        let (w, h) = (l.size.x as usize, l.size.y as usize);
        let quarter = h / 2 + 1;
        let along_z: Vec<DVec2> = (0..h)
            .map(|n| DVec2::from_angle((wave_number(n, h, l.period.y) * x.y).rem_euclid(TAU)))
            .collect();
        for m in 0..l.active_rows {
            let kx = wave_number(m, w, l.period.x);
            let along_x = DVec2::from_angle((kx * x.x).rem_euclid(TAU));
            // Entries off the axis kx = 0 stand for themselves and their conjugate.
            let weight = if m == 0 { 1.0 } else { 2.0 };
            for n in 0..h {
                let (even, odd) = (l.even[m * h + n], l.odd[m * h + n]);
                if even == Complex32::default() && odd == Complex32::default() {
                    continue;
                }
                let kz = wave_number(n, h, l.period.y);
                let k = kx.hypot(kz);
                let turns = l.turns[m * quarter + n.min(h - n)];
                let turn = turns * time;
                let (sin, cos) = (TAU * (turn - turn.round())).sin_cos();
                let wide = |c: Complex32| DVec2::new(f64::from(c.re), f64::from(c.im));
                let (even, odd) = (wide(even), wide(odd));
                let place = weight * along_x.rotate(along_z[n]);
                // Re and Im of ĥ e^{ik·x}, and of its derivative in time.
                let wave = (even * cos + odd * sin).rotate(place);
                let rate = turns * l.radians * (odd * cos - even * sin).rotate(place);
                let per_k = per_wave_number(k, depth);
                let value = |field: Field| {
                    let (factor, imaginary) = field.factor(kx, kz, per_k);
                    let of = if field.is_rate() { rate } else { wave };
                    factor * if imaginary { -of.y } else { of.x }
                };
                sums.height += wave.x;
                sums.rise += rate.x;
                sums.slope += DVec2::new(value(Field::SlopeX), value(Field::SlopeZ));
                sums.displacement += DVec2::new(value(Field::DisplacementX), value(Field::DisplacementZ));
                sums.velocity += DVec2::new(value(Field::VelocityX), value(Field::VelocityZ));
                let stretch = [Field::StretchXX, Field::StretchZZ, Field::StretchXZ];
                for (sum, field) in sums.stretch.iter_mut().zip(stretch) {
                    *sum += value(field);
                }
            }
        }
    }
}

impl Ocean {
    /// The surface over `position` (metres, X and Z) at `time` seconds, summed over all waves in double precision:
    /// some milliseconds a point for a patch of 512².
    pub fn surface_at(&self, position: DVec2, time: f64) -> SurfacePoint {
        let origin = self.spec.origin.as_dvec2();
        let depth = self.depth.unwrap_or(f64::INFINITY);
        let moment = self.moment(time);
        let exact = |x: DVec2| {
            let mut sums = Sums::default();
            for cascade in &self.cascades {
                cascade.patch.add_exact(x - origin, moment, &mut sums, depth);
            }
            sums
        };
        let close = 1e-9 * f64::from(self.spec.spacing);
        displaced_to(position, self.choppiness, close, exact).point(f64::from(self.level), self.choppiness)
    }
}
