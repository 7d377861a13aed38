//! Everything that a ray can meet, and what it meets first.

use super::droplets::Spray;
use super::objects::Placed;
use super::surface::Surface;
use crate::caster::Ray;
use glam::{DVec2, DVec3, Vec3};
use meniscus_sim::Grid;
use meniscus_sim::mesh::Shine;
use meniscus_sim::stage::ground::Ground;
use meniscus_sim::stage::light::Light;
use meniscus_sim::stage::surroundings::Edges;
use meniscus_sim::stage::volume::Volume;

/// What a ray travels in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Medium {
    Air,
    Water,
}

/// What a ray meets.
#[derive(Clone, Copy, Debug)]
pub(crate) enum What {
    /// The water's surface or a glass side of it; the normal points into the air.
    Water {
        glass: bool,
    },
    Ground,
    /// A side of a basin or the deck around it.
    Wall,
    Object {
        shading: DVec3,
        color: Vec3,
        shine: Option<Shine>,
    },
    Droplet {
        centre: DVec3,
        radius: f64,
    },
}

/// Where and what a ray meets.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Hit {
    pub(crate) t: f64,
    pub(crate) position: DVec3,
    /// Geometric unit normal: upwards for heightfields, outwards for solids.
    pub(crate) normal: DVec3,
    pub(crate) what: What,
}

/// A frame ready for rays.
#[derive(Debug)]
pub(crate) struct World<'a> {
    pub(crate) water: &'a Surface,
    pub(crate) ground: Option<&'a Surface>,
    /// How much of the sky the ground sees, 0 to 1, on the ground's own grid.
    pub(crate) openness: Option<&'a Grid<f32>>,
    pub(crate) look: &'a Ground,
    pub(crate) edges: &'a Edges,
    pub(crate) objects: Vec<Placed>,
    pub(crate) spray: Option<Spray>,
    pub(crate) foam: Option<&'a Grid<f32>>,
    pub(crate) light: &'a Light,
    pub(crate) volume: &'a Volume,
    /// Refractive index of the water.
    pub(crate) index: f32,
    /// A length that is nothing beside the scene and much beside rounding, metres.
    pub(crate) hair: f64,
}

pub(crate) fn in_plan(p: DVec3) -> DVec2 {
    DVec2::new(p.x, p.z)
}

impl World<'_> {
    /// Height of the ground, −∞ where there is none.
    pub(crate) fn ground_height(&self, p: DVec3) -> f64 {
        self.ground.map_or(f64::NEG_INFINITY, |g| g.height(in_plan(p)))
    }

    /// Depth of a point below the water's surface, negative above it; whether there is water is not asked.
    pub(crate) fn depth(&self, p: DVec3) -> f64 {
        self.water.height(in_plan(p)) - p.y
    }

    /// What is at a point that is in neither ground nor object.
    pub(crate) fn medium(&self, p: DVec3) -> Medium {
        if self.depth(p) > 0.0 && self.edges.within_glass(p) {
            Medium::Water
        } else {
            Medium::Air
        }
    }

    /// What the ray meets first within `t_max`.
    pub(crate) fn cast(&self, ray: &Ray, medium: Medium, t_max: f64) -> Option<Hit> {
        let mut best: Option<Hit> = None;
        let mut limit = t_max;
        let mut take = |hit: Hit, limit: &mut f64| {
            if hit.t <= *limit {
                *limit = hit.t;
                best = Some(hit);
            }
        };
        for object in &self.objects {
            if let Some(hit) = object.cast(ray, limit) {
                let what = What::Object {
                    shading: hit.shading,
                    color: hit.color,
                    shine: hit.shine,
                };
                take(solid(ray, hit.t, hit.normal, what), &mut limit);
            }
        }
        if let Some((t, normal)) = self.edges.cast_solid(ray, limit) {
            take(solid(ray, t, normal, What::Wall), &mut limit);
        }
        if let Some(hit) = self.ground.and_then(|g| g.cast(ray, limit)) {
            let what = What::Ground;
            take(
                Hit {
                    t: hit.t,
                    position: hit.position,
                    normal: hit.normal,
                    what,
                },
                &mut limit,
            );
        }
        if let Some(hit) = self.water.cast(ray, limit)
            && self.edges.within_glass(hit.position)
        {
            let what = What::Water { glass: false };
            take(
                Hit {
                    t: hit.t,
                    position: hit.position,
                    normal: hit.normal,
                    what,
                },
                &mut limit,
            );
        }
        if self.edges.has_glass()
            && let Some((t, normal)) = self
                .edges
                .cast_glass(ray, limit, |p| self.depth(p) > 0.0 && self.ground_height(p) < p.y)
        {
            take(solid(ray, t, normal, What::Water { glass: true }), &mut limit);
        }
        if medium == Medium::Air
            && let Some((t, centre, radius)) = self.spray.as_ref().and_then(|s| s.cast(ray, limit))
        {
            let position = ray.origin + t * ray.direction;
            let normal = (position - centre) / radius;
            take(
                solid(ray, t, normal, What::Droplet { centre, radius }),
                &mut limit,
            );
        }
        best
    }

    /// Whether something opaque is in the way.
    pub(crate) fn occluded(&self, ray: &Ray, t_max: f64) -> bool {
        self.edges.cast_solid(ray, t_max).is_some()
            || self.objects.iter().any(|o| o.cast(ray, t_max).is_some())
            || self.ground.is_some_and(|g| g.cast(ray, t_max).is_some())
    }
}

fn solid(ray: &Ray, t: f64, normal: DVec3, what: What) -> Hit {
    Hit {
        t,
        position: ray.origin + t * ray.direction,
        normal,
        what,
    }
}
