//! Matt surfaces: where they are and which way they face.

use super::world::{Hit, World, in_plan};
use glam::{DVec3, Vec2, Vec3};

/// A point of a matt surface.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Matt {
    pub(crate) position: DVec3,
    /// Unit normal of the surface, away from its solid side.
    pub(crate) geometric: DVec3,
    /// Unit normal for shading.
    pub(crate) normal: Vec3,
    pub(crate) albedo: Vec3,
    /// Share of the sky that it sees, of what its normal would let it.
    pub(crate) open: f32,
    /// How far above the surface shadow rays start, metres.
    pub(crate) lift: f64,
    /// Whether waves focus sunlight on it.
    pub(crate) caustics: bool,
}

impl Matt {
    /// In the open, shaded by its geometric normal.
    pub(crate) fn flat(hit: &Hit, albedo: Vec3, lift: f64) -> Self {
        Self {
            position: hit.position,
            geometric: hit.normal,
            normal: hit.normal.as_vec3(),
            albedo,
            open: 1.0,
            lift,
            caustics: false,
        }
    }
}

impl World<'_> {
    /// Smooth upward normal of the ground at `p`.
    pub(crate) fn ground_normal(&self, p: DVec3) -> DVec3 {
        let slope = self
            .ground
            .map_or(Vec2::ZERO, |g| g.slope(in_plan(p)).0)
            .as_dvec2();
        DVec3::new(-slope.x, 1.0, -slope.y).normalize()
    }

    /// The ground at a hit of a ray along `direction` whose pixel is `width` metres wide there; `None` without ground.
    pub(crate) fn ground_matt(&self, hit: &Hit, direction: DVec3, width: f32) -> Option<Matt> {
        let ground = self.ground?;
        let at = in_plan(hit.position);
        let (slope, _) = ground.slope(at);
        let above = -self.depth(hit.position) as f32;
        // The footprint stretches where the ground is seen at a slant.
        let cos = hit.normal.dot(direction).abs().max(0.1) as f32;
        let (albedo, slope) = self.look.shade(at, slope, above, width / cos.sqrt());
        // Where the smooth ground is in light but the flat facet turns from it, a shadow ray that starts on the facet
        // would draw the facets: it starts a little above.
        let relief = if self.openness.is_some() {
            0.02 * ground.spacing()
        } else {
            0.0
        };
        Some(Matt {
            normal: Vec3::new(-slope.x, 1.0, -slope.y).normalize(),
            open: self.openness.map_or(1.0, |o| o.sample(at.as_vec2())),
            caustics: true,
            ..Matt::flat(hit, albedo, self.hair.max(relief))
        })
    }
}
