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
