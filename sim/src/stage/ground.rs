//! How the ground looks: colour by slope, height above the water and wetness, with detail finer than its grid.
//!
//! A height map with a sample every 75 m looks like folded paper. Ground therefore carries a fractal of value noise
//! below its own spacing, down to the size of a pixel, that tilts the shading normal and varies the colour; the shape
//! is not changed. It is a fixed function of position and scene seed. Level ground (tanks, pools) and checkerboards
//! have none.

use crate::Scene;
use crate::rng::Rng;
use glam::{DVec2, Vec2, Vec3};

/// Stream of the random generator that noise draws from.
const NOISE_STREAM: u64 = 0x006e_6f69_7365;
/// Samples of the noise lattice along a side; octaves are turned against each other so that repeats do not align.
pub const LATTICE: usize = 128;
const OCTAVES: u32 = 10;
/// Each octave is turned by atan(3/4) and moved, so that lattice directions do not show.
const TURN: DVec2 = DVec2::new(0.8, 0.6);

/// The look of the ground of one scene.
#[derive(Debug)]
pub struct Ground {
    /// Colour of flat ground.
    pub albedo: Vec3,
    /// Colour of steep ground, walls and decks.
    pub steep: Vec3,
    /// Colour of the shore and of ground under water, or the second colour of a checkerboard.
    pub shore: Vec3,
    /// Side of the squares of a checkerboard, metres; 0 for none.
    pub checker: f64,
    /// Distance of the ground's samples, metres.
    pub spacing: f64,
    noise: Option<Noise>,
}

impl Ground {
    /// `relief`: whether the ground has any.
    pub fn new(scene: &Scene, spacing: f64, relief: bool) -> Self {
        let look = &scene.description.ground;
        let checker = f64::from(look.checker);
        Self {
            albedo: look.albedo,
            steep: look.steep_albedo,
            shore: look.shore_albedo,
            checker,
            spacing,
            noise: (relief && checker <= 0.0).then(|| Noise::new(scene.description.seed)),
        }
    }

    /// Bytes of the noise lattice, where there is one.
    pub fn noise_bytes() -> u64 {
        (LATTICE * LATTICE * size_of::<f32>()) as u64
    }

    /// The noise's lattice, [`LATTICE`] squared, row-major; `None` for level ground and checkerboards.
    pub fn lattice(&self) -> Option<&[f32]> {
        self.noise.as_ref().map(|noise| noise.lattice.as_slice())
    }

    /// Colour of faces of walls and of the deck around a basin.
    pub fn wall(&self) -> Vec3 {
        self.steep
    }

    /// Albedo and shading slope at `p` (X, Z), where the ground's smooth slope is `slope`, it lies `above` metres above
    /// the water (negative: below), and a pixel covers `footprint` metres.
    pub fn shade(&self, p: DVec2, slope: Vec2, above: f32, footprint: f32) -> (Vec3, Vec2) {
        if self.checker > 0.0 {
            let share = checker_share(p / self.checker, f64::from(footprint) / self.checker);
            return (self.albedo.lerp(self.shore, share as f32), slope);
        }
        let Some(noise) = &self.noise else {
            let wet = smoothstep(0.02 * self.spacing as f32, 0.0, above);
            return (self.albedo.lerp(self.shore, wet), slope);
        };
        let steepness = slope.length();
        let detail = noise.fractal(p / self.spacing, f64::from(footprint) / self.spacing);
        // Rougher where it is steep; little under water, where sediment lies.
        let roughness =
            (0.10 + 0.35 * steepness.min(1.0)) * smoothstep(-0.1 * self.spacing as f32, 0.0, above).max(0.3);
        let tilted = slope + roughness * detail.slope;
        let patches = noise.value(p / (7.0 * self.spacing)) + 0.6 * noise.value(p / (2.3 * self.spacing));
        let height = detail.height;
        let steep = smoothstep(0.38, 0.62, steepness + 0.12 * height + 0.06 * patches);
        let tone = 1.0 + 0.30 * patches + 0.45 * height;
        let cover =
            self.albedo * tone.clamp(0.45, 1.6) * Vec3::new(1.0 + 0.18 * patches, 1.0, 1.0 + 0.08 * patches);
        let rock = self.steep * (1.0 + 0.5 * height).clamp(0.5, 1.5);
        let land = cover.lerp(rock, steep);
        // The shore's own colour in a band whose edge the noise frays; darker where the water has just been.
        let band = 0.05 * self.spacing as f32;
        let beach = smoothstep(
            1.6 * band,
            0.3 * band,
            above + band * (0.5 * height + 0.35 * patches),
        );
        let shore = self.shore * (1.0 + 0.25 * height).clamp(0.6, 1.3);
        let wet = smoothstep(0.35 * band, 0.0, above + 0.2 * band * height);
        let color = land.lerp(shore, beach) * (1.0 - 0.45 * wet);
        (color.clamp(Vec3::ZERO, Vec3::ONE), tilted)
    }
}

