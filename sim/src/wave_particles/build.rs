//! From a scene to a solver, and to and from a checkpoint.

use super::flight::{Beyond, Course};
use super::hull::Wake;
use super::ledger::Ledger;
use super::particle::Particles;
use super::sources::{Emission, Maker};
use super::surface::Surface;
use super::walls::{Segment, Walls};
use super::{Mover, WaveParticles, shore};
use crate::events::EventError;
use crate::grid::GridSpec;
use crate::mesh::TriangleMesh;
use crate::reduce;
use crate::scene::Scene;
use crate::scene::description::{self, Edge, Initial, Motion, WaveFront};
use crate::solvers::{BuildError, GRAVITY, name_of};
use glam::DVec2;
use serde::{Deserialize, Serialize};

/// Radius in samples of the particles that objects make, unless the scene says otherwise.
const DEFAULT_RADIUS: f32 = 4.0;

/// The state of a run as plain data, for restarts of a solver made from the same scene.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Checkpoint {
    spec: GridSpec,
    time: f64,
    speed: f64,
    wakes: u64,
    events: u64,
    ledger: Ledger,
    particles: Particles,
    pending: Vec<(f64, Emission)>,
}

/// Why a checkpoint cannot be restored.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum RestoreError {
    /// It is of another scene.
    #[error(
        "the checkpoint is of other waters ({what}); make the solver from the scene that it was taken of"
    )]
    OtherScene {
        /// What differs.
        what: &'static str,
    },
    /// It holds what no state does.
    #[error("the checkpoint holds a number that no state does; the file is damaged")]
    Damaged,
}

fn positive(key: &str, value: f32, unit: &str) -> Result<f64, BuildError> {
    if value.is_finite() && value > 0.0 {
        Ok(f64::from(value))
    } else {
        Err(BuildError::impossible(
            key,
            format!("{value} {unit} is not positive"),
            format!("give a positive number of {unit}"),
        ))
    }
}

fn whole(key: &str, value: f32, most: f32) -> Result<usize, BuildError> {
    if value.fract() == 0.0 && (1.0..=most).contains(&value) {
        Ok(value as usize)
    } else {
        Err(BuildError::impossible(
            key,
            format!("{value} is not a count"),
            format!("give a whole number from 1 to {most}"),
        ))
    }
}

/// Refuses what is no front.
pub(super) fn check_front(front: &WaveFront) -> Result<(), EventError> {
    let impossible = |quantity, value, remedy| EventError::Impossible {
        action: "front",
        quantity,
        value,
        remedy,
    };
    for (quantity, value) in [
        ("time", front.time as f32),
        ("position x", front.position.x),
        ("position z", front.position.y),
        ("direction", front.direction),
        ("spread", front.spread),
        ("height", front.height),
    ] {
        if !value.is_finite() {
            return Err(impossible(quantity, value, "it must be a finite number"));
        }
    }
    if front.spread.abs() > 360.0 {
        return Err(impossible(
            "spread",
            front.spread,
            "a front spans at most 360 degrees",
        ));
    }
    for (quantity, value) in [("width", front.width), ("radius", front.radius)] {
        if !(value.is_finite() && value > 0.0) {
            return Err(impossible(
                quantity,
                value,
                "it must be a positive length in metres",
            ));
        }
    }
    Ok(())
}

/// Water and walls of a scene.
struct Waters {
    wet: Vec<bool>,
    segments: Vec<Segment>,
    /// Mean depth of the water, metres.
    depth: f64,
}

fn mesh_of(scene: &Scene, number: usize) -> Result<&TriangleMesh, BuildError> {
    scene.meshes.get(number).ok_or_else(|| {
        BuildError::impossible(
            format!("object `{}`", scene.description.objects[number].name),
            "its geometry is not loaded",
            "load the scene with `Scene::load`",
        )
    })
}

