//! How the energy of a frequency spreads over directions: `D(θ)` per radian about the mean direction, ∫D dθ = 1.

pub use crate::scene::description::Spreading;
use std::f64::consts::{PI, TAU};

/// ln Γ(x) for x > 0 by Lanczos' series (g = 7, nine terms), to 1e-14.
fn ln_gamma(x: f64) -> f64 {
    const C: [f64; 9] = [
        0.999_999_999_999_809_9,
        676.520_368_121_885_1,
        -1_259.139_216_722_402_8,
        771.323_428_777_653_1,
        -176.615_029_162_140_6,
        12.507_343_278_686_905,
        -0.138_571_095_265_720_12,
        9.984_369_578_019_572e-6,
        1.505_632_735_149_311_6e-7,
    ];
    if x < 0.5 {
        return (PI / (PI * x).sin()).ln() - ln_gamma(1.0 - x);
    }
    let x = x - 1.0;
    let t = x + 7.5;
    let series = C[1..]
        .iter()
        .enumerate()
        .fold(C[0], |sum, (i, c)| sum + c / (x + i as f64 + 1.0));
    0.5 * TAU.ln() + (x + 0.5) * t.ln() - t + series.ln()
}

/// cos²ˢ(θ/2) with its normalisation Q(s) = 2^{2s−1}/π Γ(s+1)²/Γ(2s+1), in logarithms so that no s overflows.
fn cosine_power(s: f64, theta: f64) -> f64 {
    let c = (0.5 * theta).cos().abs();
    let ln_q = (2.0 * s - 1.0) * std::f64::consts::LN_2 - PI.ln() + 2.0 * ln_gamma(s + 1.0)
        - ln_gamma(2.0 * s + 1.0);
    if c <= 0.0 {
        return if s > 0.0 { 0.0 } else { ln_q.exp() };
    }
    (ln_q + 2.0 * s * c.ln()).exp()
}

/// Hasselmann's exponent at `ratio` = ω/ω_p. The steepness of its fall depends on the age of the sea, U ω_p/g.
fn hasselmann(ratio: f64, peak: f64, wind: f64) -> f64 {
    let s = if ratio <= 1.0 {
        6.97 * ratio.powf(4.06)
    } else {
        let age = wind * peak / crate::solvers::GRAVITY;
        9.77 * ratio.powf(-2.33 - 1.45 * (age - 1.17))
    };
    s.min(1e4)
}

impl Spreading {
    /// `D(θ)` per radian at angle `theta` (radians) from the mean direction, for angular frequency `omega` of a sea
    /// whose peak is at `peak`, raised by `wind` m/s.
    pub fn density(&self, theta: f64, omega: f64, peak: f64, wind: f64) -> f64 {
        // Wrapped to (−π, π], where every distribution here is defined.
        let theta = theta - TAU * (theta / TAU).round();
        let ratio = omega / peak;
        match *self {
            Self::CosinePower { exponent } => cosine_power(exponent.max(0.0), theta),
            Self::Mitsuyasu => {
                let at_peak = 11.5 * (peak * wind / crate::solvers::GRAVITY).max(1e-3).powf(-2.5);
                let s = at_peak
                    * if ratio <= 1.0 {
                        ratio.powi(5)
                    } else {
                        ratio.powf(-2.5)
                    };
                cosine_power(s, theta)
            }
            Self::Hasselmann => cosine_power(hasselmann(ratio, peak, wind), theta),
            Self::Swell { elongation } => {
                let longer = 16.0 * (1.0 / ratio).tanh() * elongation * elongation;
                cosine_power(hasselmann(ratio, peak, wind) + longer, theta)
            }
            Self::DonelanBanner => {
                let beta = if ratio < 0.95 {
                    2.61 * ratio.max(0.56).powf(1.3)
                } else if ratio < 1.6 {
                    2.28 * ratio.powf(-1.3)
                } else {
                    10.0_f64.powf(-0.4 + 0.8393 * (-0.567 * (ratio * ratio).ln()).exp())
                };
                beta / (2.0 * (beta * PI).tanh()) / (beta * theta).cosh().powi(2)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ln_gamma_has_its_known_values() {
        for (x, value) in [
            (1.0, 1.0_f64),
            (2.0, 1.0),
            (0.5, PI.sqrt()),
            (5.0, 24.0),
            (11.0, 3_628_800.0),
        ] {
            assert!((ln_gamma(x) - value.ln()).abs() < 1e-12, "{x}");
        }
    }

    #[test]
    fn every_distribution_integrates_to_one_at_every_frequency() {
        let kinds = [
            Spreading::CosinePower { exponent: 0.0 },
            Spreading::CosinePower { exponent: 4.0 },
            Spreading::CosinePower { exponent: 300.0 },
            Spreading::Mitsuyasu,
            Spreading::Hasselmann,
            Spreading::Swell { elongation: 0.0 },
            Spreading::Swell { elongation: 1.0 },
            Spreading::DonelanBanner,
        ];
        for kind in kinds {
            for wind in [3.0, 12.0, 60.0] {
                for ratio in [0.2, 0.6, 0.95, 1.0, 1.3, 1.6, 3.0, 20.0] {
                    let n = 20_000;
                    let step = TAU / f64::from(n);
                    let total: f64 = (0..n)
                        .map(|i| kind.density(-PI + (f64::from(i) + 0.5) * step, ratio, 1.0, wind) * step)
                        .sum();
                    // Small exponents have a cusp at θ = π, which limits the midpoint rule.
                    assert!((total - 1.0).abs() < 1e-5, "{kind:?} {wind} {ratio}: {total}");
                }
            }
        }
    }
}
