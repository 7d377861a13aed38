//! Water in flight: spheres under gravity and the drag of still air.

use crate::solvers::GRAVITY;

/// Density of air over that of water.
const AIR_OVER_WATER: f64 = 1.2e-3;
/// Drag coefficient of a sphere between Reynolds numbers of 10³ and 10⁵ (Clift, Grace & Weber 1978).
const DRAG_COEFFICIENT: f64 = 0.47;
/// Sub-steps of a flight for each time in which a falling droplet takes on its final speed.
const RESOLUTION: f64 = 8.0;
/// Most sub-steps of one flight; beyond them a droplet is mist, which is slow whatever the step.
const MOST_SUBSTEPS: f64 = 64.0;

/// Droplets as plain arrays.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Flock {
    /// Centre, m: X, height above datum, Z.
    pub(crate) position: Vec<[f64; 3]>,
    /// m/s.
    pub(crate) velocity: Vec<[f64; 3]>,
    /// Volume as depth over one cell, m.
    pub(crate) height: Vec<f64>,
    /// m.
    pub(crate) radius: Vec<f64>,
}

impl Flock {
    pub(crate) fn len(&self) -> usize {
        self.height.len()
    }

    pub(crate) fn push(&mut self, position: [f64; 3], velocity: [f64; 3], height: f64, radius: f64) {
        self.position.push(position);
        self.velocity.push(velocity);
        self.height.push(height);
        self.radius.push(radius);
    }

    /// Removes every droplet for which `gone` says so; the others keep their order.
    pub(crate) fn retain(&mut self, gone: &[bool]) {
        let mut kept = 0;
        for (k, gone) in gone.iter().enumerate() {
            if !gone {
                self.position[kept] = self.position[k];
                self.velocity[kept] = self.velocity[k];
                self.height[kept] = self.height[k];
                self.radius[kept] = self.radius[k];
                kept += 1;
            }
        }
        self.position.truncate(kept);
        self.velocity.truncate(kept);
        self.height.truncate(kept);
        self.radius.truncate(kept);
    }

    pub(crate) fn bytes(&self) -> usize {
        self.height.capacity() * (2 * size_of::<[f64; 3]>() + 2 * size_of::<f64>())
    }
}

/// k of dv/dt = g − k |v| v for a sphere of water of `radius` m, 1/m.
pub(crate) fn drag(radius: f64) -> f64 {
    0.375 * DRAG_COEFFICIENT * AIR_OVER_WATER / radius.max(1e-7)
}

/// Moves a droplet by `dt` s under gravity and drag `k` (1/m).
///
/// Half a kick, the exact flow of pure drag (v → v / (1 + k|v|τ), x → x + v ln(1 + k|v|τ)/(k|v|)), half a kick: second
/// order, exact without drag, and bounded for any step.
pub(crate) fn fly(position: &mut [f64; 3], velocity: &mut [f64; 3], k: f64, dt: f64) {
    let substeps = (RESOLUTION * dt * (GRAVITY * k).sqrt())
        .ceil()
        .clamp(1.0, MOST_SUBSTEPS);
    let tau = dt / substeps;
    let kick = 0.5 * GRAVITY * tau;
    for _ in 0..substeps as u32 {
        velocity[1] -= kick;
        let speed = velocity.iter().map(|v| v * v).sum::<f64>().sqrt();
        let braked = k * speed * tau;
        let stretch = if braked < 1e-6 {
            tau * (1.0 - 0.5 * braked)
        } else {
            tau * braked.ln_1p() / braked
        };
        for (x, v) in position.iter_mut().zip(velocity.iter_mut()) {
            *x += *v * stretch;
            *v /= 1.0 + braked;
        }
        velocity[1] -= kick;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Fall from rest with quadratic drag: v = V tanh(g t/V), y = −(V²/g) ln cosh(g t/V), V = √(g/k).
    #[test]
    fn a_fall_with_drag_is_second_order_and_ends_at_the_final_speed() {
        let k = drag(2e-3);
        let terminal = (GRAVITY / k).sqrt();
        // A drop of 4 mm falls at about 9 m/s (Gunn & Kinzer 1949: 8.83).
        assert!((terminal - 9.6).abs() < 0.3, "{terminal}");
        let time = 2.0_f64;
        let truth = -(terminal * terminal / GRAVITY) * (GRAVITY * time / terminal).cosh().ln();
        let error = |steps: u32| {
            let (mut x, mut v) = ([0.0; 3], [0.0; 3]);
            for _ in 0..steps {
                fly(&mut x, &mut v, k, time / f64::from(steps));
            }
            (x[1] - truth).abs()
        };
        // From 64 on the steps are shorter than the sub-steps would be.
        let (coarse, fine) = (error(64), error(128));
        assert!(
            coarse < 1e-3 && (3.6..4.4).contains(&(coarse / fine)),
            "{coarse} {fine}"
        );
        let (mut x, mut v) = ([0.0; 3], [3.0, 0.0, -1.0]);
        for _ in 0..600 {
            fly(&mut x, &mut v, k, 0.02);
        }
        assert!((v[1] + terminal).abs() < 1e-3 * terminal && v[0] < 0.01, "{v:?}");
    }

    #[test]
    fn a_flight_without_drag_is_the_parabola_and_mist_stays_bounded() {
        let (mut x, mut v) = ([1.0, 2.0, 3.0], [3.0, 5.0, -2.0]);
        for _ in 0..7 {
            fly(&mut x, &mut v, 0.0, 0.1);
        }
        let t = 0.7;
        let truth = [
            1.0 + 3.0 * t,
            2.0 + 5.0 * t - 0.5 * GRAVITY * t * t,
            3.0 - 2.0 * t,
        ];
        for (x, truth) in x.iter().zip(truth) {
            assert!((x - truth).abs() < 1e-12);
        }
        let (mut x, mut v) = ([0.0; 3], [100.0, 100.0, 0.0]);
        fly(&mut x, &mut v, drag(1e-6), 1e4);
        assert!(v.iter().chain(&x).all(|c| c.is_finite()));
    }
}
