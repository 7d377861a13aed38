//! Bodies that the water moves, found together with its pressure.
//!
//! A body of mass M and inertia I about its centre is one more thing that the pressure of `dfsph` accelerates. With g the
//! gradient of what it fills of the kernel of a particle at r from its centre, the particle's rate of compression is less by
//! (V + Ω × r) · L g for the body's motion, and the particle's pressure p pushes the body with m p L g at r: minus what it
//! gives the particle, so that momentum and angular momentum are kept, and the transpose of that rate, so that
//! energy is not gained. Nothing lags by a step, and a body much lighter than the water that it sets in motion needs no care.
//! What the other forces do to the water at a body (`mcg03`, friction, what hits it in flight) is given to the
//! body after the step.

use super::boundary::{Boundary, WallTable};
use super::correction::Local;
use glam::{DMat3, DVec3, Vec3, Vec4};

/// A body that the water moves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Float {
    /// Number of the obstacle that has its shape.
    pub obstacle: usize,
    /// Mass in kg.
    pub mass: f64,
    /// Inertia about the centre of mass, world axes, kg m².
    pub inertia: DMat3,
    /// Centre of mass in metres.
    pub centre: DVec3,
    /// Velocity of the centre of mass, m/s.
    pub velocity: DVec3,
    /// Angular velocity in rad/s, world axes.
    pub spin: DVec3,
}

impl Float {
    /// Changes the motion by an impulse `j` in kg m/s at `arm` from the centre.
    fn kick(&mut self, arm: DVec3, j: DVec3) {
        self.velocity += j / self.mass;
        self.spin += self.inertia.inverse() * arm.cross(j);
    }

    /// Velocity in m/s at `arm` from the centre.
    fn at(&self, arm: DVec3) -> DVec3 {
        self.velocity + self.spin.cross(arm)
    }
}

/// A particle whose kernel a body fills in part.
#[derive(Clone, Copy, Debug)]
struct Contact {
    particle: usize,
    float: usize,
    /// From the body's centre to the particle, m.
    arm: Vec3,
    /// Gradient of the share that the body fills, 1/m, and the same by L.
    gradient: Vec3,
    corrected: Vec3,
    /// Friction per viscosity, 1/m²; 0 where water slides.
    friction: f32,
}

/// The bodies that the water moves, and where it touches them.
#[derive(Debug, Default)]
pub(crate) struct Floating {
    pub(crate) floats: Vec<Float>,
    contacts: Vec<Contact>,
}

/// What the motion of bodies takes from the rates of compression.
#[derive(Debug, Default)]
pub(crate) struct Carried {
    /// Accelerations of the bodies, linear and angular.
    motions: Vec<[DVec3; 2]>,
    /// By particle; empty where there is no body.
    rates: Vec<f32>,
}

impl Carried {
    /// That of particle `i`, 1/s (or 1/s² of accelerations).
    #[inline]
    pub(crate) fn at(&self, i: usize) -> f32 {
        self.rates.get(i).copied().unwrap_or(0.0)
    }

    /// No body moves.
    pub(crate) fn clear(&mut self) {
        self.rates.clear();
    }

    pub(crate) fn bytes(&self) -> usize {
        4 * self.rates.capacity() + size_of::<[DVec3; 2]>() * self.motions.capacity()
    }
}

impl Floating {
    /// Finds the particles that touch a body. `share` is what boundaries fill of each particle's kernel.
    pub(crate) fn find(
        &mut self,
        boundary: &Boundary,
        table: &WallTable,
        positions: &[Vec4],
        share: impl Fn(usize) -> f32,
        sticks: bool,
    ) {
        self.contacts.clear();
        for (float, body) in self.floats.iter().enumerate() {
            let Some(obstacle) = boundary.obstacles.get(body.obstacle) else {
                continue;
            };
            for (particle, p) in positions.iter().enumerate() {
                let p = p.truncate();
                let Some((distance, normal, _)) = obstacle.near(p, table.reach()) else {
                    continue;
                };
                let (gradient, friction) = table.part(distance, normal, share(particle));
                self.contacts.push(Contact {
                    particle,
                    float,
                    arm: (p.as_dvec3() - body.centre).as_vec3(),
                    gradient,
                    corrected: gradient,
                    friction: if sticks { friction } else { 0.0 },
                });
            }
        }
    }

    /// Takes the correction of every particle that touches a body.
    pub(crate) fn correct(&mut self, local: &[Local]) {
        for contact in &mut self.contacts {
            contact.corrected = local[contact.particle]
                .correct(contact.gradient.extend(0.0))
                .truncate();
        }
    }

    fn carry(
        contacts: &[Contact],
        count: usize,
        out: &mut Vec<f32>,
        rate: impl Fn(&Contact, DVec3) -> DVec3,
        gradient: impl Fn(&Contact) -> Vec3,
    ) {
        out.clear();
        if contacts.is_empty() {
            return;
        }
        out.resize(count, 0.0);
        for contact in contacts {
            let moving = rate(contact, contact.arm.as_dvec3());
            out[contact.particle] += moving.as_vec3().dot(gradient(contact));
        }
    }

