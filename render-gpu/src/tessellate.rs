//! Objects cut for the broad phase: no edge longer than the bend of refraction allows, none across the water's level.

use crate::hierarchy::Rows;
use meniscus_sim::glam::{DMat3, DVec3, Vec2, Vec3};
use meniscus_sim::mesh::TriangleMesh;

/// Triangles that one object is cut into at most.
const MOST: usize = 200_000;

/// A triangle of an object, in its own axes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Triangle {
    pub(crate) corners: [Vec3; 3],
    pub(crate) normals: [Vec3; 3],
    /// Texture coordinates.
    pub(crate) coordinates: [Vec2; 3],
    /// Row of its material in the buffer of objects; 0 where it has the object's colour.
    pub(crate) material: u32,
}

impl Triangle {
    /// As shaders read it; with looks as `shaders/shared/looks.wgsl` has them.
    pub(crate) fn write(&self, looks: bool, rows: &mut Rows) {
        let row = |v: Vec3, word: f32| [v.x.to_bits(), v.y.to_bits(), v.z.to_bits(), word.to_bits()];
        let at = self.coordinates;
        rows.extend((0..3).map(|k| row(self.corners[k], at[k].x)));
        rows.extend((0..3).map(|k| row(self.normals[k], at[k].y)));
        if looks {
            rows.push([self.material, 0, 0, 0]);
        }
    }
}

/// The triangles of a mesh that have an area. `materials` are the rows of its materials.
pub(crate) fn triangles_of(mesh: &TriangleMesh, materials: &[u32]) -> Vec<Triangle> {
    fn gather<T: Copy>(values: &[T], t: &[u32; 3]) -> Option<[T; 3]> {
        let at = |k: usize| values.get(t[k] as usize).copied();
        Some([at(0)?, at(1)?, at(2)?])
    }
    mesh.triangles
        .iter()
        .enumerate()
        .filter_map(|(k, t)| {
            let corners = gather(&mesh.positions, t)?;
            let face = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
            let material = mesh.material_of.get(k).map(|&m| usize::from(m));
            (face.length_squared() > 0.0).then(|| Triangle {
                corners,
                normals: gather(&mesh.normals, t).unwrap_or([face.normalize(); 3]),
                coordinates: gather(&mesh.texcoords, t).unwrap_or_default(),
                material: material.and_then(|m| materials.get(m)).copied().unwrap_or(0),
            })
        })
        .collect()
}

/// Cuts an edge at the share `s` of its length.
fn cut(t: &Triangle, edge: usize, s: f32) -> [Triangle; 2] {
    let (a, b) = (edge, (edge + 1) % 3);
    let corner = t.corners[a].lerp(t.corners[b], s);
    let normal = t.normals[a].lerp(t.normals[b], s);
    let at = t.coordinates[a].lerp(t.coordinates[b], s);
    [b, a].map(|replaced| {
        let mut part = *t;
        part.corners[replaced] = corner;
        part.normals[replaced] = normal;
        part.coordinates[replaced] = at;
        part
    })
}

/// Halves the longest edges until none is longer than `longest`, metres. An edge's fate depends on the edge alone, so
/// neighbours stay joined.
pub(crate) fn refined(triangles: Vec<Triangle>, longest: f32) -> Vec<Triangle> {
    let mut todo = triangles;
    let mut out = Vec::new();
    while let Some(t) = todo.pop() {
        let lengths: [f32; 3] = std::array::from_fn(|k| t.corners[k].distance(t.corners[(k + 1) % 3]));
        let edge = (0..3)
            .max_by(|&a, &b| lengths[a].total_cmp(&lengths[b]))
            .unwrap_or(0);
        if !(lengths[edge] > longest) || todo.len() + out.len() > MOST {
            out.push(t);
        } else {
            todo.extend(cut(&t, edge, 0.5));
        }
    }
    out
}

/// Splits triangles that cross the level `y` = 0 of the world, where the object stands at `position` above it.
pub(crate) fn split(triangles: &[Triangle], world_from_body: DMat3, position: DVec3) -> Vec<Triangle> {
    let height = |p: Vec3| (world_from_body * p.as_dvec3()).y + position.y;
    let mut out = Vec::with_capacity(triangles.len());
    let mut todo: Vec<Triangle> = Vec::new();
    for t in triangles {
        todo.push(*t);
        // Two cuts make every part lie on one side.
        let mut budget = 4;
        while let Some(t) = todo.pop() {
            let y = t.corners.map(height);
            let span = y.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
            let hair = 1e-6 * span;
            let crossing = (0..3).find(|&k| {
                let (a, b) = (y[k], y[(k + 1) % 3]);
                a * b < 0.0 && a.abs() > hair && b.abs() > hair
            });
            match crossing.filter(|_| budget > 0) {
                Some(k) => {
                    budget -= 1;
                    let s = y[k] / (y[k] - y[(k + 1) % 3]);
                    todo.extend(cut(&t, k, s as f32));
                }
                None => out.push(t),
            }
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    fn area(triangles: &[Triangle]) -> f32 {
        let face = |Triangle { corners: p, .. }: &Triangle| 0.5 * (p[1] - p[0]).cross(p[2] - p[0]).length();
        triangles.iter().map(face).sum()
    }

    const LARGE: Triangle = Triangle {
        corners: [
            Vec3::new(-1.0, -1.0, 0.0),
            Vec3::new(2.0, -0.5, 0.3),
            Vec3::new(0.2, 1.5, -0.4),
        ],
        normals: [Vec3::Z; 3],
        coordinates: [Vec2::new(-1.0, -1.0), Vec2::new(2.0, -0.5), Vec2::new(0.2, 1.5)],
        material: 7,
    };

    #[test]
    fn cut_triangles_cover_what_they_were_cut_from() {
        let fine = refined(vec![LARGE], 0.3);
        assert!((area(&fine) / area(&[LARGE]) - 1.0).abs() < 1e-4);
        let longest = fine
            .iter()
            .flat_map(|t| (0..3).map(move |k| t.corners[k].distance(t.corners[(k + 1) % 3])));
        assert!(longest.fold(0.0, f32::max) <= 0.3);
        let parts = split(&fine, DMat3::IDENTITY, DVec3::new(0.0, 0.1, 0.0));
        assert!((area(&parts) / area(&[LARGE]) - 1.0).abs() < 1e-4);
        for t in &parts {
            let y = t.corners.map(|v| v.y + 0.1);
            assert!(
                y.iter().all(|v| *v < 1e-5) || y.iter().all(|v| *v > -1e-5),
                "{y:?}"
            );
            // Coordinates stay with their points: here they are x and y.
            assert_eq!(t.material, 7);
            for (p, at) in t.corners.iter().zip(&t.coordinates) {
                assert!((p.truncate() - *at).length() < 1e-5, "{p} {at}");
            }
        }
    }
}
