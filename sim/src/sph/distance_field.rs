//! Signed distances of a closed triangle mesh on a grid.

use crate::mesh::TriangleMesh;
use glam::{UVec3, Vec3};

/// Grid points across the longest side of a body at most.
const FINEST: f32 = 96.0;
/// Points beyond the body on each side.
const MARGIN: u32 = 3;

/// Signed distance of a closed surface, sampled; trilinear between the samples.
#[derive(Clone, Debug, PartialEq)]
pub struct DistanceField {
    low: Vec3,
    spacing: f32,
    size: UVec3,
    values: Vec<f32>,
}

impl DistanceField {
    /// The field of `mesh` at about `spacing` metres. Points are inside where a vertical line to them crosses the
    /// surface an odd number of times; a line that crosses it an odd number of times altogether meets a hole and
    /// counts as outside.
    pub fn new(mesh: &TriangleMesh, spacing: f32) -> Self {
        let (low, high) = mesh
            .positions
            .iter()
            .fold((Vec3::MAX, Vec3::MIN), |(l, h), p| (l.min(*p), h.max(*p)));
        let (low, high) = if mesh.positions.is_empty() {
            (Vec3::ZERO, Vec3::ZERO)
        } else {
            (low, high)
        };
        let spacing = spacing.max((high - low).max_element() / FINEST).max(1e-6);
        let size = ((high - low) / spacing).ceil().as_uvec3() + 1 + 2 * MARGIN;
        let mut field = Self {
            low: low - spacing * MARGIN as f32,
            spacing,
            size,
            values: vec![f32::MAX; size.x as usize * size.y as usize * size.z as usize],
        };
        for t in &mesh.triangles {
            field.near_triangle(t.map(|k| mesh.positions[k as usize]));
        }
        field.spread();
        field.sign(mesh);
        field
    }

    fn index(&self, c: UVec3) -> usize {
        ((c.z * self.size.y + c.y) * self.size.x + c.x) as usize
    }

    fn point(&self, c: UVec3) -> Vec3 {
        self.low + self.spacing * c.as_vec3()
    }

    /// Exact distances to a triangle at the points about it.
    fn near_triangle(&mut self, t: [Vec3; 3]) {
        let reach = 2.0 * self.spacing;
        let grid = |p: Vec3| (p - self.low) / self.spacing;
        let first = grid(t[0].min(t[1]).min(t[2]) - reach)
            .ceil()
            .max(Vec3::ZERO)
            .as_uvec3();
        let last = grid(t[0].max(t[1]).max(t[2]) + reach)
            .as_uvec3()
            .min(self.size - 1);
        for z in first.z..=last.z {
            for y in first.y..=last.y {
                for x in first.x..=last.x {
                    let c = UVec3::new(x, y, z);
                    let distance = (self.point(c) - nearest_on(t, self.point(c))).length();
                    let k = self.index(c);
                    self.values[k] = self.values[k].min(distance);
                }
            }
        }
    }

    /// Distances beyond the triangles' neighbourhood, along the grid's 26 directions: two sweeps each way.
    fn spread(&mut self) {
        for _ in 0..2 {
            self.sweep(false);
            self.sweep(true);
        }
    }

    fn sweep(&mut self, backward: bool) {
        let n = self.size.as_ivec3();
        let turn = |k: i32, n: i32| if backward { n - 1 - k } else { k };
        for z in 0..n.z {
            for y in 0..n.y {
                for x in 0..n.x {
                    let at = glam::IVec3::new(turn(x, n.x), turn(y, n.y), turn(z, n.z));
                    let k = self.index(at.as_uvec3());
                    let mut best = self.values[k];
                    for code in 0..27 {
                        let step = glam::IVec3::new(code % 3 - 1, code / 3 % 3 - 1, code / 9 - 1);
                        let from = at + step;
                        if from.min_element() >= 0 && from.cmplt(n).all() {
                            let length = self.spacing * step.as_vec3().length();
                            best = best.min(self.values[self.index(from.as_uvec3())] + length);
                        }
                    }
                    self.values[k] = best;
                }
            }
        }
    }

    fn sign(&mut self, mesh: &TriangleMesh) {
        // A little off the grid, so that lines do not run along edges of models that stand on it.
        let aside = self.spacing * Vec3::new(1.37e-3, 0.0, 2.11e-3);
        let mut crossings = vec![Vec::new(); (self.size.x * self.size.z) as usize];
        for t in &mesh.triangles {
            let [a, b, c] = t.map(|k| (mesh.positions[k as usize] - self.low - aside) / self.spacing);
            let first = a.min(b).min(c).ceil().max(Vec3::ZERO).as_uvec3();
            let last = a.max(b).max(c).as_uvec3().min(self.size - 1);
            for z in first.z..=last.z {
                for x in first.x..=last.x {
                    if let Some(y) = height_at(a, b, c, x as f32, z as f32) {
                        crossings[(z * self.size.x + x) as usize].push(y);
                    }
                }
            }
        }
        for z in 0..self.size.z {
            for x in 0..self.size.x {
                let line = &mut crossings[(z * self.size.x + x) as usize];
                line.sort_by(f32::total_cmp);
                for pair in line.chunks_exact(2).filter(|_| line.len() % 2 == 0) {
                    for y in pair[0].ceil().max(0.0) as u32..(pair[1].ceil().max(0.0) as u32).min(self.size.y)
                    {
                        let k = self.index(UVec3::new(x, y, z));
                        self.values[k] = -self.values[k];
                    }
                }
            }
        }
    }

