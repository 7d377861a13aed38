//! One path of light, followed from the eye.

use super::Settings;
use super::dome::Dome;
use super::manifold::Manifold;
use super::scatter::Scatter;
use crate::caster::Ray;
use crate::sky::Sun;
use crate::stage::air;
use crate::stage::interface::FOAM_ALBEDO;
use crate::stage::matt::Matt;
use crate::stage::world::{Hit, Medium, What, World};
use glam::{DVec3, Vec3};
use meniscus_sim::optics::{fresnel, reflect, refract};
use meniscus_sim::rng::Rng;
use std::f32::consts::{PI, TAU};

/// Bounces from which a path may end by chance.
const CERTAIN_BOUNCES: u32 = 3;
/// Largest chance of going on.
const MOST_LIKELY: f32 = 0.95;
/// Inner reflections of a droplet after which its ray is given up (a share of 0.02 to that power is left).
const INNER_REFLECTIONS: u32 = 16;

/// Where a path begins.
#[derive(Clone, Copy, Debug)]
pub(super) struct Start {
    pub(super) ray: Ray,
    pub(super) medium: Medium,
    /// Half-angle of the pixel's cone.
    pub(super) spread: f32,
}

/// Follows paths.
pub(super) struct Tracer<'a> {
    pub(super) world: &'a World<'a>,
    pub(super) settings: &'a Settings,
    /// The sky's light by direction, where directions are chosen by it.
    pub(super) dome: Option<&'a Dome>,
    /// Finds sunlight through waves, where it is solved for.
    pub(super) manifold: Option<Manifold<'a>>,
    pub(super) rng: Rng,
    pub(super) rays: u64,
}

/// What lies between the present ray and the last place at which light was looked for: which light was found there
/// already, and must not be counted again when the ray meets it.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Looked {
    /// Nowhere: the ray comes from the eye by mirrors and lenses alone, or by a way that was not looked along.
    Nowhere,
    /// In air, straight away: the sun entirely; the sky by choice, against this density of the ray's own direction.
    InAir { density: f32 },
    /// Under water, where the sun was solved for; `crossed` is whether the surface has been left since.
    UnderWater { crossed: bool },
}

/// The path so far.
struct Walk {
    ray: Ray,
    medium: Medium,
    /// Factor on what the ray brings back.
    share: Vec3,
    found: Vec3,
    /// Width of the pixel's cone, metres.
    width: f32,
    spread: f32,
    looked: Looked,
    /// Whether it was scattered in the water.
    scattered: bool,
}

