//! Rigid bodies in water: they float, sink, collide, are towed, thrown and dragged, and push the water in turn.
//!
//! Forces are computed here, panel by panel over the wet part of each hull ([`loads`]), with the inertia of the water
//! that goes along ([`added_mass`]); rapier3d ([`world`]) integrates positions and keeps bodies, ground and walls apart.
//! `docs/numerics-bodies.md` derives the coupling and gives its measured errors.
//!
//! Any solver can carry bodies:
//!
//! * **one way**, by answering two questions about its water ([`Water`]): call [`Bodies::advance`] after each step;
//! * **both ways**, if it has columns of water that can be pushed and displaced ([`Columns`]): call
//!   [`Bodies::advance_coupled`] after each of its own sub-steps, and keep those below [`Bodies::largest_step`].
//!
//! ```
//! use meniscus_sim::bodies::{Bodies, StillWater};
//! use meniscus_sim::scene::Scene;
//! use std::path::Path;
//!
//! let text = r#"
//! name = "one float"
//! domain = { size = [4.0, 4.0] }
//! solver = { kind = "procedural", spacing = 0.5 }
//! [[object]]
//! name = "crate"
//! shape = { kind = "box", size = [1.0, 0.5, 1.0] }
//! position = [2.0, 0.2, 2.0]
//! density = 400.0
//! motion = { kind = "free" }
//! "#;
//! let scene = Scene::from_toml(text, Path::new("float.toml"), Path::new("."), &[])?;
//! let sea = StillWater { level: 0.0, bed: f64::NEG_INFINITY };
//! let mut bodies = Bodies::from_scene(&scene, &sea)?.expect("the scene has a free body");
//! for step in 0..1200 {
//!     bodies.advance(&sea, f64::from(step) / 60.0, 1.0 / 60.0)?;
//! }
//! // 0.2 m of the crate stay below the surface.
//! assert!((bodies.poses()[0].position.y - 0.05).abs() < 1e-3);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod actions;
mod added_mass;
mod body;
mod checkpoint;
mod cut;
mod displaced;
#[cfg(feature = "sph")]
mod driven;
mod error;
mod from_scene;
mod hull;
mod loads;
mod mass;
mod reference;
mod six;
mod state;
mod water;
mod world;

pub use checkpoint::BodiesCheckpoint;
pub use displaced::Columns;
#[cfg(feature = "shallow-water")]
pub(crate) use displaced::spread;
pub use error::{BodyError, MotionError};
pub use mass::{Mass, MassError};
pub use water::{Column, StillWater, WATER_DENSITY, Water};

use crate::frame::BodyPose;
use crate::grid::Grid;
use crate::solvers::GRAVITY;
use body::{Body, Motion};
use displaced::Displaced;
use glam::DVec3;
use rayon::prelude::*;
use reference::Plane;
use world::{Kind, World};

/// Longest sub-step, s.
const LONGEST_STEP: f64 = 1.0 / 60.0;
/// Longest sub-step of a body, in √(size / g): a hundredth of the period of a floating body.
const STEP_OF_PERIOD: f64 = 0.05;
/// Longest step between exchanges with the water, in √(size / g).
const EXCHANGE_OF_PERIOD: f64 = 0.2;
/// Smallest impulse that is handed to the water, relative to the body's volume of water at √(g size).
const LEAST_IMPULSE: f64 = 1e-6;
/// Most sub-steps of one call.
const MOST_STEPS: f64 = 1e5;

/// The bodies of a scene.
pub struct Bodies {
    bodies: Vec<Body>,
    world: World,
    displaced: Displaced,
    ground: Option<Grid<f32>>,
    /// Smallest and largest X and Z, m.
    bounds: [[f64; 2]; 2],
    /// Cube root of the smallest free body's volume, m.
    smallest: f64,
    clamps: u64,
}

impl Bodies {
    /// Poses of the scene's objects, in their order.
    pub fn poses(&self) -> Vec<BodyPose> {
        self.bodies.iter().map(|b| b.state.pose(b.mass.centre)).collect()
    }

