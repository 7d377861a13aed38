//! The dispersion relation of gravity-capillary waves on water of finite depth.

use crate::solvers::GRAVITY;

/// Surface tension over density of clean water at 20 °C, m³/s² (0.0728 N/m over 998 kg/m³).
pub const SURFACE_TENSION: f64 = 7.29e-5;

/// ω² = (g k + (σ/ρ) k³) tanh(k d).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dispersion {
    /// Water depth `d` in metres; infinite for deep water.
    pub depth: f64,
    /// Surface tension over density, σ/ρ, in m³/s²; 0 leaves capillarity out.
    pub surface_tension: f64,
}

impl Dispersion {
    /// Water of that depth (`None`: deep), with capillarity.
    pub fn new(depth: Option<f64>) -> Self {
        Self {
            depth: depth.unwrap_or(f64::INFINITY),
            surface_tension: SURFACE_TENSION,
        }
    }

    /// What pulls a wave of wave number `k` flat, g + (σ/ρ) k² in m/s².
    pub fn stiffness(&self, k: f64) -> f64 {
        GRAVITY + self.surface_tension * k * k
    }

    /// Angular frequency ω in rad/s of wave number `k` in rad/m (≥ 0).
    pub fn omega(&self, k: f64) -> f64 {
        if k <= 0.0 {
            return 0.0;
        }
        (k * self.stiffness(k) * (k * self.depth).tanh()).sqrt()
    }

    /// Group speed dω/dk in m/s.
    pub fn group_speed(&self, k: f64) -> f64 {
        if k <= 0.0 {
            return if self.depth.is_finite() {
                (GRAVITY * self.depth).sqrt()
            } else {
                f64::INFINITY
            };
        }
        let kd = k * self.depth;
        let s = self.surface_tension;
        let tanh = kd.tanh();
        // k d sech²(k d) vanishes in deep water; cosh would overflow long after it has.
        let sech_term = if kd < 350.0 {
            let c = kd.cosh();
            self.depth * (GRAVITY * k + s * k * k * k) / (c * c)
        } else {
            0.0
        };
        ((GRAVITY + 3.0 * s * k * k) * tanh + sech_term) / (2.0 * self.omega(k))
    }

    /// Wave number in rad/m of angular frequency `omega` in rad/s (≥ 0), to rounding.
    pub fn wave_number(&self, omega: f64) -> f64 {
        if omega <= 0.0 {
            return 0.0;
        }
        // Eckart's 1952 estimate: within 5 % for gravity waves at any depth.
        let deep = omega * omega / GRAVITY;
        let mut k = if self.depth.is_finite() {
            deep / (deep * self.depth).tanh().sqrt()
        } else {
            deep
        };
        // ω(k) is concave, then convex where capillarity takes over; bracketed Newton serves both.
        let (mut low, mut high) = (0.0, f64::INFINITY);
        for _ in 0..60 {
            let error = self.omega(k) - omega;
            if error > 0.0 {
                high = k;
            } else {
                low = k;
            }
            let mut next = k - error / self.group_speed(k);
            if !(next > low && next < high) {
                next = if high.is_finite() {
                    0.5 * (low + high)
                } else {
                    2.0 * k
                };
            }
            if (next - k).abs() <= 4.0 * f64::EPSILON * k {
                return next;
            }
            k = next;
        }
        k
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limits_of_deep_shallow_and_capillary_waves() {
        let deep = Dispersion {
            depth: f64::INFINITY,
            surface_tension: 0.0,
        };
        assert!((deep.omega(1.0) - GRAVITY.sqrt()).abs() < 1e-12);
        assert!((deep.group_speed(1.0) - 0.5 * GRAVITY.sqrt()).abs() < 1e-12);
        let shallow = Dispersion {
            depth: 1e-3,
            surface_tension: 0.0,
        };
        assert!((shallow.omega(1.0) / (GRAVITY * 1e-3).sqrt() - 1.0).abs() < 1e-6);
        // The slowest wave on deep water: 23 cm/s at 1.7 cm.
        let water = Dispersion::new(None);
        let k = (GRAVITY / SURFACE_TENSION).sqrt();
        assert!((water.omega(k) / k - 0.2312).abs() < 1e-3);
        // There group and phase speed are equal.
        assert!((water.group_speed(k) / (water.omega(k) / k) - 1.0).abs() < 1e-12);
    }

    #[test]
    fn group_speed_is_the_derivative_and_wave_number_the_inverse() {
        for depth in [None, Some(1e-3), Some(0.5), Some(20.0), Some(1e4)] {
            let d = Dispersion::new(depth);
            for k in [1e-4, 1e-2, 0.3, 5.0, 370.0, 4e3] {
                let e = 1e-5 * k;
                let slope = (d.omega(k + e) - d.omega(k - e)) / (2.0 * e);
                assert!((d.group_speed(k) / slope - 1.0).abs() < 1e-6, "{depth:?} {k}");
                assert!(
                    (d.wave_number(d.omega(k)) / k - 1.0).abs() < 1e-11,
                    "{depth:?} {k}"
                );
            }
        }
    }
}
