//! Ray marching as shaders do it: equal steps through the slab that holds the surface, then a bisection.
//!
//! Steps are a fixed number, or as long in plan as a safety radius within which a ray is taken to meet the surface once at
//! most (Baboud & Décoret 2006, §5.2: constant for water that moves; a radius of one cell is nearly exact).

use meniscus_render_cpu::caster::{Caster, HeightfieldError, Hit, Ray};
use meniscus_sim::Grid;
use meniscus_sim::glam::{DVec3, Vec2};

/// Halvings of the step in which the sign changed; 24 exhaust the precision of `f32`.
const HALVINGS: u32 = 24;

/// How far a step goes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Pace {
    /// The same share of the way of each ray.
    Steps(u32),
    /// So many cells in plan.
    Radius(f64),
}

/// A caster with equal steps along each ray: cheap, simple, and blind to what lies between two steps.
pub(crate) struct March {
    surface: Grid<f32>,
    low: f64,
    high: f64,
    pace: Pace,
}

impl March {
    pub(crate) fn new(surface: &Grid<f32>, pace: Pace) -> Self {
        let (low, high) = surface.range();
        Self {
            surface: surface.clone(),
            low: f64::from(low),
            high: f64::from(high),
            pace,
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

    /// Steps over a part of the ray of length `length` in multiples of its direction.
    fn steps(&self, ray: &Ray, length: f64) -> u32 {
        match self.pace {
            Pace::Steps(steps) => steps,
            Pace::Radius(cells) => {
                let level = ray.direction.x.hypot(ray.direction.z);
                let way = level * length / f64::from(self.surface.spec().spacing);
                (way / cells).ceil().clamp(1.0, f64::from(u16::MAX)) as u32
            }
        }
    }

    /// Height of a point above the surface, in the precision of a shader.
    fn above(&self, p: DVec3) -> f32 {
        p.y as f32 - self.surface.sample(Vec2::new(p.x as f32, p.z as f32))
    }
}

impl Caster for March {
    fn name(&self) -> &'static str {
        match self.pace {
            Pace::Steps(_) => "march",
            Pace::Radius(_) => "safety radius",
        }
    }

    fn rebuild(&mut self, elevation: &Grid<f32>) -> Result<(), HeightfieldError> {
        *self = Self::new(elevation, self.pace);
        Ok(())
    }

    fn cast(&self, ray: &Ray, t_min: f64, t_max: f64) -> Option<Hit> {
        let (from, to) = self.clip(ray, t_min, t_max)?;
        let steps = self.steps(ray, to - from);
        let step = (to - from) / f64::from(steps);
        let begins_above = self.above(ray.at(from)) >= 0.0;
        let crossed = |t: f64| (self.above(ray.at(t)) >= 0.0) != begins_above;
        let k = (1..=steps).find(|k| crossed(from + f64::from(*k) * step))?;
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
        let hit = March::new(&slope, Pace::Steps(64))
            .cast(&ray, 0.0, f64::INFINITY)
            .unwrap();
        assert!((hit.t - 16.0).abs() < 1e-5, "{hit:?}");
        let ridge = Grid::from_fn(spec, |i, _| if i == 19 { 4.0 } else { 0.0 });
        assert!(
            March::new(&ridge, Pace::Steps(8))
                .cast(&ray, 0.0, f64::INFINITY)
                .is_none()
        );
        assert!(
            March::new(&ridge, Pace::Steps(256))
                .cast(&ray, 0.0, f64::INFINITY)
                .is_some()
        );
        // The ridge is two cells wide at its foot and half a cell at the height of the ray.
        assert!(
            March::new(&ridge, Pace::Radius(16.0))
                .cast(&ray, 0.0, f64::INFINITY)
                .is_none()
        );
        assert!(
            March::new(&ridge, Pace::Radius(0.4))
                .cast(&ray, 0.0, f64::INFINITY)
                .is_some()
        );
    }
}
