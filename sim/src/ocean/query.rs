//! The surface at any point and time: exact, as the sum of all waves, or from the samples of one time.

use super::Ocean;
use super::lattice::wave_number;
use super::patch::{Field, Group, Patch, Plane, per_wave_number};
use glam::{DMat2, DVec2, DVec3, UVec2};
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
struct Sums {
    height: f64,
    slope: DVec2,
    displacement: DVec2,
    /// ∂Dx/∂x, ∂Dz/∂z, ∂Dx/∂z.
    stretch: [f64; 3],
    velocity: DVec2,
    rise: f64,
}

impl Sums {
    fn deformation(&self, choppiness: f64) -> DMat2 {
        let [xx, zz, xz] = self.stretch.map(|s| choppiness * s);
        DMat2::from_cols(DVec2::new(1.0 + xx, xz), DVec2::new(xz, 1.0 + zz))
    }

    fn point(&self, level: f64, choppiness: f64) -> SurfacePoint {
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
fn displaced_to(x: DVec2, choppiness: f64, close: f64, sums: impl Fn(DVec2) -> Sums) -> Sums {
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
    /// [`Patch::synthesise`]), summed in double precision.
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

    /// The sea at `time`, for any number of points at about a microsecond each.
    pub fn snapshot(&self, time: f64) -> Snapshot {
        let moment = self.moment(time);
        let groups = [
            Group::Two(Field::Elevation, Field::Rise),
            Group::Two(Field::DisplacementX, Field::DisplacementZ),
            Group::Two(Field::VelocityX, Field::VelocityZ),
        ];
        let mut works = self.work.borrow_mut();
        let patches = self.cascades.iter().zip(works.iter_mut()).map(|(cascade, work)| {
            let planes = cascade.patch.synthesise(moment, &groups, work);
            let plane = |at: usize| match &planes[at] {
                Plane::Two(v) => v.clone(),
                Plane::One(_) => Vec::new(),
            };
            let lattice = cascade.patch.lattice();
            SampledPatch {
                size: lattice.size,
                scale: lattice.size.as_dvec2() / lattice.period,
                planes: [plane(0), plane(1), plane(2)],
            }
        });
        Snapshot {
            patches: patches.collect(),
            origin: self.spec.origin.as_dvec2(),
            level: f64::from(self.level),
            choppiness: self.choppiness,
            close: 1e-4 * f64::from(self.spec.spacing),
        }
    }
}

/// Samples of one patch at one time.
#[derive(Clone, Debug)]
struct SampledPatch {
    size: UVec2,
    /// Samples a metre.
    scale: DVec2,
    /// Elevation and rise, displacement, velocity.
    planes: [Vec<Complex32>; 3],
}

/// An ocean at one time, sampled: the surface over any point, inside the domain or beyond it, by cubic interpolation.
#[derive(Clone, Debug)]
pub struct Snapshot {
    patches: Vec<SampledPatch>,
    origin: DVec2,
    level: f64,
    choppiness: f64,
    /// How near to the place asked for the sample must stand, metres.
    close: f64,
}

/// Weights of four samples at −1, 0, 1, 2 for the value and the derivative of the Catmull–Rom spline at `t` in [0, 1].
fn spline(t: f64) -> ([f64; 4], [f64; 4]) {
    let (t2, t3) = (t * t, t * t * t);
    (
        [
            -0.5 * t + t2 - 0.5 * t3,
            1.0 - 2.5 * t2 + 1.5 * t3,
            0.5 * t + 2.0 * t2 - 1.5 * t3,
            -0.5 * t2 + 0.5 * t3,
        ],
        [
            -0.5 + 2.0 * t - 1.5 * t2,
            -5.0 * t + 4.5 * t2,
            0.5 + 4.0 * t - 4.5 * t2,
            -t + 1.5 * t2,
        ],
    )
}

impl SampledPatch {
    fn add(&self, x: DVec2, sums: &mut Sums) {
        let n = self.size.as_dvec2();
        let at = (x * self.scale).rem_euclid(n);
        let cell = at.floor();
        let ((wx, gx), (wz, gz)) = (spline(at.x - cell.x), spline(at.y - cell.y));
        let (w, h) = (self.size.x as usize, self.size.y as usize);
        let [wave, moved, flow] = &self.planes;
        for b in 0..4 {
            let row = (cell.y as usize + h + b - 1) % h * w;
            for a in 0..4 {
                let at = row + (cell.x as usize + w + a - 1) % w;
                let value = wx[a] * wz[b];
                let (dx, dz) = (gx[a] * wz[b] * self.scale.x, wx[a] * gz[b] * self.scale.y);
                let wide = |c: Complex32| DVec2::new(f64::from(c.re), f64::from(c.im));
                let (wave, moved, flow) = (wide(wave[at]), wide(moved[at]), wide(flow[at]));
                sums.height += value * wave.x;
                sums.rise += value * wave.y;
                sums.slope += DVec2::new(dx, dz) * wave.x;
                sums.displacement += value * moved;
                sums.velocity += value * flow;
                sums.stretch[0] += dx * moved.x;
                sums.stretch[1] += dz * moved.y;
                sums.stretch[2] += 0.5 * (dz * moved.x + dx * moved.y);
            }
        }
    }
}

impl Snapshot {
    /// The surface over `position` (metres, X and Z).
    pub fn surface_at(&self, position: DVec2) -> SurfacePoint {
        let sampled = |x: DVec2| {
            let mut sums = Sums::default();
            for patch in &self.patches {
                patch.add(x - self.origin, &mut sums);
            }
            sums
        };
        displaced_to(position, self.choppiness, self.close, sampled).point(self.level, self.choppiness)
    }
}
