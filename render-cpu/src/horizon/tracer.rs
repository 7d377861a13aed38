//! What a ray brings back from a room of pictures.

use super::normals::Normals;
use super::room::Room;
use crate::caster::Ray;
use crate::stage::interface::keep_side;
use crate::stage::world::{Hit, Medium, What, World, in_plan};
use glam::{DVec3, Vec2, Vec3};
use meniscus_sim::optics::{fresnel, reflect, refract};
use meniscus_sim::scene::description::Horizon;
use std::f32::consts::PI;

/// Water surfaces after which a ray takes what it would see without further ones.
const MOST_SURFACES: u32 = 12;
/// Share of the pixel below which it does likewise: half a step of an 8-bit picture at most.
const CUTOFF: f32 = 2e-3;

/// Follows the rays of one thread.
pub(super) struct Tracer<'a> {
    world: &'a World<'a>,
    room: &'a Room,
    normals: &'a Normals<'a>,
    look: &'a Horizon,
    /// Basic irradiance of a level floor through still water, but for what the water absorbs, over π.
    on_floor: Vec3,
    /// Radiance of a white thing in the open, seen from anywhere.
    in_air: Vec3,
    pub(super) rays: u64,
}

#[derive(Clone, Copy)]
struct Path {
    ray: Ray,
    medium: Medium,
    spread: f32,
    width: f32,
    surfaces: u32,
    share: f32,
}

impl<'a> Tracer<'a> {
    pub(super) fn new(
        world: &'a World<'a>,
        room: &'a Room,
        normals: &'a Normals<'a>,
        look: &'a Horizon,
    ) -> Self {
        let light = world.light;
        let beam = light
            .beam
            .map_or(Vec3::ZERO, |beam| beam.irradiance * beam.direction.y);
        Self {
            world,
            room,
            normals,
            look,
            on_floor: (light.entering * light.sky.irradiance(Vec3::Y) + beam) / PI,
            in_air: light.level_irradiance() / PI,
            rays: 0,
        }
    }

    /// Radiance along a ray from the eye, seen through a cone of half-angle `spread`.
    pub(super) fn radiance(&mut self, ray: &Ray, medium: Medium, spread: f32) -> Vec3 {
        self.follow(&Path {
            ray: *ray,
            medium,
            spread,
            width: 0.0,
            surfaces: 0,
            share: 1.0,
        })
    }

    fn follow(&mut self, path: &Path) -> Vec3 {
        self.rays += 1;
        let within = match path.medium {
            Medium::Air => self.room.wall(&path.ray),
            Medium::Water => f64::INFINITY,
        };
        let hit = self.world.cast(&path.ray, path.medium, within);
        if path.medium == Medium::Water {
            return self.through_water(path, hit);
        }
        match hit {
            None => self.room.picture(&path.ray, &self.world.light.sky, path.spread),
            Some(hit) => self.surface(path, &hit),
        }
    }

    /// A way through water, to the floor at the latest.
    fn through_water(&mut self, path: &Path, hit: Option<Hit>) -> Vec3 {
        let ray = &path.ray;
        let floor = if self.world.ground.is_none() && ray.direction.y < 0.0 {
            ((self.room.floor - ray.origin.y) / ray.direction.y).max(0.0)
        } else {
            f64::INFINITY
        };
        let length = hit.map_or(f64::INFINITY, |h| h.t).min(floor);
        let left = self.world.volume.transmittance(length as f32);
        match hit.filter(|h| h.t <= floor) {
            Some(hit) => left * self.surface(path, &hit),
            None if floor.is_finite() => left * self.floor(path, ray.at(floor), floor),
            None => Vec3::ZERO,
        }
    }

