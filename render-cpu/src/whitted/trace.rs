//! The recursion: what a ray brings back.

use super::Settings;
use super::caustics::Caustics;
use crate::caster::Ray;
use crate::photon::Maps;
use crate::stage::air;
use crate::stage::interface::{FOAM_ALBEDO, Interface};
use crate::stage::light::Disc;
use crate::stage::matt::Matt;
use crate::stage::world::{Hit, Medium, What, World};
use glam::{DVec3, Vec3};
use meniscus_sim::optics::{fresnel, reflect, refract};

/// Interfaces at which a ray is still followed after it is no longer split.
const UNSPLIT_INTERFACES: u32 = 8;

/// A ray with what it carries.
#[derive(Clone, Copy, Debug)]
pub(super) struct Path {
    pub(super) ray: Ray,
    pub(super) medium: Medium,
    /// Width of the ray's cone at its origin, metres, and how fast it grows, metres a metre.
    pub(super) width: f32,
    pub(super) spread: f32,
    /// Interfaces met so far.
    pub(super) interfaces: u32,
    /// Largest share that what this ray sees has in its pixel.
    pub(super) weight: f32,
}

/// Follows the rays of one thread.
#[derive(Clone, Copy, Debug)]
pub(super) struct Tracer<'a> {
    pub(super) world: &'a World<'a>,
    pub(super) settings: &'a Settings,
    /// Sunlight that waves focus on the ground, where there is any.
    pub(super) caustics: Option<&'a Caustics>,
    /// Light that was followed through the water, where it was.
    pub(super) photons: Option<&'a Maps>,
    /// Point of the sun's disc that shadow rays of the present sample aim at.
    pub(super) sun_point: [f32; 2],
    /// Rays cast so far.
    pub(super) rays: u64,
}

