//! What a ray sees when it leaves the scene, and the light that a surface receives from it.

use glam::{Vec2, Vec3};
use hw_skymodel::rgb::{Channel, SkyParams, SkyState};
use meniscus_sim::Scene;
use meniscus_sim::scene::Panorama;
use meniscus_sim::scene::description;
use std::f32::consts::{FRAC_PI_2, PI, TAU};

/// Rows of the picture that a daylight sky is evaluated to (0.7° each; the model is smooth beside the sun's disc,
/// which is not part of it).
const DAYLIGHT_ROWS: u32 = 256;

/// Factor from Hosek & Wilkie's RGB radiance to scene units. At 45° and turbidity 2.5 the sky then lights level ground
/// with 0.3 of what the default sun gives it, the usual share under a clear sky.
const DAYLIGHT_UNITS: f32 = 0.0252;

/// Where the sun stands in a daylight sky when the scene has no sun.
const DEFAULT_SUN: (f32, f32) = (45.0, 180.0);

const HORIZON_STEPS: usize = 32;
const NORMAL_ROWS: usize = 17;
const NORMAL_COLUMNS: usize = 32;

/// The sky of a scene, without the sun's disc.
#[derive(Clone, Debug)]
pub struct Sky {
    dome: Dome,
    /// Radiance just above the horizon, low-passed, by azimuth: the colour of distant haze.
    horizon: [Vec3; HORIZON_STEPS],
    /// Irradiance from the upper hemisphere by normal: rows from zenith to nadir, columns by azimuth.
    irradiance: Vec<Vec3>,
}

#[derive(Clone, Debug)]
enum Dome {
    Uniform(Vec3),
    Picture {
        levels: Vec<Level>,
        rotation: f32,
        scale: f32,
    },
}

/// One resolution of an equirectangular picture.
#[derive(Clone, Debug)]
struct Level {
    width: usize,
    height: usize,
    pixels: Vec<Vec3>,
}

impl Sky {
    /// The sky that the scene describes. A picture that is missing (a scene made by hand) gives the default sky.
    pub fn new(scene: &Scene) -> Self {
        let light = &scene.description.light;
        let dome = match (&light.sky, &scene.sky) {
            (description::Sky::Uniform { radiance }, _) => Dome::Uniform(*radiance),
            (description::Sky::Picture { rotation, scale, .. }, Some(picture))
                if picture.size.min_element() > 0 =>
            {
                Dome::Picture {
                    levels: pyramid(Level::from_panorama(picture)),
                    rotation: rotation.to_radians(),
                    scale: *scale,
                }
            }
            (description::Sky::Picture { .. }, _) => match description::Sky::default() {
                description::Sky::Uniform { radiance } => Dome::Uniform(radiance),
                _ => Dome::Uniform(Vec3::ONE),
            },
            (description::Sky::Daylight { turbidity, scale }, _) => {
                let (elevation, azimuth) = light
                    .sun
                    .as_ref()
                    .map_or(DEFAULT_SUN, |sun| (sun.elevation, sun.azimuth));
                Dome::Picture {
                    levels: pyramid(daylight(elevation, azimuth, *turbidity)),
                    rotation: 0.0,
                    scale: *scale,
                }
            }
        };
        let mut sky = Self {
            dome,
            horizon: [Vec3::ZERO; HORIZON_STEPS],
            irradiance: Vec::new(),
        };
        sky.horizon = sky.low_passed_horizon();
        sky.irradiance = sky.irradiance_table();
        sky
    }

    /// Radiance from `direction` (unit, pointing away from the eye), averaged over a cone of half-angle `spread`
    /// radians.
    pub fn radiance(&self, direction: Vec3, spread: f32) -> Vec3 {
        match &self.dome {
            Dome::Uniform(radiance) => *radiance,
            Dome::Picture {
                levels,
                rotation,
                scale,
            } => {
                let u = (azimuth(direction) + rotation) / TAU;
                let v = direction.y.clamp(-1.0, 1.0).acos() / PI;
                let texel = PI / levels[0].height as f32;
                let level = (2.0 * spread / texel)
                    .max(1.0)
                    .log2()
                    .min((levels.len() - 1) as f32);
                let k = level as usize;
                let fine = levels[k].sample(u, v);
                let share = level - k as f32;
                let value = if share > 0.0 && k + 1 < levels.len() {
                    fine.lerp(levels[k + 1].sample(u, v), share)
                } else {
                    fine
                };
                *scale * value
            }
        }
    }

    /// Colour of distant haze in the azimuth of `direction`: the sky's radiance low above the horizon.
    pub fn haze(&self, direction: Vec3) -> Vec3 {
        let x = azimuth(direction).rem_euclid(TAU) / TAU * HORIZON_STEPS as f32;
        let k = x as usize % HORIZON_STEPS;
        self.horizon[k].lerp(self.horizon[(k + 1) % HORIZON_STEPS], x.fract())
    }

