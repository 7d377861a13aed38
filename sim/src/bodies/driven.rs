//! Bodies whose water is computed elsewhere, as particles: only hands, contacts and the way travelled are found here.

use super::Bodies;
use super::body::Motion;
use super::error::MotionError;
use super::state::State;
use super::world::Kind;
use crate::frame::BodyPose;
use glam::{DMat3, DVec3};

/// A free body as its water sees it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Driven {
    /// Number of the object.
    pub(crate) object: usize,
    /// kg
    pub(crate) mass: f64,
    /// About the centre of mass, world axes, kg m².
    pub(crate) inertia: DMat3,
    /// Centre of mass, m.
    pub(crate) centre: DVec3,
    /// Its velocity and spin after hands have pulled, m/s and rad/s.
    pub(crate) velocity: DVec3,
    pub(crate) spin: DVec3,
}

impl Bodies {
    /// The free bodies, with the velocities that they have when hands have pulled them for `h` seconds.
    pub(crate) fn driven(&self, h: f64) -> impl Iterator<Item = Driven> {
        let free = self.bodies.iter().enumerate();
        free.filter(|(_, b)| b.kind == Kind::Free)
            .map(move |(object, body)| {
                let pulled = body.pulled(h);
                Driven {
                    object,
                    mass: body.mass.mass,
                    inertia: body.inertia(),
                    centre: body.state.position,
                    velocity: body.state.velocity + pulled.linear,
                    spin: body.state.spin + pulled.angular,
                }
            })
    }

    /// Moves the bodies by `h` seconds from `time`: free ones, in their order, with these velocities and spins, as far as they
    /// do not collide; those that are led to where `led` says.
    ///
    /// # Errors
    /// [`MotionError`] if a body's motion is no longer finite.
    pub(crate) fn drive(
        &mut self,
        motions: impl IntoIterator<Item = [DVec3; 2]>,
        led: impl Fn(usize) -> BodyPose,
        time: f64,
        h: f64,
    ) -> Result<(), MotionError> {
        let mut motions = motions.into_iter();
        for (k, body) in self.bodies.iter_mut().enumerate() {
            match &body.motion {
                Motion::Free => {
                    let Some([velocity, spin]) = motions.next() else {
                        continue;
                    };
                    let force = (velocity - body.state.velocity) * (body.mass.mass / h);
                    let torque = body.inertia() * (spin - body.state.spin) / h;
                    if !(force.is_finite() && torque.is_finite()) {
                        return Err(body.lost(time));
                    }
                    self.world.push(k, force, torque);
                }
                Motion::Led(_) => {
                    body.state = State::from_pose(&led(k), body.mass.centre);
                    self.world.lead(k, &body.state, body.mass.centre);
                }
                Motion::Fixed => {}
            }
        }
        self.collide(time, h)
    }

    /// Stands walls around a round vessel.
    pub(crate) fn keep_within(&mut self, centre: [f64; 2], radius: f64) {
        self.world.add_round_wall(centre, radius);
    }

    /// Kinetic and potential energy of the free bodies in J, the latter relative to `rest` under `gravity`.
    pub(crate) fn mechanical_energy(&self, gravity: DVec3, rest: DVec3) -> f64 {
        let free = self.bodies.iter().filter(|b| b.kind == Kind::Free);
        free.map(|b| {
            let kinetic = b.mass.mass * b.state.velocity.length_squared()
                + b.state.spin.dot(b.inertia() * b.state.spin);
            0.5 * kinetic - b.mass.mass * gravity.dot(b.state.position - rest)
        })
        .sum()
    }
}
