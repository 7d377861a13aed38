//! What a ray sees when it leaves the scene, and the light that a surface receives from it.
//!
//! There is one sun. An HDR picture of a clear sky holds one too, as a few texels thousands of times brighter than the
//! rest: it casts no sharp shadow, gives no sharp glint, and would double the sun that the scene names. It is therefore
//! taken out of the picture. If the scene names no sun, it becomes the scene's, with its direction and irradiance.

use crate::Scene;
use crate::optics;
use crate::scene::Panorama;
use crate::scene::description;
use glam::{Vec2, Vec3};
use hw_skymodel::rgb::{Channel, SkyParams, SkyState};
use std::f32::consts::{FRAC_PI_2, PI, TAU};

/// Rows of the picture that a daylight sky is evaluated to (0.7° each; the model is smooth beside the sun's disc,
/// which is not part of it).
pub const DAYLIGHT_ROWS: u32 = 256;

/// Factor from Hosek & Wilkie's RGB radiance to scene units. At 45° and turbidity 2.5 the sky then lights level ground
/// with 0.3 of what the default sun gives it, the usual share under a clear sky.
const DAYLIGHT_UNITS: f32 = 0.0252;

/// Where the sun stands in a daylight sky when the scene has no sun.
const DEFAULT_SUN: (f32, f32) = (45.0, 180.0);

/// Steps of azimuth of the haze.
pub const HORIZON_STEPS: usize = 32;
/// Rows of the table of irradiance, zenith to nadir.
pub const NORMAL_ROWS: usize = 17;
/// Columns of the table of irradiance.
pub const NORMAL_COLUMNS: usize = 32;

/// A bright texel belongs to the sun's disc and glare within this angle, radians (5°).
const GLARE: f32 = 0.087;
/// A picture shows the sun if its brightest texel exceeds the sky around the glare by this factor.
const SUN_CONTRAST: f32 = 40.0;

/// The sun.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sun {
    /// Unit direction towards the sun.
    pub direction: Vec3,
    /// Linear RGB irradiance of a surface that faces it.
    pub irradiance: Vec3,
    /// Angular radius of the disc in radians.
    pub radius: f32,
}

impl Sun {
    fn described(light: &description::Light) -> Option<Self> {
        let sun = light.sun.as_ref()?;
        Some(Self {
            direction: toward(sun.azimuth.to_radians(), sun.elevation.to_radians()),
            irradiance: sun.irradiance,
            radius: sun.radius.to_radians().max(1e-5),
        })
    }
}

/// The sky of a scene, without the sun's disc, and the sun.
#[derive(Clone, Debug)]
pub struct Sky {
    dome: Dome,
    sun: Option<Sun>,
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

/// One resolution of an equirectangular picture, row-major from the zenith.
#[derive(Clone, Debug)]
pub struct Level {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Linear radiance.
    pub pixels: Vec<Vec3>,
}

/// What a sky is made of, for renderers that keep it elsewhere. [`Sky::radiance`], [`Sky::haze`] and
/// [`Sky::irradiance`] say how it is read.
#[derive(Clone, Copy, Debug)]
pub struct SkyParts<'a> {
    /// The picture and its halvings; none of a uniform sky.
    pub levels: &'a [Level],
    /// Turn of the picture, radians.
    pub rotation: f32,
    /// Factor on the picture, or the radiance of a uniform sky.
    pub scale: Vec3,
    /// Colour of haze by azimuth, [`HORIZON_STEPS`] around.
    pub horizon: &'a [Vec3],
    /// Irradiance by normal, [`NORMAL_ROWS`] of [`NORMAL_COLUMNS`]; none of a uniform sky.
    pub irradiance: &'a [Vec3],
}

