//! Normals of a mesh of quadrilaterals, blended between its vertices in the paper's three ways.
//!
//! The last of them, weights by the area of the rectangle between the point and the corner *opposite*, is bilinear
//! interpolation; it alone is continuous from face to face.

use glam::{BVec2, DVec2, Vec2, Vec3};
use meniscus_sim::scene::description::NormalBlend;
use meniscus_sim::stage::continuation::neighbour;
use meniscus_sim::{Grid, GridSpec};
use rayon::prelude::*;

/// Normals of the water's mesh.
#[derive(Clone, Debug)]
pub(super) struct Normals<'a> {
    heights: &'a Grid<f32>,
    /// Mean of the faces about each vertex; empty where faces are flat.
    vertices: Vec<Vec3>,
    blend: NormalBlend,
    periodic: BVec2,
}

impl<'a> Normals<'a> {
    pub(super) fn new(heights: &'a Grid<f32>, blend: NormalBlend, periodic: BVec2) -> Self {
        let mut normals = Self {
            heights,
            vertices: Vec::new(),
            blend,
            periodic,
        };
        if blend != NormalBlend::Face {
            let width = heights.spec().width();
            normals.vertices = (0..heights.spec().len())
                .into_par_iter()
                .map(|k| normals.vertex(k % width, k / width))
                .collect();
        }
        normals
    }

    fn spec(&self) -> &GridSpec {
        self.heights.spec()
    }

    /// Faces along each axis.
    fn faces(&self) -> (usize, usize) {
        let spec = self.spec();
        let along = |n: usize, periodic: bool| if periodic { n } else { n.saturating_sub(1) };
        (
            along(spec.width(), self.periodic.x),
            along(spec.height(), self.periodic.y),
        )
    }

    /// Upward normal of the face with the corners (i, j) and (i + 1, j + 1): across its diagonals.
    fn face(&self, i: usize, j: usize) -> Vec3 {
        let spec = self.spec();
        let (i1, j1) = ((i + 1) % spec.width(), (j + 1) % spec.height());
        let at = |i, j| self.heights[(i, j)];
        let (a, b, c, d) = (at(i, j), at(i1, j), at(i, j1), at(i1, j1));
        let scale = 0.5 / spec.spacing;
        Vec3::new(-scale * (b - a + d - c), 1.0, -scale * (c - a + d - b)).normalize()
    }

    fn vertex(&self, i: usize, j: usize) -> Vec3 {
        let (w, h) = self.faces();
        let mut sum = Vec3::ZERO;
        for dj in [-1, 0] {
            for di in [-1, 0] {
                // One more than there are faces, since a periodic row is taken to hold its first sample twice.
                let face_i = neighbour(i as isize + di, w + 1, self.periodic.x);
                let face_j = neighbour(j as isize + dj, h + 1, self.periodic.y);
                if face_i < w && face_j < h {
                    sum += self.face(face_i, face_j);
                }
            }
        }
        sum.normalize_or(Vec3::Y)
    }

