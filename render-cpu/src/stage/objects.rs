//! Solid objects: spheres, boxes and cylinders in closed form, models as triangles under a bounding-volume hierarchy.

use crate::caster::Ray;
use glam::{DMat3, DVec3, Vec2, Vec3, Vec3A};
use meniscus_sim::frame::Frame;
use meniscus_sim::mesh::{Material, Shine, TriangleMesh};
use meniscus_sim::scene::Scene;
use meniscus_sim::scene::description::Shape;
use meniscus_sim::stage::objects::standing;
use obvhs::bvh2::Bvh2;
use obvhs::triangle::Triangle;
use obvhs::{BvhBuildParams, bvh2::builder::build_bvh2_from_tris};
use std::sync::Arc;

/// Where a ray meets an object.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ObjectHit {
    pub(crate) t: f64,
    /// Geometric and shading normal, outwards.
    pub(crate) normal: DVec3,
    pub(crate) shading: DVec3,
    pub(crate) color: Vec3,
    /// Gloss over the colour, of models that have one.
    pub(crate) shine: Option<Shine>,
}

/// Colour and gloss of a point.
type Look = (Vec3, Option<Shine>);

/// A triangle mesh ready for rays, in its own axes.
pub(crate) struct Model {
    bvh: Bvh2,
    /// Corners and vertex normals in the order of the hierarchy's leaves.
    corners: Vec<[Vec3; 3]>,
    normals: Vec<[Vec3; 3]>,
    /// Look of each triangle and where it is in it, where the mesh has more than one colour.
    looks: Vec<(u16, [Vec2; 3])>,
    materials: Vec<Material>,
    radius: f64,
}

impl std::fmt::Debug for Model {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Model")
            .field("triangles", &self.corners.len())
            .finish_non_exhaustive()
    }
}

impl Model {
    /// `None` if the mesh has no triangle with an area.
    pub(crate) fn build(mesh: &TriangleMesh) -> Option<Self> {
        let mut corners = Vec::with_capacity(mesh.triangles.len());
        let mut normals = Vec::with_capacity(mesh.triangles.len());
        let mut looks = Vec::new();
        for (k, triangle) in mesh.triangles.iter().enumerate() {
            let index = triangle.map(|k| k as usize);
            let Some(p) = gather(&mesh.positions, index) else {
                continue;
            };
            let face = (p[1] - p[0]).cross(p[2] - p[0]);
            if !(face.length_squared() > 0.0) {
                continue;
            }
            corners.push(p);
            if let Some(&material) = mesh.material_of.get(k) {
                looks.push((material, gather(&mesh.texcoords, index).unwrap_or_default()));
            }
            normals.push(gather(&mesh.normals, index).unwrap_or([face.normalize(); 3]));
        }
        if corners.is_empty() {
            return None;
        }
        let triangles: Vec<Triangle> = corners
            .iter()
            .map(|p| Triangle {
                v0: p[0].into(),
                v1: p[1].into(),
                v2: p[2].into(),
            })
            .collect();
        let mut params = BvhBuildParams::medium_build();
        // Leaves then hold each triangle once, so that the arrays can be put in their order.
        params.pre_split = false;
        let bvh = build_bvh2_from_tris(&triangles, params, &mut std::time::Duration::default());
        let order = |k: &u32| *k as usize;
        let radius = corners.iter().flatten().map(|p| p.length()).fold(0.0, f32::max);
        Some(Self {
            corners: bvh.primitive_indices.iter().map(|k| corners[order(k)]).collect(),
            normals: bvh.primitive_indices.iter().map(|k| normals[order(k)]).collect(),
            looks: bvh
                .primitive_indices
                .iter()
                .filter_map(|k| looks.get(order(k)).copied())
                .collect(),
            materials: mesh.materials.clone(),
            bvh,
            radius: f64::from(radius) * (1.0 + 1e-6),
        })
    }

    /// Bytes that a model of that many triangles holds.
    pub(crate) fn bytes_for(triangles: u64) -> u64 {
        // Corners and normals, two nodes of 32 bytes and an index a triangle.
        triangles * (36 + 36 + 64 + 4)
    }

