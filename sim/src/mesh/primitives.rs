//! Spheres, boxes and cylinders.

use super::{DEFAULT_COLOR, TriangleMesh};
use glam::Vec3;
use std::f32::consts::{PI, TAU};

/// Segments about the axis of spheres and cylinders.
const AROUND: u32 = 64;

/// Segments from pole to pole of spheres.
const RINGS: u32 = 32;

impl TriangleMesh {
    /// A sphere of `radius` metres about the origin. Its vertices lie on the sphere.
    pub fn sphere(radius: f32) -> Self {
        let mut mesh = Self {
            base_color: DEFAULT_COLOR,
            ..Self::default()
        };
        mesh.push(Vec3::Y * radius, Vec3::Y);
        for ring in 1..RINGS {
            let (sin, cos) = (PI * ring as f32 / RINGS as f32).sin_cos();
            for k in 0..AROUND {
                let n = Vec3::new(sin * angle(k).cos(), cos, sin * angle(k).sin());
                mesh.push(n * radius, n.normalize());
            }
        }
        let last = mesh.push(-Vec3::Y * radius, -Vec3::Y);
        for k in 0..AROUND {
            let next = (k + 1) % AROUND;
            mesh.triangles.push([0, 1 + next, 1 + k]);
            for ring in 0..RINGS - 2 {
                let (upper, lower) = (1 + ring * AROUND, 1 + (ring + 1) * AROUND);
                mesh.triangles.push([upper + k, upper + next, lower + next]);
                mesh.triangles.push([upper + k, lower + next, lower + k]);
            }
            let ring = 1 + (RINGS - 2) * AROUND;
            mesh.triangles.push([ring + k, ring + next, last]);
        }
        mesh
    }

    /// A box with the full side lengths `size` metres about the origin; its faces are flat-shaded.
    pub fn cuboid(size: Vec3) -> Self {
        let mut mesh = Self {
            base_color: DEFAULT_COLOR,
            ..Self::default()
        };
        for normal in [Vec3::X, -Vec3::X, Vec3::Y, -Vec3::Y, Vec3::Z, -Vec3::Z] {
            // Two in-plane axes with u × v = normal, so that the corners run anticlockwise seen from outside.
            let u = Vec3::new(normal.y.abs(), normal.z.abs(), normal.x.abs());
            let v = normal.cross(u);
            let corner = |a: f32, b: f32| 0.5 * size * (normal + a * u + b * v);
            let first = mesh.push(corner(-1.0, -1.0), normal);
            mesh.push(corner(1.0, -1.0), normal);
            mesh.push(corner(1.0, 1.0), normal);
            mesh.push(corner(-1.0, 1.0), normal);
            mesh.triangles.push([first, first + 1, first + 2]);
            mesh.triangles.push([first, first + 2, first + 3]);
        }
        mesh
    }

    /// An upright cylinder (axis Y) of `radius` and full `height` metres about the origin; round side, flat ends.
    pub fn cylinder(radius: f32, height: f32) -> Self {
        let mut mesh = Self {
            base_color: DEFAULT_COLOR,
            ..Self::default()
        };
        let point = |k: u32, y: f32| Vec3::new(radius * angle(k).cos(), y, radius * angle(k).sin());
        let (top, bottom) = (0.5 * height, -0.5 * height);
        for y in [top, bottom] {
            for k in 0..AROUND {
                mesh.push(
                    point(k, y),
                    Vec3::new(angle(k).cos(), 0.0, angle(k).sin()).normalize(),
                );
            }
        }
        for k in 0..AROUND {
            let next = (k + 1) % AROUND;
            mesh.triangles.push([k, next, AROUND + next]);
            mesh.triangles.push([k, AROUND + next, AROUND + k]);
        }
        for (y, normal) in [(top, Vec3::Y), (bottom, -Vec3::Y)] {
            let centre = mesh.push(Vec3::Y * y, normal);
            for k in 0..AROUND {
                mesh.push(point(k, y), normal);
            }
            for k in 0..AROUND {
                let (a, b) = (centre + 1 + k, centre + 1 + (k + 1) % AROUND);
                mesh.triangles.push(if normal.y > 0.0 {
                    [centre, b, a]
                } else {
                    [centre, a, b]
                });
            }
        }
        mesh
    }

    fn push(&mut self, position: Vec3, normal: Vec3) -> u32 {
        self.positions.push(position);
        self.normals.push(normal);
        (self.positions.len() - 1) as u32
    }
}

fn angle(k: u32) -> f32 {
    TAU * k as f32 / AROUND as f32
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::closed::assert_closed;

    fn volume(mesh: &TriangleMesh) -> f64 {
        mesh.triangles
            .iter()
            .map(|t| {
                let [a, b, c] = t.map(|k| mesh.positions[k as usize].as_dvec3());
                a.dot(b.cross(c)) / 6.0
            })
            .sum()
    }

    #[test]
    fn primitives_are_closed_face_outwards_and_have_their_volume() {
        use std::f64::consts::PI;
        for (mesh, exact, tolerance) in [
            // Inscribed polyhedra: the volume is short by the order of the squared angle between vertices.
            (TriangleMesh::sphere(2.0), 4.0 / 3.0 * PI * 8.0, 0.01),
            (TriangleMesh::cuboid(Vec3::new(1.0, 2.0, 4.0)), 8.0, 1e-6),
            (TriangleMesh::cylinder(0.5, 3.0), 0.75 * PI, 0.002),
        ] {
            assert_closed(&mesh, true);
            let v = volume(&mesh);
            assert!(
                v > 0.0 && v <= exact * (1.0 + 1e-6) && (exact - v) / exact < tolerance,
                "{v} {exact}"
            );
        }
    }
}
