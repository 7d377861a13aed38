//! Where a scene's objects are at a time.

use super::description::{Motion, Object, WayPoint};
use crate::frame::BodyPose;
use glam::{DQuat, DVec3};

impl Object {
    /// Where the object is and how fast it moves at `time` seconds, as the scene file says: fixed, or along its path
    /// (positions linear in time, rotations by the shorter great arc, velocities those of the present stretch).
    /// Before the first and after the last way point it rests. A free body is where it starts; its solver knows better.
    pub fn pose_at(&self, time: f64) -> BodyPose {
        let rest = BodyPose {
            position: self.position,
            rotation: self.rotation,
            ..BodyPose::default()
        };
        match &self.motion {
            Motion::Fixed => rest,
            Motion::Free => BodyPose {
                velocity: self.velocity,
                angular_velocity: self.spin,
                ..rest
            },
            Motion::Path { points } => along(points, time).unwrap_or(rest),
        }
    }
}

/// The pose on a path; `None` if there is no way point.
fn along(points: &[WayPoint], time: f64) -> Option<BodyPose> {
    let at_rest = |p: &WayPoint| BodyPose {
        position: p.position,
        rotation: p.rotation,
        ..BodyPose::default()
    };
    // The first way point that is still to come: the stretch that is left at a way point's time is the one after it.
    let next = points.partition_point(|p| p.time <= time);
    let Some(to) = points.get(next) else {
        return points.last().map(at_rest);
    };
    let Some(from) = next.checked_sub(1).map(|k| &points[k]) else {
        return Some(at_rest(to));
    };
    let duration = to.time - from.time;
    let share = (time - from.time) / duration;
    let (p0, p1) = (from.position.as_dvec3(), to.position.as_dvec3());
    let (q0, q1) = (unit(from), unit(to));
    Some(BodyPose {
        position: p0.lerp(p1, share).as_vec3(),
        rotation: q0.slerp(q1, share).normalize().as_quat(),
        velocity: ((p1 - p0) / duration).as_vec3(),
        angular_velocity: (shorter_turn(q0, q1) / duration).as_vec3(),
    })
}

fn unit(point: &WayPoint) -> DQuat {
    point.rotation.as_dquat().normalize()
}

/// The turn from `a` to `b` as axis times angle, world axes.
fn shorter_turn(a: DQuat, b: DQuat) -> DVec3 {
    let turn = b * a.inverse();
    if turn.w < 0.0 { -turn } else { turn }.to_scaled_axis()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::description::Shape;
    use glam::{Quat, Vec3};
    use std::f32::consts::FRAC_PI_2;

    fn object(points: Vec<WayPoint>) -> Object {
        Object {
            name: "boat".into(),
            shape: Shape::Sphere { radius: 1.0 },
            position: Vec3::splat(9.0),
            rotation: Quat::IDENTITY,
            velocity: Vec3::ZERO,
            spin: Vec3::ZERO,
            density: 600.0,
            motion: Motion::Path { points },
            color: None,
        }
    }

    fn point(time: f64, x: f32, turn: f32) -> WayPoint {
        WayPoint {
            time,
            position: Vec3::new(x, 0.0, 0.0),
            rotation: Quat::from_rotation_y(turn),
        }
    }

    #[test]
    fn a_path_is_followed_at_constant_speed_and_rests_at_its_ends() {
        let o = object(vec![
            point(1.0, 2.0, 0.0),
            point(3.0, 6.0, FRAC_PI_2),
            point(4.0, 6.0, 0.0),
        ]);
        let mid = o.pose_at(2.0);
        assert!((mid.position - Vec3::new(4.0, 0.0, 0.0)).length() < 1e-6);
        assert!((mid.velocity - Vec3::new(2.0, 0.0, 0.0)).length() < 1e-6);
        assert!(mid.rotation.angle_between(Quat::from_rotation_y(FRAC_PI_2 / 2.0)) < 1e-3);
        assert!((mid.angular_velocity - Vec3::Y * FRAC_PI_2 / 2.0).length() < 1e-6);
        let back = o.pose_at(3.5);
        assert!((back.angular_velocity + Vec3::Y * FRAC_PI_2).length() < 1e-6);
        for (t, x) in [(-5.0, 2.0), (1.0 - 1e-9, 2.0), (4.0, 6.0), (1e9, 6.0)] {
            let pose = o.pose_at(t);
            assert_eq!((pose.position.x, pose.velocity), (x, Vec3::ZERO));
        }
    }

    #[test]
    fn rotations_take_the_shorter_way_whatever_the_sign_of_the_quaternion() {
        let mut points = vec![point(0.0, 0.0, 0.1), point(1.0, 0.0, 0.3)];
        let turn = object(points.clone()).pose_at(0.5);
        points[1].rotation = -points[1].rotation;
        let other = object(points).pose_at(0.5);
        assert!((turn.angular_velocity - Vec3::Y * 0.2).length() < 1e-6);
        assert!((other.angular_velocity - turn.angular_velocity).length() < 1e-6);
    }

    #[test]
    fn velocity_is_the_difference_of_positions() {
        let o = object(vec![point(0.0, 0.0, 0.0), point(2.0, 3.0, 1.0)]);
        let (a, b) = (o.pose_at(0.5), o.pose_at(0.5 + 1.0 / 64.0));
        assert!((((b.position - a.position) * 64.0) - a.velocity).length() < 1e-4);
    }
}
