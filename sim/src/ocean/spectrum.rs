//! Frequency spectra of wind seas: variance density `S(ω)` in m² s, so that ∫S dω = m0 and the significant wave height
//! is Hs = 4 √m0.

use crate::dispersion::Dispersion;
pub use crate::scene::description::Spectrum;
use crate::solvers::GRAVITY;

/// α g² ω⁻⁵ exp(−1.25 (ω_p/ω)⁴) γ^r, the form shared by JONSWAP, TMA and swell.
fn jonswap_form(omega: f64, peak: f64, alpha: f64, gamma: f64) -> f64 {
    let ratio = peak / omega;
    let decay = 1.25 * ratio.powi(4);
    if decay > 700.0 {
        return 0.0;
    }
    let sigma = if omega <= peak { 0.07 } else { 0.09 };
    let r = (-((omega - peak) / (sigma * peak)).powi(2) / 2.0).exp();
    alpha * GRAVITY * GRAVITY / omega.powi(5) * (-decay).exp() * gamma.powf(r)
}

/// Peak frequency and α of JONSWAP; the dimensionless fetch is kept between calm (1) and fully developed (2.2e4).
fn jonswap_parameters(wind: f64, fetch: f64) -> (f64, f64) {
    let x = (GRAVITY * fetch / (wind * wind)).clamp(1.0, 2.2e4);
    (22.0 * GRAVITY / wind * x.powf(-1.0 / 3.0), 0.076 * x.powf(-0.22))
}

impl Spectrum {
    /// Angular frequency of the peak in rad/s; `None` for a calm (no wind, no height).
    pub fn peak(&self) -> Option<f64> {
        match *self {
            // ω⁻⁵ exp(−(g/(U ω))⁴) in deep water: maximum at (4/5)^¼ g/U.
            Self::Phillips { wind, height } => {
                (wind > 0.0 && height > 0.0).then(|| 0.8_f64.powf(0.25) * GRAVITY / wind)
            }
            Self::PiersonMoskowitz { wind } => (wind > 0.0).then(|| 0.87 * GRAVITY / wind),
            Self::Jonswap { wind, fetch, .. } | Self::Tma { wind, fetch, .. } => {
                (wind > 0.0 && fetch > 0.0).then(|| jonswap_parameters(wind, fetch).0)
            }
            Self::Swell { height, period, .. } => {
                (height > 0.0 && period > 0.0).then(|| std::f64::consts::TAU / period)
            }
        }
    }

    /// Speed of the wind in m/s that raised the sea; a swell's is that of its peak's phase speed in deep water.
    pub fn wind(&self) -> f64 {
        match *self {
            Self::Phillips { wind, .. }
            | Self::PiersonMoskowitz { wind }
            | Self::Jonswap { wind, .. }
            | Self::Tma { wind, .. } => wind,
            Self::Swell { period, .. } => GRAVITY * period / std::f64::consts::TAU,
        }
    }

    /// The shape of the spectrum at `omega` > 0; for Phillips and swell up to the factor that [`Self::scale`] gives.
    fn shape(&self, omega: f64, dispersion: &Dispersion) -> f64 {
        let Some(peak) = self.peak() else { return 0.0 };
        match *self {
            Self::Phillips { wind, .. } => {
                let ratio = (GRAVITY / (wind * omega)).powi(4);
                if ratio > 700.0 {
                    0.0
                } else {
                    (-ratio).exp() / omega.powi(5)
                }
            }
            Self::PiersonMoskowitz { .. } => {
                let decay = 1.291 * (peak / omega).powi(4);
                if decay > 700.0 {
                    0.0
                } else {
                    8.1e-3 * GRAVITY * GRAVITY / omega.powi(5) * (-decay).exp()
                }
            }
            Self::Jonswap { wind, fetch, gamma } => {
                let (peak, alpha) = jonswap_parameters(wind, fetch);
                jonswap_form(omega, peak, alpha, gamma)
            }
            Self::Tma { wind, fetch, gamma } => {
                let (peak, alpha) = jonswap_parameters(wind, fetch);
                jonswap_form(omega, peak, alpha, gamma) * kitaigorodskii(omega, dispersion.depth)
            }
            Self::Swell { gamma, .. } => jonswap_form(omega, peak, 1.0, gamma),
        }
    }

    /// The factor on the shape, computed once for a spectrum.
    pub fn scale(&self, dispersion: &Dispersion) -> f64 {
        match *self {
            Self::Phillips { height, .. } | Self::Swell { height, .. } => {
                let m0 = integrate(self.peak(), |w| self.shape(w, dispersion));
                if m0 > 0.0 {
                    (height / 4.0).powi(2) / m0
                } else {
                    0.0
                }
            }
            _ => 1.0,
        }
    }

