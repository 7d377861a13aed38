//! Where a body is and how it moves.

use crate::frame::BodyPose;
use glam::{DQuat, DVec3};

/// State of a body about its centre of mass, world axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct State {
    /// Centre of mass, m.
    pub(super) position: DVec3,
    /// `world_from_body`.
    pub(super) rotation: DQuat,
    /// Velocity of the centre of mass, m/s.
    pub(super) velocity: DVec3,
    /// Angular velocity, rad/s.
    pub(super) spin: DVec3,
}

impl State {
    /// Of a body whose centre of mass is `centre` in its own axes.
    pub(super) fn from_pose(pose: &BodyPose, centre: DVec3) -> Self {
        let rotation = pose.rotation.as_dquat().normalize();
        let arm = rotation * centre;
        let spin = pose.angular_velocity.as_dvec3();
        Self {
            position: pose.position.as_dvec3() + arm,
            rotation,
            velocity: pose.velocity.as_dvec3() + spin.cross(arm),
            spin,
        }
    }

    /// The pose of the body's origin.
    pub(super) fn pose(&self, centre: DVec3) -> BodyPose {
        let arm = self.rotation * centre;
        BodyPose {
            position: (self.position - arm).as_vec3(),
            rotation: self.rotation.as_quat(),
            velocity: (self.velocity - self.spin.cross(arm)).as_vec3(),
            angular_velocity: self.spin.as_vec3(),
        }
    }

    /// Whether every number is finite and within what can be computed with.
    pub(super) fn is_sound(&self) -> bool {
        self.position.is_finite()
            && self.rotation.is_finite()
            && self.velocity.length() < 1e5
            && self.spin.length() < 1e6
    }
}