    /// What the velocities of the bodies take from the rates of `count` particles, with L or without.
    pub(crate) fn carried(&self, corrected: bool, count: usize, out: &mut Carried) {
        Self::carry(
            &self.contacts,
            count,
            &mut out.rates,
            |contact, arm| self.floats[contact.float].at(arm),
            |contact| {
                if corrected {
                    contact.corrected
                } else {
                    contact.gradient
                }
            },
        );
    }

    /// Accelerations of the bodies by `pressure` (over density, m²/s²) of particles of `mass` kg, and what they take from the
    /// rates of those that are `count`.
    pub(crate) fn accelerate(
        &self,
        pressure: impl Fn(usize) -> f32,
        mass: f64,
        count: usize,
        out: &mut Carried,
    ) {
        out.motions.clear();
        out.motions.resize(self.floats.len(), [DVec3::ZERO; 2]);
        for contact in &self.contacts {
            let force = mass * (pressure(contact.particle) * contact.corrected).as_dvec3();
            let [linear, angular] = &mut out.motions[contact.float];
            *linear += force;
            *angular += contact.arm.as_dvec3().cross(force);
        }
        for ([linear, angular], body) in out.motions.iter_mut().zip(&self.floats) {
            *linear /= body.mass;
            *angular = body.inertia.inverse() * *angular;
        }
        let motions = &out.motions;
        Self::carry(
            &self.contacts,
            count,
            &mut out.rates,
            |contact, arm| {
                let [linear, angular] = motions[contact.float];
                linear + angular.cross(arm)
            },
            |contact| contact.corrected,
        );
    }

    /// Changes the velocities of the bodies by what [`Self::accelerate`] found, over `dt` seconds.
    pub(crate) fn push(&mut self, found: &Carried, dt: f32) {
        for (body, [linear, angular]) in self.floats.iter_mut().zip(&found.motions) {
            body.velocity += f64::from(dt) * *linear;
            body.spin += f64::from(dt) * *angular;
        }
    }

    /// Gravity acts for `dt` seconds.
    pub(crate) fn fall(&mut self, gravity: Vec3, dt: f32) {
        for body in &mut self.floats {
            body.velocity += (dt * gravity).as_dvec3();
        }
    }

    /// Gives the bodies the impulses that `impulse` of mass, per particle and its gradient, takes from the water.
    pub(crate) fn react(&mut self, mass: f64, impulse: impl Fn(usize, Vec3) -> Vec3) {
        for contact in &self.contacts {
            let j = mass * impulse(contact.particle, contact.gradient).as_dvec3();
            self.floats[contact.float].kick(contact.arm.as_dvec3(), j);
        }
    }

    /// Water of viscosity times `dt` = `scale` m² that sticks drags the bodies along. `flow` holds its velocities after
    /// friction has acted on them; the pull is that of a step that ends with the bodies' own new velocities, as far as they
    /// move without turning, so that no step is too long for a light one.
    pub(crate) fn drag(&mut self, flow: &[Vec4], mass: f64, scale: f32) {
        for float in 0..self.floats.len() {
            let own = self.contacts.iter().filter(|c| c.float == float);
            let weight = |c: &Contact| mass * f64::from(scale * c.friction);
            let all: f64 = own.clone().map(weight).sum();
            let body = self.floats[float];
            let share = body.mass / (body.mass + all);
            for contact in own {
                let arm = contact.arm.as_dvec3();
                let slip = flow[contact.particle].truncate().as_dvec3() - body.at(arm);
                self.floats[float].kick(arm, share * weight(contact) * slip);
            }
        }
    }

    /// Gives the bodies what particles bring that are about to move into them: `step(i)` is where particle `i` will be and
    /// its velocity. All that hits a body in a step is taken as one inelastic blow.
    pub(crate) fn bounce(&mut self, boundary: &Boundary, mass: f64, step: impl Fn(usize) -> (Vec3, Vec3)) {
        for float in 0..self.floats.len() {
            let Some(obstacle) = boundary.obstacles.get(self.floats[float].obstacle) else {
                continue;
            };
            let blow = |contact: &Contact| {
                let (p, v) = step(contact.particle);
                let (_, normal, velocity) = obstacle.near(p, 0.0)?;
                let approach = (v - velocity).dot(normal);
                (approach < 0.0).then_some((contact.arm, approach * normal))
            };
            let own = self.contacts.iter().filter(|c| c.float == float);
            let hits = own.clone().filter(|c| blow(c).is_some()).count() as f64;
            let share = 1.0 / (1.0 + hits * mass / self.floats[float].mass);
            for (arm, change) in own.filter_map(blow) {
                self.floats[float].kick(arm.as_dvec3(), share * mass * change.as_dvec3());
            }
        }
    }

    /// Lets the obstacles move as their bodies do.
    pub(crate) fn tell(&self, boundary: &mut Boundary) {
        for body in &self.floats {
            if let Some(obstacle) = boundary.obstacles.get_mut(body.obstacle) {
                let arm = obstacle.pose.position.as_dvec3() - body.centre;
                obstacle.pose.velocity = body.at(arm).as_vec3();
                obstacle.pose.angular_velocity = body.spin.as_vec3();
            }
        }
    }

    pub(crate) fn bytes(&self) -> usize {
        size_of::<Contact>() * self.contacts.capacity() + size_of::<Float>() * self.floats.capacity()
    }
}
