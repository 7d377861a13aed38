//! Water in flight, drawn as spheres of water.

use crate::caster::Ray;
use glam::{DVec3, Vec3, Vec3A};
use meniscus_sim::frame::Droplets;
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::builder::build_bvh2;
use obvhs::{Boundable, BvhBuildParams};

/// A droplet.
#[derive(Clone, Copy, Debug)]
struct Ball {
    centre: Vec3,
    radius: f32,
}

impl Boundable for Ball {
    fn aabb(&self) -> Aabb {
        // A hair wider than the sphere, for the rounding of the f32 traversal.
        let r = Vec3A::splat(self.radius * 1.0001) + Vec3A::from(self.centre).abs() * 1e-6;
        Aabb::new(Vec3A::from(self.centre) - r, Vec3A::from(self.centre) + r)
    }
}

/// All droplets of a frame under a bounding-volume hierarchy.
pub(crate) struct Spray {
    bvh: Bvh2,
    balls: Vec<Ball>,
}

impl std::fmt::Debug for Spray {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Spray")
            .field("droplets", &self.balls.len())
            .finish_non_exhaustive()
    }
}

impl Spray {
    /// `None` if there is none of positive radius.
    pub(crate) fn build(droplets: &Droplets) -> Option<Self> {
        let balls: Vec<Ball> = droplets
            .position
            .iter()
            .zip(&droplets.radius)
            .filter(|(_, r)| **r > 0.0)
            .map(|(&centre, &radius)| Ball { centre, radius })
            .collect();
        if balls.is_empty() {
            return None;
        }
        let bvh = build_bvh2(
            &balls,
            BvhBuildParams::fast_build(),
            &mut std::time::Duration::default(),
        );
        let balls = bvh.primitive_indices.iter().map(|&k| balls[k as usize]).collect();
        Some(Self { bvh, balls })
    }

    /// The first droplet from outside: ray parameter, centre and radius.
    pub(crate) fn cast(&self, ray: &Ray, t_max: f64) -> Option<(f64, DVec3, f64)> {
        let mut best: Option<(f64, usize)> = None;
        let mut limit = t_max;
        let f32_ray = obvhs::ray::Ray::new(
            Vec3A::from(ray.origin.as_vec3()),
            Vec3A::from(ray.direction.as_vec3()),
            0.0,
            (t_max * (1.0 + 1e-5)) as f32,
        );
        self.bvh
            .ray_traverse(f32_ray, &mut obvhs::ray::RayHit::none(), |_, k| {
                let ball = self.balls[k];
                let o = ray.origin - ball.centre.as_dvec3();
                let r = f64::from(ball.radius);
                let outside = o.length_squared() > r * r;
                match super::objects::sphere(o, ray.direction, r) {
                    Some(t) if outside && t < limit => {
                        limit = t;
                        best = Some((t, k));
                        (t * (1.0 + 1e-6)) as f32
                    }
                    _ => f32::INFINITY,
                }
            });
        best.map(|(t, k)| {
            (
                t,
                self.balls[k].centre.as_dvec3(),
                f64::from(self.balls[k].radius),
            )
        })
    }
}