    /// Irradiance that the sky above the horizon gives a surface of unit `normal` in the open.
    pub fn irradiance(&self, normal: Vec3) -> Vec3 {
        if let Dome::Uniform(radiance) = self.dome {
            return radiance * (FRAC_PI_2 * (1.0 + normal.y));
        }
        let y = normal.y.clamp(-1.0, 1.0).acos() / PI * (NORMAL_ROWS - 1) as f32;
        let x = azimuth(normal).rem_euclid(TAU) / TAU * NORMAL_COLUMNS as f32;
        let j = (y as usize).min(NORMAL_ROWS - 2);
        let i = x as usize % NORMAL_COLUMNS;
        let at = |i: usize, j: usize| self.irradiance[j * NORMAL_COLUMNS + i % NORMAL_COLUMNS];
        let (fx, fy) = (x.fract(), y - j as f32);
        at(i, j)
            .lerp(at(i + 1, j), fx)
            .lerp(at(i, j + 1).lerp(at(i + 1, j + 1), fx), fy)
    }

    /// Bytes held.
    pub fn bytes(&self) -> u64 {
        let picture = match &self.dome {
            Dome::Uniform(_) => 0,
            Dome::Picture { levels, .. } => levels.iter().map(|l| l.pixels.len()).sum(),
        };
        ((picture + self.irradiance.len() + HORIZON_STEPS) * size_of::<Vec3>()) as u64
    }

    /// Bytes that the sky of a scene would hold, without building it.
    pub fn planned_bytes(scene: &Scene) -> u64 {
        let pixels = match (&scene.description.light.sky, &scene.sky) {
            (description::Sky::Uniform { .. }, _) => return 0,
            (description::Sky::Picture { .. }, Some(p)) => u64::from(p.size.x) * u64::from(p.size.y),
            (description::Sky::Picture { .. }, None) => return 0,
            (description::Sky::Daylight { .. }, _) => 2 * u64::from(DAYLIGHT_ROWS) * u64::from(DAYLIGHT_ROWS),
        };
        // The coarser levels add a third.
        (pixels * 4 / 3 + (NORMAL_ROWS * NORMAL_COLUMNS + HORIZON_STEPS) as u64) * size_of::<Vec3>() as u64
    }

    fn low_passed_horizon(&self) -> [Vec3; HORIZON_STEPS] {
        let step = TAU / HORIZON_STEPS as f32;
        let ring: [Vec3; HORIZON_STEPS] = std::array::from_fn(|k| {
            let a = k as f32 * step;
            let total: Vec3 = [2.0_f32, 4.0, 6.0, 8.0]
                .map(|degrees| {
                    let e = degrees.to_radians();
                    self.radiance(toward(a, e), 0.5 * step)
                })
                .into_iter()
                .sum();
            0.25 * total
        });
        // Weights of a binomial of order 4: what stands on the picture's horizon does not streak into the haze.
        std::array::from_fn(|k| {
            let at = |d: usize| ring[(k + HORIZON_STEPS + d - 2) % HORIZON_STEPS];
            (at(0) + 4.0 * at(1) + 6.0 * at(2) + 4.0 * at(3) + at(4)) / 16.0
        })
    }

    fn irradiance_table(&self) -> Vec<Vec3> {
        if matches!(self.dome, Dome::Uniform(_)) {
            return Vec::new();
        }
        const ROWS: usize = 24;
        const COLUMNS: usize = 96;
        // Directions of equal solid angle over the upper hemisphere.
        let samples: Vec<(Vec3, Vec3)> = (0..ROWS * COLUMNS)
            .map(|k| {
                let sin_e = ((k / COLUMNS) as f32 + 0.5) / ROWS as f32;
                let a = ((k % COLUMNS) as f32 + 0.5) / COLUMNS as f32 * TAU;
                let d = toward(a, sin_e.asin());
                (d, self.radiance(d, PI / COLUMNS as f32))
            })
            .collect();
        (0..NORMAL_ROWS * NORMAL_COLUMNS)
            .map(|k| {
                let polar = (k / NORMAL_COLUMNS) as f32 / (NORMAL_ROWS - 1) as f32 * PI;
                let n = toward(
                    (k % NORMAL_COLUMNS) as f32 / NORMAL_COLUMNS as f32 * TAU,
                    FRAC_PI_2 - polar,
                );
                let (mut sum, mut weight) = (Vec3::ZERO, 0.0_f32);
                for (d, radiance) in &samples {
                    let cos = d.dot(n).max(0.0);
                    sum += cos * *radiance;
                    weight += cos;
                }
                // Scaled so that a uniform sky gives the exact irradiance.
                if weight > 0.0 {
                    sum / weight * (FRAC_PI_2 * (1.0 + n.y).max(0.0))
                } else {
                    Vec3::ZERO
                }
            })
            .collect()
    }
}