    /// Moves the bodies by `dt` seconds from `time`, in water that they leave as it is.
    ///
    /// # Errors
    /// [`MotionError`] if the step is too long or a body's motion is no longer finite.
    pub fn advance(&mut self, water: &dyn Water, time: f64, dt: f64) -> Result<(), MotionError> {
        let limit = if self.smallest.is_finite() {
            (STEP_OF_PERIOD * (self.smallest / GRAVITY).sqrt()).min(LONGEST_STEP)
        } else {
            LONGEST_STEP
        };
        let steps = (dt / limit).ceil().max(1.0);
        if !(steps <= MOST_STEPS) {
            let needed = steps as u64;
            return Err(MotionError::TooLong { dt, needed });
        }
        let h = dt / steps;
        for step in 0..steps as u32 {
            self.substep(water, time + f64::from(step) * h, h)?;
        }
        Ok(())
    }

    /// Moves the bodies by `dt` seconds from `time` and gives the water what they displace and what they push.
    ///
    /// # Errors
    /// As [`Self::advance`].
    pub fn advance_coupled(
        &mut self,
        columns: &mut dyn Columns,
        time: f64,
        dt: f64,
    ) -> Result<(), MotionError> {
        self.look_around(&*columns, dt);
        self.advance(&*columns, time, dt)?;
        let shared = &*columns;
        self.bodies.par_iter_mut().for_each(|body| {
            body.footprint = match &body.plane {
                Some(plane) => displaced::heights(&body.hull, &body.state, plane, shared),
                None => Vec::new(),
            };
        });
        let wanted = displaced::sum(self.bodies.iter().map(|b| &b.footprint));
        self.displaced.settle(&wanted, columns);
        for body in &mut self.bodies {
            // Rounding is owed until it amounts to something, so that water around a float at rest can rest too.
            let impulse = [body.impulse.x, body.impulse.z];
            let least = LEAST_IMPULSE * WATER_DENSITY * body.mass.volume * (GRAVITY * body.size).sqrt();
            if impulse[0].hypot(impulse[1]) > least
                && displaced::push(columns, &body.footprint, impulse, WATER_DENSITY)
            {
                body.impulse = DVec3::ZERO;
            }
        }
        Ok(())
    }

    /// Puts bodies onto ground that has moved, sampled as the scene's is. Those that it has risen into are pushed out by the next
    /// steps.
    pub fn move_ground(&mut self, ground: &Grid<f32>) {
        if self.ground.is_some() {
            self.world.move_ground(ground);
            self.know_ground(ground);
        }
    }

    /// The ground as it stands, which the world of collisions holds already.
    pub(crate) fn know_ground(&mut self, ground: &Grid<f32>) {
        if let Some(known) = &mut self.ground {
            known.clone_from(ground);
        }
    }

    /// Finds the surface around each body, and how fast it rises.
    fn look_around(&mut self, water: &dyn Water, dt: f64) {
        self.bodies.par_iter_mut().for_each(|body| {
            let Some(plane) = Plane::around(&body.hull, &body.state, water) else {
                body.rise = 0.0;
                return;
            };
            let at = body.state.position;
            body.rise = match &body.plane {
                Some(before) if dt > 0.0 => {
                    let rise = (plane.at(at.x, at.z) - before.at(at.x, at.z)) / dt;
                    // A surface that jumps (a shore that falls dry) says nothing about its speed.
                    let fastest = (GRAVITY * body.size).sqrt();
                    rise.clamp(-fastest, fastest)
                }
                _ => 0.0,
            };
            body.plane = Some(plane);
        });
    }

    /// Longest step in seconds after which the bodies must have met the water again; infinite if none is wet.
    pub fn largest_step(&self, spacing: f64) -> f64 {
        let wet = self
            .bodies
            .iter()
            .filter(|b| b.kind != Kind::Fixed && b.wet > 0.0);
        wet.map(|body| {
            let speed = body.state.velocity.length();
            let period = EXCHANGE_OF_PERIOD * (body.size.max(spacing) / GRAVITY).sqrt();
            // A body that crosses a cell in a step would leave gaps in its wake.
            period.min(spacing / (2.0 * speed).max(1e-30))
        })
        .fold(f64::INFINITY, f64::min)
    }

