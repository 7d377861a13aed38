//! What tests ask of a closed surface.

use super::TriangleMesh;
use std::collections::HashMap;

/// Every edge is shared by exactly two triangles that run along it in opposite directions (after merging equal
/// positions). Normals are unit vectors; if `facing`, they point to the outer side of every face.
pub(super) fn assert_closed(mesh: &TriangleMesh, facing: bool) {
    let mut ids = HashMap::new();
    let id: Vec<usize> = mesh
        .positions
        .iter()
        .map(|p| {
            let next = ids.len();
            *ids.entry(p.to_array().map(|c| (c + 0.0).to_bits()))
                .or_insert(next)
        })
        .collect();
    let mut edges: HashMap<(usize, usize), i32> = HashMap::new();
    for t in &mesh.triangles {
        for e in 0..3 {
            let (a, b) = (id[t[e] as usize], id[t[(e + 1) % 3] as usize]);
            assert_ne!(a, b, "degenerate triangle {t:?}");
            *edges.entry((a, b)).or_default() += 1;
        }
    }
    for (&(a, b), &count) in &edges {
        assert_eq!((count, edges.get(&(b, a))), (1, Some(&1)), "edge {a} {b}");
    }
    for t in &mesh.triangles {
        let [a, b, c] = t.map(|k| mesh.positions[k as usize]);
        let face = (b - a).cross(c - a);
        for &k in t {
            let n = mesh.normals[k as usize];
            assert!(
                (n.length() - 1.0).abs() < 1e-6 && (!facing || n.dot(face) > 0.0),
                "{t:?} {n} {face}"
            );
        }
    }
}
