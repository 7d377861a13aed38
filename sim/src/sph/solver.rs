//! The solver of a scene: sub-steps, obstacles on their paths, pouring, frames.

use super::boundary::Outline;
use super::extract::Extractor;
use super::floats::Floats;
use super::fluid::Fluid;
use super::jets::{self, Jet};
use super::led::Led;
use super::{actions, covered};
use crate::events::{Action, EventError};
use crate::frame::{Channels, Frame};
use crate::grid::{Grid, GridSpec};
use crate::scene::description::{Drain, Tilt};
use crate::solver::{Solver, StepError, StepReport};
use glam::{Vec2, Vec3};
use std::sync::{Mutex, PoisonError};
use std::time::Instant;

/// Water in a tank as particles.
pub struct Sph {
    pub(super) spec: GridSpec,
    pub(super) fluid: Fluid,
    pub(super) ground: Grid<f32>,
    pub(super) extractor: Mutex<Extractor>,
    pub(super) all_droplets: bool,
    pub(super) led: Led,
    pub(super) floats: Floats,
    /// Gravity by time, the earliest first; never empty.
    pub(super) turns: Vec<Tilt>,
    pub(super) jets: Vec<Jet>,
    pub(super) drains: Vec<Drain>,
    /// Whether an edge lets water out.
    pub(super) open: bool,
    pub(super) most_steps: u64,
    pub(super) time: f64,
}

impl Sph {
    /// The particles.
    pub fn fluid(&self) -> &Fluid {
        &self.fluid
    }

    /// Tilts gravity from now on, m/s²; from there it turns evenly to the next turn of the scene, if there is one.
    pub fn tilt(&mut self, gravity: Vec3) {
        let time = self.time;
        self.turns.retain(|turn| turn.time > time);
        self.turns.insert(0, Tilt { time, gravity });
        self.fluid.set_gravity(gravity);
    }

    /// Drags an obstacle that the water does not move, within the tank and as far above and below it as that is wide, or lets it
    /// go. Returns whether there is such an obstacle.
    fn lead(&mut self, action: &Action) -> bool {
        let Some(k) = action.body().and_then(|name| self.led.find(name)) else {
            return false;
        };
        match action {
            Action::Drag { grip, target, .. } => {
                let (low, high) = (self.spec.origin, self.spec.origin + self.spec.extent());
                let (bottom, top) = self.ground.range();
                let reach = (high - low).max_element();
                let target = target.clamp(
                    Vec3::new(low.x, bottom - reach, low.y),
                    Vec3::new(high.x, top + reach, high.y),
                );
                self.led.drag(k, *grip, target, self.time);
            }
            Action::Release { .. } => self.led.release(k, self.time),
            _ => return false,
        }
        true
    }

    fn gravity_at(&self, time: f64) -> Vec3 {
        let next = self.turns.partition_point(|t| t.time <= time);
        let before = next.checked_sub(1).and_then(|k| self.turns.get(k));
        match (before, self.turns.get(next)) {
            (Some(a), Some(b)) => {
                let share = (time - a.time) / (b.time - a.time);
                a.gravity.lerp(b.gravity, share as f32)
            }
            (Some(turn), None) | (None, Some(turn)) => turn.gravity,
            (None, None) => self.fluid.settings().gravity,
        }
    }

    /// Puts the obstacles that the water does not move where they are at `time`.
    fn place_obstacles(&mut self, time: f64) {
        let obstacles = self.fluid.boundary_mut().obstacles.iter_mut();
        for (obstacle, pose) in obstacles.zip(self.led.poses_at(time)) {
            if let Some(pose) = pose {
                obstacle.pose = pose;
            }
        }
    }

    /// The longest stable step now, pouring included.
    fn stable_step(&self) -> f64 {
        let jets = self.jets.iter().map(|j| j.speed(self.time)).fold(0.0, f32::max);
        self.fluid
            .stable_step()
            .min(self.fluid.settings().stable_step(jets))
    }

    /// The error that names the particle that went wrong.
    fn runaway(&self) -> Option<StepError> {
        let (k, speed) = self.fluid.runaway()?;
        let p = self.fluid.positions()[k];
        let at = self.spec.nearest(Vec2::new(p.x, p.z));
        Some(StepError::Unstable {
            quantity: "speed of a particle in m/s",
            value: f64::from(speed),
            limit: f64::from(self.fluid.speed_limit()),
            i: at.x as usize,
            j: at.y as usize,
            time: self.time,
            remedy: "look at obstacles and events there, or lower `solver.courant`".into(),
        })
    }