    /// First triangle that a ray in the model's axes meets: `(t, geometric normal, interpolated normal)`, and its colour
    /// where it has one of its own.
    fn cast(&self, origin: DVec3, direction: DVec3, t_max: f64) -> Option<(f64, DVec3, DVec3, Option<Look>)> {
        // The hierarchy works in f32 and only finds candidates: its boxes are widened by the ray's rounding.
        let mut best: Option<(f64, usize)> = None;
        let mut limit = t_max;
        let ray = obvhs::ray::Ray::new(
            Vec3A::from(origin.as_vec3()),
            Vec3A::from(direction.as_vec3()),
            0.0,
            (t_max * (1.0 + 1e-5)) as f32,
        );
        self.bvh
            .ray_traverse(ray, &mut obvhs::ray::RayHit::none(), |_, k| {
                match triangle(&self.corners[k], origin, direction) {
                    Some(t) if t >= 0.0 && t < limit => {
                        limit = t;
                        best = Some((t, k));
                        (t * (1.0 + 1e-6)) as f32
                    }
                    _ => f32::INFINITY,
                }
            });
        let (t, k) = best?;
        let p = self.corners[k].map(Vec3::as_dvec3);
        let face = (p[1] - p[0]).cross(p[2] - p[0]);
        let at = origin + t * direction;
        // Barycentric coordinates by areas.
        let area = face.length_squared();
        let w1 = (at - p[0]).cross(p[2] - p[0]).dot(face) / area;
        let w2 = (p[1] - p[0]).cross(at - p[0]).dot(face) / area;
        let n = self.normals[k].map(Vec3::as_dvec3);
        let smooth = (1.0 - w1 - w2) * n[0] + w1 * n[1] + w2 * n[2];
        let face = face.normalize();
        let color = self.looks.get(k).and_then(|(material, uv)| {
            let at = (1.0 - w1 - w2) as f32 * uv[0] + w1 as f32 * uv[1] + w2 as f32 * uv[2];
            let material = self.materials.get(usize::from(*material))?;
            Some((material.color_at(at), material.shine))
        });
        Some((t, face, smooth.try_normalize().unwrap_or(face), color))
    }
}

fn gather<T: Copy>(values: &[T], index: [usize; 3]) -> Option<[T; 3]> {
    Some([
        *values.get(index[0])?,
        *values.get(index[1])?,
        *values.get(index[2])?,
    ])
}

/// Ray parameter of a triangle. The signed volumes of an edge are exact negatives for the two triangles that share it,
/// so a ray cannot pass between them (Woop, Benthin & Wald 2013, without the shear).
fn triangle(corners: &[Vec3; 3], origin: DVec3, direction: DVec3) -> Option<f64> {
    let [a, b, c] = corners.map(|p| p.as_dvec3() - origin);
    let u = c.cross(b).dot(direction);
    let v = a.cross(c).dot(direction);
    let w = b.cross(a).dot(direction);
    if !((u >= 0.0 && v >= 0.0 && w >= 0.0) || (u <= 0.0 && v <= 0.0 && w <= 0.0)) {
        return None;
    }
    let n = (b - a).cross(c - a);
    let d = n.dot(direction);
    (d != 0.0).then(|| n.dot(a) / d)
}

#[derive(Debug)]
enum Geometry {
    Sphere { radius: f64 },
    Box { half: DVec3 },
    Cylinder { radius: f64, half: f64 },
    Model(Arc<Model>),
}

/// One object at its pose.
#[derive(Debug)]
pub(crate) struct Placed {
    geometry: Geometry,
    position: DVec3,
    world_from_body: DMat3,
    body_from_world: DMat3,
    bound: f64,
    color: Vec3,
}

/// The scene's objects at the poses of the frame, or where the frame has none, of their descriptions.
pub(crate) fn place(scene: &Scene, frame: &Frame, models: &[Option<Arc<Model>>]) -> Vec<Placed> {
    let objects = scene.description.objects.iter().enumerate();
    objects
        .filter_map(|(k, object)| {
            let at = standing(scene, frame, k)?;
            let geometry = match &object.shape {
                Shape::Sphere { radius } => Geometry::Sphere {
                    radius: f64::from(*radius),
                },
                Shape::Box { size } => Geometry::Box {
                    half: 0.5 * size.as_dvec3(),
                },
                Shape::Cylinder { radius, height } => Geometry::Cylinder {
                    radius: f64::from(*radius),
                    half: 0.5 * f64::from(*height),
                },
                Shape::Model { .. } => Geometry::Model(models.get(k)?.clone()?),
            };
            let bound = match &geometry {
                Geometry::Sphere { radius } => *radius,
                Geometry::Box { half } => half.length(),
                Geometry::Cylinder { radius, half } => radius.hypot(*half),
                Geometry::Model(model) => model.radius,
            };
            let world_from_body = DMat3::from_quat(at.rotation);
            (bound > 0.0 && bound.is_finite()).then(|| Placed {
                geometry,
                position: at.position,
                world_from_body,
                body_from_world: world_from_body.transpose(),
                bound,
                color: at.color,
            })
        })
        .collect()
}

