//! Matt surfaces: the light that falls on them and what they send back.

use super::caustics;
use super::trace::{Path, Tracer};
use crate::caster::Ray;
use crate::stage::light::{DIFFUSE_PATH, Disc};
use crate::stage::matt::Matt;
use crate::stage::world::{Hit, Medium, in_plan};
use glam::{DVec3, Vec3};
use std::f32::consts::PI;

impl Tracer<'_> {
    pub(super) fn ground(&mut self, path: &Path, hit: &Hit, width: f32) -> Vec3 {
        match self.world.ground_matt(hit, path.ray.direction, width) {
            Some(matt) => self.lit(&matt, path.medium),
            None => Vec3::ZERO,
        }
    }

    /// Radiance of a matt surface.
    pub(super) fn lit(&mut self, matt: &Matt, medium: Medium) -> Vec3 {
        if self.settings.glow {
            return matt.albedo;
        }
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
        irradiance + self.photons.map_or(Vec3::ZERO, |maps| maps.above(matt))
    }

    fn irradiance_in_water(&mut self, matt: &Matt) -> Vec3 {
        let (light, volume) = (self.world.light, self.world.volume);
        let depth = self.world.depth(matt.position).max(0.0) as f32;
        let sky = light.entering * light.sky.irradiance(Vec3::Y) * volume.diffuse_transmittance(depth);
        let strength = light.beam.map(|beam| {
            let path = depth / beam.direction.y;
            (beam, path, beam.irradiance * volume.transmittance(path))
        });
        // Light that the bottom sends up is partly reflected back by the surface: the sum of the series.
        let back = (1.0 - light.entering) * matt.albedo * volume.transmittance(2.0 * DIFFUSE_PATH * depth);
        let level = sky + strength.map_or(Vec3::ZERO, |(beam, _, strength)| strength * beam.direction.y);
        let sent_back = back / (1.0 - back).max(Vec3::splat(1e-3)) * level;

        if let Some((maps, irradiance)) = self.photons.and_then(|maps| Some((maps, maps.below(matt)?))) {
            let more = if maps.sent_back() { Vec3::ZERO } else { sent_back };
            return irradiance * self.lean(matt) + more;
        }
        // What faces down or sideways sees the lit bottom as far as it does not see the surface.
        let up = 0.5 * (1.0 + matt.normal.y);
        let mut irradiance = sky * (up + (1.0 - up) * matt.albedo) * matt.open;
        if let Some((beam, path, strength)) = strength {
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
        irradiance + sent_back
    }

    /// By how much more the sun's beam falls on the detail of a surface than on the surface itself.
    fn lean(&self, matt: &Matt) -> f32 {
        let Some(beam) = self.world.light.beam else {
            return 1.0;
        };
        let even = matt.geometric.as_vec3().dot(beam.direction).max(0.2);
        (matt.normal.dot(beam.direction) / even).clamp(0.0, 2.0)
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
