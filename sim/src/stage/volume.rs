//! What happens to light inside the water.
//!
//! Water absorbs (`a` per metre) and scatters (`b` per metre), nearly all of it forwards. By the similarity relation
//! (van de Hulst 1980) light scattered by the mean cosine g counts as unscattered; the rest, `s = (1 − g) b`, is taken
//! as isotropic. Along a path of length d the radiance falls by e^(−c d) with c = a + s (Beer–Lambert), and what is
//! scattered once into the path is added,
//!
//! L = s/4π Σ Eᵢ e^(−kᵢ z₀) (1 − e^(−(c + kᵢ μ) d)) / (c + kᵢ μ),
//!
//! the integral of the source along a straight path that starts at depth z₀ and sinks by μ a metre. The sum is over
//! the sun's beam below flat water (scalar irradiance E across the beam, k = c / cos θt) and the light of the sky
//! (E = 1.2 times the entering irradiance, k = 1.2 c). Shadows in the water and light scattered more than once are
//! left out.

use super::light::{DIFFUSE_PATH, Light};
use crate::scene::description::Water;
use glam::Vec3;
use std::f32::consts::PI;

/// Mean cosine of scattering in natural waters (Petzold 1972: about 0.9).
const MEAN_COSINE: f32 = 0.9;

/// The body of water.
#[derive(Clone, Debug)]
pub struct Volume {
    /// c per metre: what a path loses.
    pub extinction: Vec3,
    /// s per metre: the part of it that is scattered isotropically.
    scattering: Vec3,
    /// (Eᵢ, kᵢ) of the sources.
    pub sources: [(Vec3, Vec3); 2],
}

impl Volume {
    /// The water of a scene in that light.
    pub fn new(water: &Water, light: &Light) -> Self {
        let scattering = (1.0 - MEAN_COSINE) * water.scattering.max(Vec3::ZERO);
        let extinction = water.absorption.max(Vec3::ZERO) + scattering;
        let sky = light.entering * light.sky.irradiance(Vec3::Y);
        let sun = light.beam.map_or((Vec3::ZERO, Vec3::ZERO), |beam| {
            (beam.irradiance, extinction / beam.direction.y.max(1e-3))
        });
        Self {
            extinction,
            scattering,
            sources: [sun, (DIFFUSE_PATH * sky, DIFFUSE_PATH * extinction)],
        }
    }

    /// Whether light passes unchanged.
    pub fn is_clear(&self) -> bool {
        self.extinction == Vec3::ZERO
    }

    /// s per metre: what is scattered in all directions alike.
    pub fn scattering(&self) -> Vec3 {
        self.scattering
    }

    /// Share of radiance left after `distance` metres.
    pub fn transmittance(&self, distance: f32) -> Vec3 {
        crate::optics::transmittance(self.extinction, distance)
    }

    /// Share of the sky's diffuse light left at `depth` metres.
    pub fn diffuse_transmittance(&self, depth: f32) -> Vec3 {
        self.transmittance(DIFFUSE_PATH * depth.max(0.0))
    }

    /// Radiance scattered into a path of `distance` metres (which may be infinite) that starts `depth` metres below the
    /// surface and sinks by `sinking` metres a metre.
    pub fn scattered(&self, depth: f32, sinking: f32, distance: f32) -> Vec3 {
        if self.scattering == Vec3::ZERO {
            return Vec3::ZERO;
        }
        let depth = depth.max(0.0);
        let mut sum = Vec3::ZERO;
        for (irradiance, k) in self.sources {
            // A path may not climb out of the water on its way: depth stays positive, so the exponent does not grow.
            let sinking = if distance.is_finite() {
                sinking.max(-depth / distance.max(1e-6))
            } else {
                sinking.max(0.0)
            };
            let rate = self.extinction + k * sinking;
            let integral = Vec3::new(
                saturating(rate.x, distance),
                saturating(rate.y, distance),
                saturating(rate.z, distance),
            );
            sum += irradiance * (-k * depth).exp() * integral;
        }
        sum * self.scattering / (4.0 * PI)
    }
}

/// ∫₀^d e^(−r s) ds for any sign of r.
fn saturating(rate: f32, distance: f32) -> f32 {
    let x = rate * distance;
    if x.is_nan() || x.abs() < 1e-4 {
        // The series; 0 · ∞ means water that takes nothing away over an endless path, whose light is left out.
        return if distance.is_finite() {
            distance * (1.0 - 0.5 * x)
        } else {
            0.0
        };
    }
    -(-x).exp_m1() / rate
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_closed_form_equals_the_integral() {
        let volume = Volume {
            extinction: Vec3::new(0.3, 0.05, 0.01),
            scattering: Vec3::new(0.001, 0.001, 0.002),
            sources: [
                (Vec3::new(2.0, 1.5, 1.0), Vec3::new(0.35, 0.06, 0.012)),
                (Vec3::new(0.4, 0.6, 0.8), Vec3::new(0.36, 0.06, 0.012)),
            ],
        };
        for (depth, sinking, distance) in [
            (0.0, 0.7, 12.0),
            (5.0, -0.4, 10.0),
            (3.0, 0.0, 40.0),
            (8.0, -0.8, 10.0),
        ] {
            let closed = volume.scattered(depth, sinking, distance).as_dvec3();
            let steps = 20_000;
            let mut sum = glam::DVec3::ZERO;
            for n in 0..steps {
                let s = (n as f32 + 0.5) / steps as f32 * distance;
                for (e, k) in volume.sources {
                    let here = e * (-k * (depth + s * sinking)).exp() * (-volume.extinction * s).exp();
                    sum += (here * volume.scattering / (4.0 * PI)).as_dvec3() * f64::from(distance)
                        / f64::from(steps);
                }
            }
            assert!(
                ((closed - sum) / sum).abs().max_element() < 1e-4,
                "{closed} {sum}"
            );
        }
        // An endless path downwards converges to a colour.
        let deep = volume.scattered(0.0, 1.0, f32::INFINITY);
        let long = volume.scattered(0.0, 1.0, 3000.0);
        assert!(deep.is_finite() && ((deep - long) / deep).abs().max_element() < 1e-4);
    }
}
