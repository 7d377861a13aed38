//! Solid bodies in the water, by their signed distance.

use super::distance_field::DistanceField;
use crate::frame::BodyPose;
use crate::mesh::TriangleMesh;
use crate::scene::description::{Object, Shape};
use glam::Vec3;
use std::sync::Arc;

/// Shape of an obstacle about its origin, metres.
#[derive(Clone, Debug)]
pub enum Solid {
    /// A sphere of this radius.
    Sphere(f32),
    /// A box of these half lengths.
    Box(Vec3),
    /// An upright cylinder of this radius and half height.
    Cylinder(f32, f32),
    /// Any closed surface.
    Field(Arc<DistanceField>),
}

/// A solid body with its pose.
#[derive(Clone, Debug)]
pub struct Obstacle {
    /// Its shape.
    pub solid: Solid,
    /// Where it is and how it moves.
    pub pose: BodyPose,
    /// Whether the water moves it ([`super::Float`]).
    pub floats: bool,
    /// Radius about its origin beyond which it is not.
    radius: f32,
}

impl Obstacle {
    /// A body.
    pub fn new(solid: Solid, pose: BodyPose) -> Self {
        let radius = match &solid {
            Solid::Sphere(r) => *r,
            Solid::Box(half) => half.length(),
            Solid::Cylinder(r, half) => r.hypot(*half),
            Solid::Field(field) => field.radius(),
        };
        Self {
            solid,
            pose,
            floats: false,
            radius,
        }
    }

    /// The body of a scene's object. `spacing` is the resolution at which a model's surface is known.
    pub fn of_object(object: &Object, mesh: &TriangleMesh, spacing: f32) -> Self {
        let solid = match &object.shape {
            Shape::Sphere { radius } => Solid::Sphere(*radius),
            Shape::Box { size } => Solid::Box(0.5 * *size),
            Shape::Cylinder { radius, height } => Solid::Cylinder(*radius, 0.5 * height),
            Shape::Model { .. } => Solid::Field(Arc::new(DistanceField::new(mesh, spacing))),
        };
        Self::new(solid, object.pose_at(0.0))
    }

    /// Radius about its origin beyond which it is not, m.
    pub(crate) fn radius(&self) -> f32 {
        self.radius
    }

    /// Fastest that its surface may move, m/s.
    pub(crate) fn fastest(&self) -> f32 {
        self.pose.velocity.length() + self.radius * self.pose.angular_velocity.length()
    }

    /// Distance, outward normal and velocity of the surface nearest to `p`, if it is nearer than `reach` (negative
    /// inside).
    pub(crate) fn near(&self, p: Vec3, reach: f32) -> Option<(f32, Vec3, Vec3)> {
        let arm = p - self.pose.position;
        let far = self.radius + reach;
        if arm.length_squared() > far * far {
            return None;
        }
        let turn = self.pose.rotation;
        let (distance, normal) = self.solid.distance(turn.inverse() * arm);
        if distance >= reach {
            return None;
        }
        let velocity = self.pose.velocity + self.pose.angular_velocity.cross(arm);
        Some((distance, turn * normal, velocity))
    }
}

impl Solid {
    /// Signed distance of `p` (body axes) and the direction in which it grows.
    fn distance(&self, p: Vec3) -> (f32, Vec3) {
        match self {
            Self::Sphere(radius) => {
                let r = p.length();
                let outward = if r > 0.0 { p / r } else { Vec3::Y };
                (r - radius, outward)
            }
            Self::Box(half) => {
                let beyond = p.abs() - *half;
                let sign = Vec3::ONE.copysign(p);
                if beyond.max_element() > 0.0 {
                    let outside = beyond.max(Vec3::ZERO);
                    let distance = outside.length();
                    (distance, outside * sign / distance)
                } else {
                    let nearest = beyond.max_element();
                    let axis = if nearest == beyond.x {
                        Vec3::X
                    } else if nearest == beyond.y {
                        Vec3::Y
                    } else {
                        Vec3::Z
                    };
                    (nearest, axis * sign)
                }
            }
            Self::Cylinder(radius, half) => {
                let side = Vec3::new(p.x, 0.0, p.z);
                let r = side.length();
                let outward = if r > 0.0 { side / r } else { Vec3::X };
                let up = Vec3::new(0.0, 1.0_f32.copysign(p.y), 0.0);
                let (a, b) = (r - radius, p.y.abs() - half);
                if a > 0.0 && b > 0.0 {
                    let distance = a.hypot(b);
                    (distance, (a * outward + b * up) / distance)
                } else if a > b {
                    (a, outward)
                } else {
                    (b, up)
                }
            }
            Self::Field(field) => field.distance(p),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Quat;

    #[test]
    fn normals_are_the_gradient_of_the_distance() {
        for solid in [
            Solid::Sphere(0.4),
            Solid::Box(Vec3::new(0.3, 0.2, 0.5)),
            Solid::Cylinder(0.3, 0.4),
        ] {
            for p in [
                Vec3::new(0.5, 0.1, 0.2),
                Vec3::new(0.1, 0.19, 0.07),
                Vec3::new(-0.7, -0.6, 0.9),
                Vec3::new(0.02, -0.11, -0.2),
            ] {
                let (_, normal) = solid.distance(p);
                assert!((normal.length() - 1.0).abs() < 1e-5);
                for axis in [Vec3::X, Vec3::Y, Vec3::Z] {
                    let e = 1e-3;
                    let slope = (solid.distance(p + e * axis).0 - solid.distance(p - e * axis).0) / (2.0 * e);
                    assert!((slope - normal.dot(axis)).abs() < 2e-3, "{solid:?} {p} {axis}");
                }
            }
        }
    }

    #[test]
    fn a_turning_body_carries_its_surface() {
        let pose = BodyPose {
            position: Vec3::new(1.0, 0.0, 0.0),
            rotation: Quat::from_rotation_y(0.3),
            velocity: Vec3::Y,
            angular_velocity: Vec3::Z,
        };
        let body = Obstacle::new(Solid::Sphere(0.5), pose);
        let (distance, normal, velocity) = body.near(Vec3::new(1.6, 0.0, 0.0), 0.2).unwrap();
        assert!((distance - 0.1).abs() < 1e-6 && (normal - Vec3::X).length() < 1e-6);
        assert!((velocity - Vec3::new(0.0, 1.6, 0.0)).length() < 1e-6);
        assert!(body.near(Vec3::new(1.8, 0.0, 0.0), 0.2).is_none());
    }
}
