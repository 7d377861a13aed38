//! Solutions of the linear wave equation ∂²η/∂t² = c²∇²η from rest.

use std::f64::consts::{PI, TAU};

/// A standing wave of unit amplitude in a basin with walls at 0 and `length` along both axes:
/// cos(mπx/L) cos(nπz/L) cos(ωt), ω = c π √(m² + n²)/L.
#[derive(Clone, Copy, Debug)]
pub(crate) struct StandingWave {
    kx: f64,
    kz: f64,
    /// Angular frequency, rad/s.
    pub omega: f64,
}

/// The standing wave of `modes` half waves along each axis.
pub(crate) fn standing_wave(length: f64, modes: (f64, f64), speed: f64) -> StandingWave {
    let (kx, kz) = (modes.0 * PI / length, modes.1 * PI / length);
    StandingWave {
        kx,
        kz,
        omega: speed * kx.hypot(kz),
    }
}

impl StandingWave {
    /// Elevation at time 0.
    pub(crate) fn shape(&self, x: f64, z: f64) -> f64 {
        (self.kx * x).cos() * (self.kz * z).cos()
    }

    /// Elevation at any time.
    pub(crate) fn at(&self, x: f64, z: f64, t: f64) -> f64 {
        self.shape(x, z) * (self.omega * t).cos()
    }
}

/// A ridge of unit height, exp(−x²/2σ²), on a line of period L: it parts into two pulses of half its height
/// (d'Alembert 1747).
#[derive(Clone, Copy, Debug)]
pub(crate) struct RidgePulse {
    /// Standard deviation, metres.
    pub width: f64,
    /// Where it starts, metres.
    pub centre: f64,
    /// Period, metres; many times the width.
    pub period: f64,
    /// Wave speed, m/s.
    pub speed: f64,
}

impl RidgePulse {
    fn ridge(&self, x: f64) -> f64 {
        // Distance to the nearest of the periodic images; the next one is below rounding.
        let d = (x - self.centre + 0.5 * self.period).rem_euclid(self.period) - 0.5 * self.period;
        (-0.5 * (d / self.width).powi(2)).exp()
    }

    /// Elevation at any time.
    pub(crate) fn at(&self, x: f64, t: f64) -> f64 {
        0.5 * (self.ridge(x - self.speed * t) + self.ridge(x + self.speed * t))
    }
}

/// The profile over radius of a hump exp(−r²/2σ²) that starts at rest in an endless basin, as a table for interpolation.
///
/// The solution is the Hankel integral η(r, t) = σ² ∫₀^∞ e^{−σ²k²/2} cos(ckt) J₀(kr) k dk. With Bessel's integral for
/// J₀ the integral over k becomes a plane ridge F(s) = 1 − √2 (s/σ) D(s/(√2 σ)), D being Dawson's integral, and η is
/// the mean over all directions φ of F(r cos φ − ct): a periodic integrand, for which equal steps converge faster than
/// any power.
#[derive(Clone, Debug)]
pub(crate) struct RadialPulse {
    step: f64,
    values: Vec<f64>,
}

/// The profile at time `t` for radii up to `reach`.
pub(crate) fn radial_pulse(width: f64, speed: f64, t: f64, reach: f64) -> RadialPulse {
    let step = width / 40.0;
    let count = (reach / step).ceil() as usize + 8;
    let values = (0..count).map(|n| mean_ridge(n as f64 * step / width, speed * t / width));
    RadialPulse {
        step,
        values: values.collect(),
    }
}

impl RadialPulse {
    /// Elevation at radius `r`; six-point Lagrange interpolation, good to 1e-11 of the height.
    pub(crate) fn at(&self, r: f64) -> f64 {
        let p = r / self.step;
        // The profile is even, so the table goes on to the left as its mirror image.
        let first = p.floor() as i64 - 2;
        let value = |n: i64| self.values.get(n.unsigned_abs() as usize).copied().unwrap_or(0.0);
        let u = p - first as f64;
        (0..6_i32)
            .map(|a| {
                let others = (0..6_i32).filter(|b| *b != a);
                let weight: f64 = others.map(|b| (u - f64::from(b)) / f64::from(a - b)).product();
                weight * value(first + i64::from(a))
            })
            .sum()
    }
}

/// Mean over all directions of F(r cos φ − s), lengths in widths.
fn mean_ridge(r: f64, s: f64) -> f64 {
    // The integrand's Fourier series falls off beyond an order of a few times r.
    let count = 48 + 12 * r.ceil() as usize;
    let sum: f64 = (0..count)
        .map(|k| ridge(r * (TAU * k as f64 / count as f64).cos() - s))
        .sum();
    sum / count as f64
}

