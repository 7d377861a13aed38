//! The whole state of the bodies as plain data, for restarts.

use super::body::{Grip, Motion};
use super::displaced::Displaced;
use super::reference::Plane;
use super::six::Symmetric;
use super::state::State;
use super::{Bodies, BodyError};
use glam::DVec3;
use serde::{Deserialize, Serialize};

/// Everything that the further motion of bodies depends on, besides the scene that they were made from.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct BodiesCheckpoint {
    /// The world of collisions, poses and velocities in it, or why it could not be saved.
    world: Result<Vec<u8>, String>,
    displaced: Displaced,
    bodies: Vec<Saved>,
    clamps: u64,
}

/// What a body has besides.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Saved {
    grip: Option<Grip>,
    plane: Option<Plane>,
    wet: f64,
    added: Symmetric,
    impulse: DVec3,
}

impl Bodies {
    /// Everything that the further motion depends on.
    pub fn checkpoint(&self) -> BodiesCheckpoint {
        let save = |b: &super::Body| Saved {
            grip: b.grip,
            plane: b.plane,
            wet: b.wet,
            added: b.added,
            impulse: b.impulse,
        };
        BodiesCheckpoint {
            world: self.world.save(),
            displaced: self.displaced.clone(),
            bodies: self.bodies.iter().map(save).collect(),
            clamps: self.clamps,
        }
    }

    /// Goes on from a checkpoint at `time` seconds: bit-identical to a run without interruption.
    ///
    /// # Errors
    /// [`BodyError::Saved`] if the checkpoint is damaged or of other bodies; the state is then unchanged.
    pub fn restore(&mut self, saved: &BodiesCheckpoint, time: f64) -> Result<(), BodyError> {
        if saved.bodies.len() != self.bodies.len() {
            return Err(BodyError::Saved("it holds other bodies".into()));
        }
        let world = saved.world.as_ref().map_err(|e| BodyError::Saved(e.clone()))?;
        self.world.load(world).map_err(BodyError::Saved)?;
        self.displaced = saved.displaced.clone();
        self.clamps = saved.clamps;
        for (k, (body, saved)) in self.bodies.iter_mut().zip(&saved.bodies).enumerate() {
            body.grip = saved.grip;
            body.plane = saved.plane;
            body.wet = saved.wet;
            body.added = saved.added;
            body.impulse = saved.impulse;
            body.state = match &body.motion {
                Motion::Free | Motion::Fixed => self.world.state(k, body.mass.centre),
                Motion::Led(path) => State::from_pose(&path.pose_at(time), body.mass.centre),
            };
        }
        Ok(())
    }
}
