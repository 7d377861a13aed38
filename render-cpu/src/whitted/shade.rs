//! Matt surfaces: the light that falls on them and what they send back.

use super::caustics;
use super::trace::{Path, Tracer};
use crate::caster::Ray;
use crate::stage::light::{DIFFUSE_PATH, Disc};
use crate::stage::world::{Hit, Medium, in_plan};
use glam::{DVec3, Vec2, Vec3};
use std::f32::consts::PI;

/// A point of a matt surface.
#[derive(Clone, Copy, Debug)]
pub(super) struct Matt {
    pub(super) position: DVec3,
    /// Unit normal of the surface, away from its solid side.
    pub(super) geometric: DVec3,
    /// Unit normal for shading.
    pub(super) normal: Vec3,
    pub(super) albedo: Vec3,
    /// Share of the sky that it sees, of what its normal would let it.
    pub(super) open: f32,
    /// How far above the surface shadow rays start, metres.
    pub(super) lift: f64,
    /// Whether waves focus sunlight on it.
    pub(super) caustics: bool,
}

impl Matt {
    /// In the open, shaded by its geometric normal.
    pub(super) fn flat(hit: &Hit, albedo: Vec3, lift: f64) -> Self {
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

impl Tracer<'_> {
    pub(super) fn ground_normal(&self, p: DVec3) -> DVec3 {
        let slope = self
            .world
            .ground
            .map_or(Vec2::ZERO, |g| g.slope(in_plan(p)).0)
            .as_dvec2();
        DVec3::new(-slope.x, 1.0, -slope.y).normalize()
    }

    pub(super) fn ground(&mut self, path: &Path, hit: &Hit, width: f32) -> Vec3 {
        let Some(ground) = self.world.ground else {
            return Vec3::ZERO;
        };
        let at = in_plan(hit.position);
        let (slope, _) = ground.slope(at);
        let above = -self.world.depth(hit.position) as f32;
        // The footprint stretches where the ground is seen at a slant.
        let cos = hit.normal.dot(path.ray.direction).abs().max(0.1) as f32;
        let (albedo, slope) = self.world.look.shade(at, slope, above, width / cos.sqrt());
        // Where the smooth ground is in light but the flat facet turns from it, a shadow ray that starts on the facet
        // would draw the facets: it starts a little above.
        let relief = if self.world.openness.is_some() {
            0.02 * ground.spacing()
        } else {
            0.0
        };
        let matt = Matt {
            normal: Vec3::new(-slope.x, 1.0, -slope.y).normalize(),
            open: self.world.openness.map_or(1.0, |o| o.sample(at.as_vec2())),
            caustics: true,
            ..Matt::flat(hit, albedo, self.world.hair.max(relief))
        };
        self.lit(&matt, path.medium)
    }

    /// Radiance of a matt surface.
    pub(super) fn lit(&mut self, matt: &Matt, medium: Medium) -> Vec3 {
        let irradiance = match medium {
            Medium::Air => self.irradiance_in_air(matt),
            Medium::Water => self.irradiance_in_water(matt),
        };
        matt.albedo * irradiance / PI
    }

    fn irradiance_in_air(&mut self, matt: &Matt) -> Vec3 {
        let light = self.world.light;
        let mut irradiance = light.ambient(matt.normal) * matt.open;
        if let Some(sun) = &light.sun {
            let towards = sun.sample(self.sun_point);
            let cos = matt.normal.dot(towards);
            let origin = matt.position + matt.geometric * matt.lift;
            if cos > 0.0 && !self.shadowed(origin, towards.as_dvec3(), f64::INFINITY) {
                irradiance += sun.irradiance * cos;
            }
        }
        irradiance
    }

    fn irradiance_in_water(&mut self, matt: &Matt) -> Vec3 {
        let (light, volume) = (self.world.light, self.world.volume);
        let depth = self.world.depth(matt.position).max(0.0) as f32;
        let sky = light.entering * light.sky.irradiance(Vec3::Y) * volume.diffuse_transmittance(depth);
        // What faces down or sideways sees the lit bottom as far as it does not see the surface.
        let up = 0.5 * (1.0 + matt.normal.y);
        let mut irradiance = sky * (up + (1.0 - up) * matt.albedo) * matt.open;
        let mut level = sky;
        if let Some(beam) = &light.beam {
            let path = depth / beam.direction.y;
            let strength = beam.irradiance * volume.transmittance(path);
            level += strength * beam.direction.y;
            let cos = match self.caustics.filter(|_| matt.caustics) {
                Some(map) => {
                    let share = map.at(in_plan(matt.position).as_vec2());
                    caustics::received(beam.direction, matt.normal, matt.geometric, share)
                }
                None => matt.normal.dot(beam.direction),
            };
            let origin = matt.position + matt.geometric * matt.lift;
            if cos > 0.0 && !self.shadowed_below(origin, beam.direction, f64::from(path)) {
                irradiance += strength * cos;
            }
        }
        // Light that the bottom sends up is partly reflected back by the surface: the sum of the series.
        let back = (1.0 - light.entering) * matt.albedo * volume.transmittance(2.0 * DIFFUSE_PATH * depth);
        irradiance + back / (1.0 - back).max(Vec3::splat(1e-3)) * level
    }

    fn shadowed(&mut self, origin: DVec3, direction: DVec3, t_max: f64) -> bool {
        self.rays += 1;
        self.world.occluded(&Ray { origin, direction }, t_max)
    }

    /// Shadow under water: along the refracted beam to the level of the surface above, then on to the sun.
    fn shadowed_below(&mut self, origin: DVec3, direction: Vec3, path: f64) -> bool {
        let direction = direction.as_dvec3();
        if self.shadowed(origin, direction, path) {
            return true;
        }
        let Some(sun) = self.world.light.sun else {
            return false;
        };
        let out = origin + direction * path;
        self.shadowed(out, sun.sample(self.sun_point).as_dvec3(), f64::INFINITY)
    }
}