    /// Largest distance of a point of the field from the origin of the body.
    pub(crate) fn radius(&self) -> f32 {
        let high = self.point(self.size - 1);
        self.low.abs().max(high.abs()).length()
    }

    /// Signed distance at `p` and the unit direction in which it grows. Beyond the field: far away.
    pub(crate) fn distance(&self, p: Vec3) -> (f32, Vec3) {
        let g = (p - self.low) / self.spacing;
        let last = (self.size - 1).as_vec3();
        if g.min_element() < 0.0 || g.cmpgt(last).any() {
            return (f32::MAX, Vec3::Y);
        }
        let c = g.as_uvec3().min(self.size - 2);
        let t = g - c.as_vec3();
        let v = |x: u32, y: u32, z: u32| self.values[self.index(c + UVec3::new(x, y, z))];
        let mix = |a: f32, b: f32, t: f32| a + t * (b - a);
        let edge = |y: u32, z: u32| mix(v(0, y, z), v(1, y, z), t.x);
        let face = |z: u32| mix(edge(0, z), edge(1, z), t.y);
        let dx = |y: u32, z: u32| v(1, y, z) - v(0, y, z);
        let gradient = Vec3::new(
            mix(mix(dx(0, 0), dx(1, 0), t.y), mix(dx(0, 1), dx(1, 1), t.y), t.z),
            mix(edge(1, 0) - edge(0, 0), edge(1, 1) - edge(0, 1), t.z),
            face(1) - face(0),
        );
        (
            mix(face(0), face(1), t.z),
            gradient.try_normalize().unwrap_or(Vec3::Y),
        )
    }
}

/// Height at which the vertical line through (x, z) crosses a triangle. Edges belong to one of the triangles that share
/// them, since both compute the same sign.
fn height_at(a: Vec3, b: Vec3, c: Vec3, x: f32, z: f32) -> Option<f32> {
    let side = |p: Vec3, q: Vec3| {
        (f64::from(q.x) - f64::from(p.x)) * (f64::from(z) - f64::from(p.z))
            - (f64::from(q.z) - f64::from(p.z)) * (f64::from(x) - f64::from(p.x))
    };
    let (u, v, w) = (side(b, c), side(c, a), side(a, b));
    let inside = (u >= 0.0 && v >= 0.0 && w >= 0.0) || (u < 0.0 && v < 0.0 && w < 0.0);
    let sum = u + v + w;
    (inside && sum != 0.0)
        .then(|| ((u * f64::from(a.y) + v * f64::from(b.y) + w * f64::from(c.y)) / sum) as f32)
}

/// The point of triangle `abc` nearest to `p`, by the regions of Voronoi (Ericson, Real-Time Collision Detection, 5.1.5).
fn nearest_on([a, b, c]: [Vec3; 3], p: Vec3) -> Vec3 {
    let (ab, ac, ap) = (b - a, c - a, p - a);
    let (d1, d2) = (ab.dot(ap), ac.dot(ap));
    if d1 <= 0.0 && d2 <= 0.0 {
        return a;
    }
    let bp = p - b;
    let (d3, d4) = (ab.dot(bp), ac.dot(bp));
    if d3 >= 0.0 && d4 <= d3 {
        return b;
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        return a + ab * (d1 / (d1 - d3));
    }
    let cp = p - c;
    let (d5, d6) = (ab.dot(cp), ac.dot(cp));
    if d6 >= 0.0 && d5 <= d6 {
        return c;
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        return a + ac * (d2 / (d2 - d6));
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 >= d3 && d5 >= d6 {
        return b + (c - b) * ((d4 - d3) / ((d4 - d3) + (d5 - d6)));
    }
    let sum = va + vb + vc;
    if sum > 0.0 {
        a + ab * (vb / sum) + ac * (vc / sum)
    } else {
        a
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_field_of_a_cube_is_its_distance() {
        let corner = |k: u32| Vec3::new((k & 1) as f32, (k >> 1 & 1) as f32, (k >> 2) as f32) - 0.5;
        let mesh = TriangleMesh {
            positions: (0..8).map(corner).collect(),
            triangles: vec![
                [0, 2, 1],
                [1, 2, 3],
                [4, 5, 6],
                [5, 7, 6],
                [0, 1, 4],
                [1, 5, 4],
                [2, 6, 3],
                [3, 6, 7],
                [0, 4, 2],
                [2, 4, 6],
                [1, 3, 5],
                [3, 7, 5],
            ],
            ..TriangleMesh::default()
        };
        let field = DistanceField::new(&mesh, 0.05);
        for (p, expected) in [
            (Vec3::new(0.6, 0.1, 0.1), 0.1),
            (Vec3::new(0.1, -0.42, 0.2), -0.08),
            (Vec3::new(0.56, 0.58, 0.0), 0.1),
            (Vec3::ZERO, -0.5),
            (Vec3::new(0.0, 0.3, -0.1), -0.2),
        ] {
            let (distance, normal) = field.distance(p);
            assert!((distance - expected).abs() < 0.03, "{p} {distance} {expected}");
            assert!((normal.length() - 1.0).abs() < 1e-4);
        }
        assert!((field.distance(Vec3::new(0.56, 0.1, 0.1)).1 - Vec3::X).length() < 0.05);
        assert_eq!(field.distance(Vec3::splat(9.0)).0, f32::MAX);
    }
}
