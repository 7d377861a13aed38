//! Where the scene's objects stand in a frame, and in which colour.

use crate::Scene;
use crate::frame::Frame;
use crate::scene::description::{Motion, Object, WayPoint};
use glam::{DQuat, DVec3, Quat, Vec3};

/// Base colour of objects without one.
const GREY: Vec3 = Vec3::splat(0.55);

/// An object of the scene at its place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Standing {
    /// World position of its origin, metres.
    pub position: DVec3,
    /// Rotation `world_from_body`, a unit quaternion.
    pub rotation: DQuat,
    /// Albedo.
    pub color: Vec3,
}

/// Object `k` of the scene at the pose of the frame, or where the frame has none, of its description; `None` beyond
/// the last object.
pub fn standing(scene: &Scene, frame: &Frame, k: usize) -> Option<Standing> {
    let object = scene.description.objects.get(k)?;
    let (position, rotation) = match frame.bodies.as_ref().and_then(|b| b.get(k)) {
        Some(pose) => (pose.position, pose.rotation),
        None => described_pose(object, frame.time),
    };
    let rotation: DQuat = rotation.as_dquat();
    let rotation = if rotation.length_squared() > 0.0 {
        rotation.normalize()
    } else {
        DQuat::IDENTITY
    };
    let model_color = scene
        .meshes
        .get(k)
        .filter(|m| !m.triangles.is_empty())
        .map(|m| m.base_color);
    Some(Standing {
        position: position.as_dvec3(),
        rotation,
        color: object.color.or(model_color).unwrap_or(GREY),
    })
}

/// Pose of an object that follows its description.
fn described_pose(object: &Object, time: f64) -> (Vec3, Quat) {
    let Motion::Path { points } = &object.motion else {
        return (object.position, object.rotation);
    };
    let rest = |p: &WayPoint| (p.position, p.rotation);
    let after = points.iter().position(|p| p.time > time);
    match (after, points.last()) {
        (_, None) => (object.position, object.rotation),
        (None, Some(last)) => rest(last),
        (Some(0), _) => rest(&points[0]),
        (Some(k), _) => {
            let (a, b) = (&points[k - 1], &points[k]);
            let s = ((time - a.time) / (b.time - a.time)).clamp(0.0, 1.0) as f32;
            (a.position.lerp(b.position, s), a.rotation.slerp(b.rotation, s))
        }
    }
}
