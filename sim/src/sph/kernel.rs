//! Smoothing kernels, and the share of a kernel that a plane of wall fills.
//!
//! Every kernel has compact support `h`, integrates to 1 over space and has the unit 1/m³.

use std::f32::consts::PI;

/// Cubic spline (Monaghan 1992) of support `h`, with what each evaluation shares.
///
/// With q = r/h: W = 8/(πh³) · (6(q³ − q²) + 1) for q ≤ ½, and 16/(πh³) · (1 − q)³ beyond. On a cubic lattice of spacing
/// h/2 its sum times the volume of a particle is 1.0002, so that a particle's volume is the lattice's, exactly.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CubicSpline {
    support: f32,
    inverse: f32,
    value: f32,
    slope: f32,
}

impl CubicSpline {
    pub(crate) fn new(support: f32) -> Self {
        let cube = PI * support.powi(3);
        Self {
            support,
            inverse: 1.0 / support,
            value: 8.0 / cube,
            slope: 48.0 / (cube * support * support),
        }
    }

    /// Scaled so that its sum and that of its gradients over a cubic lattice of `spacing` are exact: a particle's volume
    /// is then the lattice's, and a column of them does not settle. The scales are within 1 % of 1.
    pub(crate) fn of_lattice(support: f32, spacing: f32) -> Self {
        let mut kernel = Self::new(support);
        let reach = (support / spacing) as i32;
        let (mut sum, mut moment) = (0.0, 0.0);
        for i in -reach..=reach {
            for j in -reach..=reach {
                for k in -reach..=reach {
                    let r = spacing * ((i * i + j * j + k * k) as f32).sqrt();
                    sum += kernel.at(r);
                    if r > 0.0 && r < support {
                        moment -= kernel.gradient_factor(r) * r * r / 3.0;
                    }
                }
            }
        }
        let volume = spacing.powi(3);
        kernel.value /= volume * sum;
        kernel.slope /= volume * moment;
        kernel
    }

    /// Share of the density over its gradient, in metres, that a level surface half a spacing above a lattice lacks.
    pub(crate) fn depth_of_gradient(&self, spacing: f32) -> f32 {
        let (mut share, mut slope, mut s) = (0.0, 0.0, spacing);
        while s < self.support {
            share += self.over_plane(s);
            slope -= self.over_plane_slope(s);
            s += spacing;
        }
        share / slope
    }

    pub(crate) fn support(&self) -> f32 {
        self.support
    }

    /// Value at distance `r` in 1/m³.
    #[inline(always)]
    pub(crate) fn at(&self, r: f32) -> f32 {
        let q = r * self.inverse;
        let u = (1.0 - q).max(0.0);
        let (inner, outer) = (6.0 * q * q * (q - 1.0) + 1.0, 2.0 * u * u * u);
        self.value * if q <= 0.5 { inner } else { outer }
    }

    /// Factor by which the vector between the points is multiplied to give the gradient, in 1/m⁵.
    #[inline(always)]
    pub(crate) fn gradient_factor(&self, r: f32) -> f32 {
        let q = r * self.inverse;
        let u = (1.0 - q).max(0.0);
        let (inner, outer) = (3.0 * q - 2.0, -u * u / q);
        self.slope * if q <= 0.5 { inner } else { outer }
    }

    /// ∫ W over the plane at distance `s` ≥ 0 from the kernel's centre, in 1/m.
    fn over_plane(&self, s: f32) -> f32 {
        let t = s * self.inverse;
        let inner = |q: f32| q * q * (0.5 + q * q * (-1.5 + 1.2 * q));
        let u = (1.0 - t).max(0.0);
        let integral = if t < 0.5 {
            0.01875 + inner(0.5) - inner(t)
        } else {
            u.powi(4) * (0.5 - 0.4 * u)
        };
        2.0 * PI * self.value * self.support * self.support * integral
    }

    /// Derivative of [`Self::over_plane`] in 1/m².
    fn over_plane_slope(&self, s: f32) -> f32 {
        -2.0 * PI * s * self.at(s)
    }

    /// What a plane wall at distance `z` contributes to the density ratio of a particle, and its derivative in 1/m.
    ///
    /// The wall mirrors the particle's own layer and those behind it, each `spacing` farther away and smeared evenly over
    /// its plane: L(z) = d Σ_k A(2z + k d) with A the kernel's integral over a plane. A lattice that begins half a
    /// spacing before the wall then has the density ratio 1; the push p L′ of a pressure p is that of mirrored
    /// particles of the same pressure, so a level pressure is in balance; and since it is the derivative of the density,
    /// a wall at rest does no work. Nothing changes along the wall: water slides on it.
    pub(crate) fn wall(&self, spacing: f32, z: f32) -> (f32, f32) {
        let (mut share, mut slope) = (0.0, 0.0);
        let mut s = 2.0 * z.max(0.0);
        while s < self.support {
            share += spacing * self.over_plane(s);
            slope += 2.0 * spacing * self.over_plane_slope(s);
            s += spacing;
        }
        (share, slope)
    }
}

/// The three kernels of Müller, Charypar & Gross 2003 of one support: `poly6` for densities, `spiky` for pressure
/// gradients, `viscosity` for its Laplacian.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Muller {
    support: f32,
    poly6: f32,
    poly6_slope: f32,
    forces: f32,
}