    /// Height at which the water's centre of mass would stand at rest in this tank, were it level.
    fn rest_height(&self) -> f64 {
        let (low, high) = (self.spec.origin, self.spec.origin + self.spec.extent());
        let area = match self.fluid.boundary().outline {
            Outline::Box => f64::from(high.x - low.x) * f64::from(high.y - low.y),
            Outline::Round => std::f64::consts::FRAC_PI_4 * f64::from((high - low).min_element()).powi(2),
        };
        let water = self.fluid.len() as f64 * f64::from(self.fluid.settings().spacing).powi(3);
        let ground = self.ground.as_slice();
        let share = area / ground.len() as f64;
        let (mut below, mut above) = (f64::from(self.ground.range().0), f64::from(self.ground.range().1));
        above += water / area;
        if below == f64::from(self.ground.range().1) {
            return below + 0.5 * water / area;
        }
        for _ in 0..50 {
            let level = 0.5 * (below + above);
            let held: f64 = ground
                .iter()
                .map(|&g| share * (level - f64::from(g)).max(0.0))
                .sum();
            if held < water {
                below = level;
            } else {
                above = level;
            }
        }
        let moment: f64 = ground
            .iter()
            .map(|&g| f64::from(g))
            .filter(|g| *g < below)
            .map(|g| share * 0.5 * (below * below - g * g))
            .sum();
        if water > 0.0 { moment / water } else { below }
    }
}

