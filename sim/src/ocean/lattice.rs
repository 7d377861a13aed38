//! The random waves of one periodic patch: a lattice of wave numbers with an amplitude and a frequency each.

use super::sea::WaveField;
use crate::dispersion::Dispersion;
use crate::rng::Rng;
use glam::{DVec2, UVec2};
use rayon::prelude::*;
use rustfft::num_complex::Complex32;
use std::f64::consts::TAU;

/// Cells of the lattice within this many steps of k = 0 are integrated by [`FINE`]² points: there the spectrum changes
/// much from one wave number to the next.
const NEAR: i64 = 24;
/// Points along one side of a cell that is integrated finely.
const FINE: usize = 4;

/// Amplitudes of a patch at time 0 and what it takes to move them.
///
/// Waves are stored for the half plane kx ≥ 0, `width/2 + 1` rows of `height`, with kz fastest in the order of the FFT
/// (0, 1, …, −2, −1). The surface is η(x, t) = Σ ĥ(k, t) e^{ik·x} over the whole plane, with
/// ĥ(k, t) = h0(k) e^{−iωt} + conj(h0(−k)) e^{iωt}, where h0 = (ξ + iξ′) · ½ √v with ξ, ξ′ standard normal and v the
/// variance ∫Ψ dk over the wave number's cell: then the variance of η is Σ v, hence 4 √(var η) = Hs. (Tessendorf's factor
/// 1/√2 instead of ½, and spectra taken as two-sided, are why well-known codes are 1.4 to 2.8 times too high.)
#[derive(Clone, Debug)]
pub struct Lattice {
    /// Period along X and Z in metres.
    pub period: DVec2,
    /// Samples along X and Z.
    pub size: UVec2,
    /// Variance that the band holds, Σ v in m² (expected, not of this draw).
    pub variance: f64,
    /// 2π over the unit of time: frequencies in rad/s are `radians · turns`.
    pub radians: f64,
    /// ĥ = even · cos ωt + odd · sin ωt: h0(k) + conj(h0(−k)).
    pub(super) even: Vec<Complex32>,
    /// −i (h0(k) − conj(h0(−k))).
    pub(super) odd: Vec<Complex32>,
    /// Frequencies in turns a second, or whole turns a loop: `height/2 + 1` for kz ≥ 0, and the same for −kz.
    pub(super) turns: Vec<f64>,
    /// Rows of kx from this on hold no wave.
    pub(super) active_rows: usize,
    /// Energy in J/m² and momentum along X and Z in kg/(m s) of these waves, a square metre of sea.
    pub(super) energy: f64,
    pub(super) momentum: DVec2,
}

/// FFT index `m` of `n` as a signed number.
pub(super) fn signed(m: usize, n: usize) -> i64 {
    if 2 * m > n { m as i64 - n as i64 } else { m as i64 }
}

/// Wave number of FFT index `m` of `n` along a period.
pub(super) fn wave_number(m: usize, n: usize, period: f64) -> f64 {
    TAU * signed(m, n) as f64 / period
}

/// Standard normal pair of mode `(m, n)`: depends on seed, patch and mode alone, so that a finer grid adds waves without
/// changing those that were there.
fn normal_pair(seed: u64, patch: u64, m: i64, n: i64) -> (f64, f64) {
    let stream = (patch << 56) ^ (((m as u64) & 0x0fff_ffff) << 28) ^ ((n as u64) & 0x0fff_ffff);
    let mut rng = Rng::new(seed, stream);
    (rng.normal(), rng.normal())
}

/// What a patch is drawn from besides the sea.
#[derive(Clone, Copy, Debug)]
pub struct Draw {
    /// Period along X and Z in metres.
    pub period: DVec2,
    /// Samples along X and Z.
    pub size: UVec2,
    /// Wave numbers |k| in rad/m that the patch holds: from the first up to below the second.
    pub band: (f64, f64),
    /// Seed of the random numbers.
    pub seed: u64,
    /// Number of the patch, so that patches draw different waves.
    pub patch: u64,
    /// With a loop period in seconds every frequency is rounded down to a whole number of turns a loop.
    pub loop_period: Option<f64>,
}

