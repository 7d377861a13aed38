//! Oscillations in a parabolic basin (Thacker 1981, doi:10.1017/S0022112081001882; SWASHES §4.2.2).

use super::Water;
use crate::solvers::GRAVITY;

/// The planar surface that rotates about the axis of a paraboloid (SWASHES §4.2.2.2).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ThackerPlanar {
    /// Centre of the basin, m.
    pub centre: [f64; 2],
    /// Radius of the shoreline at rest, m.
    pub radius: f64,
    /// Depth at the centre at rest, m.
    pub depth: f64,
    /// Amplitude η of the motion, as a share of the radius by `amplitude / radius`, m.
    pub amplitude: f64,
}

impl ThackerPlanar {
    fn frequency(&self) -> f64 {
        (2.0 * GRAVITY * self.depth).sqrt() / self.radius
    }

    /// Period of the motion, s.
    pub fn period(&self) -> f64 {
        std::f64::consts::TAU / self.frequency()
    }

    /// Height of the bed, m; the surface at rest is at 0.
    pub fn bed(&self, x: f64, z: f64) -> f64 {
        basin(self.centre, self.radius, self.depth, x, z)
    }

    /// The water at a point and `time` s.
    pub fn at(&self, x: f64, z: f64, time: f64) -> Water {
        let w = self.frequency();
        let (dx, dz) = (x - self.centre[0], z - self.centre[1]);
        let (sin, cos) = (w * time).sin_cos();
        let a2 = self.radius * self.radius;
        let surface = self.amplitude * self.depth / a2 * (2.0 * dx * cos + 2.0 * dz * sin - self.amplitude);
        let depth = surface - self.bed(x, z);
        if depth <= 0.0 {
            return Water::DRY;
        }
        Water {
            depth,
            velocity: [-self.amplitude * w * sin, self.amplitude * w * cos],
        }
    }
}

/// The radially symmetric bulge that rises and spreads in a paraboloid (SWASHES §4.2.2.1).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ThackerRadial {
    /// Centre of the basin, m.
    pub centre: [f64; 2],
    /// Radius of the shoreline at rest, m.
    pub radius: f64,
    /// Depth at the centre at rest, m.
    pub depth: f64,
    /// Radius of the shoreline at time 0, m. (SWASHES' `r0` is `shore² / radius`.)
    pub shore: f64,
}

impl ThackerRadial {
    fn frequency(&self) -> f64 {
        (8.0 * GRAVITY * self.depth).sqrt() / self.radius
    }

    /// Period of the motion, s.
    pub fn period(&self) -> f64 {
        std::f64::consts::TAU / self.frequency()
    }

    /// Height of the bed, m; the surface at rest is at 0.
    pub fn bed(&self, x: f64, z: f64) -> f64 {
        basin(self.centre, self.radius, self.depth, x, z)
    }

    /// The water at a point and `time` s.
    pub fn at(&self, x: f64, z: f64, time: f64) -> Water {
        let w = self.frequency();
        let a2 = self.radius * self.radius;
        let (a4, r4) = (a2 * a2, self.shore.powi(4));
        let a = (a4 - r4) / (a4 + r4);
        let (dx, dz) = (x - self.centre[0], z - self.centre[1]);
        let square = dx * dx + dz * dz;
        let (sin, cos) = (w * time).sin_cos();
        let share = 1.0 - a * cos;
        let root = (1.0 - a * a).sqrt();
        let surface =
            self.depth * (root / share - 1.0 - square / a2 * ((1.0 - a * a) / (share * share) - 1.0));
        let depth = surface - self.bed(x, z);
        if depth <= 0.0 {
            return Water::DRY;
        }
        // du/dr of the strain; ∂h/∂t + div(h u) = 0 holds with it.
        let rate = 0.5 * w * a * sin / share;
        Water {
            depth,
            velocity: [rate * dx, rate * dz],
        }
    }
}

fn basin(centre: [f64; 2], radius: f64, depth: f64, x: f64, z: f64) -> f64 {
    let (dx, dz) = (x - centre[0], z - centre[1]);
    -depth * (1.0 - (dx * dx + dz * dz) / (radius * radius))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Largest residual of the equations of mass and momentum at a point, by central differences.
    fn residual(at: impl Fn(f64, f64, f64) -> Water, bed: impl Fn(f64, f64) -> f64, p: [f64; 3]) -> f64 {
        let e = 1e-5;
        let [x, z, t] = p;
        let derive = |f: &dyn Fn(f64, f64, f64) -> f64| {
            [
                (f(x + e, z, t) - f(x - e, z, t)) / (2.0 * e),
                (f(x, z + e, t) - f(x, z - e, t)) / (2.0 * e),
                (f(x, z, t + e) - f(x, z, t - e)) / (2.0 * e),
            ]
        };
        let here = at(x, z, t);
        let [u, v] = here.velocity;
        let surface = derive(&|x, z, t| at(x, z, t).depth + bed(x, z));
        let fx = derive(&|x, z, t| at(x, z, t).depth * at(x, z, t).velocity[0])[0];
        let fz = derive(&|x, z, t| at(x, z, t).depth * at(x, z, t).velocity[1])[1];
        let du = derive(&|x, z, t| at(x, z, t).velocity[0]);
        let dv = derive(&|x, z, t| at(x, z, t).velocity[1]);
        let mass = surface[2] + fx + fz;
        let x_momentum = du[2] + u * du[0] + v * du[1] + GRAVITY * surface[0];
        let z_momentum = dv[2] + u * dv[0] + v * dv[1] + GRAVITY * surface[1];
        mass.abs().max(x_momentum.abs()).max(z_momentum.abs())
    }

    #[test]
    fn both_oscillations_satisfy_the_equations() {
        let planar = ThackerPlanar {
            centre: [2.0, 2.0],
            radius: 1.0,
            depth: 0.1,
            amplitude: 0.5,
        };
        let radial = ThackerRadial {
            centre: [2.0, 2.0],
            radius: 1.0,
            depth: 0.1,
            shore: 0.8,
        };
        for p in [[2.1, 1.8, 0.4], [2.2, 2.1, 1.3]] {
            assert!(residual(|x, z, t| planar.at(x, z, t), |x, z| planar.bed(x, z), p) < 1e-8);
            assert!(residual(|x, z, t| radial.at(x, z, t), |x, z| radial.bed(x, z), p) < 1e-8);
        }
        let (a, b) = (
            planar.at(2.3, 2.2, 0.7),
            planar.at(2.3, 2.2, 0.7 + planar.period()),
        );
        assert!((a.depth - b.depth).abs() < 1e-12);
        assert!((radial.at(2.79, 2.0, 0.0).depth > 0.0) && (radial.at(2.81, 2.0, 0.0).depth == 0.0));
    }
}