impl Solver for Sph {
    fn name(&self) -> &'static str {
        "sph"
    }

    fn spec(&self) -> GridSpec {
        self.spec
    }

    fn time(&self) -> f64 {
        self.time
    }

    fn offers(&self) -> Channels {
        // A hand may move any of them.
        let bodies = if self.led.is_empty() {
            Channels::NONE
        } else {
            Channels::BODIES
        };
        Channels::DEPTH | Channels::VELOCITY | Channels::DROPLETS | Channels::PARTICLES | bodies
    }

    fn advance(&mut self, dt: f32) -> Result<StepReport, StepError> {
        StepError::check_step(dt)?;
        let (start, dt) = (self.time, f64::from(dt));
        let mut done = 0.0;
        let mut steps = 0_u64;
        let (mut courant, mut stalls) = (0.0_f64, 0);
        let clamped = self.floats.clamps();
        self.fluid.stages.clear();
        while done < dt {
            self.place_obstacles(self.time);
            let left = dt - done;
            // Steps given by the scene divide a frame to rounding only.
            let needed = (left / self.stable_step() - 1e-6).ceil().max(1.0);
            if !(steps as f64 + needed <= self.most_steps as f64) {
                return Err(StepError::TooManySubsteps {
                    dt,
                    needed: steps.saturating_add(needed as u64),
                    allowed: self.most_steps,
                    remedy: "use more frames a second, coarser particles or a larger `solver.most_steps`"
                        .into(),
                });
            }
            let step = left / needed;
            let mut clock = Instant::now();
            for jet in &mut self.jets {
                jet.pour(&mut self.fluid, self.time, step);
            }
            self.fluid.set_gravity(self.gravity_at(self.time));
            self.fluid.stages.lap("pouring", &mut clock);
            self.floats.begin(&mut self.fluid, step);
            let stepped = self.fluid.step(step as f32);
            stalls += u64::from(stepped.stalled);
            courant = courant
                .max(f64::from(self.fluid.fastest()) * step / f64::from(self.fluid.settings().spacing));
            let (led, end) = (&self.led, self.time + step);
            let mut clock = Instant::now();
            self.floats
                .follow(&mut self.fluid, |k| led.pose_at(k, end), self.time, step)?;
            self.fluid.stages.lap("bodies", &mut clock);
            done = if needed <= 1.0 { dt } else { done + step };
            self.time = start + done;
            steps += 1;
            if let Some(error) = self.runaway() {
                return Err(error);
            }
            jets::drain(&mut self.fluid, &self.drains);
            if self.open {
                let (low, high) = (self.spec.origin, self.spec.origin + self.spec.extent());
                self.fluid
                    .remove(|p| p.x < low.x || p.z < low.y || p.x > high.x || p.z > high.y);
            }
            self.fluid.stages.lap("pouring", &mut clock);
        }
        self.place_obstacles(self.time);
        Ok(StepReport {
            substeps: u32::try_from(steps).unwrap_or(u32::MAX),
            courant,
            clamps: stalls + self.floats.clamps() - clamped,
            ..self.report()
        })
    }

    fn extract(&self, want: Channels, out: &mut Frame) {
        let particles = out.particles.take();
        // A panic elsewhere leaves buffers that are filled anew anyway.
        let mut extractor = self.extractor.lock().unwrap_or_else(PoisonError::into_inner);
        extractor.extract(&self.fluid, &self.ground, want, self.all_droplets, out);
        let (obstacles, spacing) = (&self.fluid.boundary().obstacles, self.fluid.settings().spacing);
        if !obstacles.is_empty() {
            covered::close(obstacles, spacing, &self.ground, &mut out.elevation);
            if let Some(depth) = &mut out.depth {
                let heights = out.elevation.as_slice().iter().zip(self.ground.as_slice());
                for (depth, (y, ground)) in depth.as_mut_slice().iter_mut().zip(heights) {
                    *depth = (y - ground).max(0.0);
                }
            }
        }
        out.time = self.time;
        if want.contains(Channels::PARTICLES) {
            let mut list = particles.unwrap_or_default();
            list.clear();
            list.position
                .extend(self.fluid.positions().iter().map(|p| p.truncate()));
            list.velocity
                .extend(self.fluid.velocities().iter().map(|v| v.truncate()));
            list.radius.resize(self.fluid.len(), extractor.droplet());
            out.particles = Some(list);
        }
        if want.contains(Channels::BODIES) && self.offers().contains(Channels::BODIES) {
            out.bodies = Some(obstacles.iter().map(|o| o.pose).collect());
        }
    }

    fn apply(&mut self, action: &Action) -> Result<(), EventError> {
        match action {
            Action::Tilt { gravity } => {
                action.check()?;
                self.tilt(*gravity);
                Ok(())
            }
            _ if action.is_on_body() => {
                action.check()?;
                if self.lead(action) {
                    return Ok(());
                }
                let none = || EventError::NoBody {
                    action: action.name(),
                    body: action.body().unwrap_or_default().to_owned(),
                };
                self.floats.apply(action).unwrap_or_else(|| Err(none()))
            }
            _ => actions::apply(&mut self.fluid, action),
        }
    }

    fn report(&self) -> StepReport {
        let mass = self.fluid.particle_mass();
        let (mut momentum, mut energy) = ([0.0; 2], 0.0);
        let gravity = self.fluid.settings().gravity.as_dvec3();
        let (low, high) = (self.spec.origin, self.spec.origin + self.spec.extent());
        let middle = (0.5 * (low + high)).as_dvec2();
        let rest = glam::DVec3::new(middle.x, self.rest_height(), middle.y);
        for (p, v) in self.fluid.positions().iter().zip(self.fluid.velocities()) {
            let (p, v) = (p.truncate().as_dvec3(), v.truncate().as_dvec3());
            momentum[0] += mass * v.x;
            momentum[1] += mass * v.z;
            energy += mass * (0.5 * v.length_squared() - gravity.dot(p - rest));
        }
        let bodies = self.floats.momentum();
        momentum = [momentum[0] + bodies[0], momentum[1] + bodies[1]];
        energy += self.floats.energy(self.fluid.settings().gravity, rest);
        StepReport {
            substeps: 0,
            largest_stable_step: self.stable_step(),
            mass: mass * self.fluid.len() as f64,
            momentum,
            energy,
            courant: 0.0,
            froude: 0.0,
            clamps: 0,
        }
    }

    fn stages(&self) -> &[(&'static str, f64)] {
        self.fluid.stages.as_slice()
    }

    fn bytes(&self) -> u64 {
        let extractor = self.extractor.lock().unwrap_or_else(PoisonError::into_inner);
        self.fluid.bytes() + extractor.bytes() + self.floats.bytes() + 4 * self.ground.as_slice().len() as u64
    }
}