impl Draw {
    /// Variance of the sea in the cell of mode `(m, n)`, as far as it lies in the band.
    fn cell_variance(&self, sea: &WaveField, m: i64, n: i64) -> f64 {
        let step = TAU / self.period;
        let centre = step * DVec2::new(m as f64, n as f64);
        let reach = 0.5 * step.length();
        let at_border = |k: f64| (centre.length() - k).abs() <= reach;
        let near = m.abs().max(n.abs()) <= NEAR;
        let points = if near || at_border(self.band.0) || at_border(self.band.1) {
            FINE
        } else {
            1
        };
        let offset = |i: usize| (i as f64 + 0.5) / points as f64 - 0.5;
        let mut sum = 0.0;
        for b in 0..points {
            for a in 0..points {
                let k = centre + step * DVec2::new(offset(a), offset(b));
                let length = k.length();
                if length >= self.band.0 && length < self.band.1 {
                    sum += sea.density(k.x, k.y);
                }
            }
        }
        sum * step.x * step.y / (points * points) as f64
    }
}

/// Expected variance of every wave of a patch: what all its draws have in common.
#[derive(Clone, Debug)]
pub struct Cells {
    /// Of k and of −k for each stored wave number, laid out as the lattice, m².
    pairs: Vec<[f64; 2]>,
}

impl Cells {
    /// The waves of `sea` that belong to a patch.
    pub fn new(sea: &WaveField, draw: &Draw) -> Self {
        let (w, h) = (draw.size.x as usize, draw.size.y as usize);
        let pairs = (0..(w / 2 + 1) * h).into_par_iter().map(|at| {
            let (m, n) = (at / h, at % h);
            // The Nyquist row and column have no partner of the opposite sign; k = 0 is no wave.
            if 2 * m == w || 2 * n == h || at == 0 {
                return [0.0; 2];
            }
            let (m, n) = (m as i64, signed(n, h));
            [draw.cell_variance(sea, m, n), draw.cell_variance(sea, -m, -n)]
        });
        Self {
            pairs: pairs.collect(),
        }
    }
}

/// One row of kx while it is drawn.
#[derive(Default)]
struct Row {
    even: Vec<Complex32>,
    odd: Vec<Complex32>,
    turns: Vec<f64>,
    variance: f64,
    energy: f64,
    momentum: DVec2,
}

impl Lattice {
    /// Draws the waves of `sea` for a patch.
    pub fn new(sea: &WaveField, draw: &Draw) -> Self {
        Self::from_cells(&Cells::new(sea, draw), &sea.dispersion, draw)
    }

    /// Draws waves of known variance; `cells` were made for the same period, size and band.
    pub fn from_cells(cells: &Cells, dispersion: &Dispersion, draw: &Draw) -> Self {
        let (w, h) = (draw.size.x as usize, draw.size.y as usize);
        let half = w / 2 + 1;
        let rows: Vec<Row> = cells
            .pairs
            .par_chunks(h)
            .enumerate()
            .map(|(m, cells)| draw_row(cells, dispersion, draw, m, w, h))
            .collect();
        let mut lattice = Self {
            period: draw.period,
            size: draw.size,
            variance: 0.0,
            radians: TAU / draw.loop_period.unwrap_or(1.0),
            even: Vec::with_capacity(half * h),
            odd: Vec::with_capacity(half * h),
            turns: Vec::with_capacity(half * (h / 2 + 1)),
            active_rows: 0,
            energy: 0.0,
            momentum: DVec2::ZERO,
        };
        for (m, row) in rows.into_iter().enumerate() {
            if row.variance > 0.0 {
                lattice.active_rows = m + 1;
            }
            lattice.variance += row.variance;
            lattice.energy += row.energy;
            lattice.momentum += row.momentum;
            lattice.even.extend(row.even);
            lattice.odd.extend(row.odd);
            lattice.turns.extend(row.turns);
        }
        lattice
    }

    /// Bytes held.
    pub fn bytes(&self) -> u64 {
        (self.even.len() * (8 + 8) + self.turns.len() * 8) as u64
    }
}

