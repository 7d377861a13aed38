//! A sea as a sum of wind seas and swells, each with its own spectrum, direction and spreading.

use crate::dispersion::Dispersion;
use crate::scene::description::Sea;

/// Wave-number spectrum of a whole sea.
#[derive(Clone, Debug)]
pub struct WaveField {
    /// Dispersion of its waves.
    pub dispersion: Dispersion,
    components: Vec<Prepared>,
}

#[derive(Clone, Debug)]
struct Prepared {
    component: Sea,
    scale: f64,
    peak: f64,
}

impl WaveField {
    /// The waves of these seas; calm ones (no wind, no height, no fetch) drop out.
    pub fn new(components: &[Sea], dispersion: Dispersion) -> Self {
        let components = components
            .iter()
            .filter_map(|component| {
                let peak = component.spectrum.peak()?;
                let scale = component.spectrum.scale(&dispersion);
                Some(Prepared {
                    component: *component,
                    scale,
                    peak,
                })
            })
            .collect();
        Self {
            dispersion,
            components,
        }
    }

    /// Variance density Ψ(k) in m⁴ over the wave-number plane, k = (kx, kz) in rad/m:
    /// Ψ = S(ω) D(θ) (dω/dk)/k, summed over the components. 0 at k = 0.
    pub fn density(&self, kx: f64, kz: f64) -> f64 {
        let k = kx.hypot(kz);
        if k <= 0.0 || self.components.is_empty() {
            return 0.0;
        }
        let omega = self.dispersion.omega(k);
        let angle = kz.atan2(kx);
        let jacobian = self.dispersion.group_speed(k) / k;
        let directional: f64 = self
            .components
            .iter()
            .map(|c| {
                let theta = angle - c.component.direction.to_radians();
                let spreading =
                    c.component
                        .spreading
                        .density(theta, omega, c.peak, c.component.spectrum.wind());
                c.component.spectrum.density(omega, c.scale, &self.dispersion) * spreading
            })
            .sum();
        directional * jacobian
    }

    /// Variance m0 of the whole sea in m², over all waves.
    pub fn variance(&self) -> f64 {
        self.components
            .iter()
            .map(|c| c.component.spectrum.variance(&self.dispersion))
            .sum()
    }

    /// Whether there is no wave at all.
    pub fn is_calm(&self) -> bool {
        self.components.is_empty()
    }

    /// Lowest peak frequency in rad/s; `None` for a calm.
    pub fn lowest_peak(&self) -> Option<f64> {
        self.components.iter().map(|c| c.peak).min_by(f64::total_cmp)
    }
}