    /// Longest step in seconds between two looks at the water: a fraction of the smallest free body's period.
    pub(crate) fn exchange_step(&self) -> f64 {
        EXCHANGE_OF_PERIOD * (self.smallest / GRAVITY).sqrt()
    }

    /// One step of all bodies, with the water as it is.
    fn substep(&mut self, water: &dyn Water, time: f64, h: f64) -> Result<(), MotionError> {
        let pushes: Vec<_> = self.bodies.par_iter().map(|b| b.pushed(water, h)).collect();
        for (k, (body, push)) in self.bodies.iter_mut().zip(pushes).enumerate() {
            let Some(push) = push else {
                return Err(body.lost(time));
            };
            body.wet = push.wet;
            body.added = push.added;
            body.impulse -= push.by_water * h;
            match &body.motion {
                Motion::Free => self.world.push(k, push.force, push.torque),
                Motion::Led(path) => {
                    body.state = state::State::from_pose(&path.pose_at(time + h), body.mass.centre);
                    self.world.lead(k, &body.state, body.mass.centre);
                }
                Motion::Fixed => {}
            }
        }
        self.collide(time, h)
    }

    /// Moves the bodies by what they were pushed with, as far as they do not collide.
    fn collide(&mut self, time: f64, h: f64) -> Result<(), MotionError> {
        self.world.step(h);
        for k in 0..self.bodies.len() {
            if self.bodies[k].kind == Kind::Free {
                self.follow(k, time + h)?;
            }
        }
        Ok(())
    }

    /// Takes over what the world made of a free body, and brings it back if it fell through the ground or a wall.
    fn follow(&mut self, k: usize, time: f64) -> Result<(), MotionError> {
        let body = &mut self.bodies[k];
        let mut state = self.world.state(k, body.mass.centre);
        if !state.is_sound() {
            return Err(body.lost(time));
        }
        let mut at = state.position;
        at.x = at.x.clamp(self.bounds[0][0], self.bounds[0][1]);
        at.z = at.z.clamp(self.bounds[1][0], self.bounds[1][1]);
        if let Some(ground) = &self.ground {
            let place = glam::DVec2::new(at.x, at.z).as_vec2();
            let ground = f64::from(ground.sample(place));
            if at.y < ground {
                at.y = ground + body.hull.reach;
                state.velocity = DVec3::ZERO;
            }
        }
        if at != state.position {
            state.position = at;
            self.world.place(k, &state, body.mass.centre);
            self.clamps += 1;
        }
        body.state = state;
        Ok(())
    }

    /// Volume in m³ that stands in the columns in place of bodies: the water itself is the columns' volume less this.
    pub fn displaced_volume(&self, cell_area: f64) -> f64 {
        self.displaced.height() * cell_area
    }

    /// How often a body had to be brought back from below the ground or beyond a wall.
    pub fn clamps(&self) -> u64 {
        self.clamps
    }

    /// Momentum of the free bodies in kg m/s, with what they still owe the water.
    pub fn momentum(&self) -> [f64; 3] {
        let free = self.bodies.iter().filter(|b| b.kind == Kind::Free);
        free.fold(DVec3::ZERO, |sum, b| {
            sum + b.mass.mass * b.state.velocity + b.impulse
        })
        .to_array()
    }

    /// Kinetic energy of the free bodies with the water that goes along, and their potential energy above `level` less that of the water that they
    /// displace, J: what an exchange with the water leaves constant together with the water's own energy.
    pub fn energy(&self, level: f64) -> f64 {
        self.bodies
            .iter()
            .filter(|b| b.kind == Kind::Free)
            .map(|b| b.energy(level))
            .sum()
    }

    /// Submerged volume of body `k` as of the last step, m³.
    pub fn submerged_volume(&self, k: usize) -> f64 {
        self.bodies[k].wet
    }

    /// Bytes held, those of the collision world not counted.
    pub fn bytes(&self) -> u64 {
        let bodies: usize = self.bodies.iter().map(Body::bytes).sum();
        let ground = self
            .ground
            .as_ref()
            .map_or(0, |g| 2 * g.as_slice().len() * size_of::<f32>());
        (bodies + ground + self.displaced.bytes()) as u64
    }
}