/// Draws row `m` of kx.
fn draw_row(cells: &[[f64; 2]], dispersion: &Dispersion, draw: &Draw, m: usize, w: usize, h: usize) -> Row {
    let mut row = Row {
        even: vec![Complex32::default(); h],
        odd: vec![Complex32::default(); h],
        turns: vec![0.0; h / 2 + 1],
        ..Row::default()
    };
    let kx = wave_number(m, w, draw.period.x);
    for (n, turns) in row.turns.iter_mut().enumerate() {
        let k = kx.hypot(TAU * n as f64 / draw.period.y);
        let free = dispersion.omega(k) / TAU;
        *turns = draw.loop_period.map_or(free, |t| (free * t).floor());
    }
    for n in 0..h {
        let kz = wave_number(n, h, draw.period.y);
        let k = DVec2::new(kx, kz);
        let [variance, opposite] = cells[n];
        if variance == 0.0 && opposite == 0.0 {
            continue;
        }
        let mode = |variance: f64, m: i64, n: i64| {
            let (a, b) = normal_pair(draw.seed, draw.patch, m, n);
            let scale = 0.5 * variance.sqrt();
            [a * scale, b * scale]
        };
        let plus = mode(variance, m as i64, signed(n, h));
        let minus = mode(opposite, -(m as i64), -signed(n, h));
        let complex = |re: f64, im: f64| Complex32::new(re as f32, im as f32);
        row.even[n] = complex(plus[0] + minus[0], plus[1] - minus[1]);
        row.odd[n] = complex(plus[1] + minus[1], minus[0] - plus[0]);
        // On kx = 0 both signs of kz are stored, so each counts once; elsewhere this entry stands for two.
        let count = if m == 0 { 1.0 } else { 2.0 };
        row.variance += 0.5 * count * (variance + opposite);
        // Potential and kinetic energy of a mode add up to ρ (g + σ/ρ k²) (|h0(k)|² + |h0(−k)|²), which travels as
        // momentum E k/ω along k and against it.
        let power = [plus, minus].map(|[a, b]| a * a + b * b);
        let length = k.length();
        let stiff = count * crate::optics::WATER_DENSITY * dispersion.stiffness(length);
        row.energy += stiff * (power[0] + power[1]);
        row.momentum += stiff * (power[0] - power[1]) * k / dispersion.omega(length);
    }
    row
}

/// sin and cos of `turns` whole turns, to f32 rounding for any number of them: the turn is reduced in f64.
///
/// Written without branches so that it vectorises. The polynomials are the Taylor series of sin πr and cos πr on
/// |r| ≤ ½ (error below 6e-8), doubled to the full angle.
#[inline(always)]
pub(super) fn sin_cos_turns(turns: f64) -> (f32, f32) {
    // Adding and subtracting 1.5 · 2⁵² rounds to the nearest whole number.
    const ROUND: f64 = 6_755_399_441_055_744.0;
    let whole = (turns + ROUND) - ROUND;
    let r = (turns - whole) as f32;
    let x = std::f32::consts::PI * r;
    let y = x * x;
    let s = x
        * (1.0
            + y * (-1.666_666_7e-1
                + y * (8.333_333e-3 + y * (-1.984_127e-4 + y * (2.755_731_9e-6 + y * -2.505_210_8e-8)))));
    let c = 1.0
        + y * (-0.5
            + y * (4.166_666_7e-2
                + y * (-1.388_888_9e-3 + y * (2.480_158_7e-5 + y * (-2.755_732e-7 + y * 2.087_675_7e-9)))));
    (2.0 * s * c, 1.0 - 2.0 * s * s)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn phases_are_exact_for_long_times() {
        for k in 0..20_000_u32 {
            let turns = f64::from(k) * 7.123_456_789 - 5e4;
            let (s, c) = sin_cos_turns(turns);
            let angle = TAU * (turns - turns.round());
            // The turn is rounded to f32 (2π · 3e-8), and doubling the angle quadruples the rounding of the half angle.
            assert!((f64::from(s) - angle.sin()).abs() < 7e-7, "{turns}");
            assert!((f64::from(c) - angle.cos()).abs() < 7e-7, "{turns}");
        }
    }
}
