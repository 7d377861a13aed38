//! Where fixed objects pierce the surface at rest: there the water has no surface that could move.

use crate::grid::GridSpec;
use crate::mesh::TriangleMesh;
use crate::scene::Scene;
use crate::scene::description::{Motion, Object, Shape};
use crate::solvers::BuildError;
use glam::{DVec2, Quat, Vec2, Vec3};

/// For each sample whether the still surface there lies inside a fixed object.
pub(super) fn pierced(scene: &Scene) -> Result<Vec<bool>, BuildError> {
    let spec = scene.grid;
    let level = scene.description.water.level;
    let mut inside = vec![false; spec.len()];
    for (number, object) in scene.description.objects.iter().enumerate() {
        match object.motion {
            Motion::Fixed => {}
            // What moves does not stand in the water long enough to reflect waves; its wake is an event's to make.
            Motion::Path { .. } | Motion::Free => continue,
        }
        match &object.shape {
            Shape::Sphere { radius } => {
                primitive(&spec, level, object, *radius, &mut inside, |p| {
                    p.length() < *radius
                });
            }
            Shape::Box { size } => {
                let half = 0.5 * *size;
                primitive(&spec, level, object, half.length(), &mut inside, |p| {
                    p.abs().cmplt(half).all()
                });
            }
            Shape::Cylinder { radius, height } => {
                let reach = radius.hypot(0.5 * height);
                primitive(&spec, level, object, reach, &mut inside, |p| {
                    p.x.hypot(p.z) < *radius && p.y.abs() < 0.5 * height
                });
            }
            Shape::Model { .. } => {
                let mesh = scene.meshes.get(number).ok_or_else(|| {
                    BuildError::impossible(
                        format!("object.{number}.shape"),
                        "its geometry is not loaded",
                        "load the scene with `Scene::load`",
                    )
                })?;
                model(&spec, level, object.position, object.rotation, mesh, &mut inside);
            }
        }
    }
    Ok(inside)
}

/// Marks the samples whose point of the still surface is in a primitive of bounding radius `reach`.
fn primitive(
    spec: &GridSpec,
    level: f32,
    object: &Object,
    reach: f32,
    inside: &mut [bool],
    contains: impl Fn(Vec3) -> bool,
) {
    let body_from_world = object.rotation.inverse();
    let centre = Vec2::new(object.position.x, object.position.z);
    for (i, j) in samples_within(spec, centre - reach, centre + reach) {
        let p = spec.position(i, j);
        if contains(body_from_world * (Vec3::new(p.x, level, p.y) - object.position)) {
            inside[spec.index(i, j)] = true;
        }
    }
}

/// Marks the samples from which an upward ray leaves a closed mesh an odd number of times.
fn model(
    spec: &GridSpec,
    level: f32,
    position: Vec3,
    rotation: Quat,
    mesh: &TriangleMesh,
    inside: &mut [bool],
) {
    let mut odd = vec![false; inside.len()];
    let points: Vec<Vec3> = mesh.positions.iter().map(|&p| position + rotation * p).collect();
    for triangle in &mesh.triangles {
        let [Some(&a), Some(&b), Some(&c)] = triangle.map(|v| points.get(v as usize)) else {
            continue;
        };
        if a.y.max(b.y).max(c.y) < level {
            continue;
        }
        let plan = |p: Vec3| Vec2::new(p.x, p.z);
        let low = plan(a).min(plan(b)).min(plan(c));
        let high = plan(a).max(plan(b)).max(plan(c));
        for (i, j) in samples_within(spec, low, high) {
            if crosses_above(spec.position(i, j), level, [a, b, c]) {
                let k = spec.index(i, j);
                odd[k] = !odd[k];
            }
        }
    }
    for (inside, odd) in inside.iter_mut().zip(odd) {
        *inside |= odd;
    }
}

