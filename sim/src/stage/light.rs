//! Light that reaches surfaces: sun and sky, in air and under water.
//!
//! All radiance is *basic radiance* (radiance over the square of the refractive index), which an interface passes on
//! without a factor: pictures taken in air are exact, pictures taken under water are darker by n² throughout, which is
//! a matter of exposure. Irradiance under water is scaled likewise.

use super::sky::{Sky, Sun};
use crate::optics::fresnel;
use crate::scene::description::Description;
use glam::Vec3;
use std::f32::consts::PI;

/// Mean path of diffuse light a metre of depth: the radiance that entered through a flat surface runs within 48.6° of
/// the vertical, on average at 1.2 times the depth.
pub const DIFFUSE_PATH: f32 = 1.2;

/// What the tracer asks of the sun.
pub trait Disc {
    /// Radiance of the disc seen through a cone of half-angle `spread`.
    fn disc(&self, direction: Vec3, spread: f32) -> Vec3;
    /// A direction towards the disc; `u` in the unit square picks the point.
    fn sample(&self, u: [f32; 2]) -> Vec3;
}

impl Disc for Sun {
    /// Radiance of the disc seen through a cone of half-angle `spread`: a Gaussian lobe whose variance is the disc's
    /// plus the cone's. Its integral over all directions is the irradiance whatever the spread, so a glint keeps its
    /// light when it is smaller than a pixel.
    fn disc(&self, direction: Vec3, spread: f32) -> Vec3 {
        // The variance along one axis of a uniform disc of radius r is r²/4.
        let variance = 0.25 * (self.radius * self.radius + spread * spread);
        // |a − b|² of unit vectors: exact for small angles, where 1 − cos is not.
        let distance = (direction - self.direction).length_squared();
        let x = 0.5 * distance / variance;
        if x > 30.0 {
            Vec3::ZERO
        } else {
            self.irradiance * ((-x).exp() / (2.0 * PI * variance))
        }
    }

    fn sample(&self, u: [f32; 2]) -> Vec3 {
        let (radius, angle) = (self.radius * u[0].sqrt(), 2.0 * PI * u[1]);
        let (a, b) = self.direction.any_orthonormal_pair();
        (self.direction + radius * (angle.cos() * a + angle.sin() * b)).normalize()
    }
}

/// Everything that shines, with what the water lets through.
#[derive(Debug)]
pub struct Light {
    /// The sky without the sun.
    pub sky: Sky,
    /// The sun.
    pub sun: Option<Sun>,
    /// Share of the light of a uniform sky that enters flat water, in basic radiance: ∫ (1 − F) 2 sinθ cosθ dθ within
    /// the critical angle.
    pub entering: f32,
    /// The sun's beam below flat water.
    pub beam: Option<Beam>,
    /// Mean radiance of what lies below the horizon, for surfaces that face down.
    pub from_below: Vec3,
}

/// Sunlight below flat water.
#[derive(Clone, Copy, Debug)]
pub struct Beam {
    /// Unit direction from below towards where the light comes from.
    pub direction: Vec3,
    /// Basic irradiance across the beam just below the surface.
    pub irradiance: Vec3,
}

impl Light {
    /// The light of a scene under that sky.
    pub fn new(description: &Description, sky: Sky) -> Self {
        let index = description.water.index;
        let sun = sky.sun();
        let beam = sun.filter(|s| s.direction.y > 0.0).map(|s| beam_below(&s, index));
        let mut light = Self {
            entering: entering_share(index),
            beam,
            from_below: Vec3::ZERO,
            sky,
            sun,
        };
        let ground = if description.terrain.is_some() {
            description.ground.albedo
        } else {
            Vec3::splat(0.06)
        };
        light.from_below = ground * light.level_irradiance() / PI;
        light
    }

    /// Irradiance of level ground in the open.
    pub fn level_irradiance(&self) -> Vec3 {
        let sun = self
            .sun
            .map_or(Vec3::ZERO, |s| s.irradiance * s.direction.y.max(0.0));
        self.sky.irradiance(Vec3::Y) + sun
    }

    /// Irradiance by sky and surroundings (not sun) of a surface in air.
    pub fn ambient(&self, normal: Vec3) -> Vec3 {
        self.sky.irradiance(normal) + self.from_below * (0.5 * PI * (1.0 - normal.y))
    }
}

/// See [`Light::entering`]; the midpoint rule in sin²θ, where the integrand is smooth up to the critical angle.
pub fn entering_share(index: f32) -> f32 {
    if index <= 1.0 {
        return 1.0;
    }
    const STEPS: u32 = 4096;
    let end = 1.0 / f64::from(index * index);
    let total: f64 = (0..STEPS)
        .map(|k| {
            let sin2 = end * (f64::from(k) + 0.5) / f64::from(STEPS);
            f64::from(1.0 - fresnel((1.0 - sin2).sqrt() as f32, index))
        })
        .sum();
    (total * end / f64::from(STEPS)) as f32
}

fn beam_below(sun: &Sun, index: f32) -> Beam {
    let cos_i = sun.direction.y;
    let sin2 = (1.0 - cos_i * cos_i) / (index * index);
    let cos_t = (1.0 - sin2).max(0.0).sqrt();
    let across = Vec3::new(sun.direction.x, 0.0, sun.direction.z) / index;
    // The beam narrows by cosθt/cosθi; basic irradiance is over n².
    let factor = (1.0 - fresnel(cos_i, 1.0 / index)) * cos_i / (cos_t * index * index);
    Beam {
        direction: Vec3::new(across.x, cos_t, across.z).normalize(),
        irradiance: sun.irradiance * factor,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_glint_keeps_its_light_at_any_spread() {
        let sun = Sun {
            direction: Vec3::Y,
            irradiance: Vec3::splat(3.0),
            radius: 4.652e-3,
        };
        for spread in [0.0, 0.01, 0.05] {
            let steps = 4000;
            let widest = 8.0 * (spread + sun.radius);
            let total: f32 = (0..steps)
                .map(|k| {
                    let theta = (k as f32 + 0.5) / steps as f32 * widest;
                    sun.disc(Vec3::new(theta.sin(), theta.cos(), 0.0), spread).x
                        * 2.0
                        * PI
                        * theta.sin()
                        * (widest / steps as f32)
                })
                .sum();
            // A Gaussian in |a − b|² over the sphere integrates to 1 up to its variance.
            assert!((total / 3.0 - 1.0).abs() < 2e-3, "{spread}: {total}");
        }
    }

    #[test]
    fn diffuse_light_enters_by_the_known_share() {
        // n² times the share is the diffuse transmittance of a flat water surface, 0.934 for n = 1.333
        // (Preisendorfer 1976: 1 − 0.066).
        let share = entering_share(1.333) * 1.333 * 1.333;
        assert!((share - 0.934).abs() < 2e-3, "{share}");
        assert_eq!(entering_share(1.0), 1.0);
    }
}
