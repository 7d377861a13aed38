//! The linear dispersion relation of water waves.

use crate::solvers::GRAVITY;

/// Surface tension over density of clean water at 20 °C, m³/s² (0.0728 N/m over 998 kg/m³).
pub const WATER_CAPILLARITY: f64 = 7.29e-5;

/// Angular frequency in rad/s of waves of wave number `k` (rad/m, positive): ω² = (g k + s k³) tanh(k d).
///
/// `depth` is that of the water in metres, `None` for deep water; `capillarity` is surface tension over density in
/// m³/s², 0 for gravity waves alone.
pub fn angular_frequency(k: f64, depth: Option<f64>, capillarity: f64) -> f64 {
    (k * (GRAVITY + capillarity * k * k) * bed(k, depth)).sqrt()
}

/// Speed in m/s at which the energy of such waves travels, dω/dk.
pub fn group_speed(k: f64, depth: Option<f64>, capillarity: f64) -> f64 {
    let t = bed(k, depth);
    let stiff = GRAVITY + capillarity * k * k;
    // k d sech²(kd) goes to 0 for deep water; 1 − tanh² cancels there, so take it from cosh.
    let shallow = depth.map_or(0.0, |d| k * d / (k * d).min(350.0).cosh().powi(2));
    ((GRAVITY + 3.0 * capillarity * k * k) * t + stiff * shallow)
        / (2.0 * angular_frequency(k, depth, capillarity))
}

/// tanh(k d): 1 for deep water.
pub(super) fn bed(k: f64, depth: Option<f64>) -> f64 {
    depth.map_or(1.0, |d| (k * d).tanh())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_limits_are_deep_water_shallow_water_and_capillary_waves() {
        let k = 0.01;
        assert!((angular_frequency(k, None, 0.0) - (GRAVITY * k).sqrt()).abs() < 1e-15);
        // ω = k √(g d) (1 − (kd)²/6 + …)
        let shallow = k * (GRAVITY * 0.1_f64).sqrt();
        assert!((angular_frequency(k, Some(0.1), 0.0) / shallow - 1.0 + 1e-6 / 6.0).abs() < 1e-11);
        let k = 1e5;
        let capillary = (WATER_CAPILLARITY * k * k * k).sqrt();
        assert!((angular_frequency(k, None, WATER_CAPILLARITY) / capillary - 1.0).abs() < 1e-4);
    }

    #[test]
    fn the_slowest_waves_travel_at_23_centimetres_a_second() {
        // The classical minimum of ω/k for clean water lies at 1.7 cm (Lamb, Hydrodynamics, § 267).
        let speed = |length: f64| {
            let k = std::f64::consts::TAU / length;
            angular_frequency(k, None, WATER_CAPILLARITY) / k
        };
        let slowest = (10..40)
            .map(|n| f64::from(n) * 1e-3)
            .min_by(|a, b| speed(*a).total_cmp(&speed(*b)));
        assert_eq!(slowest, Some(0.017));
        assert!((speed(0.017) - 0.231).abs() < 1e-3);
    }

    #[test]
    fn group_speed_is_the_derivative() {
        for (k, depth, s) in [
            (0.3, None, 0.0),
            (0.3, Some(2.0), 0.0),
            (300.0, Some(0.01), WATER_CAPILLARITY),
            (40.0, Some(100.0), WATER_CAPILLARITY),
        ] {
            let e = 1e-5 * k;
            let numeric =
                (angular_frequency(k + e, depth, s) - angular_frequency(k - e, depth, s)) / (2.0 * e);
            assert!((group_speed(k, depth, s) / numeric - 1.0).abs() < 1e-8);
        }
    }
}