impl Placed {
    /// A height that it does not rise above, metres.
    pub(crate) fn top(&self) -> f64 {
        self.position.y + self.bound
    }

    pub(crate) fn cast(&self, ray: &Ray, t_max: f64) -> Option<ObjectHit> {
        // Distance of the centre from the ray's line against the bounding sphere.
        let to = self.position - ray.origin;
        let along = to.dot(ray.direction);
        let reach = self.bound * (1.0 + 1e-9);
        if to.length_squared() - along * along > reach * reach || along < -reach || along - reach > t_max {
            return None;
        }
        let o = self.body_from_world * -to;
        let d = self.body_from_world * ray.direction;
        let (mut color, mut shine) = (self.color, None);
        let (t, normal, shading) = match &self.geometry {
            Geometry::Sphere { radius } => {
                let t = sphere(o, d, *radius)?;
                let n = (o + t * d) / *radius;
                (t, n, n)
            }
            Geometry::Box { half } => {
                let (t, n) = cuboid(o, d, *half)?;
                (t, n, n)
            }
            Geometry::Cylinder { radius, half } => {
                let (t, n) = cylinder(o, d, *radius, *half)?;
                (t, n, n)
            }
            Geometry::Model(model) => {
                let (t, normal, shading, own) = model.cast(o, d, t_max)?;
                (color, shine) = own.unwrap_or((color, shine));
                (t, normal, shading)
            }
        };
        (t <= t_max).then(|| ObjectHit {
            t,
            normal: self.world_from_body * normal,
            shading: self.world_from_body * shading,
            color,
            shine,
        })
    }
}

/// First `t ≥ 0` on a sphere about the origin, from outside or inside; the direction is a unit vector.
pub(crate) fn sphere(o: DVec3, d: DVec3, radius: f64) -> Option<f64> {
    let b = o.dot(d);
    // |o − (o·d) d|² is the stable form of o² − b² far away.
    let q = o - b * d;
    let disc = radius * radius - q.length_squared();
    if disc < 0.0 {
        return None;
    }
    let root = disc.sqrt();
    [-b - root, -b + root].into_iter().find(|t| *t >= 0.0)
}

fn cuboid(o: DVec3, d: DVec3, half: DVec3) -> Option<(f64, DVec3)> {
    let (mut near, mut far) = (f64::NEG_INFINITY, f64::INFINITY);
    let (mut near_axis, mut far_axis) = (0, 0);
    for k in 0..3 {
        if d[k] == 0.0 {
            if o[k].abs() > half[k] {
                return None;
            }
            continue;
        }
        let (a, b) = ((-half[k] - o[k]) / d[k], (half[k] - o[k]) / d[k]);
        let (a, b) = (a.min(b), a.max(b));
        if a > near {
            (near, near_axis) = (a, k);
        }
        if b < far {
            (far, far_axis) = (b, k);
        }
    }
    if near > far {
        return None;
    }
    let axis = |k: usize, sign: f64| {
        let mut n = DVec3::ZERO;
        n[k] = sign;
        n
    };
    if near >= 0.0 {
        Some((near, axis(near_axis, -d[near_axis].signum())))
    } else if far >= 0.0 {
        Some((far, axis(far_axis, d[far_axis].signum())))
    } else {
        None
    }
}

fn cylinder(o: DVec3, d: DVec3, radius: f64, half: f64) -> Option<(f64, DVec3)> {
    let mut best: Option<(f64, DVec3)> = None;
    let mut take = |t: f64, n: DVec3| {
        if t >= 0.0 && best.is_none_or(|(b, _)| t < b) {
            best = Some((t, n));
        }
    };
    let a = d.x * d.x + d.z * d.z;
    if a > 0.0 {
        let b = o.x * d.x + o.z * d.z;
        let disc = b * b - a * (o.x * o.x + o.z * o.z - radius * radius);
        if disc >= 0.0 {
            for t in [(-b - disc.sqrt()) / a, (-b + disc.sqrt()) / a] {
                let p = o + t * d;
                if p.y.abs() <= half {
                    take(t, DVec3::new(p.x, 0.0, p.z) / radius);
                }
            }
        }
    }
    if d.y != 0.0 {
        for y in [-half, half] {
            let t = (y - o.y) / d.y;
            let p = o + t * d;
            if p.x * p.x + p.z * p.z <= radius * radius {
                take(t, DVec3::new(0.0, y.signum(), 0.0));
            }
        }
    }
    best
}
