//! Every cell, one after another: the oracle that the other casters are held against.
//!
//! It shares nothing with them but the samples: the patch is a polynomial in `t`, solved within the cell's own interval.

use super::surface::{HeightfieldError, Patch, Surface};
use super::{Caster, Hit, Ray};
use glam::DVec3;
use meniscus_sim::Grid;

/// Tests all cells for every ray. Far too slow for pictures.
#[derive(Clone, Debug)]
pub struct BruteForce {
    surface: Surface,
}

/// How far outside its cell, in cells, a root still counts as inside.
const SLACK: f64 = 1e-12;

impl BruteForce {
    /// The oracle for `elevation`.
    ///
    /// # Errors
    /// [`HeightfieldError`] if a sample is not finite, or the grid impossible.
    pub fn build(elevation: &Grid<f32>, patch: Patch) -> Result<Self, HeightfieldError> {
        let mut brute = Self {
            surface: Surface::empty(patch),
        };
        Caster::rebuild(&mut brute, elevation)?;
        Ok(brute)
    }

    /// The ray in units of samples.
    pub(super) fn local(&self, ray: &Ray) -> Local {
        let p = self.surface.to_grid(ray.origin.x, ray.origin.z);
        let spacing = self.surface.spacing();
        Local {
            x: p.x,
            z: p.y,
            y: ray.origin.y,
            dx: ray.direction.x / spacing,
            dz: ray.direction.z / spacing,
            dy: ray.direction.y,
        }
    }

    /// What there is to say of a hit at `t` in a cell.
    pub(super) fn hit(&self, ray: &Ray, local: &Local, t: f64, (i, j): (u32, u32)) -> Hit {
        let (u, v) = (
            local.x + local.dx * t - f64::from(i),
            local.z + local.dz * t - f64::from(j),
        );
        let point = ray.at(t);
        let (height, normal) = self.surface.height_and_normal(i, j, u, v);
        Hit {
            t,
            position: DVec3::new(point.x, height, point.z),
            normal,
            cell: (i, j),
        }
    }

    /// Smallest root within a cell.
    pub(super) fn cell(&self, local: &Local, i: u32, j: u32, t_min: f64, t_max: f64) -> Option<f64> {
        let (t0, t1) = local.clip([f64::from(i), f64::from(j)], 1.0, (t_min, t_max))?;
        let [a, b, c, d] = self.surface.corners(i, j);
        match self.surface.patch {
            Patch::Bilinear => {
                // h = a + (b − a) u + (c − a) v + k u v with u, v linear in τ = t − t0.
                let k = (a - b) - (c - d);
                let (u, v) = (
                    local.x + local.dx * t0 - f64::from(i),
                    local.z + local.dz * t0 - f64::from(j),
                );
                let height = a + (b - a) * u + (c - a) * v + k * u * v;
                let constant = local.y + local.dy * t0 - height;
                let linear =
                    local.dy - (b - a) * local.dx - (c - a) * local.dz - k * (u * local.dz + v * local.dx);
                let quadratic = -k * local.dx * local.dz;
                first_in(quadratic, linear, constant, t0, t1, local.slack())
            }
            Patch::Triangles => {
                let (u, v) = (local.x - f64::from(i), local.z - f64::from(j));
                let lower = (b - a, d - b, 1.0);
                let upper = (d - c, c - a, -1.0);
                [lower, upper]
                    .into_iter()
                    .filter_map(|(slope_u, slope_v, sign)| {
                        let rate = local.dy - slope_u * local.dx - slope_v * local.dz;
                        let gap = local.y - (a + slope_u * u + slope_v * v);
                        let t = -gap / rate;
                        let beyond = sign * ((u + local.dx * t) - (v + local.dz * t));
                        let slack = local.slack();
                        (t >= t0 - slack && t <= t1 + slack && beyond >= -SLACK).then_some(t)
                    })
                    .reduce(f64::min)
            }
        }
    }
}

/// A ray in units of samples.
pub(super) struct Local {
    x: f64,
    z: f64,
    pub(super) y: f64,
    pub(super) dx: f64,
    pub(super) dz: f64,
    pub(super) dy: f64,
}

impl Local {
    /// The part of `span` over the square of that side with that low corner.
    pub(super) fn clip(&self, low: [f64; 2], side: f64, span: (f64, f64)) -> Option<(f64, f64)> {
        let (mut t0, mut t1) = span;
        for (p, d, low) in [(self.x, self.dx, low[0]), (self.z, self.dz, low[1])] {
            if d == 0.0 {
                if p < low || p > low + side {
                    return None;
                }
            } else {
                let (a, b) = ((low - p) / d, (low + side - p) / d);
                t0 = t0.max(a.min(b));
                t1 = t1.min(a.max(b));
            }
        }
        // Also of no number at all.
        (t0 <= t1).then_some((t0, t1))
    }

    /// [`SLACK`] cells in units of `t`.
    fn slack(&self) -> f64 {
        let speed = self.dx.abs().max(self.dz.abs());
        if speed > 0.0 { SLACK / speed } else { 0.0 }
    }
}

/// Smallest root of `a τ² + b τ + c` with `t0 + τ` in `[t0, t1]`.
fn first_in(a: f64, b: f64, c: f64, t0: f64, t1: f64, slack: f64) -> Option<f64> {
    let inside = |tau: f64| (tau.is_finite() && tau >= -slack && t0 + tau <= t1 + slack).then_some(t0 + tau);
    let discriminant = b * b - 4.0 * a * c;
    if discriminant < 0.0 {
        return None;
    }
    let q = -0.5 * (b + discriminant.sqrt().copysign(b));
    // A quotient by zero is infinite or NaN and therefore not inside.
    match (inside(q / a), inside(c / q)) {
        (Some(p), Some(q)) => Some(p.min(q)),
        (p, q) => p.or(q),
    }
}

impl Caster for BruteForce {
    fn name(&self) -> &'static str {
        "brute"
    }

    fn rebuild(&mut self, elevation: &Grid<f32>) -> Result<(), HeightfieldError> {
        self.surface.copy_from(elevation)?;
        self.surface.measure(elevation)
    }

    /// As `Heightfield::cast`, save that a root where the ray starts counts.
    fn cast(&self, ray: &Ray, t_min: f64, t_max: f64) -> Option<Hit> {
        let local = self.local(ray);
        let mut best: Option<(f64, u32, u32)> = None;
        for j in 0..self.surface.cells_z() {
            for i in 0..self.surface.cells_x() {
                if let Some(t) = self.cell(&local, i, j, t_min, t_max)
                    && best.is_none_or(|(t_best, ..)| t < t_best)
                {
                    best = Some((t, i, j));
                }
            }
        }
        let (t, i, j) = best?;
        Some(self.hit(ray, &local, t, (i, j)))
    }

    fn bytes(&self) -> usize {
        self.surface.bytes()
    }
}