impl Sky {
    /// The sky that the scene describes. A picture that is missing (a scene made by hand) gives the default sky.
    pub fn new(scene: &Scene) -> Self {
        let light = &scene.description.light;
        let mut sun = Sun::described(light);
        let dome = match (&light.sky, &scene.sky) {
            (description::Sky::Uniform { radiance }, _) => Dome::Uniform(*radiance),
            (description::Sky::Picture { rotation, scale, .. }, Some(picture))
                if picture.size.min_element() > 0 =>
            {
                let rotation = rotation.to_radians();
                let mut base = Level::from_panorama(picture);
                if let Some(own) = base.take_sun() {
                    // The look-up turns by `rotation`; the sun turns the other way.
                    let turned = azimuth(own.direction) - rotation;
                    sun = sun.or(Some(Sun {
                        direction: toward(turned, own.direction.y.clamp(-1.0, 1.0).asin()),
                        irradiance: *scale * own.irradiance,
                        radius: own.radius,
                    }));
                }
                Dome::Picture {
                    levels: pyramid(base),
                    rotation,
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
            sun,
            horizon: [Vec3::ZERO; HORIZON_STEPS],
            irradiance: Vec::new(),
        };
        sky.horizon = sky.low_passed_horizon();
        sky.irradiance = sky.irradiance_table();
        sky
    }

    /// The sun: the scene's, else the picture's.
    pub fn sun(&self) -> Option<Sun> {
        self.sun
    }

    /// The parts.
    pub fn parts(&self) -> SkyParts<'_> {
        let (levels, rotation, scale) = match &self.dome {
            Dome::Uniform(radiance) => (&[][..], 0.0, *radiance),
            Dome::Picture {
                levels,
                rotation,
                scale,
            } => (levels.as_slice(), *rotation, Vec3::splat(*scale)),
        };
        SkyParts {
            levels,
            rotation,
            scale,
            horizon: &self.horizon,
            irradiance: &self.irradiance,
        }
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
pub fn toward(azimuth: f32, elevation: f32) -> Vec3 {
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

    /// Direction of the middle of texel `k` and its solid angle.
    fn texel(&self, k: usize) -> (Vec3, f32) {
        let (i, j) = (k % self.width, k / self.width);
        let polar = (j as f32 + 0.5) / self.height as f32 * PI;
        let around = (i as f32 + 0.5) / self.width as f32 * TAU;
        let area = TAU / self.width as f32 * PI / self.height as f32 * polar.sin();
        (toward(around, FRAC_PI_2 - polar), area)
    }

    /// Takes the sun out of the picture, if it shows one above the horizon: texels near the brightest one are cut to
    /// the brightness of the sky around, and what was cut is the sun's.
    fn take_sun(&mut self) -> Option<Sun> {
        let luminance = |c: Vec3| c.dot(Vec3::new(0.2126, 0.7152, 0.0722));
        let brightest = (0..self.pixels.len())
            .max_by(|&a, &b| luminance(self.pixels[a]).total_cmp(&luminance(self.pixels[b])))?;
        let (towards, _) = self.texel(brightest);
        if towards.y <= 0.0 {
            return None;
        }
        let angle = |d: Vec3| d.dot(towards).clamp(-1.0, 1.0).acos();
        let (mut ring, mut area) = (Vec3::ZERO, 0.0);
        for k in 0..self.pixels.len() {
            let (d, w) = self.texel(k);
            // Only the sky's own part of the ring: the ground below a low sun is dark.
            if d.y > 0.0 && (GLARE..2.0 * GLARE).contains(&angle(d)) {
                ring += w * self.pixels[k];
                area += w;
            }
        }
        let around = ring / f32::max(area, 1e-9);
        let limit = luminance(around);
        if !(limit > 0.0 && luminance(self.pixels[brightest]) > SUN_CONTRAST * limit) {
            return None;
        }
        let (mut direction, mut irradiance) = (Vec3::ZERO, Vec3::ZERO);
        for k in 0..self.pixels.len() {
            let (d, w) = self.texel(k);
            let value = self.pixels[k];
            let cut = value - value.min(around * 2.0);
            if angle(d) < GLARE && cut.max_element() > 0.0 {
                self.pixels[k] -= cut;
                irradiance += w * cut;
                direction += w * luminance(cut) * d;
            }
        }
        Some(Sun {
            direction: direction.try_normalize()?,
            irradiance,
            radius: optics::SUN_ANGULAR_RADIUS,
        })
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

#[cfg(test)]
mod tests {
    use super::*;

    fn level(f: impl Fn(Vec3) -> Vec3) -> Level {
        let mut level = Level {
            width: 256,
            height: 128,
            pixels: vec![Vec3::ZERO; 256 * 128],
        };
        for k in 0..level.pixels.len() {
            level.pixels[k] = f(level.texel(k).0);
        }
        level
    }

    #[test]
    fn the_sun_of_a_picture_is_found_with_its_light_and_leaves_it() {
        let truth = toward(1.2, 0.6);
        let mut picture = level(|d| {
            if d.dot(truth) > 0.03_f32.cos() {
                Vec3::new(900.0, 800.0, 600.0)
            } else {
                Vec3::splat(0.5)
            }
        });
        // The light over the sky's of the texels that show the disc: texels of 1.4° make it larger or smaller than its cone.
        let expected: f32 = (0..picture.pixels.len())
            .filter(|&k| picture.pixels[k].x > 1.0)
            .map(|k| picture.texel(k).1 * (900.0 - 0.5))
            .sum();
        let sun = picture.take_sun().unwrap();
        assert!(sun.direction.dot(truth) > 0.01_f32.cos());
        assert!(
            (sun.irradiance.x / expected - 1.0).abs() < 0.01,
            "{}",
            sun.irradiance
        );
        assert!(picture.pixels.iter().all(|p| p.max_element() <= 1.0));
        assert!(picture.take_sun().is_none(), "there is only one");
    }

    #[test]
    fn an_overcast_sky_keeps_its_light() {
        let mut picture = level(|d| Vec3::splat(1.0 + 2.0 * d.y.max(0.0)));
        assert!(picture.take_sun().is_none());
    }

    #[test]
    fn a_texel_is_seen_in_its_own_direction() {
        let picture = level(|d| d);
        for k in [300, 5_000, 20_000, 30_000] {
            let (d, _) = picture.texel(k);
            let (u, v) = (azimuth(d) / TAU, d.y.acos() / PI);
            assert!((picture.sample(u, v) - d).length() < 1e-3, "{d}");
        }
    }
}
