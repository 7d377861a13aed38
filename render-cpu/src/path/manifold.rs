//! Sunlight that reaches a point under water through the waves, found by solving for the places of the surface that
//! send it there.
//!
//! A path tracer that leaves it to chance whether a ray from the bottom meets the sun (1 part in 10⁵ of the sky) needs
//! millions of samples. Here the surface point q whose refracted ray from P leaves along a given direction ω to the sun is
//! solved for by Newton's method, W(q) = ω with W the direction into the air of the ray from P through q. Waves may have
//! several solutions (between the branches of a caustic there are three). The start of each search is random; a solution
//! that is found with probability p counts 1/p, and 1/p is estimated without bias by counting how many further
//! searches it takes to find the same solution again (Zeltner, Georgiev & Jakob 2020, *Specular manifold sampling*,
//! doi:10.1145/3386569.3392408, §4.3).
//!
//! The share of the light is what a ray from P would bring back, changed from solid angles at P to those at the sun:
//! |∂Ω/∂q| / |∂ω/∂q|, with the differences taken on the very surface that rays meet, so that this estimator and one by
//! chance have the same mean.

use crate::caster::Ray;
use crate::stage::interface::keep_side;
use crate::stage::surface::Surface;
use crate::stage::world::{Medium, What, World, in_plan};
use glam::{DMat2, DVec2, DVec3, Vec3};
use meniscus_sim::optics::{fresnel, refract};
use meniscus_sim::rng::Rng;

/// Newton steps of one search.
const STEPS: usize = 24;
/// Sine of the angle between the solved and the wanted direction at which a search has arrived.
const ARRIVED: f64 = 1e-6;
/// Solutions nearer to each other than this many spacings are the same.
const SAME: f64 = 1e-3;
/// Searches after which a solution that was found once is taken to be that rare. Reached for one solution in a hundred
/// thousand or so; without an end one unlucky pixel would hold up a picture.
const MOST_TRIALS: u32 = 20_000;

/// Light that the sun sends through one place of the surface.
#[derive(Clone, Copy, Debug)]
pub(super) struct Connection {
    /// Unit direction from the point under water to the surface.
    pub(super) direction: Vec3,
    /// Metres of water on the way.
    pub(super) length: f32,
    /// Basic irradiance across the beam at the point over the sun's irradiance, absorption left out: what waves focus,
    /// what the interface lets through and 1/n² are in it, the chance of its being found is taken out.
    pub(super) share: f32,
}

/// How far waves can throw light sideways: radius of the disc, per metre of depth, in which solutions are sought.
pub(super) fn reach(water: &Surface, sun: Vec3, index: f32) -> Option<f64> {
    let flat = refract(-sun, Vec3::Y, 1.0 / index)?;
    let landing = |t: Vec3| DVec2::new(f64::from(t.x), f64::from(t.z)) / f64::from(-t.y);
    let steepest = water.steepest();
    let mut reach = 0.0_f64;
    for share in [0.25, 0.5, 0.75, 1.0] {
        for k in 0..16 {
            let (sin, cos) = (k as f32 * std::f32::consts::TAU / 16.0).sin_cos();
            let normal = Vec3::new(share * steepest * cos, 1.0, share * steepest * sin).normalize();
            if normal.dot(sun) <= 0.0 {
                continue;
            }
            if let Some(t) = refract(-sun, normal, 1.0 / index)
                && t.y < -1e-3
            {
                reach = reach.max((landing(t) - landing(flat)).length());
            }
        }
    }
    // A tenth more, and a little for a surface that is almost flat.
    Some(1.1 * reach + 1e-3)
}

/// Looks for the ways that sunlight takes through the waves to a point under water.
#[derive(Clone, Copy, Debug)]
pub(super) struct Manifold<'a> {
    pub(super) world: &'a World<'a>,
    /// See [`reach`].
    pub(super) reach: f64,
}

/// A place of the surface as seen from the point under water.
struct Place {
    /// From the point to the place, metres.
    way: DVec3,
    /// Direction into the air.
    out: Vec3,
    /// Share of light that passes the interface.
    passed: f32,
}

