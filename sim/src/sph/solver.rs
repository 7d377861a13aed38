//! The solver of a scene: sub-steps, obstacles on their paths, pouring, frames.

use super::actions;
use super::boundary::{Boundary, Ground, Outline};
use super::extract::{Extractor, Root};
use super::fluid::Fluid;
use super::jets::{self, Jet};
use super::obstacle::Obstacle;
use super::settings::{Model, Settings};
use crate::events::{Action, EventError};
use crate::frame::{Channels, Frame};
use crate::grid::{Grid, GridSpec};
use crate::scene::Scene;
use crate::scene::description::{
    self, Drain, Edge, Initial, Motion, Object, SphDroplets, SphModel, SphSurface, SphWalls, Tilt, Vessel,
};
use crate::solver::{Solver, StepError, StepReport};
use crate::solvers::{BuildError, name_of};
use glam::{Vec2, Vec3};
use std::sync::{Mutex, PoisonError};

/// Sub-steps of one call at most, unless the scene says so.
const MOST_STEPS: u64 = 100_000;
/// Particles at most: some 1 KiB each.
const MOST_PARTICLES: f64 = 2e7;
/// Distances of a fall that `mcg03` may compress: the speed of sound is ten times that of a fall from the surface.
const MACH: f32 = 100.0;

/// Water in a tank as particles.
pub struct Sph {
    spec: GridSpec,
    fluid: Fluid,
    ground: Grid<f32>,
    extractor: Mutex<Extractor>,
    all_droplets: bool,
    objects: Vec<Object>,
    tilts: Vec<Tilt>,
    gravity: Vec3,
    jets: Vec<Jet>,
    drains: Vec<Drain>,
    /// Whether an edge lets water out.
    open: bool,
    most_steps: u64,
    time: f64,
}

impl Sph {
    /// The solver of a scene with `solver.kind = "sph"`: the tank is the domain, its bottom the terrain.
    ///
    /// # Errors
    /// [`BuildError`] if the scene asks for another solver, has no terrain, periodic edges or bodies that float, or
    /// needs too many particles.
    pub fn from_scene(scene: &Scene) -> Result<Self, BuildError> {
        let description::Solver::Sph(parameters) = &scene.description.solver else {
            return Err(BuildError::WrongSolver {
                expected: "sph",
                found: name_of(&scene.description.solver),
            });
        };
        let spec = scene.grid;
        let Some(ground) = scene.ground_on_grid() else {
            return Err(BuildError::impossible(
                "terrain",
                "a tank needs a bottom, and the scene has no terrain",
                "add a `[terrain]` table; `kind = \"flat\"` makes a level bottom",
            ));
        };
        let boundary = boundary(scene, &ground, parameters)?;
        let surface = surface(scene);
        let settings = settings(parameters, spec, &ground, &surface);
        let room = volume(&spec, &ground, &surface) / f64::from(settings.spacing).powi(3);
        if room > MOST_PARTICLES {
            return Err(BuildError::impossible(
                "solver.particle",
                format!("the water would be {room:.1e} particles, more than {MOST_PARTICLES:.0e}"),
                format!(
                    "use particles {:.1} times as far apart",
                    (room / MOST_PARTICLES).cbrt() * 1.05
                ),
            ));
        }
        let root = match parameters.surface {
            SphSurface::Fast => Root::Fast,
            SphSurface::Exact => Root::Exact,
        };
        let spacing = settings.spacing;
        let mut solver = Self {
            spec,
            extractor: Mutex::new(Extractor::new(spec, spacing, root)),
            open: boundary.walls.contains(&false) && boundary.outline == Outline::Box,
            fluid: Fluid::new(settings, boundary),
            all_droplets: parameters.droplets == SphDroplets::All,
            objects: scene.description.objects.clone(),
            tilts: parameters.tilts.clone(),
            gravity: parameters.gravity,
            jets: parameters
                .emitters
                .iter()
                .map(|e| Jet::new(*e, spacing))
                .collect(),
            drains: parameters.drains.clone(),
            most_steps: parameters.most_steps.map_or(MOST_STEPS, |n| n as u64),
            ground,
            time: 0.0,
        };
        solver.fill(&surface);
        Ok(solver)
    }

    /// The particles.
    pub fn fluid(&self) -> &Fluid {
        &self.fluid
    }

    /// Tilts gravity from now on, m/s²; later turns of the scene still come.
    pub fn tilt(&mut self, gravity: Vec3) {
        self.gravity = gravity;
        self.fluid.set_gravity(gravity);
    }

