//! Six-dimensional motion: velocity and spin together, and the symmetric matrices that resist them.

use glam::{DMat3, DVec3};
use serde::{Deserialize, Serialize};

/// Force and torque, or velocity and spin; the second about the centre of mass.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Six {
    pub(super) linear: DVec3,
    pub(super) angular: DVec3,
}

impl std::ops::Add for Six {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self {
            linear: self.linear + other.linear,
            angular: self.angular + other.angular,
        }
    }
}

impl std::ops::AddAssign for Six {
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl std::ops::Sub for Six {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        self + other * -1.0
    }
}

impl std::ops::Mul<f64> for Six {
    type Output = Self;
    fn mul(self, factor: f64) -> Self {
        Self {
            linear: self.linear * factor,
            angular: self.angular * factor,
        }
    }
}

impl Six {
    /// What a force at `r` from the centre of mass does.
    pub(super) fn at(r: DVec3, force: DVec3) -> Self {
        Self {
            linear: force,
            angular: r.cross(force),
        }
    }
}

/// A symmetric 6 × 6 matrix: the blocks linear-linear, angular-linear and angular-angular.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Symmetric {
    linear: DMat3,
    mixed: DMat3,
    angular: DMat3,
}

impl Default for Symmetric {
    /// Zero: glam's own default of a matrix is the identity.
    fn default() -> Self {
        Self {
            linear: DMat3::ZERO,
            mixed: DMat3::ZERO,
            angular: DMat3::ZERO,
        }
    }
}

impl Symmetric {
    /// Mass and inertia of a rigid body about its centre of mass.
    pub(super) fn body(mass: f64, inertia: DMat3) -> Self {
        Self {
            linear: DMat3::IDENTITY * mass,
            mixed: DMat3::ZERO,
            angular: inertia,
        }
    }

    /// Adds what resists the velocity of the point at `r` with the symmetric matrix `resistance`.
    pub(super) fn add_at(&mut self, r: DVec3, resistance: DMat3) {
        let arm = DMat3::from_cols(
            DVec3::new(0.0, r.z, -r.y),
            DVec3::new(-r.z, 0.0, r.x),
            DVec3::new(r.y, -r.x, 0.0),
        );
        self.linear += resistance;
        self.mixed += arm * resistance;
        self.angular += arm * resistance * arm.transpose();
    }

    /// Adds what resists the spin alone.
    pub(super) fn add_angular(&mut self, inertia: DMat3) {
        self.angular += inertia;
    }

    /// The sum with `factor` times another.
    pub(super) fn plus(&self, factor: f64, other: &Self) -> Self {
        Self {
            linear: self.linear + other.linear * factor,
            mixed: self.mixed + other.mixed * factor,
            angular: self.angular + other.angular * factor,
        }
    }

    /// The product with a vector.
    pub(super) fn times(&self, v: Six) -> Six {
        Six {
            linear: self.linear * v.linear + self.mixed.transpose() * v.angular,
            angular: self.mixed * v.linear + self.angular * v.angular,
        }
    }

    /// The vector whose product is `right`, for a positive definite matrix (Cholesky); `None` if it is not.
    pub(super) fn solve(&self, right: Six) -> Option<Six> {
        let mut m = [[0.0; 6]; 6];
        for r in 0..3 {
            for c in 0..3 {
                m[r][c] = self.linear.col(c)[r];
                m[r + 3][c] = self.mixed.col(c)[r];
                m[r + 3][c + 3] = self.angular.col(c)[r];
            }
        }
        let (f, t) = (right.linear, right.angular);
        let mut x = [f.x, f.y, f.z, t.x, t.y, t.z];
        for r in 0..6 {
            for c in 0..=r {
                let sum = m[r][c] - (0..c).map(|k| m[r][k] * m[c][k]).sum::<f64>();
                if r == c {
                    if !(sum > 0.0) {
                        return None;
                    }
                    m[r][r] = sum.sqrt();
                } else {
                    m[r][c] = sum / m[c][c];
                }
            }
        }
        for r in 0..6 {
            x[r] = (x[r] - (0..r).map(|k| m[r][k] * x[k]).sum::<f64>()) / m[r][r];
        }
        for r in (0..6).rev() {
            x[r] = (x[r] - (r + 1..6).map(|k| m[k][r] * x[k]).sum::<f64>()) / m[r][r];
        }
        Some(Six {
            linear: DVec3::new(x[0], x[1], x[2]),
            angular: DVec3::new(x[3], x[4], x[5]),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn solving_undoes_the_product() {
        let mut m = Symmetric::body(3.0, DMat3::from_diagonal(DVec3::new(1.0, 2.0, 0.5)));
        m.add_at(DVec3::new(0.3, -1.0, 2.0), DMat3::IDENTITY * 2.0);
        m.add_at(
            DVec3::new(-0.5, 0.2, 1.0),
            super::super::mass::outer(DVec3::new(1.0, 2.0, -1.0)),
        );
        let v = Six {
            linear: DVec3::new(1.0, -2.0, 0.5),
            angular: DVec3::new(0.1, 3.0, -1.0),
        };
        let back = m.solve(m.times(v)).unwrap();
        assert!((back.linear - v.linear).length() + (back.angular - v.angular).length() < 1e-12);
        assert!(Symmetric::default().solve(v).is_none());
    }

    #[test]
    fn a_resistance_at_a_point_acts_on_that_points_velocity() {
        let (r, k) = (
            DVec3::new(0.3, -1.0, 2.0),
            super::super::mass::outer(DVec3::new(1.0, 2.0, -1.0)),
        );
        let mut m = Symmetric::default();
        m.add_at(r, k);
        let v = Six {
            linear: DVec3::new(1.0, -2.0, 0.5),
            angular: DVec3::new(0.1, 3.0, -1.0),
        };
        let expected = Six::at(r, k * (v.linear + v.angular.cross(r)));
        let found = m.times(v);
        assert!((found.linear - expected.linear).length() < 1e-12);
        assert!((found.angular - expected.angular).length() < 1e-12);
    }
}
