//! One body: its hull, its state, and the step of its velocity.

use super::displaced::Heights;
use super::error::MotionError;
use super::hull::Hull;
use super::loads::{Loads, Surroundings};
use super::mass::Mass;
use super::reference::Plane;
use super::six::{Six, Symmetric};
use super::state::State;
use super::water::{WATER_DENSITY, Water};
use super::world::Kind;
use crate::events::SPRING;
use crate::scene::description::Object;
use crate::solvers::GRAVITY;
use glam::{DMat3, DVec3};
use serde::{Deserialize, Serialize};

/// How a body is moved.
pub(super) enum Motion {
    /// By forces.
    Free,
    /// Along the path of its object.
    Led(Box<Object>),
    /// Not at all.
    Fixed,
}

/// A hand that holds a body.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Grip {
    /// Where it holds, from the centre of mass, body axes, m.
    pub(super) at: DVec3,
    /// Where it pulls to, m.
    pub(super) target: DVec3,
}

pub(super) struct Body {
    pub(super) name: String,
    pub(super) kind: Kind,
    pub(super) motion: Motion,
    pub(super) mass: Mass,
    pub(super) hull: Hull,
    pub(super) state: State,
    /// Cube root of its volume, m.
    pub(super) size: f64,
    pub(super) grip: Option<Grip>,
    /// Surface around it.
    pub(super) plane: Option<Plane>,
    /// How fast that rises, m/s.
    pub(super) rise: f64,
    /// Submerged volume as of the last step, m³.
    pub(super) wet: f64,
    /// Inertia of the water that went along in the last step.
    pub(super) added: Symmetric,
    /// What it owes the water, kg m/s.
    pub(super) impulse: DVec3,
    /// Heights of water that it displaces.
    pub(super) footprint: Heights,
}

/// What a hand does in a step.
struct Hand {
    /// Where it holds, from the centre of mass, world axes, m.
    arm: DVec3,
    /// N
    force: DVec3,
    /// What it adds to the inertia there, kg.
    inert: DMat3,
}

/// What moves a body during a step.
pub(super) struct Push {
    /// Force and torque on the bare body, N and N m.
    pub(super) force: DVec3,
    pub(super) torque: DVec3,
    /// Force by the water on the body, N.
    pub(super) by_water: DVec3,
    /// Submerged volume, m³.
    pub(super) wet: f64,
    /// Inertia of the water that goes along.
    pub(super) added: Symmetric,
}

impl Body {
    /// Inertia about the centre of mass, world axes, kg m².
    pub(super) fn inertia(&self) -> DMat3 {
        let rotation = DMat3::from_quat(self.state.rotation);
        rotation * self.mass.inertia * rotation.transpose()
    }

    /// What moves the body during `h` seconds; `None` if its state cannot be computed with.
    ///
    /// (M + A + h C) Δv = h (p + c − C v + w): M the body's mass and inertia, A those of the water that goes along, C
    /// the resistance, p pressure, c what moving water carries along, w weight and hand. Resistance acts on the new
    /// velocity, so that no step is too long for it, however light the body; pressure acts at the old place and moves
    /// the body with its new velocity, which keeps the energy of an undamped float (symplectic Euler). Water that newly
    /// goes along as a body enters is at rest at first, so that it slows the body (von Kármán's slamming); water that a
    /// leaving body lets go keeps its speed.
    pub(super) fn pushed(&self, water: &dyn Water, h: f64) -> Option<Push> {
        let around = Surroundings {
            rise: self.rise,
            size: self.size,
        };
        let loads = Loads::on(&self.hull, &self.state, water, around);
        let now = Six {
            linear: self.state.velocity,
            angular: self.state.spin,
        };
        let by_water = loads.pressure + loads.carried - loads.resistance.times(now);
        if self.kind != Kind::Free {
            return Some(Push {
                force: DVec3::ZERO,
                torque: DVec3::ZERO,
                by_water: by_water.linear,
                wet: loads.volume,
                added: loads.added,
            });
        }
        let inertia = self.inertia();
        let bare = Symmetric::body(self.mass.mass, inertia);
        let fresh = if loads.volume > self.wet {
            (loads.volume - self.wet) / loads.volume
        } else {
            0.0
        };
        // Water that goes along is carried by the accelerating flow (Morison's equation, 1950).
        let carried = Six {
            linear: water.acceleration(self.state.position),
            angular: DVec3::ZERO,
        };
        let by_water = by_water + loads.added.times(carried) - loads.added.times(now) * (fresh / h);
        let mut inert = bare.plus(1.0 + fresh, &loads.added).plus(h, &loads.resistance);
        let mut outside = Six {
            linear: DVec3::NEG_Y * (GRAVITY * self.mass.mass),
            angular: DVec3::ZERO,
        };
        if let Some(hand) = self.hand(loads.volume, h) {
            outside += Six::at(hand.arm, hand.force);
            inert.add_at(hand.arm, hand.inert);
        }
        let change = inert.solve((by_water + outside) * h)?;
        let force = self.mass.mass / h * change.linear;
        let sound = force.is_finite() && change.angular.is_finite();
        sound.then(|| Push {
            force,
            torque: inertia * change.angular / h,
            by_water: force - outside.linear,
            wet: loads.volume,
            added: loads.added,
        })
    }

