//! Where a ray of the view meets the water or a body.

use meniscus_sim::glam::{DVec3, Vec2, Vec3};
use meniscus_sim::scene::description::Shape;
use meniscus_sim::{Frame, Scene};

/// Steps of the search for the surface.
const STEPS: usize = 24;

/// Where the ray from `eye` along `direction` (unit) meets the water's surface within its grid, metres.
pub fn water(frame: &Frame, eye: DVec3, direction: DVec3) -> Option<Vec3> {
    let spec = frame.spec();
    let height = |p: DVec3| f64::from(frame.elevation.sample(Vec2::new(p.x as f32, p.z as f32)));
    // The surface is nearly level: cut the plane of the height found last.
    let (low, high) = frame.elevation.range();
    let mut level = f64::from(0.5 * (low + high));
    let mut found = None;
    for _ in 0..STEPS {
        let t = (level - eye.y) / direction.y;
        if !(t.is_finite() && t > 0.0) {
            return None;
        }
        let p = eye + t * direction;
        found = Some(p);
        let next = height(p);
        if (next - level).abs() < 1e-6 {
            break;
        }
        // Half the way, so that steep waves seen from low down do not throw it about.
        level += 0.5 * (next - level);
    }
    let p = found?.as_vec3();
    let off = Vec2::new(p.x, p.z) - spec.origin;
    (off.min_element() >= 0.0 && off.cmple(spec.extent()).all()).then_some(p)
}

/// A body that a hand can drag, where a ray meets it.
#[derive(Clone, Debug, PartialEq)]
pub struct Held {
    /// Its name.
    pub name: String,
    /// Where it is met, in its own axes, metres.
    pub grip: Vec3,
    /// Distance along the ray, metres.
    pub distance: f64,
}

/// The first body that the ray meets and a hand can drag, taken as the sphere around it.
pub fn body(scene: &Scene, frame: &Frame, eye: DVec3, direction: DVec3) -> Option<Held> {
    let poses = frame.bodies.as_ref()?;
    let objects = scene.description.objects.iter().zip(poses).enumerate();
    let met = objects.filter_map(|(k, (object, pose))| {
        if !scene.description.can_drag(object) {
            return None;
        }
        let radius = match &object.shape {
            Shape::Sphere { radius } => *radius,
            Shape::Box { size } => 0.5 * size.length(),
            Shape::Cylinder { radius, height } => radius.hypot(0.5 * height),
            Shape::Model { .. } => {
                let far = scene.meshes.get(k)?.positions.iter().map(|p| p.length());
                far.fold(0.0, f32::max)
            }
        };
        let to = pose.position.as_dvec3() - eye;
        let along = to.dot(direction);
        let across = to.length_squared() - along * along;
        let within = f64::from(radius).powi(2) - across;
        if along <= 0.0 || within < 0.0 {
            return None;
        }
        let distance = along - within.sqrt();
        let world = (eye + distance * direction).as_vec3();
        Some(Held {
            name: object.name.clone(),
            grip: pose.rotation.inverse() * (world - pose.position),
            distance,
        })
    });
    met.min_by(|a, b| a.distance.total_cmp(&b.distance))
}

#[cfg(test)]
mod tests {
    use super::*;
    use meniscus_sim::GridSpec;
    use meniscus_sim::glam::{UVec2, dvec3};

    #[test]
    fn a_ray_ends_on_the_surface_or_beside_it() {
        let spec = GridSpec::new(Vec2::ZERO, 0.1, UVec2::splat(41)).unwrap();
        let mut frame = Frame::new(spec);
        for j in 0..41 {
            for i in 0..41 {
                frame.elevation.as_mut_slice()[spec.index(i, j)] = 0.1 * (i as f32 * 0.3).sin();
            }
        }
        let eye = dvec3(2.0, 3.0, 6.0);
        let met = water(&frame, eye, (dvec3(2.0, 0.0, 2.0) - eye).normalize()).unwrap();
        let surface = frame.elevation.sample(Vec2::new(met.x, met.z));
        assert!((met.y - surface).abs() < 1e-4, "{met} against {surface}");
        assert_eq!(water(&frame, eye, DVec3::Y), None);
        assert_eq!(
            water(&frame, eye, (dvec3(30.0, 0.0, 2.0) - eye).normalize()),
            None
        );
    }
}