    /// Drags object `k` of the scene to `position` within the next `duration` seconds, in place of its own motion.
    /// Returns whether there is such an object.
    pub fn drag(&mut self, k: usize, position: Vec3, duration: f64) -> bool {
        let Some(object) = self.objects.get_mut(k) else {
            return false;
        };
        let pose = object.pose_at(self.time);
        let point = |time, position| description::WayPoint {
            time,
            position,
            rotation: pose.rotation,
        };
        object.motion = Motion::Path {
            points: vec![
                point(self.time, pose.position),
                point(self.time + duration.max(1e-6), position),
            ],
        };
        true
    }

    /// Lays a lattice of particles into every column up to `surface`, clear of obstacles.
    fn fill(&mut self, surface: &dyn Fn(Vec2) -> f32) {
        let d = self.fluid.settings().spacing;
        let (low, high) = (self.spec.origin, self.spec.origin + self.spec.extent());
        let count = |length: f32| ((length / d).round() as usize).max(1);
        let (nx, nz) = (count(high.x - low.x), count(high.y - low.y));
        // Stretched along X and Z so that the lattice fits the tank from wall to wall (a thin tank gets one layer), and
        // along Y the other way, so that each particle stands for its own volume.
        let height = d * d * d * (nx * nz) as f32 / ((high.x - low.x) * (high.y - low.y));
        let place =
            |k: usize, n: usize, low: f32, high: f32| low + (k as f32 + 0.5) * (high - low) / n as f32;
        let centre = 0.5 * (low + high);
        let round = (self.fluid.boundary().outline == Outline::Round)
            .then(|| 0.5 * (high - low).min_element() - 0.4 * d);
        let bottom = self.ground.range().0;
        let mut top = bottom;
        for j in 0..nz {
            for i in 0..nx {
                let at = Vec2::new(place(i, nx, low.x, high.x), place(j, nz, low.y, high.y));
                top = top.max(surface(at));
            }
        }
        let layers = ((top - bottom) / height).ceil().max(0.0) as usize;
        for k in 0..layers {
            let y = bottom + height * (k as f32 + 0.5);
            for j in 0..nz {
                for i in 0..nx {
                    let at = Vec2::new(place(i, nx, low.x, high.x), place(j, nz, low.y, high.y));
                    let p = Vec3::new(at.x, y, at.y);
                    let ground = self.fluid.boundary().ground_at(p).map_or(bottom, |g| g.0);
                    let clear = |o: &Obstacle| o.near(p, 0.4 * d).is_none();
                    let inside = y < surface(at)
                        && y - ground > 0.4 * d
                        && round.is_none_or(|r| at.distance(centre) < r)
                        && self.fluid.boundary().obstacles.iter().all(clear);
                    if inside {
                        self.fluid.add(p, Vec3::ZERO);
                    }
                }
            }
        }
    }

    fn gravity_at(&self, time: f64) -> Vec3 {
        let next = self.tilts.partition_point(|t| t.time <= time);
        let before = next.checked_sub(1).map(|k| self.tilts[k]);
        match (before, self.tilts.get(next)) {
            (None, None) => self.gravity,
            (Some(last), None) => last.gravity,
            (None, Some(first)) => {
                let share = (time / first.time.max(1e-9)).clamp(0.0, 1.0);
                self.gravity.lerp(first.gravity, share as f32)
            }
            (Some(a), Some(b)) => {
                let share = (time - a.time) / (b.time - a.time);
                a.gravity.lerp(b.gravity, share as f32)
            }
        }
    }

    fn place_obstacles(&mut self, time: f64) {
        for (obstacle, object) in self.fluid.boundary_mut().obstacles.iter_mut().zip(&self.objects) {
            obstacle.pose = object.pose_at(time);
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
        Channels::DEPTH | Channels::VELOCITY | Channels::DROPLETS
    }

    fn advance(&mut self, dt: f32) -> Result<StepReport, StepError> {
        StepError::check_step(dt)?;
        let (start, dt) = (self.time, f64::from(dt));
        let mut done = 0.0;
        let mut steps = 0_u64;
        let (mut courant, mut stalls) = (0.0_f64, 0);
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
            for jet in &mut self.jets {
                jet.pour(&mut self.fluid, self.time, step);
            }
            self.fluid.set_gravity(self.gravity_at(self.time));
            let stepped = self.fluid.step(step as f32);
            stalls += u64::from(stepped.stalled);
            courant = courant
                .max(f64::from(self.fluid.fastest()) * step / f64::from(self.fluid.settings().spacing));
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
        }
        self.place_obstacles(self.time);
        Ok(StepReport {
            substeps: u32::try_from(steps).unwrap_or(u32::MAX),
            courant,
            clamps: stalls,
            ..self.report()
        })
    }