impl Muller {
    pub(crate) fn new(support: f32) -> Self {
        let h6 = PI * support.powi(6);
        let h9 = PI * support.powi(9);
        Self {
            support,
            poly6: 315.0 / (64.0 * h9),
            poly6_slope: -945.0 / (32.0 * h9),
            forces: 45.0 / h6,
        }
    }

    pub(crate) fn support(&self) -> f32 {
        self.support
    }

    /// What poly6 is times (h² − r²)³, 1/m⁹ (eq. 20).
    pub(crate) fn poly6_factor(&self) -> f32 {
        self.poly6
    }

    /// 45/(πh⁶), 1/m⁶: times −(h − r)² it is the gradient of spiky along the line between the points (eq. 21), times h − r
    /// the Laplacian of the viscosity kernel (eq. 22).
    pub(crate) fn force_factor(&self) -> f32 {
        self.forces
    }

    /// poly6 at squared distance `r2`, 1/m³.
    #[cfg(test)]
    pub(crate) fn poly6(&self, r2: f32) -> f32 {
        self.poly6 * (self.support * self.support - r2).max(0.0).powi(3)
    }

    /// Gradient factor of poly6 at squared distance `r2`, 1/m⁵.
    #[inline(always)]
    pub(crate) fn poly6_gradient_factor(&self, r2: f32) -> f32 {
        let d = (self.support * self.support - r2).max(0.0);
        self.poly6_slope * d * d
    }

    /// Laplacian of poly6 at squared distance `r2`, 1/m⁵.
    #[inline(always)]
    pub(crate) fn poly6_laplacian(&self, r2: f32) -> f32 {
        let h2 = self.support * self.support;
        let d = (h2 - r2).max(0.0);
        self.poly6_slope * d * (3.0 * h2 - 7.0 * r2)
    }

    /// Gradient of spiky along the line between the points, 1/m⁴.
    #[cfg(test)]
    pub(crate) fn spiky_slope(&self, r: f32) -> f32 {
        -self.forces * (self.support - r).max(0.0).powi(2)
    }

    /// Laplacian of the viscosity kernel, 1/m⁵.
    #[cfg(test)]
    pub(crate) fn viscosity_laplacian(&self, r: f32) -> f32 {
        self.forces * (self.support - r).max(0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// ∫ f(r) 4πr² dr by the midpoint rule.
    fn over_space(support: f32, f: impl Fn(f32) -> f32) -> f64 {
        let n = 20_000;
        let dr = f64::from(support) / f64::from(n);
        (0..n)
            .map(|k| {
                let r = dr * (f64::from(k) + 0.5);
                f64::from(f(r as f32)) * 4.0 * std::f64::consts::PI * r * r * dr
            })
            .sum()
    }

    #[test]
    fn kernels_integrate_to_one_and_slopes_are_derivatives() {
        let h = 0.3;
        let cubic = CubicSpline::new(h);
        let muller = Muller::new(h);
        assert!((over_space(h, |r| cubic.at(r)) - 1.0).abs() < 1e-5);
        assert!((over_space(h, |r| muller.poly6(r * r)) - 1.0).abs() < 1e-5);
        // Integrated by parts: ∫ −r W′(r) dV = 3 ∫ W dV.
        let parts = over_space(h, |r| -r * r * cubic.gradient_factor(r) / 3.0);
        let spiky = over_space(h, |r| -r * muller.spiky_slope(r) / 3.0);
        let poly6 = over_space(h, |r| -r * r * muller.poly6_gradient_factor(r * r) / 3.0);
        for value in [parts, spiky, poly6] {
            assert!((value - 1.0).abs() < 1e-5, "{value}");
        }
        // The Laplacian of a kernel integrates to its flux through the surface of the support: none.
        assert!(over_space(h, |r| muller.poly6_laplacian(r * r)).abs() * f64::from(h * h) < 1e-3);
        for k in 1..30 {
            let (r, dr) = (0.01 * k as f32, 1e-4);
            let slope = (cubic.at(r + dr) - cubic.at(r - dr)) / (2.0 * dr);
            let error = (slope - r * cubic.gradient_factor(r)).abs();
            assert!(error < 2e-3 * cubic.at(0.0) / h, "{r}: {error}");
        }
    }

    #[test]
    fn a_lattice_against_a_wall_has_the_density_and_balance_of_one_without() {
        let (d, h) = (0.1_f32, 0.2);
        let kernel = CubicSpline::new(h);
        let volume = d.powi(3);
        for layer in 0..4 {
            let (mut density, mut pull) = (0.0, 0.0);
            for k in -layer..4 {
                for i in -3..=3_i32 {
                    for j in -3..=3_i32 {
                        let r = d * ((i * i + j * j + k * k) as f32).sqrt();
                        density += volume * kernel.at(r);
                        if r > 0.0 {
                            pull -= volume * kernel.gradient_factor(r) * d * k as f32;
                        }
                    }
                }
            }
            let (share, slope) = kernel.wall(d, d * (layer as f32 + 0.5));
            assert!(
                (density + share - 1.0).abs() < 2e-3,
                "layer {layer}: {}",
                density + share
            );
            // The pressures of both particles of a pair push, of the wall its mirrored one.
            assert!(
                (2.0 * pull + slope).abs() * d < 0.04,
                "layer {layer}: {pull} {slope}"
            );
        }
        let (dz, z) = (1e-4, 0.04);
        let ((a, slope), (b, _)) = (kernel.wall(d, z), kernel.wall(d, z + dz));
        assert!(((b - a) / dz - slope).abs() < 0.01 * slope.abs());
    }
}
