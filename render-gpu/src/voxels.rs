//! A voxel field of distances to ground, walls and objects, for the technique that marches through one.
//!
//! Surfaces are strewn with points closer than voxels; each voxel learns its nearest point from its neighbours in two
//! sweeps (Danielsson 1980), which is exact but for rare voxels that are off by a fraction of a voxel.

use crate::tessellate::Triangle;
use bytemuck::{Pod, Zeroable};
use meniscus_sim::glam::{IVec3, Vec3};

pub(crate) use placed::VoxelBox;

mod placed {
    #![allow(unsafe_code)] // Plain numbers without padding, which the derive itself proves.
    use super::{Pod, Zeroable};

    /// Where the voxels are, as the shader reads it.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
    #[repr(C)]
    pub(crate) struct VoxelBox {
        /// Lowest corner, metres from the anchor.
        pub(crate) low: [f32; 3],
        /// Voxels along a side.
        pub(crate) count: u32,
        /// Size of one, metres.
        pub(crate) step: [f32; 3],
        /// Nothing.
        pub(crate) unused: u32,
    }
}

/// The field.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Voxels {
    pub(crate) place: VoxelBox,
    /// Bits of the distance in metres, and what is nearest: 0 ground, 1 wall, 2 and more objects. X fastest, then Z, then Y.
    pub(crate) values: Vec<[u32; 2]>,
}

/// A field under construction.
pub(crate) struct Builder {
    low: Vec3,
    step: Vec3,
    n: i32,
    nearest: Vec<Option<(Vec3, u32)>>,
}

impl Builder {
    pub(crate) fn new(low: Vec3, high: Vec3, count: u32) -> Self {
        let n = count.clamp(2, 256) as i32;
        Self {
            low,
            step: ((high - low) / n as f32).max(Vec3::splat(1e-6)),
            n,
            nearest: vec![None; (n * n * n) as usize],
        }
    }

    fn index(&self, at: IVec3) -> usize {
        ((at.y * self.n + at.z) * self.n + at.x) as usize
    }

    fn centre(&self, at: IVec3) -> Vec3 {
        self.low + (at.as_vec3() + 0.5) * self.step
    }

    /// A point of a surface.
    pub(crate) fn point(&mut self, p: Vec3, what: u32) {
        let at = ((p - self.low) / self.step).floor().as_ivec3();
        if at.min_element() < 0 || at.max_element() >= self.n {
            return;
        }
        let k = self.index(at);
        let centre = self.centre(at);
        let near = |q: Vec3| q.distance_squared(centre);
        if self.nearest[k].is_none_or(|(q, _)| near(p) < near(q)) {
            self.nearest[k] = Some((p, what));
        }
    }

    /// Side of the squares in which surfaces are strewn with points.
    pub(crate) fn grain(&self) -> f32 {
        0.5 * self.step.min_element()
    }

    /// A triangle in place.
    pub(crate) fn triangle(&mut self, p: [Vec3; 3], what: u32) {
        let longest = (0..3).map(|k| p[k].distance(p[(k + 1) % 3])).fold(0.0, f32::max);
        let n = ((longest / self.grain()).ceil() as u32).clamp(1, 512);
        for a in 0..=n {
            for b in 0..=n - a {
                let (u, v) = (a as f32 / n as f32, b as f32 / n as f32);
                self.point(p[0] + u * (p[1] - p[0]) + v * (p[2] - p[0]), what);
            }
        }
    }

    /// Triangles in an object's own axes, moved by `place`.
    pub(crate) fn object(&mut self, triangles: &[Triangle], place: impl Fn(Vec3) -> Vec3, what: u32) {
        for t in triangles {
            self.triangle(t.corners.map(&place), what);
        }
    }

    /// Distances to the nearest points.
    pub(crate) fn finish(mut self) -> Voxels {
        let n = self.n;
        let before: Vec<IVec3> = (0..27)
            .map(|k| IVec3::new(k % 3 - 1, k / 9 - 1, k / 3 % 3 - 1))
            .filter(|d| (d.y, d.z, d.x) < (0, 0, 0))
            .collect();
        for forwards in [true, false, true, false] {
            let sign = if forwards { 1 } else { -1 };
            let order = |k: i32| if forwards { k } else { n - 1 - k };
            for y in 0..n {
                for z in 0..n {
                    for x in 0..n {
                        let at = IVec3::new(order(x), order(y), order(z));
                        let k = self.index(at);
                        let centre = self.centre(at);
                        let mut best = self.nearest[k];
                        for &d in &before {
                            let q = at + sign * d;
                            if q.min_element() < 0 || q.max_element() >= n {
                                continue;
                            }
                            if let Some(there) = self.nearest[self.index(q)]
                                && best.is_none_or(|b| {
                                    there.0.distance_squared(centre) < b.0.distance_squared(centre)
                                })
                            {
                                best = Some(there);
                            }
                        }
                        self.nearest[k] = best;
                    }
                }
            }
        }
        let far = (self.step * n as f32).length();
        let values = (0..self.nearest.len())
            .map(|k| {
                let k32 = k as i32;
                let at = IVec3::new(k32 % n, k32 / (n * n), k32 / n % n);
                match self.nearest[k] {
                    Some((p, what)) => [p.distance(self.centre(at)).to_bits(), what],
                    None => [far.to_bits(), 1],
                }
            })
            .collect();
        Voxels {
            place: VoxelBox {
                low: self.low.to_array(),
                count: n as u32,
                step: self.step.to_array(),
                unused: 0,
            },
            values,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distances_to_a_plane_and_a_point_are_those_of_geometry() {
        let mut builder = Builder::new(Vec3::ZERO, Vec3::splat(2.0), 16);
        let corner = |x: f32, z: f32| Vec3::new(x, 0.4, z);
        builder.triangle([corner(0.0, 0.0), corner(2.0, 0.0), corner(0.0, 2.0)], 0);
        builder.triangle([corner(2.0, 2.0), corner(2.0, 0.0), corner(0.0, 2.0)], 0);
        builder.point(Vec3::new(1.0, 1.8, 1.0), 5);
        let field = builder.finish();
        let step = 0.125_f32;
        for y in 0..16 {
            for z in 0..16 {
                for x in 0..16 {
                    let p = (Vec3::new(x as f32, y as f32, z as f32) + 0.5) * step;
                    let (plane, point) = ((p.y - 0.4).abs(), p.distance(Vec3::new(1.0, 1.8, 1.0)));
                    let [bits, what] = field.values[(y * 16 + z) * 16 + x];
                    // Points of the plane are half a voxel apart.
                    assert!((f32::from_bits(bits) - plane.min(point)).abs() < 0.6 * step);
                    if (plane - point).abs() > step {
                        assert_eq!(what, if point < plane { 5 } else { 0 });
                    }
                }
            }
        }
    }
}
