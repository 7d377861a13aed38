//! Fields of one periodic patch at a time: only those that are asked for are transformed.

use super::lattice::{Lattice, sin_cos_turns, wave_number};
use super::transform::Transform;
use rustfft::num_complex::Complex32;

/// A real field over the patch.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Field {
    /// η in metres.
    Elevation,
    /// Horizontal displacement along X in metres, coth(kd) i kx/k ĥ: towards the crests. (With −i, as often printed, the
    /// points would move away from them; codes then use a negative choppiness.)
    DisplacementX,
    /// Horizontal displacement along Z in metres.
    DisplacementZ,
    /// ∂η/∂x.
    SlopeX,
    /// ∂η/∂z.
    SlopeZ,
    /// ∂Dx/∂x.
    StretchXX,
    /// ∂Dz/∂z.
    StretchZZ,
    /// ∂Dx/∂z = ∂Dz/∂x.
    StretchXZ,
    /// Orbital velocity at the surface along X in m/s.
    VelocityX,
    /// Orbital velocity at the surface along Z in m/s.
    VelocityZ,
}

impl Field {
    /// The factor on ĥ (or ∂ĥ/∂t for velocities) at wave number (kx, kz), and whether i multiplies it too. `per_k` is
    /// coth(kd)/k.
    fn factor(self, kx: f32, kz: f32, per_k: f32) -> (f32, bool) {
        match self {
            Self::Elevation => (1.0, false),
            Self::DisplacementX | Self::VelocityX => (kx * per_k, true),
            Self::DisplacementZ | Self::VelocityZ => (kz * per_k, true),
            Self::SlopeX => (kx, true),
            Self::SlopeZ => (kz, true),
            Self::StretchXX => (-kx * kx * per_k, false),
            Self::StretchZZ => (-kz * kz * per_k, false),
            Self::StretchXZ => (-kx * kz * per_k, false),
        }
    }

    fn is_velocity(self) -> bool {
        matches!(self, Self::VelocityX | Self::VelocityZ)
    }
}

/// A lattice of waves with what it takes to transform it.
#[derive(Debug)]
pub struct Patch {
    lattice: Lattice,
    transform: Transform,
    kz: Vec<f32>,
    per_k: Vec<f32>,
}

impl Patch {
    /// A patch in water of `depth` metres (infinite: deep).
    pub fn new(lattice: Lattice, depth: f64) -> Self {
        let (w, h) = (lattice.size.x as usize, lattice.size.y as usize);
        let kz: Vec<f32> = (0..h)
            .map(|n| wave_number(n, h, lattice.period.y) as f32)
            .collect();
        let mut per_k = vec![0.0; (w / 2 + 1) * h];
        for m in 0..=w / 2 {
            for n in 0..h {
                let k = wave_number(m, w, lattice.period.x).hypot(wave_number(n, h, lattice.period.y));
                if k > 0.0 {
                    per_k[m * h + n] = (1.0 / (k * (k * depth).tanh())) as f32;
                }
            }
        }
        let transform = Transform::new(lattice.size);
        Self {
            lattice,
            transform,
            kz,
            per_k,
        }
    }

    /// The waves.
    pub fn lattice(&self) -> &Lattice {
        &self.lattice
    }

    /// Bytes held.
    pub fn bytes(&self) -> u64 {
        self.lattice.bytes() + self.transform.bytes() + 4 * (self.kz.len() + self.per_k.len()) as u64
    }