    fn extract(&self, want: Channels, out: &mut Frame) {
        // A panic elsewhere leaves buffers that are filled anew anyway.
        let mut extractor = self.extractor.lock().unwrap_or_else(PoisonError::into_inner);
        extractor.extract(&self.fluid, &self.ground, want, self.all_droplets, out);
        out.time = self.time;
    }

    fn apply(&mut self, action: &Action) -> Result<(), EventError> {
        actions::apply(&mut self.fluid, action)
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

    fn bytes(&self) -> u64 {
        let extractor = self.extractor.lock().unwrap_or_else(PoisonError::into_inner);
        self.fluid.bytes() + extractor.bytes() + 4 * self.ground.as_slice().len() as u64
    }
}

/// Elevation of the water at time 0.
fn surface(scene: &Scene) -> impl Fn(Vec2) -> f32 {
    let water = scene.description.water.clone();
    let array = scene.initial_elevation.clone();
    move |at: Vec2| match &water.initial {
        Initial::Still => water.level,
        Initial::Dam { min, max, level } => {
            let inside = at.cmpge(*min).all() && at.cmple(*max).all();
            if inside { *level } else { water.level }
        }
        Initial::Disturbance {
            position,
            radius,
            height,
        } => water.level + height * (-0.5 * at.distance_squared(*position) / (radius * radius)).exp(),
        Initial::Array { .. } => array.as_ref().map_or(water.level, |a| a.sample(at)),
    }
}

/// Volume of the water at time 0 in m³, from the samples.
fn volume(spec: &GridSpec, ground: &Grid<f32>, surface: &dyn Fn(Vec2) -> f32) -> f64 {
    let extent = spec.extent().as_dvec2();
    let mut depth = 0.0;
    for j in 0..spec.height() {
        for i in 0..spec.width() {
            depth += f64::from((surface(spec.position(i, j)) - ground[(i, j)]).max(0.0));
        }
    }
    depth / spec.len() as f64 * extent.x * extent.y
}

fn settings(
    parameters: &description::Sph,
    spec: GridSpec,
    ground: &Grid<f32>,
    surface: &dyn Fn(Vec2) -> f32,
) -> Settings {
    let spacing = parameters.particle.unwrap_or(2.0 * parameters.spacing);
    let model = match parameters.model {
        SphModel::Dfsph => Model::Dfsph,
        SphModel::Mcg03 => Model::Mcg03,
    };
    let mut depth = spacing;
    for j in 0..spec.height() {
        for i in 0..spec.width() {
            depth = depth.max(surface(spec.position(i, j)) - ground[(i, j)]);
        }
    }
    let base = Settings::water(spacing);
    Settings {
        model,
        gravity: parameters.gravity,
        viscosity: parameters.viscosity,
        surface_tension: parameters.surface_tension,
        sticks: parameters.walls == SphWalls::Stick,
        stiffness: parameters
            .stiffness
            .unwrap_or(MACH * parameters.gravity.length() * depth),
        courant: parameters.courant.unwrap_or(base.courant),
        step: parameters.step.unwrap_or(f32::INFINITY),
        ..base
    }
}

fn boundary(
    scene: &Scene,
    ground: &Grid<f32>,
    parameters: &description::Sph,
) -> Result<Boundary, BuildError> {
    let d = &scene.description;
    let edges = [
        ("x_min", d.boundary.x_min),
        ("x_max", d.boundary.x_max),
        ("z_min", d.boundary.z_min),
        ("z_max", d.boundary.z_max),
    ];
    if let Some((edge, _)) = edges.iter().find(|e| e.1 == Edge::Periodic) {
        return Err(BuildError::impossible(
            format!("boundary.{edge}"),
            "a tank of particles has no periodic edges",
            "use \"wall\", or \"open\" with an emitter at the other end",
        ));
    }
    if let Some(body) = d.objects.iter().find(|o| o.motion == Motion::Free) {
        return Err(BuildError::impossible(
            format!("object `{}`: motion", body.name),
            "this solver cannot float bodies",
            "use motion kind \"fixed\" or \"path\"",
        ));
    }
    let spacing = parameters.particle.unwrap_or(2.0 * parameters.spacing);
    let (low, high) = ground.range();
    Ok(Boundary {
        low: scene.grid.origin,
        high: scene.grid.origin + scene.grid.extent(),
        walls: edges.map(|e| e.1 == Edge::Wall),
        outline: match parameters.vessel {
            Vessel::Box => Outline::Box,
            Vessel::Round => Outline::Round,
        },
        ground: if low == high {
            Ground::Flat(low)
        } else {
            Ground::Heights(ground.clone())
        },
        obstacles: d
            .objects
            .iter()
            .zip(&scene.meshes)
            .map(|(object, mesh)| Obstacle::of_object(object, mesh, spacing))
            .collect(),
    })
}
