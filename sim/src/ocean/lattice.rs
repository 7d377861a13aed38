//! The random waves of one periodic patch: a lattice of wave numbers with an amplitude and a frequency each.

use super::sea::Sea;
use crate::rng::Rng;
use glam::{DVec2, UVec2};
use rustfft::num_complex::Complex32;
use std::f64::consts::TAU;

/// Amplitudes of a patch at time 0 and what it takes to move them.
///
/// Waves are stored for the half plane kx ≥ 0, `half_width × height`, with kz fastest in the order of the FFT
/// (0, 1, …, −2, −1). The surface is η(x, t) = Σ ĥ(k, t) e^{ik·x} over the whole plane, with
/// ĥ(k, t) = h0(k) e^{−iωt} + conj(h0(−k)) e^{iωt}, where h0 = (ξ + iξ′) · ½ √(Ψ Δkx Δkz) with ξ, ξ′ standard normal: then
/// the variance of η is Σ Ψ Δkx Δkz, hence 4 √(var η) = Hs. (Tessendorf's factor 1/√2 instead of ½, and spectra taken as
/// two-sided, are why well-known codes are 1.4 to 2.8 times too high.)
#[derive(Clone, Debug)]
pub struct Lattice {
    /// Period along X and Z in metres.
    pub period: DVec2,
    /// Samples along X and Z.
    pub size: UVec2,
    /// Variance that the band holds, Σ Ψ Δkx Δkz in m² (expected, not of this draw).
    pub variance: f64,
    /// ĥ = even · cos ωt + odd · sin ωt: h0(k) + conj(h0(−k)).
    pub(super) even: Vec<Complex32>,
    /// −i (h0(k) − conj(h0(−k))).
    pub(super) odd: Vec<Complex32>,
    /// Frequencies in turns a second (or whole turns a loop).
    pub(super) turns: Vec<f64>,
    /// Which rows of kx hold any wave at all.
    pub(super) active_rows: usize,
}

/// Wave number of FFT index `m` of `n` along a period.
pub(super) fn wave_number(m: usize, n: usize, period: f64) -> f64 {
    let signed = if 2 * m > n { m as f64 - n as f64 } else { m as f64 };
    TAU * signed / period
}

/// Standard normal pair of mode `(m, n)`: depends on seed, patch and mode alone, so that a finer grid adds waves without
/// changing those that were there.
fn draw(seed: u64, patch: u64, m: i64, n: i64) -> (f64, f64) {
    let stream = (patch << 56) ^ (((m as u64) & 0x0fff_ffff) << 28) ^ ((n as u64) & 0x0fff_ffff);
    let mut rng = Rng::new(seed, stream);
    (rng.normal(), rng.normal())
}

impl Lattice {
    /// Draws the waves of `sea` with `band.0 <= |k| < band.1` (rad/m) for a patch.
    ///
    /// `patch` numbers the cascade, so that patches draw different waves. With `loop_period` (seconds) every frequency is
    /// rounded down to a whole number of turns a loop.
    pub fn new(
        sea: &Sea,
        period: DVec2,
        size: UVec2,
        band: (f64, f64),
        seed: u64,
        patch: u64,
        loop_period: Option<f64>,
    ) -> Self {
        let (w, h) = (size.x as usize, size.y as usize);
        let half = w / 2 + 1;
        let cell = (TAU / period.x) * (TAU / period.y);
        let signed = |m: usize, n: usize| if 2 * m > n { m as i64 - n as i64 } else { m as i64 };
        let h0 = |m: i64, n: i64| -> (Complex32, f64) {
            let (kx, kz) = (TAU * m as f64 / period.x, TAU * n as f64 / period.y);
            let k = kx.hypot(kz);
            if !(k >= band.0 && k < band.1) || k <= 0.0 {
                return (Complex32::new(0.0, 0.0), 0.0);
            }
            let variance = sea.density(kx, kz) * cell;
            let (a, b) = draw(seed, patch, m, n);
            let scale = 0.5 * variance.sqrt();
            (Complex32::new((a * scale) as f32, (b * scale) as f32), variance)
        };
        let zero = Complex32::new(0.0, 0.0);
        let mut lattice = Self {
            period,
            size,
            variance: 0.0,
            even: vec![zero; half * h],
            odd: vec![zero; half * h],
            turns: vec![0.0; half * h],
            active_rows: 0,
        };
        for m in 0..half {
            for n in 0..h {
                // The Nyquist row and column have no partner of the opposite sign.
                if 2 * m == w || 2 * n == h {
                    continue;
                }
                let (plus, variance) = h0(m as i64, signed(n, h));
                let (minus, opposite) = h0(-(m as i64), -signed(n, h));
                if variance == 0.0 && opposite == 0.0 {
                    continue;
                }
                // On kx = 0 both signs of kz are stored, so each counts once; elsewhere this entry stands for two.
                lattice.variance += if m == 0 { variance } else { variance + opposite };
                let k = wave_number(m, w, period.x).hypot(wave_number(n, h, period.y));
                let turns = sea.dispersion.omega(k) / TAU;
                let at = m * h + n;
                lattice.even[at] = plus + minus.conj();
                lattice.odd[at] = (plus - minus.conj()) * Complex32::new(0.0, -1.0);
                lattice.turns[at] = loop_period.map_or(turns, |t| (turns * t).floor());
                lattice.active_rows = lattice.active_rows.max(m + 1);
            }
        }
        lattice
    }

    /// Bytes held.
    pub fn bytes(&self) -> u64 {
        (self.even.len() * (8 + 8 + 8)) as u64
    }
}

/// sin and cos of `turns · time` whole turns, to f32 rounding for any time: the turn is reduced in f64.
///
/// Written without branches so that it vectorises. The polynomials are the Taylor series of sin πr and cos πr on
/// |r| ≤ ½ (error below 6e-8), doubled to the full angle.
#[inline]
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