    /// Computes `fields` at `time` into `out`, one slice of `width × height` values (x fastest) a field.
    ///
    /// `time` is in seconds for free waves and the fraction of the loop (0 to 1) for looping ones; `loop_period` is then
    /// what turns frequencies into radians a second for velocities.
    pub fn synthesise(
        &mut self,
        time: f64,
        loop_period: Option<f64>,
        fields: &[Field],
        out: &mut [Vec<f32>],
    ) {
        let (w, h) = (self.lattice.size.x as usize, self.lattice.size.y as usize);
        for grid in out.iter_mut() {
            grid.resize(w * h, 0.0);
        }
        let Self {
            lattice,
            transform,
            kz,
            per_k,
        } = self;
        let radians = std::f64::consts::TAU / loop_period.unwrap_or(1.0);
        let waves = |m: usize, velocity: bool, row: &mut [Complex32]| {
            let range = m * h..(m + 1) * h;
            let (even, odd) = (&lattice.even[range.clone()], &lattice.odd[range.clone()]);
            for (((c, e), o), turns) in row.iter_mut().zip(even).zip(odd).zip(&lattice.turns[range]) {
                let (sin, cos) = sin_cos_turns(turns * time);
                *c = if velocity {
                    let omega = (turns * radians) as f32;
                    Complex32::new(
                        omega * (o.re * cos - e.re * sin),
                        omega * (o.im * cos - e.im * sin),
                    )
                } else {
                    Complex32::new(e.re * cos + o.re * sin, e.im * cos + o.im * sin)
                };
            }
        };
        let multiply = |field: Field, m: usize, row: &mut [Complex32]| {
            let kx = wave_number(m, w, lattice.period.x) as f32;
            let per_k = &per_k[m * h..(m + 1) * h];
            for ((c, kz), per_k) in row.iter_mut().zip(kz.iter()).zip(per_k) {
                let (factor, imaginary) = field.factor(kx, *kz, *per_k);
                *c = if imaginary {
                    Complex32::new(-factor * c.im, factor * c.re)
                } else {
                    Complex32::new(factor * c.re, factor * c.im)
                };
            }
        };
        let active = lattice.active_rows;
        for (fields, out) in fields.chunks(2).zip(out.chunks_mut(2)) {
            match (fields, out) {
                ([one], [out]) => transform.real(
                    active,
                    |m, row| {
                        waves(m, one.is_velocity(), row);
                        multiply(*one, m, row);
                    },
                    out,
                ),
                ([a, b], [out_a, out_b]) => transform.pair(
                    active,
                    |m, first, second| {
                        waves(m, a.is_velocity(), first);
                        if a.is_velocity() == b.is_velocity() {
                            second.copy_from_slice(first);
                        } else {
                            waves(m, b.is_velocity(), second);
                        }
                        multiply(*a, m, first);
                        multiply(*b, m, second);
                    },
                    out_a,
                    out_b,
                ),
                _ => {}
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ocean::dispersion::Dispersion;
    use crate::ocean::sea::{Sea, SeaComponent};
    use crate::ocean::spectrum::Spectrum;
    use crate::ocean::spreading::Spreading;
    use glam::{DVec2, UVec2};
    use std::f64::consts::TAU;

    fn sea(depth: Option<f64>) -> Sea {
        let wind = SeaComponent {
            spectrum: Spectrum::Jonswap {
                wind: 10.0,
                fetch: 5e4,
                gamma: 3.3,
            },
            direction: 20.0,
            spreading: Spreading::Hasselmann,
        };
        Sea::new(&[wind], Dispersion::new(depth))
    }

    fn patch(size: UVec2, depth: Option<f64>) -> Patch {
        let lattice = Lattice::new(
            &sea(depth),
            DVec2::new(200.0, 150.0),
            size,
            (0.0, f64::INFINITY),
            3,
            0,
            None,
        );
        Patch::new(lattice, depth.unwrap_or(f64::INFINITY))
    }

    const ALL: [Field; 10] = [
        Field::Elevation,
        Field::DisplacementX,
        Field::DisplacementZ,
        Field::SlopeX,
        Field::SlopeZ,
        Field::StretchXX,
        Field::StretchZZ,
        Field::StretchXZ,
        Field::VelocityX,
        Field::VelocityZ,
    ];

    /// The fields at sample (i, j), summed mode by mode in f64.
    fn oracle(patch: &Patch, depth: f64, time: f64, i: usize, j: usize) -> [f64; 10] {
        let l = patch.lattice();
        let (w, h) = (l.size.x as usize, l.size.y as usize);
        let mut sums = [0.0; 10];
        for m in 0..=w / 2 {
            for n in 0..h {
                let at = m * h + n;
                let (kx, kz) = (wave_number(m, w, l.period.x), wave_number(n, h, l.period.y));
                let k = kx.hypot(kz);
                if k == 0.0 {
                    continue;
                }
                let omega = l.turns[at] * TAU;
                let (sin, cos) = (omega * time).sin_cos();
                let (e, o) = (l.even[at], l.odd[at]);
                let (er, ei, or, oi) = (f64::from(e.re), f64::from(e.im), f64::from(o.re), f64::from(o.im));
                let (re, im) = (er * cos + or * sin, ei * cos + oi * sin);
                let (vr, vi) = (omega * (or * cos - er * sin), omega * (oi * cos - ei * sin));
                let phase = TAU * ((m * i) as f64 / w as f64 + (n * j) as f64 / h as f64);
                let (s, c) = phase.sin_cos();
                // Entries off the axis kx = 0 stand for themselves and their conjugate.
                let weight = if m == 0 { 1.0 } else { 2.0 };
                let real = |a: f64, b: f64| weight * (a * c - b * s);
                let per_k = 1.0 / (k * (k * depth).tanh());
                let turned = real(-im, re);
                let values = [
                    real(re, im),
                    kx * per_k * turned,
                    kz * per_k * turned,
                    kx * turned,
                    kz * turned,
                    -kx * kx * per_k * real(re, im),
                    -kz * kz * per_k * real(re, im),
                    -kx * kz * per_k * real(re, im),
                    kx * per_k * real(-vi, vr),
                    kz * per_k * real(-vi, vr),
                ];
                for (sum, value) in sums.iter_mut().zip(values) {
                    *sum += value;
                }
            }
        }
        sums
    }

    #[test]
    fn transforms_equal_the_sum_of_the_waves() {
        for (size, depth) in [
            (UVec2::new(32, 24), None),
            (UVec2::new(15, 20), Some(8.0)),
            (UVec2::new(18, 9), None),
        ] {
            let mut patch = patch(size, depth);
            let mut out = vec![Vec::new(); 10];
            let time = 1e5 + 0.37;
            patch.synthesise(time, None, &ALL, &mut out);
            let mut scale = [0.0_f64; 10];
            let mut worst = [0.0_f64; 10];
            for (i, j) in [(0, 0), (3, 1), (7, 8), (14, 5), (9, 7), (1, 3)] {
                let truth = oracle(&patch, depth.unwrap_or(f64::INFINITY), time, i, j);
                for f in 0..10 {
                    let value = f64::from(out[f][j * size.x as usize + i]);
                    scale[f] = scale[f].max(truth[f].abs());
                    worst[f] = worst[f].max((value - truth[f]).abs());
                }
            }
            for f in 0..10 {
                assert!(
                    worst[f] <= 3e-6 * scale[f],
                    "{:?} {size}: {} of {}",
                    ALL[f],
                    worst[f],
                    scale[f]
                );
            }
        }
    }

    #[test]
    fn a_field_is_the_same_alone_and_packed() {
        let mut patch = patch(UVec2::new(64, 64), None);
        let mut pair = vec![Vec::new(); 2];
        patch.synthesise(12.5, None, &[Field::DisplacementX, Field::SlopeZ], &mut pair);
        for (n, field) in [Field::DisplacementX, Field::SlopeZ].into_iter().enumerate() {
            let mut alone = vec![Vec::new()];
            patch.synthesise(12.5, None, &[field], &mut alone);
            let scale = alone[0].iter().fold(0.0_f32, |m, v| m.max(v.abs()));
            for (a, b) in alone[0].iter().zip(&pair[n]) {
                assert!((a - b).abs() < 2e-6 * scale);
            }
        }
    }

    #[test]
    fn the_significant_wave_height_is_that_of_the_spectrum() {
        let sea = sea(None);
        let size = UVec2::new(256, 256);
        let period = DVec2::new(800.0, 800.0);
        let (seeds, mut mean) = (40, 0.0);
        let mut expected = 0.0;
        for seed in 0..seeds {
            let lattice = Lattice::new(&sea, period, size, (0.0, f64::INFINITY), seed, 0, None);
            expected = lattice.variance;
            let mut patch = Patch::new(lattice, f64::INFINITY);
            let mut out = vec![Vec::new()];
            patch.synthesise(0.0, None, &[Field::Elevation], &mut out);
            let n = out[0].len() as f64;
            mean += out[0].iter().map(|v| f64::from(*v).powi(2)).sum::<f64>() / n / seeds as f64;
        }
        // 40 draws of a spectrum with about a hundred waves around its peak: 1 % of the height is two deviations.
        assert!(
            (mean.sqrt() / expected.sqrt() - 1.0).abs() < 0.01,
            "{mean} {expected}"
        );
        // What the lattice leaves out is the tail above its Nyquist wave number.
        assert!(
            (expected / sea.variance() - 1.0).abs() < 0.02,
            "{expected} {}",
            sea.variance()
        );
    }
}