/// Whether the vertical through `p` meets the triangle above `level`.
fn crosses_above(p: Vec2, level: f32, triangle: [Vec3; 3]) -> bool {
    let p = p.as_dvec2();
    let [a, b, c] = triangle.map(|v| (DVec2::new(f64::from(v.x), f64::from(v.z)), f64::from(v.y)));
    // Twice the signed area against each edge. Taken along the edge in one fixed order and negated for the other, it
    // is the same number for both triangles of a shared edge, so no vertical slips between them or meets both.
    let side = |s: DVec2, e: DVec2| {
        if (s.x, s.y) < (e.x, e.y) {
            (e - s).perp_dot(p - s)
        } else {
            -(s - e).perp_dot(p - e)
        }
    };
    let (u, v, w) = (side(b.0, c.0), side(c.0, a.0), side(a.0, b.0));
    let positive = |x: f64| x > 0.0;
    if positive(u) != positive(v) || positive(v) != positive(w) {
        return false;
    }
    let area = u + v + w;
    area != 0.0 && (u * a.1 + v * b.1 + w * c.1) / area > f64::from(level)
}

/// Samples within a rectangle.
fn samples_within(spec: &GridSpec, low: Vec2, high: Vec2) -> impl Iterator<Item = (usize, usize)> + use<> {
    let (a, b) = (spec.to_grid(low).ceil(), spec.to_grid(high).floor());
    // Casts saturate; a NaN becomes 0.
    let range = |low: f32, high: f32, n: u32| {
        let first = low.max(0.0) as usize;
        let end = if high >= 0.0 {
            (high as usize).saturating_add(1).min(n as usize)
        } else {
            0
        };
        first..end
    };
    let columns = range(a.x, b.x, spec.size.x);
    range(a.y, b.y, spec.size.y).flat_map(move |j| columns.clone().map(move |i| (i, j)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wave_equation::tests::{grid, scene};

    fn object(shape: Shape, position: Vec3) -> Object {
        Object {
            name: "rock".to_owned(),
            shape,
            position,
            rotation: Quat::from_rotation_y(0.3),
            velocity: glam::Vec3::ZERO,
            spin: glam::Vec3::ZERO,
            density: 2600.0,
            motion: Motion::Fixed,
            color: None,
        }
    }

    /// A box as a mesh of twelve triangles.
    fn box_mesh(size: Vec3) -> TriangleMesh {
        let corner = |k: u32| {
            0.5 * size
                * Vec3::new(
                    if k & 1 == 0 { -1.0 } else { 1.0 },
                    if k & 2 == 0 { -1.0 } else { 1.0 },
                    if k & 4 == 0 { -1.0 } else { 1.0 },
                )
        };
        let quads = [
            [0, 1, 3, 2],
            [4, 6, 7, 5],
            [0, 4, 5, 1],
            [2, 3, 7, 6],
            [0, 2, 6, 4],
            [1, 5, 7, 3],
        ];
        TriangleMesh {
            positions: (0..8).map(corner).collect(),
            triangles: quads
                .iter()
                .flat_map(|q| [[q[0], q[1], q[2]], [q[0], q[2], q[3]]])
                .collect(),
            ..TriangleMesh::default()
        }
    }

    #[test]
    fn a_model_covers_what_its_primitive_covers() {
        let size = Vec3::new(5.3, 2.0, 3.1);
        let at = Vec3::new(9.0, 0.4, 7.2);
        let mut by_shape = scene(grid(40, 32, 0.5), "");
        by_shape.description.objects = vec![object(Shape::Box { size }, at)];
        let mut by_mesh = by_shape.clone();
        by_mesh.description.objects[0].shape = Shape::Model {
            file: "box.glb".into(),
            scale: 1.0,
        };
        by_mesh.meshes = vec![box_mesh(size)];
        let (a, b) = (pierced(&by_shape).unwrap(), pierced(&by_mesh).unwrap());
        assert_eq!(a, b);
        let area = a.iter().filter(|&&x| x).count() as f32 * 0.25;
        assert!((area - 5.3 * 3.1).abs() < 2.5, "{area}");
    }

    #[test]
    fn objects_clear_of_the_surface_do_not_pierce_it() {
        for height in [3.0, -3.0] {
            let mut scene = scene(grid(40, 32, 0.5), "");
            scene.description.objects =
                vec![object(Shape::Sphere { radius: 2.0 }, Vec3::new(9.0, height, 7.0))];
            assert!(!pierced(&scene).unwrap().contains(&true));
        }
    }
}