    fn surface(&mut self, path: &Path, hit: &Hit) -> Vec3 {
        match hit.what {
            What::Water { glass } => self.water(path, hit, glass),
            What::Ground if path.medium == Medium::Water => self.floor(path, hit.position, hit.t),
            What::Ground => {
                let width = path.width + path.spread * hit.t as f32;
                let matt = self.world.ground_matt(hit, path.ray.direction, width);
                matt.map_or(Vec3::ZERO, |matt| matt.albedo * self.in_air)
            }
            What::Wall => self.world.look.wall() * self.in_air,
            What::Object { color, .. } => {
                let up = 0.5 + 0.5 * hit.normal.y.abs() as f32;
                color * up * self.in_air
            }
            What::Droplet { .. } => self.room.picture(&path.ray, &self.world.light.sky, path.spread),
        }
    }

    /// Light of the floor at `p`, after `way` metres.
    fn floor(&self, path: &Path, p: DVec3, way: f64) -> Vec3 {
        let world = self.world;
        let slope = world.ground.map_or(Vec2::ZERO, |g| g.slope(in_plan(p)).0);
        let depth = world.depth(p).max(0.0) as f32;
        let width = path.width + path.spread * way as f32;
        let (albedo, _) = world.look.shade(in_plan(p), slope, -depth, width);
        self.look.floor * albedo * self.on_floor * world.volume.diffuse_transmittance(depth)
    }

    fn water(&mut self, path: &Path, hit: &Hit, glass: bool) -> Vec3 {
        let world = self.world;
        let direction = path.ray.direction.as_vec3();
        let from_water = hit.normal.dot(path.ray.direction) > 0.0;
        let side = if from_water { -1.0 } else { 1.0 };
        let facing = side * hit.normal;
        let at = in_plan(hit.position);
        let width = path.width + path.spread * hit.t as f32;
        // Beyond the mesh the water goes on smoothly. The cone widens by what the normal turns within it.
        let (normal, turn) = if glass {
            (hit.normal.as_vec3(), 0.0)
        } else {
            let (slope, curvature) = world.water.slope(at);
            let smooth = || Vec3::new(-slope.x, 1.0, -slope.y).normalize();
            (
                self.normals.at(at).unwrap_or_else(smooth),
                (curvature * width).min(0.5),
            )
        };
        // A blended normal may face away where its face does not: the ray then skims the surface.
        let normal = keep_side(side as f32 * normal, -direction);
        let eta = if from_water {
            world.index
        } else {
            1.0 / world.index
        };
        let refracted = refract(direction, normal, eta);
        let share = match (refracted, self.look.mix) {
            (None, _) => 1.0,
            (Some(_), Some(mix)) => mix,
            (Some(_), None) => fresnel(-direction.dot(normal), eta),
        };
        let next = |direction: Vec3, side: f64, medium, spread: f32, share: f32| Path {
            ray: Ray {
                origin: hit.position + facing * (side * world.hair),
                direction: direction.as_dvec3().normalize(),
            },
            medium,
            spread,
            width,
            surfaces: path.surfaces + 1,
            share: path.share * share,
        };
        let (near, far) = if from_water {
            (Medium::Water, Medium::Air)
        } else {
            (Medium::Air, Medium::Water)
        };
        let up = facing.as_vec3();
        let mirrored = keep_side(reflect(direction, normal), up);
        let reflected = next(mirrored, 1.0, near, path.spread + 2.0 * turn, share);
        let mut sum = share * self.branch(&reflected);
        if let Some(through) = refracted {
            let through = keep_side(through, -up);
            let below = next(through, -1.0, far, path.spread + 0.5 * turn, 1.0 - share);
            sum += (1.0 - share) * self.branch(&below);
        }
        sum
    }

    /// Follows a ray on if that can be seen, else takes what it would see without further waves.
    fn branch(&mut self, path: &Path) -> Vec3 {
        if path.surfaces < MOST_SURFACES && path.share >= CUTOFF {
            return self.follow(path);
        }
        match path.medium {
            Medium::Air => self.room.picture(&path.ray, &self.world.light.sky, path.spread),
            Medium::Water => self.floor(path, path.ray.origin, 0.0),
        }
    }
}
