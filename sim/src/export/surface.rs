//! The water surface of a frame as a triangle mesh.

use crate::frame::Frame;
use crate::grid::Grid;
use glam::{Vec2, Vec3};

/// Stands for a sample that no triangle uses.
const UNUSED: u32 = u32::MAX;

/// Vertices and triangles of a surface; reused from frame to frame.
#[derive(Default)]
pub(super) struct Surface {
    /// Metres, displacement applied.
    pub(super) positions: Vec<Vec3>,
    /// Unit normals.
    pub(super) normals: Vec<Vec3>,
    /// Anticlockwise seen from above.
    pub(super) triangles: Vec<[u32; 3]>,
    vertex_of: Vec<u32>,
}

/// Whether a sample has water.
pub(super) fn is_wet(frame: &Frame, ground: Option<&Grid<f32>>, k: usize) -> bool {
    ground.is_none_or(|g| frame.elevation.as_slice()[k] > g.as_slice()[k])
}

/// Point of the surface that belongs to sample `(i, j)`.
pub(super) fn point(frame: &Frame, i: usize, j: usize) -> Vec3 {
    let p = frame.spec().position(i, j) + frame.displacement.as_ref().map_or(Vec2::ZERO, |d| d[(i, j)]);
    Vec3::new(p.x, frame.elevation[(i, j)], p.y)
}

/// Normal by central differences of the surface points, one-sided at the edges.
fn normal(frame: &Frame, i: usize, j: usize) -> Vec3 {
    let (w, h) = (frame.spec().width(), frame.spec().height());
    let along_x = point(frame, (i + 1).min(w - 1), j) - point(frame, i.saturating_sub(1), j);
    let along_z = point(frame, i, (j + 1).min(h - 1)) - point(frame, i, j.saturating_sub(1));
    along_z.cross(along_x).normalize_or(Vec3::Y)
}

impl Surface {
    /// Makes this the surface of `frame`. Triangles without a wet corner are left out, and so are samples without a
    /// triangle; where the shore crosses a triangle it goes on below the ground, so that it ends at the waterline.
    pub(super) fn build(&mut self, frame: &Frame, ground: Option<&Grid<f32>>) {
        let (w, h) = (frame.spec().width(), frame.spec().height());
        self.positions.clear();
        self.normals.clear();
        self.triangles.clear();
        self.vertex_of.clear();
        self.vertex_of.resize(w * h, UNUSED);
        for j in 1..h {
            for i in 1..w {
                let [a, b] = [(i - 1, j - 1), (i, j - 1)];
                let [c, d] = [(i - 1, j), (i, j)];
                for corners in [[a, c, b], [b, c, d]] {
                    if corners.iter().any(|&(i, j)| is_wet(frame, ground, j * w + i)) {
                        let triangle = corners.map(|(i, j)| self.vertex(frame, i, j));
                        self.triangles.push(triangle);
                    }
                }
            }
        }
    }

    /// The vertex of a sample, made when it is first used.
    fn vertex(&mut self, frame: &Frame, i: usize, j: usize) -> u32 {
        let k = frame.spec().index(i, j);
        if self.vertex_of[k] == UNUSED {
            // A grid has at most 2²⁸ samples.
            self.vertex_of[k] = self.positions.len() as u32;
            self.positions.push(point(frame, i, j));
            self.normals.push(normal(frame, i, j));
        }
        self.vertex_of[k]
    }
}
