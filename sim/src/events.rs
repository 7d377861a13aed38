//! What acts on the water from outside: drops, pushes, rain; scheduled by a scene or sent live.

mod schedule;
#[cfg_attr(
    not(feature = "wave-equation"),
    allow(dead_code, reason = "only grids of linear waves are stamped")
)]
pub(crate) mod stamp;

pub use schedule::{Schedule, TICK};
pub use stamp::{BUMP_VOLUME, PRESS_VOLUME};

use glam::{Vec2, Vec3};
use serde::{Deserialize, Serialize};

/// One thing done to the water at one moment.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case")]
pub enum Action {
    /// Water falls onto the surface: `volume` m³ spread over a smooth bump of radius `radius`.
    Drop {
        /// Centre in metres (X, Z).
        position: Vec2,
        /// Radius of the bump in metres.
        radius: f32,
        /// Volume in m³; negative takes water away.
        volume: f32,
    },
    /// The surface is pressed down (or pulled up) without adding water: the depression of `depth` metres at the
    /// centre is surrounded by a rim of the same volume.
    Press {
        /// Centre in metres (X, Z).
        position: Vec2,
        /// Radius of the depression in metres.
        radius: f32,
        /// Depth at the centre in metres; negative pulls up.
        depth: f32,
    },
    /// A horizontal push: adds `velocity` m/s at the centre, falling smoothly to zero at `radius`. Methods that carry
    /// no velocity take it as the surface slope that such a push leaves.
    Push {
        /// Centre in metres (X, Z).
        position: Vec2,
        /// Radius in metres.
        radius: f32,
        /// Change of velocity at the centre in m/s (X, Z).
        velocity: Vec2,
    },
    /// A hand takes hold of a free object, or moves the hold that it has: a critically damped spring pulls `grip` to
    /// `target` until [`Action::Release`]. In particles obstacles that stand or follow a path can be held too: they go where the
    /// hand pulls them and stay where it lets go.
    Drag {
        /// Name of the object.
        body: String,
        /// Where the hand holds it, in the object's axes, metres.
        grip: Vec3,
        /// Where it is pulled to, metres.
        target: Vec3,
    },
    /// The hand lets go.
    Release {
        /// Name of the object.
        body: String,
    },
    /// A sudden push of a free object.
    Shove {
        /// Name of the object.
        body: String,
        /// Change of its velocity in m/s.
        velocity: Vec3,
        /// Change of its angular velocity in rad/s, world axes.
        spin: Vec3,
    },
    /// Gravity turns, as when a vessel is tilted.
    Tilt {
        /// Gravity from now on, m/s².
        gravity: Vec3,
    },
}

impl Action {
    /// Name of the action as in scene files.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Drop { .. } => "drop",
            Self::Press { .. } => "press",
            Self::Push { .. } => "push",
            Self::Drag { .. } => "drag",
            Self::Release { .. } => "release",
            Self::Shove { .. } => "shove",
            Self::Tilt { .. } => "tilt",
        }
    }

    /// Whether it acts on a body rather than on the water.
    pub fn is_on_body(&self) -> bool {
        self.body().is_some()
    }

    /// Name of the body that it acts on, if it acts on one.
    pub fn body(&self) -> Option<&str> {
        match self {
            Self::Drag { body, .. } | Self::Release { body } | Self::Shove { body, .. } => Some(body),
            _ => None,
        }
    }

    /// Checks what every solver needs: finite values and a positive radius.
    ///
    /// # Errors
    /// [`EventError::Impossible`] names the first value that is not so.
    pub fn check(&self) -> Result<(), EventError> {
        let (position, radius, rest) = match *self {
            Self::Drop {
                position,
                radius,
                volume,
            } => (position, radius, [("volume", volume), ("volume", volume)]),
            Self::Press {
                position,
                radius,
                depth,
            } => (position, radius, [("depth", depth), ("depth", depth)]),
            Self::Push {
                position,
                radius,
                velocity,
            } => (
                position,
                radius,
                [("velocity x", velocity.x), ("velocity z", velocity.y)],
            ),
            Self::Drag { grip, target, .. } => return self.finite(&[("grip", grip), ("target", target)]),
            Self::Shove { velocity, spin, .. } => {
                return self.finite(&[("velocity", velocity), ("spin", spin)]);
            }
            Self::Tilt { gravity } => return self.finite(&[("gravity", gravity)]),
            Self::Release { .. } => return Ok(()),
        };
        let impossible = |quantity, value, remedy| EventError::Impossible {
            action: self.name(),
            quantity,
            value,
            remedy,
        };
        for (quantity, value) in [("position x", position.x), ("position z", position.y)]
            .into_iter()
            .chain(rest)
        {
            if !value.is_finite() {
                return Err(impossible(quantity, value, "it must be a finite number"));
            }
        }
        if !(radius.is_finite() && radius > 0.0) {
            return Err(impossible(
                "radius",
                radius,
                "it must be a positive length in metres",
            ));
        }
        Ok(())
    }
}

impl Action {
    fn finite(&self, vectors: &[(&'static str, Vec3)]) -> Result<(), EventError> {
        for &(quantity, vector) in vectors {
            // Beyond this a single-precision pose means nothing.
            if let Some(value) = vector.to_array().into_iter().find(|v| !(v.abs() <= 1e6)) {
                return Err(EventError::Impossible {
                    action: self.name(),
                    quantity,
                    value,
                    remedy: "it must be a finite number within ±1e6",
                });
            }
        }
        Ok(())
    }
}

impl EventError {
    /// Of a method whose gravity points down.
    #[cfg_attr(
        not(any(
            feature = "wave-equation",
            feature = "shallow-water",
            feature = "wave-particles"
        )),
        allow(dead_code, reason = "these take every other action")
    )]
    pub(crate) fn upright(solver: &'static str) -> Self {
        Self::Unsupported {
            solver,
            action: "tilt",
            remedy: "choose the solver `sph`, whose vessels can be tilted",
        }
    }
}

/// Why an action cannot be applied.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum EventError {
    /// The method has no way to do this.
    #[error("solver `{solver}` cannot apply `{action}`; {remedy}")]
    Unsupported {
        /// The solver's name.
        solver: &'static str,
        /// The action's name.
        action: &'static str,
        /// What to use instead.
        remedy: &'static str,
    },
    /// It names a body that is not there.
    #[error("event `{action}`: there is no free object `{body}`; name one whose motion.kind is \"free\"")]
    NoBody {
        /// The action's name.
        action: &'static str,
        /// What it names.
        body: String,
    },
    /// A value of the action is impossible.
    #[error("event `{action}`: {quantity} is {value}, which is impossible; {remedy}")]
    Impossible {
        /// The action's name.
        action: &'static str,
        /// Which value.
        quantity: &'static str,
        /// What it was.
        value: f32,
        /// What would be right.
        remedy: &'static str,
    },
}
