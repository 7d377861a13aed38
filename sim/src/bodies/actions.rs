//! Dragging and shoving a body.

use super::Bodies;
use super::body::Grip;
use super::world::Kind;
use crate::events::{Action, EventError};

impl Bodies {
    /// Acts on a body now. Actions on the water alone change nothing here.
    ///
    /// # Errors
    /// [`EventError::NoBody`] if there is no free body of that name.
    pub fn apply(&mut self, action: &Action) -> Result<(), EventError> {
        match action {
            Action::Drag { body, grip, target } => {
                let k = self.free(action, body)?;
                let body = &mut self.bodies[k];
                body.grip = Some(Grip {
                    at: grip.as_dvec3() - body.mass.centre,
                    target: target.as_dvec3(),
                });
            }
            Action::Release { body } => {
                let k = self.free(action, body)?;
                self.bodies[k].grip = None;
            }
            Action::Shove { body, velocity, spin } => {
                let k = self.free(action, body)?;
                self.world.kick(k, velocity.as_dvec3(), spin.as_dvec3());
                let body = &mut self.bodies[k];
                body.state = self.world.state(k, body.mass.centre);
            }
            _ => {}
        }
        Ok(())
    }

    fn free(&self, action: &Action, name: &str) -> Result<usize, EventError> {
        let found = self
            .bodies
            .iter()
            .position(|b| b.name == name && b.kind == Kind::Free);
        found.ok_or_else(|| EventError::NoBody {
            action: action.name(),
            body: name.to_string(),
        })
    }
}
