//! Ray marching as shaders do it: equal steps through the slab that holds the surface, then a bisection.

use meniscus_render_cpu::caster::{Caster, HeightfieldError, Hit, Ray};
use meniscus_sim::Grid;
use meniscus_sim::glam::{DVec3, Vec2};

/// Halvings of the step in which the sign changed; 24 exhaust the precision of `f32`.
const HALVINGS: u32 = 24;

/// A caster with a fixed number of steps a ray: cheap, simple, and blind to what lies between two steps.
pub(crate) struct March {
    surface: Grid<f32>,
    low: f64,
    high: f64,
    steps: u32,
}

impl March {
    pub(crate) fn new(surface: &Grid<f32>, steps: u32) -> Self {
        let (low, high) = surface.range();
        Self {
            surface: surface.clone(),
            low: f64::from(low),
            high: f64::from(high),
            steps,
        }
    }

    /// The part of the ray in the box of the surface.
    fn clip(&self, ray: &Ray, t_min: f64, t_max: f64) -> Option<(f64, f64)> {
        let spec = self.surface.spec();
        let first = spec.origin.as_dvec2();
        let last = first + spec.extent().as_dvec2();
        let slabs = [
            (ray.origin.x, ray.direction.x, first.x, last.x),
            (ray.origin.y, ray.direction.y, self.low, self.high),
            (ray.origin.z, ray.direction.z, first.y, last.y),
        ];
        let (mut from, mut to) = (t_min, t_max);
        for (origin, direction, low, high) in slabs {
            if direction == 0.0 {
                if origin < low || origin > high {
                    return None;
                }
                continue;
            }
            let (a, b) = ((low - origin) / direction, (high - origin) / direction);
            from = from.max(a.min(b));
            to = to.min(a.max(b));
        }
        (from <= to && to.is_finite()).then_some((from, to))
    }

    /// Height of a point above the surface, in the precision of a shader.
    fn above(&self, p: DVec3) -> f32 {
        p.y as f32 - self.surface.sample(Vec2::new(p.x as f32, p.z as f32))
    }
}

impl Caster for March {
    fn name(&self) -> &'static str {
        "march"
    }

    fn rebuild(&mut self, elevation: &Grid<f32>) -> Result<(), HeightfieldError> {
        *self = Self::new(elevation, self.steps);
        Ok(())
    }

    fn cast(&self, ray: &Ray, t_min: f64, t_max: f64) -> Option<Hit> {
        let (from, to) = self.clip(ray, t_min, t_max)?;
        let step = (to - from) / f64::from(self.steps);
        let begins_above = self.above(ray.at(from)) >= 0.0;
        let crossed = |t: f64| (self.above(ray.at(t)) >= 0.0) != begins_above;
        let k = (1..=self.steps).find(|k| crossed(from + f64::from(*k) * step))?;
        let (mut low, mut high) = (from + f64::from(k - 1) * step, from + f64::from(k) * step);
        for _ in 0..HALVINGS {
            let middle = 0.5 * (low + high);
            if crossed(middle) {
                high = middle;
            } else {
                low = middle;
            }
        }
        let position = ray.at(high);
        let cell = self
            .surface
            .spec()
            .nearest(Vec2::new(position.x as f32, position.z as f32));
        Some(Hit {
            t: high,
            position,
            normal: DVec3::Y,
            cell: (cell.x, cell.y),
        })
    }

    fn bytes(&self) -> usize {
        4 * self.surface.spec().len()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use meniscus_sim::GridSpec;
    use meniscus_sim::glam::UVec2;

    #[test]
    fn a_plane_is_hit_where_it_is_and_a_thin_ridge_is_missed_by_few_steps() {
        let spec = GridSpec::new(Vec2::ZERO, 1.0, UVec2::splat(33)).unwrap();
        let slope = Grid::from_fn(spec, |i, _| 0.25 * i as f32);
        let ray = Ray {
            origin: DVec3::new(-4.0, 3.0, 16.0),
            direction: DVec3::X,
        };
        let hit = March::new(&slope, 64).cast(&ray, 0.0, f64::INFINITY).unwrap();
        assert!((hit.t - 16.0).abs() < 1e-5, "{hit:?}");
        let ridge = Grid::from_fn(spec, |i, _| if i == 19 { 4.0 } else { 0.0 });
        assert!(March::new(&ridge, 8).cast(&ray, 0.0, f64::INFINITY).is_none());
        assert!(March::new(&ridge, 256).cast(&ray, 0.0, f64::INFINITY).is_some());
    }
}
