//! Objects as triangles in place, cut for the broad phase.

use crate::facts::Facts;
use crate::fixed::Fixed;
use crate::hierarchy::Rows;
use crate::settings::Settings;
use crate::tessellate::{self, Triangle};
use meniscus_sim::glam::{DMat3, Vec2, Vec3};
use meniscus_sim::scene::description::Shape;
use meniscus_sim::stage::Lens;
use meniscus_sim::stage::objects::standing;
use meniscus_sim::{Frame, Scene};

/// How finely things must be cut for `settings.tessellation`, and the objects' triangles cut so. A straight edge of length L at
/// distance D is off by about L²/(8 D) after refraction.
pub(crate) fn cut_meshes(
    scene: &Scene,
    fixed: &Fixed,
    frame: &Frame,
    lens: &Lens,
    settings: &Settings,
    facts: &mut Facts,
) -> Rows {
    let bound = f64::from(settings.tessellation.max(0.01));
    let longest = |distance: f64| distance * (8.0 * bound * lens.pixel_angle).sqrt();
    let above = (lens.eye.y - fixed.anchor.y).abs().max(1e-3 * fixed.scale);
    // Powers of two: a moving eye then asks for few different meshes.
    let pieces = |extent: f64, most: u32| {
        let n = (extent / longest(above).max(1e-9))
            .ceil()
            .clamp(8.0, f64::from(most)) as u32;
        n.next_power_of_two().min(most)
    };
    if let Some(ground) = &fixed.ground {
        let spec = ground.grid().spec();
        let relief = {
            let (low, high) = ground.grid().range();
            low < high
        };
        let extent = f64::from(spec.spacing) * (spec.size.as_dvec2() - 1.0);
        for (k, out) in facts.mesh.ground.iter_mut().enumerate() {
            let cells = spec.size[k] - 1;
            let needed = pieces(extent[k], 512);
            // Ground with relief keeps its samples, up to a limit.
            *out = if relief {
                needed.max(cells.min(1024))
            } else {
                needed
            };
        }
    }
    facts.mesh.wall = pieces(scene.grid.extent().as_dvec2().max_element(), 64);
    let mut rows = Rows::new();
    facts.mesh.objects.clear();
    for (k, triangles) in fixed.triangles.iter().enumerate() {
        let Some(at) = standing(scene, frame, k) else {
            continue;
        };
        let reach = triangles
            .iter()
            .flat_map(|t| t.corners)
            .map(|p| p.length())
            .fold(0.0, f32::max);
        let distance = ((at.position - lens.eye).length() - f64::from(reach)).max(0.05 * fixed.scale);
        let mut cut = tessellate::refined(triangles.clone(), longest(distance) as f32);
        round(&mut cut, &scene.description.objects[k].shape);
        let position = at.position - fixed.anchor;
        if position.y.abs() <= f64::from(reach) {
            cut = tessellate::split(&cut, DMat3::from_quat(at.rotation), position);
        }
        if cut.is_empty() {
            continue;
        }
        facts
            .mesh
            .objects
            .push([k as u32, rows.len() as u32, cut.len() as u32]);
        cut.iter().for_each(|t| t.write(facts.looks, &mut rows));
    }
    rows
}

/// Moves the corners of cut triangles out to the sphere or cylinder that they were cut from.
fn round(triangles: &mut [Triangle], shape: &Shape) {
    for triangle in triangles {
        for (p, n) in triangle.corners.iter_mut().zip(&mut triangle.normals) {
            match *shape {
                Shape::Sphere { radius } => {
                    *n = p.normalize_or(*n);
                    *p = radius * *n;
                }
                Shape::Cylinder { radius, .. } if n.y.abs() < 0.5 => {
                    let out = Vec2::new(p.x, p.z).normalize_or(Vec2::X);
                    *n = Vec3::new(out.x, 0.0, out.y);
                    (p.x, p.z) = (radius * out.x, radius * out.y);
                }
                _ => {}
            }
        }
    }
}
