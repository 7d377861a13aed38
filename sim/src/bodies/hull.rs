//! A body's surface in panels about the size of a cell, so that waves shorter than the body act on it where they are.

use crate::mesh::TriangleMesh;
use glam::DVec3;

/// Most panels that a hull is divided into; coarser panels than asked for beyond.
const MOST_PANELS: f64 = 20_000.0;

/// The surface of a body about its centre of mass, body axes.
#[derive(Clone, Debug)]
pub(super) struct Hull {
    /// Corners of the panels, m from the centre of mass.
    pub(super) vertices: Vec<DVec3>,
    /// Corners of each panel, anticlockwise seen from outside.
    pub(super) panels: Vec<[u32; 3]>,
    /// Corners of the mesh as it was given.
    pub(super) corners: Vec<DVec3>,
    /// Farthest corner from the centre of mass, m.
    pub(super) reach: f64,
}

impl Hull {
    /// The mesh about `centre`, its triangles divided until no edge is longer than about `edge` metres (0: as it is).
    pub(super) fn new(mesh: &TriangleMesh, centre: DVec3, edge: f64) -> Self {
        let corners: Vec<DVec3> = mesh.positions.iter().map(|p| p.as_dvec3() - centre).collect();
        let reach = corners.iter().fold(0.0_f64, |r, p| r.max(p.length()));
        let triangle = |t: &[u32; 3]| t.map(|k| corners[k as usize]);
        let area: f64 = mesh
            .triangles
            .iter()
            .map(|t| {
                let [a, b, c] = triangle(t);
                0.5 * (b - a).cross(c - a).length()
            })
            .sum();
        let edge = if edge > 0.0 {
            // A triangle with legs of 1 and 2 edges makes some three times the panels that its area asks for.
            edge.max((6.0 * area / MOST_PANELS).sqrt())
        } else {
            f64::INFINITY
        };
        let mut hull = Self {
            vertices: Vec::new(),
            panels: Vec::new(),
            corners: Vec::new(),
            reach,
        };
        for t in &mesh.triangles {
            hull.divide(triangle(t), edge);
        }
        hull.corners = corners;
        hull
    }

    /// Adds a triangle as n² smaller ones.
    fn divide(&mut self, [a, b, c]: [DVec3; 3], edge: f64) {
        let longest = (b - a).length().max((c - b).length()).max((a - c).length());
        let n = (longest / edge).ceil().clamp(1.0, 1000.0) as u32;
        let first = self.vertices.len() as u32;
        // Row r holds r + 1 vertices, from `a` towards the edge b c.
        for row in 0..=n {
            for k in 0..=row {
                let (s, t) = (f64::from(row - k) / f64::from(n), f64::from(k) / f64::from(n));
                self.vertices.push(a + (b - a) * s + (c - a) * t);
            }
        }
        let at = |row: u32, k: u32| first + row * (row + 1) / 2 + k;
        for row in 0..n {
            for k in 0..=row {
                self.panels.push([at(row, k), at(row + 1, k), at(row + 1, k + 1)]);
                if k < row {
                    self.panels.push([at(row, k), at(row + 1, k + 1), at(row, k + 1)]);
                }
            }
        }
    }

    /// Bytes held.
    pub(super) fn bytes(&self) -> usize {
        (self.vertices.len() + self.corners.len()) * size_of::<DVec3>()
            + self.panels.len() * size_of::<[u32; 3]>()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    #[test]
    fn division_keeps_area_and_sense() {
        let mesh = TriangleMesh::cuboid(Vec3::new(1.0, 0.5, 2.0));
        for edge in [0.0, 0.7, 0.1] {
            let hull = Hull::new(&mesh, DVec3::ZERO, edge);
            let (mut area, mut volume) = (0.0, 0.0);
            for p in &hull.panels {
                let [a, b, c] = p.map(|k| hull.vertices[k as usize]);
                area += 0.5 * (b - a).cross(c - a).length();
                volume += a.dot(b.cross(c)) / 6.0;
            }
            assert!(
                (area - 7.0).abs() < 1e-9 && (volume - 1.0).abs() < 1e-9,
                "{area} {volume}"
            );
        }
        // Panels asked for far too fine: the limit holds but for rounding up and for panels that are not square.
        let fine = Hull::new(&mesh, DVec3::ZERO, 1e-6);
        assert!(
            (fine.panels.len() as f64) < 2.0 * MOST_PANELS,
            "{}",
            fine.panels.len()
        );
    }
}
