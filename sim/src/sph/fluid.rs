//! The particles, and one step of either model.

use super::boundary::{Boundary, Touch, WallTable};
use super::cells::Cells;
use super::complementarity::Buffers;
use super::correction::Local;
use super::floating::{Carried, Float, Floating};
use super::kernel::{CubicSpline, Muller};
use super::mirrors::{Inner, Mirrors};
use super::neighbours::Neighbours;
use super::noise::{self, Gradient};
use super::settings::{Model, Settings};
use super::{dfsph, mcg03, viscosity};
use crate::reduce;
use crate::stages::Stages;
use glam::{Vec3, Vec4};
use rayon::prelude::*;
use std::time::Instant;

/// Particles that one task of a simple pass takes at least.
pub(crate) const TASK: usize = 2048;
/// Fastest particle in particle spacings a second that still counts as water.
const RUNAWAY: f32 = 1e7;

/// State of the particles as plain arrays in the order of their cells. The fourth component of vectors is unused, so
/// that a neighbour arrives in one load.
#[derive(Debug, Default)]
pub(crate) struct Particles {
    pub(crate) position: Vec<Vec4>,
    pub(crate) velocity: Vec<Vec4>,
    /// Pressure over density in the last step, m²/s².
    pub(crate) pressure: Vec<f32>,
    /// What pushed compressed particles apart in the last step, m².
    pub(crate) shift: Vec<f32>,
}

/// What a step computes for each particle; lists said to have images hold theirs behind the particles'.
#[derive(Debug, Default)]
pub(crate) struct Work {
    /// Positions at the start of the step, with images.
    pub(crate) place: Vec<Vec4>,
    /// Velocities, with images.
    pub(crate) flow: Vec<Vec4>,
    /// Density over rest density.
    pub(crate) density: Vec<f32>,
    pub(crate) local: Vec<Local>,
    pub(crate) inverse: Vec<[f32; 2]>,
    pub(crate) touch: Vec<Touch>,
    pub(crate) gradient: Vec<Gradient>,
    /// Changes of velocity, then displacements.
    pub(crate) change: Vec<Vec4>,
    /// What the motion of bodies takes from the rates of compression.
    pub(crate) carried: Carried,
    pub(crate) buffers: Buffers,
    pub(crate) fields: mcg03::Fields,
    pub(crate) residual: Vec<Vec4>,
    pub(crate) direction: Vec<Vec4>,
    pub(crate) product: Vec<Vec4>,
    spare4: Vec<Vec4>,
    spare: Vec<f32>,
}

/// What one sub-step did.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Stepped {
    /// Iterations of the density and of the divergence solver.
    pub iterations: [u32; 2],
    /// Mean compression at the start of the step, relative.
    pub compression: f64,
    /// Mean rate of compression, or of what a pressure too high opens, that the divergence solver left, 1/s.
    pub divergence: f64,
    /// Iterations of the viscosity solver.
    pub viscous: u32,
    /// Whether a solver stopped at its largest number of iterations.
    pub stalled: bool,
}

/// Water as particles, with everything that a step needs.
#[derive(Debug)]
pub struct Fluid {
    pub(crate) settings: Settings,
    pub(crate) boundary: Boundary,
    pub(crate) particles: Particles,
    pub(crate) kernel: CubicSpline,
    pub(crate) muller: Muller,
    table: WallTable,
    pub(crate) cells: Cells,
    pub(crate) mirrors: Mirrors,
    pub(crate) neighbours: Neighbours,
    pub(crate) work: Work,
    pub(crate) floating: Floating,
    /// Where the time of steps went since this was cleared.
    pub(crate) stages: Stages,
    /// The neighbours are those of the present positions.
    fresh: bool,
}

impl Fluid {
    /// Water within `boundary`.
    pub fn new(settings: Settings, boundary: Boundary) -> Self {
        let kernel = CubicSpline::of_lattice(settings.support(), settings.spacing);
        Self {
            table: WallTable::new(&kernel, settings.spacing),
            muller: Muller::new(settings.support()),
            kernel,
            settings,
            boundary,
            particles: Particles::default(),
            cells: Cells::default(),
            mirrors: Mirrors::default(),
            neighbours: Neighbours::default(),
            work: Work::default(),
            floating: Floating::default(),
            stages: Stages::default(),
            fresh: false,
        }
    }