/// F(s) = 1 − √2 s D(s/√2), lengths in widths.
fn ridge(s: f64) -> f64 {
    let x = s / std::f64::consts::SQRT_2;
    if x.abs() > 12.0 {
        // 1 − 2xD(x) → −(1/(2x²) + 3/(4x⁴) + 15/(8x⁶) + …), where the difference would lose digits.
        let y = 0.5 / (x * x);
        return -y * (1.0 + y * (3.0 + y * (15.0 + y * (105.0 + y * 945.0))));
    }
    1.0 - 2.0 * x * dawson(x)
}

/// Dawson's integral e^{−x²} ∫₀ˣ e^{u²} du by Rybicki's sampling (Computers in Physics 3, 85, 1989): exact to rounding
/// with a step of 0.2, since its error is e^{−(π/0.4)²}.
fn dawson(x: f64) -> f64 {
    const STEP: f64 = 0.2;
    // The even multiple of the step nearest to x, and odd ones around it.
    let n0 = 2 * (0.5 * x / STEP).round() as i64;
    let sum: f64 = (-33..=33_i64)
        .step_by(2)
        .map(|n| {
            let d = x - (n0 + n) as f64 * STEP;
            (-d * d).exp() / (n0 + n) as f64
        })
        .sum();
    sum / PI.sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dawson_has_its_tabulated_values() {
        // Abramowitz & Stegun, table 7.5.
        for (x, d) in [
            (0.5, 0.424_436_383_502),
            (1.0, 0.538_079_506_912),
            (2.0, 0.301_340_388_923),
            (-1.0, -0.538_079_506_912),
        ] {
            assert!((dawson(x) - d).abs() < 1e-11, "{x}");
        }
        // The difference takes 24 times the 1e-11 that Dawson's function is held to.
        assert!((ridge(17.1) - (1.0 - 2_f64.sqrt() * 17.1 * dawson(17.1 / 2_f64.sqrt()))).abs() < 2.5e-10);
    }

    /// σ² ∫ e^{−σ²k²/2} cos(ckt) J₀(kr) k dk with J₀ from Bessel's integral, by the trapezoid rule; σ = c = 1.
    fn hankel(r: f64, t: f64) -> f64 {
        let bessel = |x: f64| {
            let n = 200;
            (0..n)
                .map(|k| (x * (PI * (f64::from(k) + 0.5) / f64::from(n)).sin()).cos())
                .sum::<f64>()
                / f64::from(n)
        };
        let h = 0.002;
        (1..6000)
            .map(|n| {
                let k = f64::from(n) * h;
                // Trapezoid with Gregory's end correction for the non-zero slope at 0: + h²/12.
                h * (-0.5 * k * k).exp() * (k * t).cos() * bessel(k * r) * k
            })
            .sum::<f64>()
            + h * h / 12.0
    }

    #[test]
    fn the_radial_pulse_is_its_hankel_integral() {
        for t in [0.0, 0.7, 6.0] {
            let pulse = radial_pulse(1.0, 1.0, t, 12.0);
            for r in [0.0, 0.013, 1.234, 5.0, 9.87] {
                let (a, b) = (pulse.at(r), hankel(r, t));
                assert!((a - b).abs() < 3e-10, "r = {r}, t = {t}: {a} {b}");
            }
        }
        let start = radial_pulse(1.0, 1.0, 0.0, 5.0);
        assert!((start.at(1.7) - (-0.5_f64 * 1.7 * 1.7).exp()).abs() < 1e-11);
    }

    #[test]
    fn the_solutions_satisfy_the_wave_equation() {
        let (c, e) = (1.7, 1e-3);
        let standing = standing_wave(3.0, (2.0, 1.0), c);
        let second = |f: &dyn Fn(f64) -> f64| (f(e) - 2.0 * f(0.0) + f(-e)) / (e * e);
        let (x, z, t) = (0.4, 1.3, 0.9);
        let left = second(&|d| standing.at(x, z, t + d));
        let right = c * c * (second(&|d| standing.at(x + d, z, t)) + second(&|d| standing.at(x, z + d, t)));
        assert!((left - right).abs() < 1e-4 * left.abs(), "{left} {right}");

        let pulse = RidgePulse {
            width: 0.3,
            centre: 1.0,
            period: 6.0,
            speed: c,
        };
        let left = second(&|d| pulse.at(x, t + d));
        let right = c * c * second(&|d| pulse.at(x + d, t));
        assert!(
            (left - right).abs() < 1e-4 * left.abs().max(1.0),
            "{left} {right}"
        );
        assert!(
            (pulse.at(1.0, 6.0 / c) - 1.0).abs() < 1e-12,
            "after one period both pulses are back"
        );
    }
}