impl Tracer<'_> {
    /// Radiance that one random path brings back; its mean over paths is the truth.
    pub(super) fn radiance(&mut self, start: &Start) -> Vec3 {
        let mut walk = Walk {
            ray: start.ray,
            medium: start.medium,
            share: Vec3::ONE,
            found: Vec3::ZERO,
            width: 0.0,
            spread: start.spread,
            looked: Looked::Nowhere,
            scattered: false,
        };
        for bounce in 0..self.settings.most_bounces {
            if bounce >= CERTAIN_BOUNCES {
                let chance = walk.share.max_element().min(MOST_LIKELY);
                if self.rng.uniform_f32() >= chance {
                    break;
                }
                walk.share /= chance;
            }
            self.rays += 1;
            let hit = self.world.cast(&walk.ray, walk.medium, f64::INFINITY);
            let goes_on = match (hit, walk.medium) {
                (None, Medium::Air) => {
                    self.escape(&mut walk);
                    false
                }
                (hit, Medium::Water) => self.through_water(&mut walk, hit),
                (Some(hit), Medium::Air) => {
                    self.through_air(&mut walk, &hit);
                    self.meet(&mut walk, &hit)
                }
            };
            if !goes_on {
                break;
            }
        }
        walk.found
    }

    /// The sky and the sun's disc.
    fn escape(&self, walk: &mut Walk) {
        if self.settings.glow {
            return;
        }
        let light = self.world.light;
        let direction = walk.ray.direction.as_vec3();
        let weight = match (walk.looked, self.dome) {
            (Looked::InAir { density }, Some(dome)) => density / (density + dome.density(direction)),
            _ => 1.0,
        };
        // A cone of the pixel's width where the eye looks straight on; the picture's own texels otherwise.
        let spread = if walk.looked == Looked::Nowhere {
            walk.spread
        } else {
            0.0
        };
        walk.found += walk.share * weight * light.sky.radiance(direction, spread);
        let seen_before = matches!(
            walk.looked,
            Looked::InAir { .. } | Looked::UnderWater { crossed: true }
        );
        if let Some(sun) = light.sun.filter(|_| !seen_before) {
            walk.found += walk.share * disc(&sun, direction);
        }
    }

    fn through_air(&self, walk: &mut Walk, hit: &Hit) {
        if self.settings.glow {
            return;
        }
        if let Some(left) = air::transmittance(self.settings.visual_range, hit.t as f32) {
            let haze = self.world.light.sky.haze(walk.ray.direction.as_vec3());
            walk.found += walk.share * haze * (1.0 - left);
            walk.share *= left;
        }
    }

    /// A way through water: scattered once on it, or on to what lies at its end.
    fn through_water(&mut self, walk: &mut Walk, hit: Option<Hit>) -> bool {
        let volume = self.world.volume;
        let length = hit.map_or(f32::INFINITY, |h| h.t as f32);
        let scattering = volume.scattering();
        if scattering != Vec3::ZERO && !walk.scattered && !self.settings.glow {
            let (way, weight) = self.scatter_after(length);
            let here = walk.share * weight * scattering;
            let point = walk.ray.origin + f64::from(way) * walk.ray.direction;
            // Isotropic, 1/4π a steradian.
            walk.found += here * self.sun_below(point) / (4.0 * PI);
            // One of the two ways on, each as likely as its light is left; the other is made up for.
            let left = (volume.transmittance(length) * walk.share).max_element();
            let aside = here.max_element();
            let chance = if hit.is_some() {
                (aside / (aside + left)).clamp(0.05, 0.95)
            } else {
                1.0
            };
            if self.rng.uniform_f32() < chance {
                walk.share = here / chance;
                walk.ray = Ray {
                    origin: point,
                    direction: self.any_direction().as_dvec3(),
                };
                walk.looked = self.looked_below();
                walk.scattered = true;
                return true;
            }
            walk.share /= 1.0 - chance;
        }
        let Some(hit) = hit else { return false };
        walk.share *= volume.transmittance(length);
        self.meet(walk, &hit)
    }

    /// A distance within `length` metres of water, and e^(−c·distance) over its density: one of the three colours picks
    /// the distance by its own extinction, and the density is the mean of all three's.
    fn scatter_after(&mut self, length: f32) -> (f32, Vec3) {
        let extinction = self.world.volume.extinction;
        // An endless way is cut where nothing is left of any colour that is scattered.
        let slowest = extinction
            .to_array()
            .into_iter()
            .filter(|c| *c > 0.0)
            .fold(f32::INFINITY, f32::min);
        let length = length.min(60.0 / slowest);
        let color = ((3.0 * self.rng.uniform_f32()) as usize).min(2);
        // Share of the light of each colour that does not reach the end.
        let ending = Vec3::from_array(extinction.to_array().map(|c| -(-c * length).exp_m1()));
        let u = self.rng.uniform_f32();
        let c = extinction[color];
        let way = if c * length < 1e-4 {
            u * length
        } else {
            (-(-u * ending[color]).ln_1p() / c).min(length)
        };
        let passed = (-extinction * way).exp();
        let density: f32 = (0..3)
            .map(|k| {
                if extinction[k] * length < 1e-4 {
                    1.0 / length
                } else {
                    extinction[k] * passed[k] / ending[k]
                }
            })
            .sum::<f32>()
            / 3.0;
        (way, passed / density)
    }

    /// What a ray meets; whether the path goes on.
    fn meet(&mut self, walk: &mut Walk, hit: &Hit) -> bool {
        walk.width += walk.spread * hit.t as f32;
        let hair = self.world.hair;
        match hit.what {
            What::Water { glass } => self.interface(walk, hit, glass),
            What::Ground => match self.world.ground_matt(hit, walk.ray.direction, walk.width) {
                Some(matt) => self.matt(walk, &matt),
                None => false,
            },
            What::Wall => self.matt(walk, &Matt::flat(hit, self.world.look.wall(), hair)),
            What::Object {
                shading,
                color,
                shine,
            } => {
                // A hole in a model may show its inside: both normals turn to the ray.
                let away = hit.normal.dot(walk.ray.direction) > 0.0;
                let sign = if away { -1.0 } else { 1.0 };
                let facing = Hit {
                    normal: sign * hit.normal,
                    ..*hit
                };
                let matt = Matt {
                    normal: (sign * shading).as_vec3(),
                    ..Matt::flat(&facing, color, 1e3 * hair)
                };
                let scatter = shine.map(|shine| {
                    let out = -walk.ray.direction.as_vec3();
                    Scatter::glossy(matt.normal, color, shine, out)
                });
                self.scatter(walk, &matt, scatter.unwrap_or(Scatter::matt(matt.normal, color)))
            }
            What::Droplet { centre, radius } => self.droplet(walk, hit, centre, radius),
        }
    }

    fn interface(&mut self, walk: &mut Walk, hit: &Hit, glass: bool) -> bool {
        let at = self.world.interface(walk.ray.direction, hit, glass);
        let foam = if glass {
            0.0
        } else {
            self.world.foam_cover(hit.position)
        };
        if foam > 0.0 && self.rng.uniform_f32() < foam {
            let facing = Hit {
                normal: at.facing,
                ..*hit
            };
            let matt = Matt {
                normal: at.shading,
                ..Matt::flat(&facing, Vec3::splat(FOAM_ALBEDO), self.world.hair)
            };
            return self.matt(walk, &matt);
        }
        let refracted = at.refracted.filter(|_| self.rng.uniform_f32() >= at.fresnel);
        let (direction, side) = match refracted {
            Some(direction) => (direction, -1.0),
            None => (at.reflected, 1.0),
        };
        walk.ray = Ray {
            origin: hit.position + at.facing * (side * self.world.hair),
            direction: direction.as_dvec3().normalize(),
        };
        if refracted.is_some() {
            walk.medium = if at.from_water { Medium::Air } else { Medium::Water };
        }
        walk.looked = match walk.looked {
            // Straight through the surface from where the sun was solved for.
            Looked::UnderWater { crossed: false } if refracted.is_some() && !glass => {
                Looked::UnderWater { crossed: true }
            }
            _ => Looked::Nowhere,
        };
        // Water thinner than the offset that keeps a ray off its own surface: the ground is met at once.
        if walk.medium == Medium::Water && self.world.ground_height(walk.ray.origin) >= walk.ray.origin.y {
            let ground = Hit {
                t: 0.0,
                normal: self.world.ground_normal(hit.position),
                what: What::Ground,
                ..*hit
            };
            return match self.world.ground_matt(&ground, walk.ray.direction, walk.width) {
                Some(matt) => self.matt(walk, &matt),
                None => false,
            };
        }
        true
    }

    fn matt(&mut self, walk: &mut Walk, matt: &Matt) -> bool {
        self.scatter(walk, matt, Scatter::matt(matt.normal, matt.albedo))
    }

    /// An opaque surface: light that falls on it from where it is likely, and one more direction by chance.
    fn scatter(&mut self, walk: &mut Walk, matt: &Matt, scatter: Scatter) -> bool {
        if self.settings.glow {
            walk.found += walk.share * matt.albedo;
            return false;
        }
        let origin = matt.position + matt.lift * matt.geometric;
        match walk.medium {
            Medium::Air => {
                let light = self.sun_above(matt, &scatter, origin) + self.sky_above(matt, &scatter, origin);
                walk.found += walk.share * light;
            }
            Medium::Water => {
                if let Some((direction, irradiance)) = self.sun_way(origin)
                    && matt.geometric.dot(direction.as_dvec3()) > 0.0
                {
                    walk.found += walk.share * scatter.share(direction) * irradiance;
                }
            }
        }
        let direction = scatter.choose(&mut self.rng);
        let density = scatter.density(direction);
        if !(density > 0.0) || matt.geometric.dot(direction.as_dvec3()) <= 0.0 {
            return false;
        }
        walk.looked = match walk.medium {
            Medium::Air => Looked::InAir { density },
            Medium::Water => self.looked_below(),
        };
        walk.share *= scatter.share(direction) / density;
        walk.ray = Ray {
            origin,
            direction: direction.as_dvec3().normalize(),
        };
        true
    }

    fn looked_below(&self) -> Looked {
        match self.manifold {
            Some(_) => Looked::UnderWater { crossed: false },
            None => Looked::Nowhere,
        }
    }

    /// What a surface in air sends on of the sun's light.
    fn sun_above(&mut self, matt: &Matt, scatter: &Scatter, origin: DVec3) -> Vec3 {
        let Some(sun) = self.world.light.sun else {
            return Vec3::ZERO;
        };
        let (towards, light) = self.sun_point(&sun);
        let share = scatter.share(towards);
        if share != Vec3::ZERO && matt.geometric.dot(towards.as_dvec3()) > 0.0 && self.open(origin, towards) {
            light * share
        } else {
            Vec3::ZERO
        }
    }

    /// What a surface in air sends on of the sky's light, by a direction that the sky's light chose, weighted against the one
    /// that the surface will choose.
    fn sky_above(&mut self, matt: &Matt, scatter: &Scatter, origin: DVec3) -> Vec3 {
        let Some(dome) = self.dome else {
            return Vec3::ZERO;
        };
        let (towards, density) = dome.choose(std::array::from_fn(|_| self.rng.uniform_f32()));
        let share = scatter.share(towards);
        if share != Vec3::ZERO && matt.geometric.dot(towards.as_dvec3()) > 0.0 && self.open(origin, towards) {
            // The weight of the balance heuristic over the density.
            self.world.light.sky.radiance(towards, 0.0) * share / (density + scatter.density(towards))
        } else {
            Vec3::ZERO
        }
    }

    /// Scalar irradiance by the sun of a point under water.
    fn sun_below(&mut self, point: DVec3) -> Vec3 {
        self.sun_way(point)
            .map_or(Vec3::ZERO, |(_, irradiance)| irradiance)
    }

    /// One way of the sun's light to a point under water: direction to where it comes from, and irradiance across it.
    fn sun_way(&mut self, point: DVec3) -> Option<(Vec3, Vec3)> {
        let sun = self.world.light.sun?;
        let manifold = self.manifold?;
        let (towards, light) = self.sun_point(&sun);
        let way = manifold.connect(point, towards, &mut self.rng, &mut self.rays)?;
        let left = self.world.volume.transmittance(way.length);
        Some((way.direction, light * left * way.share))
    }

    /// A point of the sun's disc, all alike by solid angle, and what the whole disc would bring if it shone like that
    /// point: radiance times solid angle.
    fn sun_point(&mut self, sun: &Sun) -> (Vec3, Vec3) {
        let height = 2.0 * (0.5 * sun.radius).sin().powi(2);
        let down = height * self.rng.uniform_f32();
        let r = (down * (2.0 - down)).max(0.0).sqrt();
        let (sin, cos) = (TAU * self.rng.uniform_f32()).sin_cos();
        let (a, b) = sun.direction.any_orthonormal_pair();
        let towards = ((1.0 - down) * sun.direction + r * (cos * a + sin * b)).normalize();
        (towards, disc_radiance(sun) * (TAU * height))
    }

    /// Whether the way from a place in air to the sky is free, of water too: light through a crest comes by chance.
    fn open(&mut self, origin: DVec3, direction: Vec3) -> bool {
        self.rays += 1;
        let ray = Ray {
            origin,
            direction: direction.as_dvec3().normalize(),
        };
        self.world.cast(&ray, Medium::Air, f64::INFINITY).is_none()
    }

    /// A sphere of water in the air.
    fn droplet(&mut self, walk: &mut Walk, hit: &Hit, centre: DVec3, radius: f64) -> bool {
        let index = self.world.index;
        let hair = self.world.hair;
        let mut direction = walk.ray.direction.as_vec3();
        walk.looked = Looked::Nowhere;
        let outside = fresnel(-direction.dot(hit.normal.as_vec3()), 1.0 / index);
        let entered = refract(direction, hit.normal.as_vec3(), 1.0 / index)
            .filter(|_| self.rng.uniform_f32() >= outside);
        let Some(inside) = entered else {
            walk.ray = Ray {
                origin: hit.position + hair * hit.normal,
                direction: reflect(direction, hit.normal.as_vec3()).as_dvec3().normalize(),
            };
            return true;
        };
        direction = inside;
        let mut position = hit.position;
        let mut normal = hit.normal;
        for _ in 0..INNER_REFLECTIONS {
            // The chord ends where it makes the same angle with the sphere as at its start.
            let chord = -2.0 * direction.as_dvec3().dot(normal) * radius;
            walk.share *= self.world.volume.transmittance(chord as f32);
            position += chord * direction.as_dvec3();
            normal = (position - centre).normalize();
            let inwards = -normal.as_vec3();
            let kept = fresnel(-direction.dot(inwards), index);
            if let Some(out) = refract(direction, inwards, index).filter(|_| self.rng.uniform_f32() >= kept) {
                walk.ray = Ray {
                    origin: position + hair * normal,
                    direction: out.as_dvec3().normalize(),
                };
                return true;
            }
            direction = reflect(direction, inwards);
        }
        false
    }

    /// Any direction, all alike.
    fn any_direction(&mut self) -> Vec3 {
        let y = 1.0 - 2.0 * self.rng.uniform_f32();
        let (sin, cos) = (TAU * self.rng.uniform_f32()).sin_cos();
        let r = (1.0 - y * y).max(0.0).sqrt();
        Vec3::new(r * cos, y, r * sin).normalize()
    }
}

/// Radiance of the sun's disc in a direction, the same all over it.
fn disc(sun: &Sun, direction: Vec3) -> Vec3 {
    // |a − b| of unit vectors is 2 sin(θ/2).
    if (direction - sun.direction).length() <= 2.0 * (0.5 * sun.radius).sin() {
        disc_radiance(sun)
    } else {
        Vec3::ZERO
    }
}

/// Radiance with which a disc of its size gives a surface that faces it the sun's irradiance.
fn disc_radiance(sun: &Sun) -> Vec3 {
    sun.irradiance / (PI * sun.radius.sin().powi(2))
}