/// Azimuth in radians from −Z towards +X.
fn azimuth(direction: Vec3) -> f32 {
    direction.x.atan2(-direction.z)
}

/// Unit direction of that azimuth and elevation, radians.
pub(crate) fn toward(azimuth: f32, elevation: f32) -> Vec3 {
    let (sa, ca) = azimuth.sin_cos();
    let (se, ce) = elevation.sin_cos();
    Vec3::new(sa * ce, se, -ca * ce)
}

/// Hosek & Wilkie 2012 as a picture. Below the horizon its radiance continues dimmed, as if from dull ground.
fn daylight(elevation: f32, sun_azimuth: f32, turbidity: f32) -> Level {
    let params = SkyParams {
        // The model ends at the horizon; a sun below it dims the sky as civil twilight does.
        elevation: elevation.clamp(0.0, 90.0).to_radians().min(FRAC_PI_2),
        turbidity: turbidity.clamp(1.0, 10.0),
        albedo: [0.15; 3],
    };
    let Ok(state) = SkyState::new(&params) else {
        // Not reached: every parameter is clamped to its range.
        return Level {
            width: 1,
            height: 1,
            pixels: vec![Vec3::ONE],
        };
    };
    let sun = toward(sun_azimuth.to_radians(), params.elevation);
    let dim = DAYLIGHT_UNITS * (elevation.min(0.0) / 3.0).exp2();
    let (width, height) = (2 * DAYLIGHT_ROWS as usize, DAYLIGHT_ROWS as usize);
    let mut pixels = Vec::with_capacity(width * height);
    for j in 0..height {
        let polar = (j as f32 + 0.5) / height as f32 * PI;
        let below = polar > FRAC_PI_2;
        for i in 0..width {
            let d = toward(
                (i as f32 + 0.5) / width as f32 * TAU,
                (FRAC_PI_2 - polar).max(0.0),
            );
            let gamma = d.dot(sun).clamp(-1.0, 1.0).acos();
            let theta = polar.min(FRAC_PI_2 - 1e-3);
            let value = Vec3::new(
                state.radiance(theta, gamma, Channel::R),
                state.radiance(theta, gamma, Channel::G),
                state.radiance(theta, gamma, Channel::B),
            );
            let ground = if below { 0.35 } else { 1.0 };
            pixels.push(value.max(Vec3::ZERO) * (dim * ground));
        }
    }
    Level {
        width,
        height,
        pixels,
    }
}

/// The picture and its halvings, down to four rows.
fn pyramid(base: Level) -> Vec<Level> {
    let mut levels = vec![base];
    while let Some(last) = levels.last() {
        if last.height < 8 || last.width < 8 {
            break;
        }
        levels.push(last.halved());
    }
    levels
}

impl Level {
    fn from_panorama(picture: &Panorama) -> Self {
        Self {
            width: picture.size.x as usize,
            height: picture.size.y as usize,
            pixels: picture.pixels.clone(),
        }
    }

    fn halved(&self) -> Self {
        let (width, height) = (self.width / 2, self.height / 2);
        let pixels = (0..width * height)
            .map(|k| {
                let (i, j) = (2 * (k % width), 2 * (k / width));
                let at = |i: usize, j: usize| self.pixels[j * self.width + i];
                0.25 * (at(i, j) + at(i + 1, j) + at(i, j + 1) + at(i + 1, j + 1))
            })
            .collect();
        Self {
            width,
            height,
            pixels,
        }
    }

    /// Bilinear; `u` in turns wraps, `v` from 0 at the zenith to 1 at the nadir is clamped.
    fn sample(&self, u: f32, v: f32) -> Vec3 {
        let p = Vec2::new(
            u.rem_euclid(1.0) * self.width as f32 - 0.5,
            (v * self.height as f32 - 0.5).clamp(0.0, (self.height - 1) as f32),
        );
        let x0 = p.x.floor();
        let i0 = (x0 as isize).rem_euclid(self.width as isize) as usize;
        let i1 = (i0 + 1) % self.width;
        let j0 = p.y as usize;
        let j1 = (j0 + 1).min(self.height - 1);
        let (fx, fy) = (p.x - x0, p.y - j0 as f32);
        let at = |i: usize, j: usize| self.pixels[j * self.width + i];
        at(i0, j0)
            .lerp(at(i1, j0), fx)
            .lerp(at(i0, j1).lerp(at(i1, j1), fx), fy)
    }
}