    /// Adds a particle.
    pub fn add(&mut self, position: Vec3, velocity: Vec3) {
        self.particles.position.push(position.extend(0.0));
        self.particles.velocity.push(velocity.extend(0.0));
        self.particles.pressure.push(0.0);
        self.particles.shift.push(0.0);
        self.fresh = false;
    }

    /// Removes the particles of which `gone` says so, in the order of the others. Returns how many there were.
    pub fn remove(&mut self, gone: impl Fn(Vec3) -> bool) -> usize {
        let before = self.len();
        let p = &mut self.particles;
        let mut kept = 0;
        for k in 0..before {
            if !gone(p.position[k].truncate()) {
                p.position[kept] = p.position[k];
                p.velocity[kept] = p.velocity[k];
                p.pressure[kept] = p.pressure[k];
                p.shift[kept] = p.shift[k];
                kept += 1;
            }
        }
        if kept < before {
            p.position.truncate(kept);
            p.velocity.truncate(kept);
            p.pressure.truncate(kept);
            p.shift.truncate(kept);
            self.fresh = false;
        }
        before - kept
    }

    /// Number of particles.
    pub fn len(&self) -> usize {
        self.particles.position.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Positions in metres; the fourth component means nothing.
    pub fn positions(&self) -> &[Vec4] {
        &self.particles.position
    }

    /// Velocities in m/s, in the order of [`Self::positions`].
    pub fn velocities(&self) -> &[Vec4] {
        &self.particles.velocity
    }

    /// Velocities, to be changed.
    pub fn velocities_mut(&mut self) -> &mut [Vec4] {
        &mut self.particles.velocity
    }

    /// Pressure over rest density about particle `k` in the last step, m²/s²: the mean of it and its neighbours with the
    /// weights of the kernel. What single particles have besides averages out within one spacing and moves nothing.
    pub fn pressure(&self, k: usize) -> f64 {
        let (place, pressure) = (&self.work.place, &self.particles.pressure);
        let images = self.mirrors.len();
        // As many as there were when they were sorted last.
        let Some(n) = place
            .len()
            .checked_sub(images)
            .filter(|n| k < *n && *n <= pressure.len())
        else {
            return 0.0;
        };
        let p = place[k].truncate();
        let (mut sum, mut weight) = (0.0, 0.0);
        let mut add = |j: usize| {
            let w = self.kernel.at((p - place[j].truncate()).length());
            sum += w * pressure[self.mirrors.behind(j, n).0];
            weight += w;
        };
        self.cells.runs_around(p).iter().flatten().for_each(&mut add);
        if images > 0 {
            let beyond = self.mirrors.cells.runs_around(p);
            beyond.iter().flatten().for_each(|j| add(n + j));
        }
        f64::from(sum / weight)
    }

    /// Pressure over rest density at a place, m²/s²: the mean over the particles about it with the weights of the kernel, 0
    /// where there is none.
    pub fn pressure_at(&self, at: Vec3) -> f64 {
        let (mut sum, mut weight) = (0.0, 0.0);
        for (p, &pressure) in self.particles.position.iter().zip(&self.particles.pressure) {
            let w = f64::from(self.kernel.at((p.truncate() - at).length()));
            sum += w * f64::from(pressure);
            weight += w;
        }
        if weight > 0.0 { sum / weight } else { 0.0 }
    }

    /// Density over rest density at the positions before the last step.
    pub fn densities(&self) -> &[f32] {
        &self.work.density[..self.len().min(self.work.density.len())]
    }

    /// What it was told.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// Tilts gravity, m/s².
    pub fn set_gravity(&mut self, gravity: Vec3) {
        self.settings.gravity = gravity;
    }

    /// What water cannot pass.
    pub fn boundary(&self) -> &Boundary {
        &self.boundary
    }

    /// Moves obstacles.
    pub fn boundary_mut(&mut self) -> &mut Boundary {
        &mut self.boundary
    }

    /// Bodies that the water moves. Every step changes their velocities, and the caller moves them and their obstacles.
    pub fn floats(&self) -> &[Float] {
        &self.floating.floats
    }

    /// Says what the water moves; the obstacles named are no longer known by their own motion.
    pub fn set_floats(&mut self, floats: impl IntoIterator<Item = Float>) {
        self.floating.floats.clear();
        self.floating.floats.extend(floats);
        for body in &self.floating.floats {
            if let Some(obstacle) = self.boundary.obstacles.get_mut(body.obstacle) {
                obstacle.floats = true;
            }
        }
        self.fresh = false;
    }

    /// Mass of a particle in kg.
    pub fn particle_mass(&self) -> f64 {
        f64::from(self.settings.density) * f64::from(self.settings.spacing).powi(3)
    }

    /// Largest speed in m/s; NaN or infinite if any is.
    pub fn fastest(&self) -> f32 {
        let v = &self.particles.velocity;
        let square = |k: usize| f64::from(v[k].truncate().length_squared());
        reduce::arg_max(v.len(), square).map_or(0.0, |(_, s)| s.sqrt() as f32)
    }

    /// The particle that left what water can do, with its speed, if any did.
    pub(crate) fn runaway(&self) -> Option<(usize, f32)> {
        let limit = RUNAWAY * self.settings.spacing;
        let speed = |k: usize| self.particles.velocity[k].truncate().length();
        let lost = |k: usize| !(speed(k) < limit) || !self.particles.position[k].truncate().is_finite();
        let found = reduce::arg_max(self.len(), |k| f64::from(u8::from(lost(k))));
        found.filter(|f| f.1 > 0.0).map(|(k, _)| (k, speed(k)))
    }

    /// Largest speed that counts as water, m/s.
    pub(crate) fn speed_limit(&self) -> f32 {
        RUNAWAY * self.settings.spacing
    }

    /// Longest stable sub-step in seconds for the present state.
    pub fn stable_step(&self) -> f64 {
        let mut speed = self.fastest();
        for obstacle in &self.boundary.obstacles {
            speed = speed.max(obstacle.fastest());
        }
        let pressure = &self.particles.pressure;
        let head = reduce::arg_max(pressure.len(), |k| f64::from(pressure[k])).map_or(0.0, |p| p.1);
        self.settings
            .stable_step(speed)
            .min(self.settings.stable_under(head))
    }

    /// Sorts the particles and finds their neighbours, unless that was done since they last moved.
    pub(crate) fn refresh(&mut self) {
        if self.fresh {
            return;
        }
        let free = free(&self.boundary, self.table.reach());
        let (p, work) = (&mut self.particles, &mut self.work);
        match self.settings.model {
            Model::Dfsph => self.cells.sort(&p.position, self.settings.support()),
            Model::Mcg03 => self.cells.sort_in_layers(&p.position, self.settings.support()),
        }
        self.cells.reorder(&mut p.position, &mut work.spare4);
        self.cells.reorder(&mut p.velocity, &mut work.spare4);
        self.cells.reorder(&mut p.pressure, &mut work.spare);
        self.cells.reorder(&mut p.shift, &mut work.spare);
        let n = p.position.len();
        // The paper's model has no images: its forces are not the gradient of its density, and a particle pushed by its
        // own image gains energy.
        let mirrors = self.settings.model == Model::Dfsph;
        let images = if mirrors { &p.position[..] } else { &[] };
        self.mirrors.find(&self.boundary, images, self.settings.support());
        work.place.clear();
        work.place.extend_from_slice(&p.position);
        work.place.extend_from_slice(&self.mirrors.position);
        work.touch.resize(n, Touch::default());
        let (table, boundary) = (&self.table, &self.boundary);
        let sticks = self.settings.sticks && self.settings.viscosity > 0.0;
        work.touch
            .par_iter_mut()
            .with_min_len(TASK)
            .zip(&p.position)
            .for_each(|(touch, p)| {
                let p = p.truncate();
                *touch = if free.as_ref().is_some_and(|free| free.holds(p)) {
                    Touch::default()
                } else {
                    table.touch(boundary, p, sticks, mirrors)
                };
            });
        work.density.resize(n, 0.0);
        work.local.resize(n, Local::default());
        work.inverse.resize(n, [0.0; 2]);
        work.change.resize(n, Vec4::ZERO);
        match self.settings.model {
            Model::Dfsph => dfsph::prepare(self),
            Model::Mcg03 => mcg03::prepare(self),
        }
        let (work, positions) = (&self.work, &self.particles.position);
        let share = |i: usize| work.touch[i].share;
        self.floating
            .find(&self.boundary, &self.table, positions, share, sticks);
        if mirrors {
            self.floating.correct(&work.local);
        }
        self.fresh = true;
    }

    /// Takes one sub-step of `dt` seconds, which the caller has kept below [`Self::stable_step`].
    pub fn step(&mut self, dt: f32) -> Stepped {
        self.floating.fall(self.settings.gravity, dt);
        if self.is_empty() {
            return Stepped::default();
        }
        let mut clock = Instant::now();
        self.refresh();
        self.stages.lap("neighbours", &mut clock);
        let n = self.len();
        let mut flow = std::mem::take(&mut self.work.flow);
        flow.clear();
        flow.extend_from_slice(&self.particles.velocity);
        self.mirrors.extend_vectors(&mut flow, n);
        self.work.flow = flow;
        let mass = self.particle_mass();
        let stepped = match self.settings.model {
            Model::Dfsph => {
                let mut stepped = Stepped::default();
                noise::damp(self, dt);
                let gravity = (self.settings.gravity * dt).extend(0.0);
                self.work.flow[..n]
                    .par_iter_mut()
                    .with_min_len(TASK)
                    .for_each(|v| *v += gravity);
                stepped.viscous = viscosity::apply(self, dt);
                self.mirrors.extend_vectors(&mut self.work.flow, n);
                self.stages.lap("viscosity", &mut clock);
                dfsph::remove_divergence(self, dt, &mut stepped);
                self.stages.lap("velocities", &mut clock);
                dfsph::keep_density(self, dt, &mut stepped);
                self.stages.lap("displacements", &mut clock);
                stepped
            }
            Model::Mcg03 => {
                let stepped = mcg03::accelerate(self, dt);
                let (pressure, density) = (&self.particles.pressure, &self.work.density);
                self.floating
                    .react(mass, |i, gradient| 0.5 * dt * pressure[i] / density[i] * gradient);
                self.stages.lap("forces", &mut clock);
                stepped
            }
        };
        if self.settings.sticks && !self.floating.floats.is_empty() {
            self.floating
                .drag(&self.work.flow, mass, self.settings.viscosity * dt);
        }
        self.floating.tell(&mut self.boundary);
        self.move_on(dt);
        self.stages.lap("motion", &mut clock);
        stepped
    }

    /// Moves the particles with their velocities and displacements, and back where they passed a boundary.
    fn move_on(&mut self, dt: f32) {
        let (work, positions) = (&self.work, &self.particles.position);
        let step = |i: usize| {
            let v = work.flow[i].truncate();
            ((positions[i] + work.change[i]).truncate() + dt * v, v)
        };
        let mass = self.particle_mass();
        self.floating.bounce(&self.boundary, mass, step);
        let (boundary, spacing) = (&self.boundary, self.settings.spacing);
        let free = free(&self.boundary, Boundary::gap(spacing));
        let p = &mut self.particles;
        p.position
            .par_iter_mut()
            .zip(&mut p.velocity)
            .with_min_len(TASK)
            .zip(&self.work.flow)
            .zip(&self.work.change)
            .for_each(|(((position, velocity), flow), change)| {
                let mut v = flow.truncate();
                let mut x = (*position + *change).truncate() + dt * v;
                if !free.as_ref().is_some_and(|free| free.holds(x)) {
                    boundary.confine(spacing, &mut x, &mut v);
                }
                *velocity = v.extend(0.0);
                *position = x.extend(0.0);
            });
        self.fresh = false;
    }

    /// Bytes held.
    pub fn bytes(&self) -> u64 {
        let (p, w) = (&self.particles, &self.work);
        let fours = [
            &p.position,
            &p.velocity,
            &w.place,
            &w.flow,
            &w.change,
            &w.residual,
            &w.direction,
            &w.product,
            &w.spare4,
        ];
        let ones = [&p.pressure, &p.shift, &w.density, &w.spare];
        let own: usize = fours.iter().map(|v| 16 * v.capacity()).sum::<usize>()
            + ones.iter().map(|v| 4 * v.capacity()).sum::<usize>()
            + size_of::<Touch>() * w.touch.capacity()
            + size_of::<Local>() * w.local.capacity()
            + size_of::<Gradient>() * w.gradient.capacity()
            + 8 * w.inverse.capacity()
            + w.carried.bytes()
            + w.buffers.bytes()
            + w.fields.bytes()
            + self.mirrors.bytes()
            + self.floating.bytes();
        (own + self.cells.bytes() + self.neighbours.bytes()) as u64
    }
}

/// Where no boundary is within `reach`, as far as that is quickly known.
fn free(boundary: &Boundary, reach: f32) -> Option<Inner> {
    // A little more, so that rounding loses nothing.
    let reach = 1.01 * reach;
    boundary.obstacles.is_empty().then(|| Inner::new(boundary, reach))
}
