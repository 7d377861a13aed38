//! Gradients that are exact for linear fields and still conserve momentum, angular momentum and energy.
//!
//! The sum Σ_j g_ij · (v_i − v_j) over a deformed lattice, or near a surface, is not the compression of a linear field v:
//! it is tr(A M) for v = A x, with M_i = −Σ_j x_ij ⊗ g_ij in place of the unit matrix. In a fluid under pressure that acts
//! as elasticity, which shortens the period of waves. With L_i = M_i⁻¹ (Bonet & Lok 1999)
//!
//!   (D v)_i = Σ_j (v_i − v_j) · L_i g_ij
//!
//! is exact. Pressures push by its transpose, a_i = −Σ_j (p_i L_i + p_j L_j) g_ij: opposite for both particles of a pair,
//! so momentum is kept; orthogonal to rigid turns, of which D sees nothing since M and L commute, so angular momentum is
//! kept; and removing D v is an orthogonal projection, which cannot raise the energy.

use super::boundary::Touch;
use glam::{Mat3, Vec3, Vec4};

/// Least eigenvalue of M that is inverted: beyond it too few neighbours are left to say what is linear.
const LEAST: f32 = 0.4;

/// What a particle's neighbours say of its surroundings.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Local {
    /// Rows of L, the fourth components 0.
    pub(crate) rows: [Vec4; 3],
    /// Σ_j g_ij with what walls add, 1/m.
    pub(crate) sum: Vec3,
    /// Density over rest density.
    pub(crate) density: f32,
    /// The same, had the water beyond a surface gone on.
    pub(crate) filled: f32,
    /// Inverse diagonals of the systems with L and without, m².
    pub(crate) inverse: [f32; 2],
}

impl Local {
    /// L x. L is symmetric; the fourth component is 0.
    #[inline(always)]
    pub(crate) fn correct(&self, x: Vec4) -> Vec4 {
        x.x * self.rows[0] + x.y * self.rows[1] + x.z * self.rows[2]
    }
}

/// L of a particle whose neighbours give the moment M = `m`.
pub(crate) fn rows(mut m: [Vec4; 3], touch: &Touch) -> [Vec4; 3] {
    // A curved wall acts as water mirrored at distance z: it sees the velocity along its normal, which is 0 at it.
    let n = touch.arm;
    m[0] -= n.x * touch.gradient.extend(0.0);
    m[1] -= n.y * touch.gradient.extend(0.0);
    m[2] -= n.z * touch.gradient.extend(0.0);
    let m = Mat3::from_cols(m[0].truncate(), m[1].truncate(), m[2].truncate());
    let m = 0.5 * (m + m.transpose());
    let lift = (LEAST - least_eigenvalue(&m, LEAST)).max(0.0);
    let inverse = (m + Mat3::from_diagonal(Vec3::splat(lift))).inverse();
    let inverse = if inverse.is_finite() {
        inverse
    } else {
        Mat3::IDENTITY
    };
    [
        inverse.x_axis.extend(0.0),
        inverse.y_axis.extend(0.0),
        inverse.z_axis.extend(0.0),
    ]
}

/// Smallest eigenvalue of a symmetric matrix (trigonometric solution of the cubic, Smith 1961), or a bound from below that is
/// above `enough`.
fn least_eigenvalue(m: &Mat3, enough: f32) -> f32 {
    let mean = (m.x_axis.x + m.y_axis.y + m.z_axis.z) / 3.0;
    let rest = *m - Mat3::from_diagonal(Vec3::splat(mean));
    let square: f32 = [rest.x_axis, rest.y_axis, rest.z_axis]
        .iter()
        .map(|c| c.length_squared())
        .sum();
    let size = (square / 6.0).sqrt();
    let bound = mean - 2.0 * size;
    if !(size > 1e-9) || bound > enough {
        return bound;
    }
    let half = (0.5 * rest.determinant() / size.powi(3)).clamp(-1.0, 1.0);
    mean + 2.0 * size * (half.acos() / 3.0 + std::f32::consts::TAU / 3.0).cos()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_least_eigenvalue_is_found() {
        let turn = Mat3::from_axis_angle(Vec3::new(1.0, 2.0, -0.5).normalize(), 0.8);
        for values in [
            Vec3::new(0.2, 0.9, 1.1),
            Vec3::ONE,
            Vec3::new(-0.3, 0.0, 0.0),
            Vec3::new(0.5, 0.5, 0.1),
        ] {
            let m = turn * Mat3::from_diagonal(values) * turn.transpose();
            assert!(
                (least_eigenvalue(&m, f32::INFINITY) - values.min_element()).abs() < 1e-3,
                "{values}"
            );
            let bound = least_eigenvalue(&m, 0.3);
            assert_eq!(bound > 0.3, values == Vec3::ONE, "{values}");
        }
    }
}
