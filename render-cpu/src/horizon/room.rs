//! The room of pictures about the water.

use crate::caster::Ray;
use crate::sky::Sky;
use crate::stage::light::Disc;
use glam::{DVec2, DVec3, Vec3};
use meniscus_sim::Scene;
use meniscus_sim::scene::description::Horizon;

/// Distance of the walls from the water, in longer sides of the domain, where the scene does not say.
const DISTANCE: f64 = 0.5;
/// Depth of the floor likewise.
const DEPTH: f64 = 0.1;
/// Room left behind an eye that stands beyond the walls, as a share of its distance from the middle.
const BEHIND_EYE: f64 = 0.1;

/// Four upright walls as high as the sky. What hangs on them is the sky as it is seen from the middle of the water.
#[derive(Clone, Copy, Debug)]
pub(super) struct Room {
    low: DVec2,
    high: DVec2,
    /// Middle of the water's surface at rest.
    middle: DVec3,
    /// Height of the floor where the scene has no ground, metres.
    pub(super) floor: f64,
}

impl Room {
    pub(super) fn new(scene: &Scene, look: &Horizon, eye: DVec3) -> Self {
        let spec = scene.grid;
        let extent = spec.extent().as_dvec2();
        let longer = extent.max_element().max(f64::from(spec.spacing));
        let distance = look.distance.map_or(DISTANCE * longer, f64::from);
        let origin = spec.origin.as_dvec2();
        let middle = origin + 0.5 * extent;
        let level = f64::from(scene.description.water.level);
        let eye = DVec2::new(eye.x, eye.z);
        // Seen from beyond a wall, the picture on it would be in the way of the water.
        let behind = eye + BEHIND_EYE * (eye - middle);
        Self {
            low: (origin - distance).min(behind),
            high: (origin + extent + distance).max(behind),
            middle: DVec3::new(middle.x, level, middle.y),
            floor: level - look.depth.map_or(DEPTH * longer, f64::from),
        }
    }

    /// How far along the ray its wall is; infinite straight up and down.
    pub(super) fn wall(&self, ray: &Ray) -> f64 {
        let along = |o: f64, d: f64, low: f64, high: f64| {
            if d == 0.0 {
                f64::INFINITY
            } else {
                ((if d > 0.0 { high } else { low }) - o) / d
            }
        };
        let (o, d) = (ray.origin, ray.direction);
        along(o.x, d.x, self.low.x, self.high.x)
            .min(along(o.z, d.z, self.low.y, self.high.y))
            .max(0.0)
    }

    /// What the ray sees on its wall, through a cone of half-angle `spread`.
    pub(super) fn picture(&self, ray: &Ray, sky: &Sky, spread: f32) -> Vec3 {
        let wall = self.wall(ray);
        let seen = if wall.is_finite() {
            (ray.at(wall) - self.middle).try_normalize()
        } else {
            None
        };
        let direction = seen.unwrap_or(ray.direction).as_vec3();
        let sun = sky.sun().map_or(Vec3::ZERO, |sun| sun.disc(direction, spread));
        sky.radiance(direction, spread) + sun
    }
}