impl Tracer<'_> {
    /// Radiance that the ray brings back.
    pub(super) fn radiance(&mut self, path: Path) -> Vec3 {
        self.rays += 1;
        let hit = self.world.cast(&path.ray, path.medium, f64::INFINITY);
        let direction = path.ray.direction.as_vec3();
        match (hit, path.medium) {
            (None, Medium::Air) => self.escaped(direction, path.spread),
            (None, Medium::Water) if self.settings.glow => Vec3::ZERO,
            (None, Medium::Water) => {
                let depth = self.world.depth(path.ray.origin) as f32;
                self.world.volume.scattered(depth, -direction.y, f32::INFINITY)
            }
            (Some(hit), Medium::Air) => {
                let seen = self.surface(&path, &hit, Vec3::ONE);
                air::through(
                    self.world.light,
                    self.settings.visual_range,
                    seen,
                    direction,
                    hit.t as f32,
                )
            }
            (Some(hit), Medium::Water) => {
                let volume = self.world.volume;
                let length = hit.t as f32;
                if volume.is_clear() {
                    return self.surface(&path, &hit, Vec3::ONE);
                }
                let left = volume.transmittance(length);
                let depth = self.world.depth(path.ray.origin) as f32;
                let added = if self.settings.glow {
                    Vec3::ZERO
                } else {
                    volume.scattered(depth, -direction.y, length)
                };
                left * self.surface(&path, &hit, left) + added
            }
        }
    }

    fn escaped(&self, direction: Vec3, spread: f32) -> Vec3 {
        if self.settings.glow {
            return Vec3::ZERO;
        }
        let light = self.world.light;
        let mut radiance = light.sky.radiance(direction, spread);
        if let Some(sun) = &light.sun {
            radiance += sun.disc(direction, spread);
        }
        radiance
    }

    /// `left` is the share of the surface's radiance that the medium lets through to the ray's origin.
    fn surface(&mut self, path: &Path, hit: &Hit, left: Vec3) -> Vec3 {
        let width = path.width + path.spread * hit.t as f32;
        match hit.what {
            What::Water { .. } => {
                let weight = path.weight * left.max_element();
                self.water(&Path { weight, ..*path }, hit, width)
            }
            What::Ground => self.ground(path, hit, width),
            What::Wall => {
                let albedo = self.world.look.wall();
                self.lit(&Matt::flat(hit, albedo, self.world.hair), path.medium)
            }
            What::Object { shading, color, .. } => {
                // A hole in a model may show its inside: both normals turn to the ray.
                let away = hit.normal.dot(path.ray.direction) > 0.0;
                let sign = if away { -1.0 } else { 1.0 };
                let hit = Hit {
                    normal: sign * hit.normal,
                    ..*hit
                };
                let normal = (sign * shading).as_vec3();
                let matt = Matt {
                    normal,
                    ..Matt::flat(&hit, color, 1e3 * self.world.hair)
                };
                self.lit(&matt, path.medium)
            }
            What::Droplet { centre, radius } => self.droplet(path, hit, centre, radius, width),
        }
    }

    fn water(&mut self, path: &Path, hit: &Hit, width: f32) -> Vec3 {
        let glass = matches!(hit.what, What::Water { glass: true });
        let at = self.world.interface(path.ray.direction, hit, glass);
        let foam = if glass {
            0.0
        } else {
            self.world.foam_cover(hit.position)
        };
        let water = if foam < 1.0 {
            self.split(path, hit, &at, width)
        } else {
            Vec3::ZERO
        };
        if foam <= 0.0 {
            return water;
        }
        let normal = at.shading * at.shading.y.signum();
        let matt = Matt {
            normal,
            ..Matt::flat(hit, Vec3::splat(FOAM_ALBEDO), self.world.hair)
        };
        water.lerp(self.lit(&matt, Medium::Air), foam)
    }

    /// Reflection and refraction at a water surface.
    fn split(&mut self, path: &Path, hit: &Hit, at: &Interface, width: f32) -> Vec3 {
        let settings = self.settings;
        if path.interfaces >= settings.interface_depth + UNSPLIT_INTERFACES {
            return self.given_up(path);
        }
        let cos = at.shading.dot(-path.ray.direction.as_vec3()).max(0.05);
        // The cone widens by what the normal turns within it, twice for a mirror, (n − 1) times or so for a lens.
        let turn = (at.curvature * width).min(0.5) + settings.roughness;
        let after = |path: &Path, direction: Vec3, medium, spread: f32, share: f32| Path {
            ray: Ray {
                origin: hit.position
                    + at.facing
                        * if direction.dot(at.facing.as_vec3()) > 0.0 {
                            self.world.hair
                        } else {
                            -self.world.hair
                        },
                direction: direction.as_dvec3().normalize(),
            },
            medium,
            width,
            spread,
            interfaces: path.interfaces + 1,
            weight: path.weight * share,
        };
        let (near, far) = if at.from_water {
            (Medium::Water, Medium::Air)
        } else {
            (Medium::Air, Medium::Water)
        };
        let reflected = after(path, at.reflected, near, path.spread + 2.0 * turn, at.fresnel);
        let Some(direction) = at.refracted else {
            return self.radiance(reflected);
        };
        let refracted = after(
            path,
            direction,
            far,
            path.spread + 0.5 * turn / cos,
            1.0 - at.fresnel,
        );
        if path.interfaces >= settings.interface_depth {
            // No longer split: the likelier way stands for both.
            return self.radiance(if at.fresnel > 0.5 { reflected } else { refracted });
        }
        if self.negligible(&reflected) {
            return self.enter(refracted, hit);
        }
        if self.negligible(&refracted) {
            return self.radiance(reflected);
        }
        at.fresnel * self.radiance(reflected) + (1.0 - at.fresnel) * self.enter(refracted, hit)
    }

    /// Whether a branch can be left to the other one: its share is below the cut-off, also of the sun.
    fn negligible(&self, path: &Path) -> bool {
        let cutoff = self.settings.cutoff;
        path.weight < cutoff
            && self.world.light.sun.is_none_or(|sun| {
                let disc = sun.disc(path.ray.direction.as_vec3(), path.spread).max_element();
                path.weight * disc < cutoff * sun.irradiance.max_element()
            })
    }

    /// A refracted ray; where the water is thinner than the offset that keeps a ray off its own surface, the ground
    /// is met at once.
    fn enter(&mut self, path: Path, hit: &Hit) -> Vec3 {
        if path.medium == Medium::Water && self.world.ground_height(path.ray.origin) >= path.ray.origin.y {
            let normal = self.world.ground_normal(hit.position);
            let hit = Hit {
                t: 0.0,
                normal,
                what: What::Ground,
                ..*hit
            };
            return self.ground(&path, &hit, path.width);
        }
        self.radiance(path)
    }

    /// After too many interfaces: the mean light of the medium.
    fn given_up(&self, path: &Path) -> Vec3 {
        if self.settings.glow {
            return Vec3::ZERO;
        }
        let light = self.world.light;
        match path.medium {
            Medium::Air => light.sky.radiance(path.ray.direction.as_vec3(), 0.5),
            Medium::Water => {
                self.world
                    .volume
                    .scattered(self.world.depth(path.ray.origin) as f32, 1.0, f32::INFINITY)
            }
        }
    }

    /// A sphere of water in the air: reflected once, or refracted in and out.
    fn droplet(&mut self, path: &Path, hit: &Hit, centre: DVec3, radius: f64, width: f32) -> Vec3 {
        if path.interfaces >= self.settings.interface_depth + UNSPLIT_INTERFACES {
            return self.given_up(path);
        }
        let index = self.world.index;
        let d = path.ray.direction.as_vec3();
        let n = hit.normal.as_vec3();
        let share = fresnel(-d.dot(n), 1.0 / index);
        let hair = self.world.hair;
        let spread = path.spread + (width / radius as f32).min(0.5);
        let next = |direction: Vec3, origin: DVec3, share: f32| Path {
            ray: Ray {
                origin,
                direction: direction.as_dvec3().normalize(),
            },
            medium: Medium::Air,
            width,
            spread,
            interfaces: path.interfaces + 1,
            weight: path.weight * share,
        };
        let mirrored = next(reflect(d, n), hit.position + hair * hit.normal, share);
        let Some(inside) = refract(d, n, 1.0 / index) else {
            return self.radiance(mirrored);
        };
        // The chord ends where it makes the same angle with the sphere as at its start.
        let chord = -2.0 * inside.as_dvec3().dot(hit.normal) * radius;
        let exit = hit.position + chord * inside.as_dvec3();
        let outwards = (exit - centre).normalize();
        let Some(leaving) = refract(inside, -outwards.as_vec3(), index) else {
            return self.radiance(mirrored);
        };
        let through = next(leaving, exit + hair * outwards, 1.0 - share);
        let left = self.world.volume.transmittance(chord as f32);
        if path.interfaces >= self.settings.interface_depth || share * path.weight < self.settings.cutoff {
            return left * self.radiance(through);
        }
        share * self.radiance(mirrored) + (1.0 - share) * left * self.radiance(through)
    }
}
