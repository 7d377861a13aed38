//! What the water's surface does to a ray.

use super::world::{Hit, World, in_plan};
use glam::{DVec3, Vec2, Vec3};
use meniscus_sim::optics::{fresnel, reflect, refract};

pub(crate) use meniscus_sim::stage::FOAM_ALBEDO;

/// What a water interface does to a ray.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Interface {
    /// Share reflected.
    pub(crate) fresnel: f32,
    pub(crate) reflected: Vec3,
    /// `None` at total reflection.
    pub(crate) refracted: Option<Vec3>,
    /// Geometric normal towards the side that the ray comes from.
    pub(crate) facing: DVec3,
    /// Shading normal towards the side that the ray comes from.
    pub(crate) shading: Vec3,
    pub(crate) from_water: bool,
    /// Largest change of the normal's direction a metre.
    pub(crate) curvature: f32,
}

impl World<'_> {
    /// What happens to a ray at a water surface.
    pub(crate) fn interface(&self, direction: DVec3, hit: &Hit, glass: bool) -> Interface {
        let from_water = hit.normal.dot(direction) > 0.0;
        let side = if from_water { -1.0 } else { 1.0 };
        let facing = side * hit.normal;
        let (smooth, curvature) = if glass {
            (hit.normal.as_vec3(), 0.0)
        } else {
            let (slope, curvature) = self.water.slope(in_plan(hit.position));
            (Vec3::new(-slope.x, 1.0, -slope.y).normalize(), curvature)
        };
        let d = direction.as_vec3();
        let g = facing.as_vec3();
        let shading = towards_ray(side as f32 * smooth, d);
        let index = self.index;
        let eta = if from_water { index } else { 1.0 / index };
        let fresnel = fresnel(-d.dot(shading), eta);
        Interface {
            fresnel,
            reflected: keep_side(reflect(d, shading), g),
            refracted: refract(d, shading, eta).map(|t| keep_side(t, -g)),
            facing,
            shading,
            from_water,
            curvature,
        }
    }

    /// Share of the surface at `p` that foam covers, 0 to 1.
    pub(crate) fn foam_cover(&self, p: DVec3) -> f32 {
        let Some(foam) = self.foam else { return 0.0 };
        let spec = foam.spec();
        let q = spec.to_grid(in_plan(p).as_vec2());
        let beyond = (-q).max(q - (spec.size.as_vec2() - Vec2::ONE)).max_element();
        // Beyond the grid it fades within eight samples.
        foam.sample(in_plan(p).as_vec2()).clamp(0.0, 1.0) * (1.0 - beyond / 8.0).clamp(0.0, 1.0)
    }
}

/// The shading normal, tilted as far as needed to face the ray.
fn towards_ray(normal: Vec3, direction: Vec3) -> Vec3 {
    const LEAST: f32 = 1e-3;
    let along = normal.dot(direction);
    if along > -LEAST {
        (normal - direction * (along + LEAST)).normalize()
    } else {
        normal
    }
}

/// A direction on the side of `normal`, tilted as far as needed.
pub(crate) fn keep_side(direction: Vec3, normal: Vec3) -> Vec3 {
    const LEAST: f32 = 1e-4;
    let along = direction.dot(normal);
    if along < LEAST {
        (direction + normal * (LEAST - along)).normalize()
    } else {
        direction
    }
}