    /// What a hand does, if one holds it, to a body of which `wet` m³ are under water, in a step of `h` seconds: it pulls with
    /// the stretch and the velocity at the end of the step.
    fn hand(&self, wet: f64, h: f64) -> Option<Hand> {
        let grip = self.grip.as_ref()?;
        let mass = self.mass.mass + 0.5 * WATER_DENSITY * wet;
        let (stiffness, damping) = (mass * SPRING * SPRING, 2.0 * mass * SPRING);
        let arm = self.state.rotation * grip.at;
        let velocity = self.state.velocity + self.state.spin.cross(arm);
        let stretch = grip.target - self.state.position - arm;
        Some(Hand {
            arm,
            force: stiffness * (stretch - h * velocity) - damping * velocity,
            inert: DMat3::IDENTITY * (h * (damping + h * stiffness)),
        })
    }

    /// Change of velocity and spin by a hand that pulls for `h` seconds with the strength that a body under water needs.
    #[cfg(feature = "sph")]
    pub(super) fn pulled(&self, h: f64) -> Six {
        let Some(hand) = self.hand(self.mass.volume, h) else {
            return Six::default();
        };
        let mut inert = Symmetric::body(self.mass.mass, self.inertia());
        inert.add_at(hand.arm, hand.inert);
        inert.solve(Six::at(hand.arm, hand.force) * h).unwrap_or_default()
    }

    /// The error of a body whose motion is no longer finite.
    pub(super) fn lost(&self, time: f64) -> MotionError {
        MotionError::Lost {
            name: self.name.clone(),
            time,
            remedy: "look at what pushes it there, or give it a density nearer to that of water",
        }
    }

    /// See [`super::Bodies::energy`].
    pub(super) fn energy(&self, level: f64) -> f64 {
        let State {
            position,
            velocity,
            spin,
            rotation,
        } = self.state;
        let motion = Six {
            linear: velocity,
            angular: spin,
        };
        let inert = Symmetric::body(self.mass.mass, self.inertia()).plus(1.0, &self.added);
        let momentum = inert.times(motion);
        let kinetic = velocity.dot(momentum.linear) + spin.dot(momentum.angular);
        let matrix = DMat3::from_quat(rotation);
        // ∫ y dV of the wet part, by the divergence theorem over its panels and its waterplane.
        let mut moment = 0.0;
        let surface = |p: DVec3| self.plane.map_or(level, |s| s.at(p.x, p.z));
        for panel in &self.hull.panels {
            let corner = |k: u32| {
                let p = position + matrix * self.hull.vertices[k as usize];
                (p, surface(p) - p.y)
            };
            super::cut::submerged(panel.map(corner), |part| {
                let [(a, da), (b, db), (c, dc)] = part;
                let down = -0.5 * (b - a).cross(c - a).y;
                let depth = (da + db + dc) / 3.0;
                let middle = (a.y + b.y + c.y) / 3.0 - level;
                moment += down * depth * (middle + 0.5 * depth);
            });
        }
        0.5 * kinetic + GRAVITY * (self.mass.mass * (position.y - level) - WATER_DENSITY * moment)
    }

    pub(super) fn bytes(&self) -> usize {
        size_of::<Self>() + self.hull.bytes() + self.footprint.capacity() * size_of::<(usize, f64)>()
    }
}