    /// Variance density S(ω) in m² s; `scale` is what [`Self::scale`] returned.
    pub fn density(&self, omega: f64, scale: f64, dispersion: &Dispersion) -> f64 {
        if omega > 0.0 {
            scale * self.shape(omega, dispersion)
        } else {
            0.0
        }
    }

    /// Variance m0 in m², integrated over all frequencies.
    pub fn variance(&self, dispersion: &Dispersion) -> f64 {
        let scale = self.scale(dispersion);
        integrate(self.peak(), |w| self.density(w, scale, dispersion))
    }
}

/// Kitaigorodskii's depth attenuation Φ(ω √(d/g)) in the piecewise form of Thompson & Vincent 1983.
fn kitaigorodskii(omega: f64, depth: f64) -> f64 {
    if !depth.is_finite() {
        return 1.0;
    }
    let w = omega * (depth / GRAVITY).sqrt();
    if w <= 1.0 {
        0.5 * w * w
    } else if w < 2.0 {
        1.0 - 0.5 * (2.0 - w).powi(2)
    } else {
        1.0
    }
}

/// ∫f dω over 0.05 to 200 peak frequencies in steps of equal ratio; the ω⁻⁵ tail beyond adds below 1e-8.
fn integrate(peak: Option<f64>, f: impl Fn(f64) -> f64) -> f64 {
    let Some(peak) = peak else { return 0.0 };
    let n = 6000;
    let (low, high) = ((0.05 * peak).ln(), (200.0 * peak).ln());
    let step = (high - low) / f64::from(n);
    (0..n)
        .map(|i| {
            let omega = (low + (f64::from(i) + 0.5) * step).exp();
            f(omega) * omega * step
        })
        .sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    const DEEP: Dispersion = Dispersion {
        depth: f64::INFINITY,
        surface_tension: 0.0,
    };

    #[test]
    fn wave_heights_are_those_of_the_literature() {
        // Pierson–Moskowitz: m0 = α g²/(4 · 1.291 ω_p⁴), Hs ≈ 0.21 U²/g.
        let pm = Spectrum::PiersonMoskowitz { wind: 15.0 };
        let m0 = 8.1e-3 * GRAVITY.powi(2) / (4.0 * 1.291 * pm.peak().unwrap().powi(4));
        assert!((pm.variance(&DEEP) / m0 - 1.0).abs() < 1e-6);
        assert!((4.0 * m0.sqrt() / (0.21 * 225.0 / GRAVITY) - 1.0).abs() < 0.02);
        // A height that is asked for is the height that comes out.
        for spectrum in [
            Spectrum::Phillips {
                wind: 12.0,
                height: 2.0,
            },
            Spectrum::Swell {
                height: 2.0,
                period: 11.0,
                gamma: 8.0,
            },
        ] {
            assert!((4.0 * spectrum.variance(&DEEP).sqrt() - 2.0).abs() < 1e-9);
        }
    }

    #[test]
    fn jonswap_without_enhancement_is_a_pierson_moskowitz_form() {
        let form = |w: f64| jonswap_form(w, 1.0, 0.01, 1.0);
        for w in [0.5_f64, 0.9, 1.0, 1.7, 6.0] {
            let pm = 0.01 * GRAVITY * GRAVITY / w.powi(5) * (-1.25 / w.powi(4)).exp();
            assert!((form(w) / pm - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn tma_loses_energy_to_shallow_water_and_none_to_deep() {
        let spectrum = |depth: f64| {
            let dispersion = Dispersion {
                depth,
                surface_tension: 0.0,
            };
            Spectrum::Tma {
                wind: 15.0,
                fetch: 2e5,
                gamma: 3.3,
            }
            .variance(&dispersion)
        };
        let jonswap = Spectrum::Jonswap {
            wind: 15.0,
            fetch: 2e5,
            gamma: 3.3,
        }
        .variance(&DEEP);
        assert!((spectrum(1e4) / jonswap - 1.0).abs() < 1e-9);
        assert!(spectrum(10.0) < 0.6 * jonswap && spectrum(2.0) < spectrum(10.0));
    }

    #[test]
    fn a_calm_has_no_waves() {
        for spectrum in [
            Spectrum::PiersonMoskowitz { wind: 0.0 },
            Spectrum::Jonswap {
                wind: 0.0,
                fetch: 1e5,
                gamma: 3.3,
            },
            Spectrum::Jonswap {
                wind: 10.0,
                fetch: 0.0,
                gamma: 3.3,
            },
            Spectrum::Phillips {
                wind: 10.0,
                height: 0.0,
            },
        ] {
            assert_eq!(spectrum.variance(&DEEP), 0.0);
            assert_eq!(spectrum.density(1.0, spectrum.scale(&DEEP), &DEEP), 0.0);
        }
    }
}
