//! Two triangles a cell in a general-purpose bounding volume hierarchy: what a renderer would use that has no
//! heightfield caster. It is here to be compared with.

use super::surface::{HeightfieldError, Patch, Surface};
use super::{Caster, Hit, Ray};
use glam::{DVec3, Vec3A};
use meniscus_sim::Grid;
use obvhs::cwbvh::CwBvh;
use obvhs::cwbvh::builder::build_cwbvh_from_tris;
use obvhs::ray::RayHit;
use obvhs::rt_triangle::RtTriangle;
use obvhs::triangle::Triangle;
use obvhs::{BvhBuildParams, ray};
use std::time::Duration;

/// The triangles of a heightfield in an eight-wide compressed hierarchy (`obvhs`), in `f32`.
///
/// Every rebuild builds the hierarchy anew and allocates. A ray that starts on the surface may hit it where it starts.
pub struct TriangleBvh {
    surface: Surface,
    bvh: Option<CwBvh>,
    /// In the order of the hierarchy's leaves.
    triangles: Vec<RtTriangle>,
}

impl TriangleBvh {
    /// A hierarchy over `elevation`.
    ///
    /// # Errors
    /// [`HeightfieldError`] if a sample is not finite, or the grid impossible.
    pub fn build(elevation: &Grid<f32>) -> Result<Self, HeightfieldError> {
        let mut bvh = Self {
            surface: Surface::empty(Patch::Triangles),
            bvh: None,
            triangles: Vec::new(),
        };
        Caster::rebuild(&mut bvh, elevation)?;
        Ok(bvh)
    }

    fn corner(&self, i: u32, j: u32) -> Vec3A {
        let spacing = self.surface.spacing();
        let y = self.surface.sample(i, j) as f32;
        Vec3A::new(
            (f64::from(i) * spacing) as f32,
            y,
            (f64::from(j) * spacing) as f32,
        )
    }
}

impl Caster for TriangleBvh {
    fn name(&self) -> &'static str {
        "bvh"
    }

    fn rebuild(&mut self, elevation: &Grid<f32>) -> Result<(), HeightfieldError> {
        self.bvh = None;
        self.surface.copy_from(elevation)?;
        self.surface.measure(elevation)?;
        let mut triangles =
            Vec::with_capacity(2 * self.surface.cells_x() as usize * self.surface.cells_z() as usize);
        for j in 0..self.surface.cells_z() {
            for i in 0..self.surface.cells_x() {
                let [a, b] = [self.corner(i, j), self.corner(i + 1, j)];
                let [c, d] = [self.corner(i, j + 1), self.corner(i + 1, j + 1)];
                triangles.push(Triangle { v0: a, v1: d, v2: b });
                triangles.push(Triangle { v0: a, v1: c, v2: d });
            }
        }
        if triangles.is_empty() {
            return Ok(());
        }
        let bvh = build_cwbvh_from_tris(
            &triangles,
            BvhBuildParams::medium_build(),
            &mut Duration::default(),
        );
        self.triangles.clear();
        self.triangles.extend(
            bvh.primitive_indices
                .iter()
                .map(|&k| RtTriangle::from(&triangles[k as usize])),
        );
        self.bvh = Some(bvh);
        Ok(())
    }

    fn cast(&self, ray: &Ray, t_min: f64, t_max: f64) -> Option<Hit> {
        let bvh = self.bvh.as_ref()?;
        let corner = self.surface.position(0, 0);
        let origin = (ray.origin - corner).as_vec3a();
        let direction = ray.direction.as_vec3a();
        if !(origin.is_finite() && direction.is_finite()) || t_min.is_nan() || t_max.is_nan() {
            return None;
        }
        let query = ray::Ray::new(origin, direction, t_min.max(0.0) as f32, t_max as f32);
        let mut found = RayHit::none();
        if !bvh.ray_traverse(query, &mut found, |ray, id| self.triangles[id].intersect(ray)) {
            return None;
        }
        let triangle = bvh.primitive_indices[found.primitive_id as usize] / 2;
        let (i, j) = (
            triangle % self.surface.cells_x(),
            triangle / self.surface.cells_x(),
        );
        let t = f64::from(found.t);
        let point = ray.at(t);
        let p = self.surface.to_grid(point.x, point.z);
        let (u, v) = (p.x - f64::from(i), p.y - f64::from(j));
        let (height, normal) = self.surface.height_and_normal(i, j, u, v);
        Some(Hit {
            t,
            position: DVec3::new(point.x, height, point.z),
            normal,
            cell: (i, j),
        })
    }

    fn bytes(&self) -> usize {
        let nodes = self.bvh.as_ref().map_or(0, |bvh| {
            size_of_val(bvh.nodes.as_slice()) + size_of_val(bvh.primitive_indices.as_slice())
        });
        self.surface.bytes() + nodes + size_of_val(self.triangles.as_slice())
    }
}
