//! The tables `[[object]]`: solid bodies and how they move.

use super::{one, path_text};
use glam::{Quat, Vec3};
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// A solid object.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Object {
    /// Name for reports.
    pub name: String,
    /// Its geometry.
    pub shape: Shape,
    /// Position of its origin in metres.
    #[serde(default)]
    pub position: Vec3,
    /// Rotation as a unit quaternion `[x, y, z, w]`.
    #[serde(default)]
    pub rotation: Quat,
    /// Velocity in m/s with which a free object starts: thrown in.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub velocity: Vec3,
    /// Angular velocity in rad/s with which a free object starts, world axes.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub spin: Vec3,
    /// Density in kg/m³; used by solvers that move bodies.
    #[serde(default = "default_density")]
    pub density: f32,
    /// How it moves.
    #[serde(default)]
    pub motion: Motion,
    /// Linear base colour, 0 to 1; default: the model's, else grey.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub color: Option<Vec3>,
}

fn is_zero(v: &Vec3) -> bool {
    *v == Vec3::ZERO
}

fn default_density() -> f32 {
    600.0
}

/// Geometry of an object.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub enum Shape {
    /// A sphere about the origin.
    Sphere {
        /// Radius in metres.
        radius: f32,
    },
    /// A box about the origin.
    Box {
        /// Full lengths along X, Y, Z in metres.
        size: Vec3,
    },
    /// An upright cylinder about the origin.
    Cylinder {
        /// Radius in metres.
        radius: f32,
        /// Full height in metres.
        height: f32,
    },
    /// A glTF or GLB model.
    Model {
        /// The file, relative to the scene file.
        #[serde(serialize_with = "path_text")]
        file: PathBuf,
        /// Metres a model unit.
        #[serde(default = "one")]
        scale: f32,
    },
}

impl super::Description {
    /// Whether a hand can drag this object of the scene: a free one, or in particles any, for they feel whatever moves.
    pub fn can_drag(&self, object: &Object) -> bool {
        object.motion == Motion::Free || matches!(self.solver, super::Solver::Sph(_))
    }
}

/// How an object moves.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub enum Motion {
    /// It stays.
    #[default]
    Fixed,
    /// It follows way points, linearly in time; before the first and after the last it rests there.
    Path {
        /// Way points in order of time.
        points: Vec<WayPoint>,
    },
    /// It floats freely (solvers with bodies).
    Free,
}

/// A pose at a time.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WayPoint {
    /// Seconds.
    pub time: f64,
    /// Position in metres.
    pub position: Vec3,
    /// Rotation as a unit quaternion.
    #[serde(default)]
    pub rotation: Quat,
}