impl Manifold<'_> {
    /// One way of the light that comes along `-sun` (unit, `sun` points at it) to `point`, with how much it brings; `None`
    /// if this search found none. The mean over many calls is the sum over all ways.
    pub(super) fn connect(
        &self,
        point: DVec3,
        sun: Vec3,
        rng: &mut Rng,
        rays: &mut u64,
    ) -> Option<Connection> {
        let (a, b) = sun.any_orthonormal_pair();
        let sought = Sought { point, sun, a, b };
        let found = self.search(&sought, rng)?;
        let same = SAME * self.world.water.spacing();
        // How many searches it takes to find it again.
        let mut trials = 1;
        while trials < MOST_TRIALS {
            match self.search(&sought, rng) {
                Some(again) if (again - found).length() < same => break,
                _ => trials += 1,
            }
        }
        let connection = self.weigh(&sought, found)?;
        if !self.open(&sought, &connection, rays) {
            return None;
        }
        Some(Connection {
            share: connection.share * trials as f32,
            ..connection
        })
    }

    /// Where a search from a random start arrives.
    fn search(&self, sought: &Sought, rng: &mut Rng) -> Option<DVec2> {
        let depth = self
            .world
            .depth(sought.point)
            .max(1e-3 * self.world.water.spacing());
        let flat = refract(-sought.sun, Vec3::Y, 1.0 / self.world.index)?;
        let centre = in_plan(sought.point)
            - DVec2::new(f64::from(flat.x), f64::from(flat.z)) / f64::from(-flat.y) * depth;
        // Waves also move the surface up and down.
        let (low, high) = self.world.water.range();
        let radius = self.reach * depth + (high - low) * (1.0 + self.reach);
        let (r, angle) = (
            radius * rng.uniform().sqrt(),
            std::f64::consts::TAU * rng.uniform(),
        );
        let mut q = centre + r * DVec2::new(angle.cos(), angle.sin());
        let mut miss = self.miss(sought, q)?;
        for _ in 0..STEPS {
            if miss.length() < ARRIVED {
                return Some(q);
            }
            let slopes = self.slopes(sought, q)?;
            let step = -(slopes.inverse() * miss);
            if !step.is_finite() {
                return None;
            }
            // A full step unless it leads astray; then shorter ones.
            let mut length = (2.0 * radius / step.length().max(1e-30)).min(1.0);
            loop {
                let next = q + length * step;
                match self.miss(sought, next) {
                    Some(new) if new.length() < miss.length() => {
                        (q, miss) = (next, new);
                        break;
                    }
                    _ if length > 1e-3 => length *= 0.5,
                    _ => return None,
                }
            }
        }
        (miss.length() < ARRIVED).then_some(q)
    }

    /// The surface at `q` as seen from the point; `None` where it lies below the point or reflects all.
    fn place(&self, sought: &Sought, q: DVec2) -> Option<Place> {
        let water = self.world.water;
        let surface = DVec3::new(q.x, water.height(q), q.y);
        let way = surface - sought.point;
        let direction = way.try_normalize()?.as_vec3();
        let (slope, _) = water.slope(q);
        let normal = Vec3::new(-slope.x, 1.0, -slope.y).normalize();
        if direction.dot(normal) <= 1e-3 {
            return None;
        }
        let out = refract(direction, -normal, self.world.index)?;
        Some(Place {
            way,
            out,
            passed: 1.0 - fresnel(direction.dot(normal), self.world.index),
        })
    }

    /// Sines of the angles by which the ray through `q` misses the sun's direction.
    fn miss(&self, sought: &Sought, q: DVec2) -> Option<DVec2> {
        let out = self.place(sought, q)?.out;
        (out.dot(sought.sun) > 0.0).then(|| sought.across(out))
    }

    /// ∂W/∂q by central differences.
    fn slopes(&self, sought: &Sought, q: DVec2) -> Option<DMat2> {
        let h = 1e-2 * self.world.water.spacing();
        let d = |e: DVec2| Some((self.miss(sought, q + h * e)? - self.miss(sought, q - h * e)?) / (2.0 * h));
        Some(DMat2::from_cols(d(DVec2::X)?, d(DVec2::Y)?))
    }

    /// What a way brings.
    fn weigh(&self, sought: &Sought, q: DVec2) -> Option<Connection> {
        let place = self.place(sought, q)?;
        let length = place.way.length();
        let direction = place.way / length;
        let focus = self.slopes(sought, q)?.determinant().abs();
        // Solid angle at the point, of the facet that rays meet: a unit of plan seen across.
        let g = self.world.water.facet_slope(q);
        let solid = (direction.y - direction.x * g.x - direction.z * g.y) / (length * length);
        let share = solid / focus * f64::from(place.passed);
        (solid > 0.0 && share.is_finite()).then(|| Connection {
            direction: direction.as_vec3(),
            length: length as f32,
            share: share as f32,
        })
    }

    /// Whether nothing is in the way, under water and beyond.
    fn open(&self, sought: &Sought, way: &Connection, rays: &mut u64) -> bool {
        *rays += 2;
        let (world, length) = (self.world, f64::from(way.length));
        let ray = Ray {
            origin: sought.point,
            direction: way.direction.as_dvec3().normalize(),
        };
        let slack = 1e-3 * world.water.spacing() + 1e-5 * length;
        let Some(hit) = world.cast(&ray, Medium::Water, length + slack) else {
            return false;
        };
        if !matches!(hit.what, What::Water { glass: false }) || (hit.t - length).abs() > slack {
            return false;
        }
        let direction = keep_side(sought.sun, hit.normal.as_vec3()).as_dvec3().normalize();
        let out = Ray {
            origin: hit.position + world.hair * hit.normal,
            direction,
        };
        world.cast(&out, Medium::Air, f64::INFINITY).is_none()
    }
}

/// What is looked for, and from where.
struct Sought {
    point: DVec3,
    sun: Vec3,
    /// Two unit vectors across the sun's direction.
    a: Vec3,
    b: Vec3,
}

impl Sought {
    fn across(&self, out: Vec3) -> DVec2 {
        let out = out.as_dvec3();
        DVec2::new(out.dot(self.a.as_dvec3()), out.dot(self.b.as_dvec3()))
    }
}