fn waters(scene: &Scene, depth: f64) -> Result<Waters, BuildError> {
    let spec = scene.grid;
    let boundary = &scene.description.boundary;
    let level = scene.description.water.level;
    let mut segments = shore::edges(&spec, boundary);
    let mut wet = vec![true; spec.len()];
    let mut mean = depth;
    if let Some(ground) = scene.ground_on_grid() {
        let below: Vec<f32> = ground.as_slice().iter().map(|g| level - g).collect();
        if let Some(k) = below.iter().position(|d| !d.is_finite()) {
            return Err(BuildError::impossible(
                "terrain",
                format!(
                    "the depth at sample ({}, {}) is {}",
                    k % spec.width(),
                    k / spec.width(),
                    below[k]
                ),
                "every height must be a finite number",
            ));
        }
        let wrap = [boundary.x_min == Edge::Periodic, boundary.z_min == Edge::Periodic];
        segments.extend(shore::waterline(&spec, &below, wrap));
        let sum = reduce::sum(below.len(), |k| f64::from(below[k].max(0.0)));
        let count = reduce::sum(below.len(), |k| if below[k] > 0.0 { 1.0 } else { 0.0 });
        if count == 0.0 {
            return Err(BuildError::impossible(
                "terrain",
                format!("the ground is nowhere below the water at {level} m"),
                "lower the ground or raise water.level",
            ));
        }
        mean = sum / count;
        for (wet, d) in wet.iter_mut().zip(&below) {
            *wet = *d > 0.0;
        }
    }
    for (number, object) in scene.description.objects.iter().enumerate() {
        match object.motion {
            Motion::Fixed => {}
            // What moves makes waves, but does not stand in one place long enough to reflect them.
            Motion::Path { .. } | Motion::Free => continue,
        }
        let mesh = mesh_of(scene, number)?;
        let outline = shore::outline(mesh, object.position, object.rotation, f64::from(level));
        let mut inside = vec![false; spec.len()];
        shore::fill(&spec, &outline, &mut inside);
        for (wet, inside) in wet.iter_mut().zip(inside) {
            *wet &= !inside;
        }
        segments.extend(outline);
    }
    Ok(Waters {
        wet,
        segments,
        depth: mean,
    })
}

impl WaveParticles {
    /// The solver of a scene with `solver.kind = "wave-particles"`, in its initial state.
    ///
    /// # Errors
    /// [`BuildError`] for impossible values and initial states that are no waves.
    pub fn from_scene(scene: &Scene) -> Result<Self, BuildError> {
        let description::Solver::WaveParticles(p) = &scene.description.solver else {
            return Err(BuildError::WrongSolver {
                expected: "wave-particles",
                found: name_of(&scene.description.solver),
            });
        };
        let spec = scene.grid;
        let boundary = &scene.description.boundary;
        let edges = [boundary.x_min, boundary.x_max, boundary.z_min, boundary.z_max];
        for (pair, names) in [(0, "x_min and x_max"), (2, "z_min and z_max")] {
            if (edges[pair] == Edge::Periodic) != (edges[pair + 1] == Edge::Periodic) {
                return Err(BuildError::impossible(
                    "boundary",
                    format!("only one of {names} is periodic"),
                    "make both periodic or neither",
                ));
            }
        }
        let waters = waters(scene, positive("solver.depth", p.depth, "m")?)?;
        let speed = match p.speed {
            Some(speed) => positive("solver.speed", speed, "m/s")?,
            None => (GRAVITY * waters.depth).sqrt(),
        };
        let radius = positive(
            "solver.radius",
            p.radius.unwrap_or(DEFAULT_RADIUS * p.spacing),
            "m",
        )?;
        let (low, high) = shore::rectangle(&spec);
        let course = Course {
            spec,
            wet: waters.wet.clone(),
            walls: Walls::new(waters.segments, low, high),
            low,
            high,
            beyond: edges.map(|e| match e {
                Edge::Open => Beyond::Open,
                Edge::Periodic => Beyond::Wrap,
                _ => Beyond::Wall,
            }),
            speed,
            split: positive("solver.split", p.split, "radii")?,
            smallest: positive("solver.smallest", p.smallest, "m")?,
            limit: whole("solver.limit", p.limit, 1e8)?,
        };
        if !(0.0..=1.0).contains(&p.horizontal) {
            return Err(BuildError::impossible(
                "solver.horizontal",
                format!("{} is not a share", p.horizontal),
                "give 0 (up and down only) to 1",
            ));
        }
        let maker = Maker::new(p.law, whole("solver.train", p.train, 64.0)?, f64::from(p.spacing));
        let level = scene.description.water.level;
        let wake = Wake {
            law: p.law,
            radius: maker.widened(radius).0,
            level: f64::from(level),
        };
        let mut movers = Vec::new();
        for (number, object) in scene.description.objects.iter().enumerate() {
            if matches!(object.motion, Motion::Path { .. }) {
                movers.push(Mover {
                    object: object.clone(),
                    mesh: mesh_of(scene, number)?.clone(),
                });
            }
        }
        let surface = Surface::new(
            &spec,
            waters.wet,
            scene.ground_on_grid(),
            level,
            waters.depth as f32,
        );
        let mut solver = Self {
            rest_volume: surface.rest_volume(&spec),
            spec,
            course,
            surface,
            maker,
            wake,
            movers,
            horizontal: p.horizontal,
            particles: Particles::default(),
            pending: Vec::new(),
            ledger: Ledger::default(),
            wakes: 0,
            time: 0.0,
            events: 0,
            workspace: Default::default(),
        };
        let mut first = solver.initial(&scene.description.water.initial)?;
        for (number, front) in p.fronts.iter().enumerate() {
            check_front(front).map_err(|e| {
                BuildError::impossible(format!("solver.front[{number}]"), e.to_string(), "mend it")
            })?;
            first.push(solver.maker.front(front));
        }
        solver.start("front", "width", 0.0, first).map_err(|e| {
            BuildError::impossible(
                "solver.limit",
                e.to_string(),
                "see docs/numerics-wave-particles.md on counts",
            )
        })?;
        Ok(solver)
    }

