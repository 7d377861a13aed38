//! Mass, centre and inertia of a body that fills a closed mesh evenly.

use crate::mesh::TriangleMesh;
use glam::{DMat3, DVec3};

/// How far a closed mesh's own faces may be from balance under an even pressure, relative to their whole area: single
/// precision of a large model.
const CLOSED: f64 = 1e-4;

/// What sets a body in motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mass {
    /// Volume of the mesh, m³.
    pub volume: f64,
    /// Mass, kg.
    pub mass: f64,
    /// Centre of mass in the object's axes, m.
    pub centre: DVec3,
    /// Inertia about the centre of mass, object's axes, kg m².
    pub inertia: DMat3,
}

/// Why a mesh cannot be a body.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MassError {
    /// Faces are missing: buoyancy would depend on where the hole is.
    #[error("the surface is not closed: its faces leave {0:.1e} of their area unbalanced")]
    Open(f64),
    /// The faces look inwards, or enclose nothing.
    #[error("the surface encloses {0:e} m³")]
    Hollow(f64),
}

impl MassError {
    /// What would be right.
    pub fn remedy(self) -> &'static str {
        match self {
            Self::Open(_) => "close the model's surface (every edge shared by two triangles)",
            Self::Hollow(_) => "turn its faces outwards, or give it some thickness",
        }
    }
}

impl Mass {
    /// Of a mesh filled with `density` kg/m³.
    ///
    /// Every triangle spans a tetrahedron with the middle of the mesh; their signed volumes and second moments add up
    /// to the body's.
    ///
    /// # Errors
    /// [`MassError`] if the mesh is open or encloses no volume.
    pub fn of(mesh: &TriangleMesh, density: f64) -> Result<Self, MassError> {
        let count = mesh.positions.len().max(1) as f64;
        let middle = mesh.positions.iter().map(|p| p.as_dvec3()).sum::<DVec3>() / count;
        let (mut area, mut facing, mut turning) = (0.0, DVec3::ZERO, DVec3::ZERO);
        let (mut volume, mut first, mut second) = (0.0, DVec3::ZERO, DMat3::ZERO);
        let mut reach = 0.0_f64;
        for t in &mesh.triangles {
            let [a, b, c] = t.map(|k| mesh.positions[k as usize].as_dvec3() - middle);
            let face = 0.5 * (b - a).cross(c - a);
            let centroid = (a + b + c) / 3.0;
            area += face.length();
            facing += face;
            turning += centroid.cross(face);
            reach = reach.max(a.length());
            let part = a.dot(b.cross(c)) / 6.0;
            volume += part;
            first += part / 4.0 * (a + b + c);
            let sum = a + b + c;
            second += (outer(a) + outer(b) + outer(c) + outer(sum)) * (part / 20.0);
        }
        let unbalanced = (facing.length() / area).max(turning.length() / (area * reach));
        if !(unbalanced < CLOSED) {
            return Err(MassError::Open(unbalanced));
        }
        if !(volume > 1e-9 * area.powf(1.5)) {
            return Err(MassError::Hollow(volume));
        }
        let centre = first / volume;
        let about = second - outer(centre) * volume;
        let trace = about.x_axis.x + about.y_axis.y + about.z_axis.z;
        Ok(Self {
            volume,
            mass: density * volume,
            centre: middle + centre,
            inertia: (DMat3::IDENTITY * trace - about) * density,
        })
    }
}

/// `v vᵀ`.
pub(super) fn outer(v: DVec3) -> DMat3 {
    DMat3::from_cols(v * v.x, v * v.y, v * v.z)
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    #[test]
    fn a_box_has_the_textbook_mass_and_inertia_wherever_it_stands() {
        let mut mesh = TriangleMesh::cuboid(Vec3::new(1.0, 2.0, 3.0));
        for p in &mut mesh.positions {
            *p += Vec3::new(10.0, -5.0, 2.0);
        }
        let m = Mass::of(&mesh, 500.0).unwrap();
        assert!((m.volume - 6.0).abs() < 1e-9 && (m.mass - 3000.0).abs() < 1e-6);
        assert!((m.centre - DVec3::new(10.0, -5.0, 2.0)).length() < 1e-9);
        let expected = DMat3::from_diagonal(DVec3::new(13.0, 10.0, 5.0) * 250.0);
        assert!(
            (m.inertia - expected).abs_diff_eq(DMat3::ZERO, 1e-6),
            "{}",
            m.inertia
        );
    }

    #[test]
    fn open_and_inverted_meshes_are_refused() {
        let mut open = TriangleMesh::cuboid(Vec3::ONE);
        open.triangles.pop();
        assert!(matches!(Mass::of(&open, 1.0), Err(MassError::Open(_))));
        let mut inverted = TriangleMesh::cuboid(Vec3::ONE);
        inverted.triangles.iter_mut().for_each(|t| t.swap(0, 1));
        assert!(matches!(Mass::of(&inverted, 1.0), Err(MassError::Hollow(_))));
    }
}
