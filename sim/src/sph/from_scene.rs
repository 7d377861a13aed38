//! The solver that a scene asks for: its tank, its water as a lattice, what it is told.

use super::boundary::{Boundary, Ground, Outline};
use super::extract::{Extractor, Root};
use super::floats::Floats;
use super::fluid::Fluid;
use super::jets::Jet;
use super::led::Led;
use super::obstacle::Obstacle;
use super::settings::{Model, Settings};
use super::solver::Sph;
use crate::grid::{Grid, GridSpec};
use crate::scene::Scene;
use crate::scene::description::{
    self, Edge, Initial, SphDroplets, SphModel, SphSurface, SphWalls, Tilt, Vessel,
};
use crate::solvers::{BuildError, name_of};
use glam::{Vec2, Vec3};
use std::sync::Mutex;

/// Sub-steps of one call at most, unless the scene says so.
const MOST_STEPS: u64 = 100_000;
/// Particles at most: some 1 KiB each.
const MOST_PARTICLES: f64 = 2e7;
/// Distances of a fall that `mcg03` may compress: the speed of sound is ten times that of a fall from the surface.
const MACH: f32 = 100.0;
/// Least viscosity of `mcg03`, over kernel support and speed of sound: its forces are not the gradient of an energy, and with
/// less they heat the water (measured: docs/numerics-sph.md).
const LEAST_VISCOSITY: f32 = 0.007;

impl Sph {
    /// The solver of a scene with `solver.kind = "sph"`: the tank is the domain, its bottom the terrain.
    ///
    /// # Errors
    /// [`BuildError`] if the scene asks for another solver, has no terrain, periodic edges or an object that cannot be a
    /// body, or needs too many particles.
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
        let floats = Floats::from_scene(scene, boundary.outline)?;
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
            led: Led::new(scene.description.objects.clone()),
            floats,
            turns: turns(parameters),
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
        solver.floats.place(&mut solver.fluid);
        solver.fill(&surface);
        Ok(solver)
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
}

/// Turns of gravity, from the one at the start.
fn turns(parameters: &description::Sph) -> Vec<Tilt> {
    let start = Tilt {
        time: 0.0,
        gravity: parameters.gravity,
    };
    std::iter::once(start)
        .chain(parameters.tilts.iter().copied())
        .collect()
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
    let stiffness = parameters
        .stiffness
        .unwrap_or(MACH * parameters.gravity.length() * depth);
    let least = match model {
        Model::Dfsph => 0.0,
        Model::Mcg03 => LEAST_VISCOSITY * base.support() * stiffness.sqrt(),
    };
    Settings {
        model,
        gravity: parameters.gravity,
        viscosity: parameters.viscosity.max(least),
        surface_tension: parameters.surface_tension,
        sticks: parameters.walls == SphWalls::Stick,
        stiffness,
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
