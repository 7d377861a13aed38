//! Periodic gradient noise in the plane and in time (Perlin 2002), four octaves.

use crate::rng::Rng;
use glam::Vec3;
use rayon::prelude::*;

/// Octaves, each twice as fine and half as high as the one before.
pub(super) const OCTAVES: usize = 4;
/// Cells of the coarsest octave along a side of the tile.
const CELLS: usize = 4;

/// Noise over a tile of period 1.
#[derive(Clone, Debug)]
pub(super) struct GradientNoise {
    seed: u64,
    octaves: usize,
    scale: f32,
}

/// Smooth step with zero first and second derivative at both ends.
fn fade(t: f32) -> f32 {
    t * t * t * (t * (t * 6.0 - 15.0) + 10.0)
}

/// The gradients of one octave at one whole time, row by row.
fn gradients(seed: u64, octave: usize, time: i64) -> Vec<Vec3> {
    let n = CELLS << octave;
    (0..n * n)
        .map(|at| {
            let stream = ((octave as u64) << 60) ^ (((time as u64) & 0xffff_ffff) << 24) ^ at as u64;
            let mut rng = Rng::new(seed, stream);
            let v = Vec3::from_array(std::array::from_fn(|_| rng.normal() as f32));
            v.try_normalize().unwrap_or(Vec3::Y)
        })
        .collect()
}

impl GradientNoise {
    /// Noise of standard deviation `height`, on tiles of `samples`² (octaves that these cannot show are left out).
    pub(super) fn new(seed: u64, height: f32, samples: usize, finest: f32) -> Self {
        // An octave whose cells are shorter than two of the frame's samples would show false waves.
        let shown = |o: &usize| 1.0 / (CELLS << o) as f32 >= 2.0 * finest;
        let mut noise = Self {
            seed,
            octaves: (0..OCTAVES).take_while(shown).count().max(1),
            scale: 1.0,
        };
        // The deviation of one tile varies; sixteen times far apart give it to a few per cent.
        let mut tile = vec![0.0; samples * samples];
        let mut square = 0.0;
        for k in 0..16 {
            noise.fill(7.3 * k as f32, samples, &mut tile);
            square += tile.iter().map(|v| f64::from(*v).powi(2)).sum::<f64>() / (16 * tile.len()) as f64;
        }
        noise.scale = height / (square.sqrt() as f32).max(1e-12);
        noise
    }

    /// Samples the tile at `time` (cells of time), row-major.
    pub(super) fn fill(&self, time: f32, samples: usize, out: &mut [f32]) {
        out.fill(0.0);
        let mut weight = self.scale;
        for octave in 0..self.octaves {
            // Finer octaves live shorter.
            let t = time * (1 << octave) as f32;
            let whole = t.floor();
            let past = t - whole;
            let layers = [0, 1].map(|d| gradients(self.seed, octave, whole as i64 + d));
            let n = CELLS << octave;
            out.par_chunks_mut(samples).enumerate().for_each(|(j, row)| {
                let z = j as f32 / samples as f32 * n as f32;
                let (j0, fz) = (z as usize, z.fract());
                for (i, out) in row.iter_mut().enumerate() {
                    let x = i as f32 / samples as f32 * n as f32;
                    let (i0, fx) = (x as usize, x.fract());
                    let corner = |a: usize, b: usize, c: usize| {
                        let gradient = layers[c][(j0 + b) % n * n + (i0 + a) % n];
                        gradient.dot(Vec3::new(fx - a as f32, fz - b as f32, past - c as f32))
                    };
                    let (u, v, w) = (fade(fx), fade(fz), fade(past));
                    let mix = |a: f32, b: f32, t: f32| a + t * (b - a);
                    let plane = |c: usize| {
                        mix(
                            mix(corner(0, 0, c), corner(1, 0, c), u),
                            mix(corner(0, 1, c), corner(1, 1, c), u),
                            v,
                        )
                    };
                    *out += weight * mix(plane(0), plane(1), w);
                }
            });
            weight *= 0.5;
        }
    }
}
