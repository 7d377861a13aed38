//! Steady flow with friction in a channel whose bed is made for a chosen depth (MacDonald, Baines, Nichols & Samuels
//! 1997, doi:10.1061/(ASCE)0733-9429(1997)123:11(1041); SWASHES §3.2.1): subcritical, 1000 m.

use super::Water;
use crate::solvers::GRAVITY;

/// The subcritical channel: Manning's roughness 0.033, q = 2 m²/s.
#[derive(Clone, Debug, PartialEq)]
pub struct MacDonald {
    /// Height of the bed at `k · LENGTH / bed.len()` m, integrated from the far end.
    bed: Vec<f64>,
}

impl MacDonald {
    /// Length of the channel, m.
    pub const LENGTH: f64 = 1000.0;
    /// Discharge per width, m²/s.
    pub const DISCHARGE: f64 = 2.0;
    /// Manning's roughness, s/m^⅓.
    pub const MANNING: f64 = 0.033;

    const STEPS: usize = 200_000;

    /// Integrates the bed.
    pub fn new() -> Self {
        let dx = Self::LENGTH / Self::STEPS as f64;
        let mut bed = vec![0.0; Self::STEPS + 1];
        for k in (0..Self::STEPS).rev() {
            // Simpson's rule over one step.
            let x = k as f64 * dx;
            let integral = Self::slope(x) + 4.0 * Self::slope(x + 0.5 * dx) + Self::slope(x + dx);
            bed[k] = bed[k + 1] - dx / 6.0 * integral;
        }
        Self { bed }
    }

    /// The chosen depth and its slope at `x` m.
    fn depth(x: f64) -> (f64, f64) {
        let scale = (4.0 / GRAVITY).cbrt();
        let s = x / Self::LENGTH - 0.5;
        let e = 0.5 * (-16.0 * s * s).exp();
        (scale * (1.0 + e), scale * e * -32.0 * s / Self::LENGTH)
    }

    /// Slope of the bed: the momentum equation solved for it.
    fn slope(x: f64) -> f64 {
        let (h, dh) = Self::depth(x);
        let q = Self::DISCHARGE;
        let froude = q * q / (GRAVITY * h.powi(3));
        let friction = Self::MANNING * Self::MANNING * q * q / h.powf(10.0 / 3.0);
        (froude - 1.0) * dh - friction
    }

    /// Height of the bed at `x` m, 0 at the far end; continued level beyond both ends.
    pub fn bed(&self, x: f64) -> f64 {
        let at = (x / Self::LENGTH).clamp(0.0, 1.0) * Self::STEPS as f64;
        let k = (at as usize).min(Self::STEPS - 1);
        let f = at - k as f64;
        self.bed[k] * (1.0 - f) + self.bed[k + 1] * f
    }

    /// The water at `x` m.
    pub fn at(&self, x: f64) -> Water {
        let (h, _) = Self::depth(x);
        Water::along_x(h, Self::DISCHARGE / h)
    }
}

impl Default for MacDonald {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn depth_slope_and_bed_agree_with_their_derivatives() {
        let channel = MacDonald::new();
        for x in [100.0, 431.0, 500.0, 777.7] {
            let e = 1e-2;
            let numeric = (MacDonald::depth(x + e).0 - MacDonald::depth(x - e).0) / (2.0 * e);
            assert!((numeric - MacDonald::depth(x).1).abs() < 1e-9);
            let numeric = (channel.bed(x + e) - channel.bed(x - e)) / (2.0 * e);
            assert!((numeric - MacDonald::slope(x)).abs() < 1e-7);
        }
        // Everywhere subcritical.
        assert!((0..1000).all(|k| {
            let w = channel.at(f64::from(k));
            w.velocity[0] < (GRAVITY * w.depth).sqrt()
        }));
    }
}