    /// The waves that the scene's initial state starts.
    fn initial(&self, initial: &Initial) -> Result<Vec<(f64, Emission)>, BuildError> {
        let mut out = Vec::new();
        match initial {
            Initial::Still => {}
            Initial::Disturbance {
                position,
                radius,
                height,
            } => {
                if !(position.is_finite() && height.is_finite()) {
                    return Err(BuildError::impossible(
                        "water.initial",
                        format!("a hump of {height} m at {position} is none"),
                        "give finite numbers",
                    ));
                }
                let radius = positive("water.initial.radius", *radius, "m")?;
                let (centre, height): (DVec2, f64) = (position.as_dvec2(), f64::from(*height));
                self.maker
                    .disturbance(centre, radius, height, self.course.speed, &mut out);
            }
            Initial::Dam { .. } | Initial::Array { .. } => {
                return Err(BuildError::impossible(
                    "water.initial",
                    "wave particles cannot begin from a given surface",
                    "use kind = \"still\" or \"disturbance\", solver.front, or the solvers `wave-equation` or \
                     `shallow-water`",
                ));
            }
        }
        Ok(out)
    }

    /// Everything that the further run depends on besides the scene.
    pub fn checkpoint(&self) -> Checkpoint {
        Checkpoint {
            spec: self.spec,
            time: self.time,
            speed: self.course.speed,
            wakes: self.wakes,
            events: self.events,
            ledger: self.ledger,
            particles: self.particles.clone(),
            pending: self.pending.clone(),
        }
    }

    /// Goes on from a checkpoint, exactly as the run that it was taken of.
    ///
    /// # Errors
    /// [`RestoreError`] if it is of another scene or damaged; nothing is then changed.
    pub fn restore(&mut self, checkpoint: &Checkpoint) -> Result<(), RestoreError> {
        if checkpoint.spec != self.spec {
            return Err(RestoreError::OtherScene { what: "another grid" });
        }
        if checkpoint.speed != self.course.speed {
            return Err(RestoreError::OtherScene {
                what: "another wave speed",
            });
        }
        let sound = checkpoint.particles.is_sound()
            && checkpoint.time.is_finite()
            && checkpoint.pending.iter().all(|(t, _)| t.is_finite());
        if !sound {
            return Err(RestoreError::Damaged);
        }
        self.time = checkpoint.time;
        self.wakes = checkpoint.wakes;
        self.events = checkpoint.events;
        self.ledger = checkpoint.ledger;
        self.particles = checkpoint.particles.clone();
        self.pending = checkpoint.pending.clone();
        Ok(())
    }
}