fn smoothstep(from: f32, to: f32, x: f32) -> f32 {
    let t = ((x - from) / (to - from)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// Share of the second colour of a unit checkerboard in a square of side `width` about `p`, exactly.
fn checker_share(p: DVec2, width: f64) -> f64 {
    // Triangle wave: the running integral of the ±1 square wave.
    let integral = |x: f64| {
        let f = (0.5 * x).fract();
        let f = if f < 0.0 { f + 1.0 } else { f };
        2.0 * (0.5 - (f - 0.5).abs())
    };
    let mean = |x: f64| {
        if width < 1e-9 {
            return if (x.floor() as i64).rem_euclid(2) == 0 {
                1.0
            } else {
                -1.0
            };
        }
        (integral(x + 0.5 * width) - integral(x - 0.5 * width)) / width
    };
    0.5 - 0.5 * mean(p.x) * mean(p.y)
}

#[derive(Clone, Copy, Debug, Default)]
struct Detail {
    /// About −1 to 1.
    height: f32,
    /// Slope per unit of roughness.
    slope: Vec2,
}

/// Value noise on a repeating lattice.
#[derive(Debug)]
struct Noise {
    lattice: Vec<f32>,
}

impl Noise {
    fn new(seed: u64) -> Self {
        let mut rng = Rng::new(seed, NOISE_STREAM);
        Self {
            lattice: (0..LATTICE * LATTICE)
                .map(|_| 2.0 * rng.uniform_f32() - 1.0)
                .collect(),
        }
    }

    /// Value in −1 to 1 and its gradient, with quintic weights (continuous second derivatives).
    fn sample(&self, p: DVec2) -> (f32, Vec2) {
        let cell = p.floor();
        let f = (p - cell).as_vec2();
        let wrap = |v: f64| (v as i64).rem_euclid(LATTICE as i64) as usize;
        let (i, j) = (wrap(cell.x), wrap(cell.y));
        let (i1, j1) = ((i + 1) % LATTICE, (j + 1) % LATTICE);
        let at = |i: usize, j: usize| self.lattice[j * LATTICE + i];
        let (a, b, c, d) = (at(i, j), at(i1, j), at(i, j1), at(i1, j1));
        let w = f * f * f * (f * (f * 6.0 - 15.0) + 10.0);
        let dw = 30.0 * f * f * (f * (f - 2.0) + 1.0);
        let k = a - b - c + d;
        let value = a + (b - a) * w.x + (c - a) * w.y + k * w.x * w.y;
        let slope = dw * Vec2::new(b - a + k * w.y, c - a + k * w.x);
        (value, slope)
    }

    fn value(&self, p: DVec2) -> f32 {
        self.sample(p).0
    }

    /// Octaves from the grid's own spacing (unit length) down to twice the footprint, the last one faded in.
    fn fractal(&self, p: DVec2, footprint: f64) -> Detail {
        let mut out = Detail::default();
        let (mut turn, mut length, mut weight) = (DVec2::X, 1.6, 1.0_f32);
        for octave in 0..OCTAVES {
            let visible = ((length / (2.0 * footprint.max(1e-9))) - 1.0).clamp(0.0, 1.0) as f32;
            if visible <= 0.0 {
                break;
            }
            let shift = f64::from(octave) * 17.31;
            let (value, slope) = self.sample(turn.rotate(p) / length + shift);
            let back = DVec2::new(turn.x, -turn.y).as_vec2();
            out.height += 0.5 * weight * visible * value;
            // The height of an octave is in proportion to its length, so its slope is the same at every scale but for
            // the weight.
            out.slope += weight * visible * back.rotate(slope);
            turn = turn.rotate(TURN);
            length *= 0.5;
            weight *= 0.72;
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_filtered_checkerboard_keeps_its_mean_and_its_corners() {
        assert_eq!(checker_share(DVec2::new(0.5, 0.5), 0.0), 0.0);
        assert_eq!(checker_share(DVec2::new(1.5, 0.5), 0.0), 1.0);
        assert_eq!(checker_share(DVec2::new(-0.5, 0.5), 0.0), 1.0);
        assert!((checker_share(DVec2::new(0.5, 0.5), 0.5) - 0.0).abs() < 1e-12);
        assert!((checker_share(DVec2::new(1.0, 0.5), 0.5) - 0.5).abs() < 1e-12);
        assert!((checker_share(DVec2::new(3.3, -7.9), 1000.0) - 0.5).abs() < 1e-3);
    }

    #[test]
    fn the_gradient_is_that_of_the_value() {
        let noise = Noise::new(3);
        for p in [
            DVec2::new(0.3, 0.7),
            DVec2::new(-5.2, 12.9),
            DVec2::new(127.6, -0.4),
        ] {
            let (_, slope) = noise.sample(p);
            let h = 1e-3;
            let d = |q: DVec2| (noise.value(p + q) - noise.value(p - q)) / (2.0 * h as f32);
            let finite = Vec2::new(d(DVec2::X * h), d(DVec2::Y * h));
            assert!((slope - finite).abs().max_element() < 5e-3, "{slope} {finite}");
        }
    }
}