    /// Upward unit normal at a place of the mesh; `None` beyond it.
    pub(super) fn at(&self, p: DVec2) -> Option<Vec3> {
        let spec = self.spec();
        let (w, h) = self.faces();
        if w == 0 || h == 0 {
            return None;
        }
        let mut g = (p - spec.origin.as_dvec2()) / f64::from(spec.spacing);
        if self.periodic.x {
            g.x = g.x.rem_euclid(w as f64);
        }
        if self.periodic.y {
            g.y = g.y.rem_euclid(h as f64);
        }
        if g.min_element() < 0.0 || g.x > w as f64 || g.y > h as f64 {
            return None;
        }
        let (i, j) = ((g.x as usize).min(w - 1), (g.y as usize).min(h - 1));
        if self.blend == NormalBlend::Face {
            return Some(self.face(i, j));
        }
        let f = Vec2::new((g.x - i as f64) as f32, (g.y - j as f64) as f32);
        let mut sum = Vec3::ZERO;
        for (dj, corner_y) in [(0, 0.0), (1, 1.0)] {
            for (di, corner_x) in [(0, 0.0), (1, 1.0)] {
                let off = (f - Vec2::new(corner_x, corner_y)).abs();
                let weight = match self.blend {
                    NormalBlend::Distance => 1.0 / off.length().max(1e-6),
                    // Sides of the rectangle that the corner opposite spans with the point.
                    NormalBlend::Area | NormalBlend::Face => (1.0 - off.x) * (1.0 - off.y),
                };
                let vertex = spec.index((i + di) % spec.width(), (j + dj) % spec.height());
                sum += weight * self.vertices[vertex];
            }
        }
        Some(sum.normalize_or(Vec3::Y))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::UVec2;

    fn bowl() -> Grid<f32> {
        let spec = GridSpec::new(Vec2::new(-1.0, 2.0), 0.25, UVec2::new(9, 5)).unwrap();
        Grid::from_fn(spec, |i, j| {
            let p = spec.position(i, j);
            0.1 * p.x * p.x + 0.05 * p.x * p.y
        })
    }

    #[test]
    fn a_plane_has_one_normal_however_it_is_blended() {
        let spec = GridSpec::new(Vec2::ZERO, 0.5, UVec2::new(4, 7)).unwrap();
        let plane = Grid::from_fn(spec, |i, j| {
            let p = spec.position(i, j);
            0.3 * p.x - 0.2 * p.y
        });
        let truth = Vec3::new(-0.3, 1.0, 0.2).normalize();
        for blend in [NormalBlend::Face, NormalBlend::Distance, NormalBlend::Area] {
            let normals = Normals::new(&plane, blend, BVec2::FALSE);
            for k in 0..50 {
                let p = DVec2::new(1.5, 3.0) * DVec2::new(f64::from(k % 7) / 6.0, f64::from(k) / 49.0);
                assert!((normals.at(p).unwrap() - truth).length() < 1e-5, "{blend:?} {p}");
            }
            assert!(normals.at(DVec2::new(-0.01, 1.0)).is_none());
            assert!(normals.at(DVec2::new(0.5, 3.01)).is_none());
        }
    }

    /// Across a border of faces only weights by area go on where they were.
    #[test]
    fn only_weights_by_area_are_continuous() {
        let bowl = bowl();
        let jump = |blend| {
            let normals = Normals::new(&bowl, blend, BVec2::FALSE);
            let at = |x: f64| normals.at(DVec2::new(x, 2.4)).unwrap();
            (at(-0.25 - 1e-7) - at(-0.25 + 1e-7)).length()
        };
        assert!(jump(NormalBlend::Area) < 1e-5, "{}", jump(NormalBlend::Area));
        assert!(jump(NormalBlend::Face) > 1e-2, "{}", jump(NormalBlend::Face));
        // By distance it hangs on the two far corners, which change at the border.
        assert!(
            jump(NormalBlend::Distance) > 1e-3,
            "{}",
            jump(NormalBlend::Distance)
        );
    }

    #[test]
    fn a_periodic_mesh_has_a_face_between_last_and_first_sample() {
        let spec = GridSpec::new(Vec2::ZERO, 0.5, UVec2::new(8, 4)).unwrap();
        let wave = Grid::from_fn(spec, |i, _| (std::f32::consts::TAU * i as f32 / 8.0).sin());
        let normals = Normals::new(&wave, NormalBlend::Area, BVec2::TRUE);
        let first = normals.at(DVec2::new(0.0, 0.3)).unwrap();
        for p in [
            DVec2::new(4.0, 0.3),
            DVec2::new(-4.0, 2.3),
            DVec2::new(4.0 - 1e-9, 0.3),
        ] {
            assert!((normals.at(p).unwrap() - first).length() < 1e-5, "{p}");
        }
        assert!(normals.at(DVec2::new(3.9, 0.3)).unwrap().x < -0.5);
    }
}
