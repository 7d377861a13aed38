//! Objects cut for the broad phase: no edge longer than the bend of refraction allows, none across the water's level.

use meniscus_sim::glam::{DMat3, DVec3, Vec3};
use meniscus_sim::mesh::TriangleMesh;

/// Triangles that one object is cut into at most.
const MOST: usize = 200_000;

/// Corners and normals.
pub(crate) type Triangle = ([Vec3; 3], [Vec3; 3]);

/// The triangles of a mesh that have an area.
pub(crate) fn triangles_of(mesh: &TriangleMesh) -> Vec<Triangle> {
    let gather = |values: &[Vec3], t: &[u32; 3]| -> Option<[Vec3; 3]> {
        Some([
            *values.get(t[0] as usize)?,
            *values.get(t[1] as usize)?,
            *values.get(t[2] as usize)?,
        ])
    };
    mesh.triangles
        .iter()
        .filter_map(|t| {
            let p = gather(&mesh.positions, t)?;
            let face = (p[1] - p[0]).cross(p[2] - p[0]);
            (face.length_squared() > 0.0)
                .then(|| (p, gather(&mesh.normals, t).unwrap_or([face.normalize(); 3])))
        })
        .collect()
}

fn cut((p, n): &Triangle, edge: usize, s: f32) -> [Triangle; 2] {
    let (a, b, c) = (edge, (edge + 1) % 3, (edge + 2) % 3);
    let middle = p[a].lerp(p[b], s);
    let normal = n[a].lerp(n[b], s);
    [
        ([p[a], middle, p[c]], [n[a], normal, n[c]]),
        ([middle, p[b], p[c]], [normal, n[b], n[c]]),
    ]
}

/// Halves the longest edges until none is longer than `longest`, metres. An edge's fate depends on the edge alone, so
/// neighbours stay joined.
pub(crate) fn refined(triangles: Vec<Triangle>, longest: f32) -> Vec<Triangle> {
    let mut todo = triangles;
    let mut out = Vec::new();
    while let Some(t) = todo.pop() {
        let lengths: [f32; 3] = std::array::from_fn(|k| t.0[k].distance(t.0[(k + 1) % 3]));
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
            let y = t.0.map(height);
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
        let face = |(p, _): &Triangle| 0.5 * (p[1] - p[0]).cross(p[2] - p[0]).length();
        triangles.iter().map(face).sum()
    }

    const LARGE: Triangle = (
        [
            Vec3::new(-1.0, -1.0, 0.0),
            Vec3::new(2.0, -0.5, 0.3),
            Vec3::new(0.2, 1.5, -0.4),
        ],
        [Vec3::Z; 3],
    );

    #[test]
    fn cut_triangles_cover_what_they_were_cut_from() {
        let fine = refined(vec![LARGE], 0.3);
        assert!((area(&fine) / area(&[LARGE]) - 1.0).abs() < 1e-4);
        let longest = fine
            .iter()
            .flat_map(|(p, _)| (0..3).map(move |k| p[k].distance(p[(k + 1) % 3])));
        assert!(longest.fold(0.0, f32::max) <= 0.3);
        let parts = split(&fine, DMat3::IDENTITY, DVec3::new(0.0, 0.1, 0.0));
        assert!((area(&parts) / area(&[LARGE]) - 1.0).abs() < 1e-4);
        for (p, _) in &parts {
            let y = p.map(|v| v.y + 0.1);
            assert!(
                y.iter().all(|v| *v < 1e-5) || y.iter().all(|v| *v > -1e-5),
                "{y:?}"
            );
        }
    }
}
