//! The solver: sub-steps, reports, frames and checkpoints around a scheme.

use super::actions;
use super::bed::MovingBed;
use super::checkpoint::{Checkpoint, CheckpointError};
use super::eddies::Eddies;
use super::finite_volume::{FiniteVolume, Refusal};
use super::floats::Floats;
use super::real::Real;
use super::scheme::Scheme;
use super::settings::{Initial, Precision, Settings, SetupError};
use super::splash::{Ledger, Splash};
use super::storage::{self, Layout};
use super::totals::{self, Totals};
#[cfg(feature = "bodies")]
use crate::bodies::{Bodies, BodyError};
use crate::events::{Action, EventError};
use crate::frame::{Channels, Frame, extend_into_dry};
use crate::grid::{Grid, GridSpec};
#[cfg(feature = "bodies")]
use crate::scene::Scene;
use crate::solver::{Extra, Solver, StepError, StepReport};
use crate::stages::Stages;
use glam::Vec2;
use rayon::prelude::*;
use std::time::Instant;

/// How far a step's fastest signal may pass the Courant number that the step was chosen for before it is taken again.
const TOLERATED: f64 = 1.1;
/// Times that one sub-step is taken again with a shorter step before the run counts as unstable.
const RETRIES: u32 = 40;
/// Samples by which the surface continues below the shore in frames.
const SHORE: usize = 3;

/// The scheme in its number type.
pub(crate) enum Core {
    Single(Scheme<f32>),
    Double(Scheme<f64>),
}

/// Runs one expression for the scheme, whatever its type.
macro_rules! scheme {
    ($core:expr, $name:ident => $value:expr) => {
        match $core {
            Core::Single($name) => $value,
            Core::Double($name) => $value,
        }
    };
}

/// Runs one expression for the water of the scheme, whatever its type.
macro_rules! each {
    (&mut $core:expr, $name:ident => $value:expr) => {
        scheme!(&mut $core, s => { let $name = s.water_mut(); $value })
    };
    ($core:expr, $name:ident => $value:expr) => {
        scheme!($core, s => { let $name = s.water(); $value })
    };
}

/// Shallow-water solver on a regular grid over arbitrary ground.
///
/// Cells are centred on the samples; walls stand half a spacing beyond the outermost samples. Memory: 28 bytes a cell
/// in single and 56 in double precision, and 4 for the ground of the frames.
pub struct ShallowWater {
    spec: GridSpec,
    settings: Settings,
    ground: Grid<f32>,
    pub(super) core: Core,
    pub(super) splash: Option<Splash>,
    /// Still water above datum, m.
    pub(super) level: f64,
    time: f64,
    /// Fastest signal as last seen; unknown after a change from outside.
    speed: Option<f64>,
    floats: Floats,
    bed: Option<MovingBed>,
    stages: Stages,
}

impl ShallowWater {
    /// A solver for a state at time 0.
    ///
    /// # Errors
    /// [`SetupError`] if a parameter or value is out of range, or the grid has fewer than 3 samples along an axis.
    pub fn new(spec: GridSpec, initial: &Initial, settings: Settings) -> Result<Self, SetupError> {
        settings.check()?;
        initial.check(&spec)?;
        let bed = moving_bed(&spec, initial, &settings)?;
        let raised = bed.as_ref().map(|bed| Initial {
            ground: bed.heights(0.0),
            ..initial.clone()
        });
        let initial = raised.as_ref().unwrap_or(initial);
        let ground = Grid::from_vec(spec, initial.ground.iter().map(|&z| z as f32).collect())?;
        let layout = Layout::new(spec.width(), spec.height());
        let core = match settings.precision {
            Precision::Single => Core::Single(start(layout, &spec, initial, &settings)),
            Precision::Double => Core::Double(start(layout, &spec, initial, &settings)),
        };
        Ok(Self {
            spec,
            splash: settings
                .splash
                .clone()
                .map(|splash| Splash::new(&spec, &settings.edges, splash)),
            level: settings.level.unwrap_or_else(|| each!(&core, c => c.base())),
            settings,
            ground,
            core,
            time: 0.0,
            speed: None,
            floats: Floats::default(),
            bed,
            stages: Stages::default(),
        })
    }

    /// Puts the moving objects of a scene into the water, which is taken to be level around them.
    ///
    /// # Errors
    /// [`BodyError`] if an object is no solid, or starts where it cannot be.
    #[cfg(feature = "bodies")]
    pub fn add_bodies(&mut self, scene: &Scene) -> Result<(), BodyError> {
        self.floats = each!(&mut self.core, c => Floats::from_scene(scene, c, &self.spec))?;
        if self.bed.is_some() {
            self.floats.move_ground(&self.ground);
        }
        Ok(())
    }

    /// The moving objects, if there are any.
    #[cfg(feature = "bodies")]
    pub fn bodies(&self) -> Option<&Bodies> {
        self.floats.get()
    }

    /// What the solver was told.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// Depth in metres at every sample, row-major, exactly as held.
    pub fn depths(&self) -> Vec<f64> {
        each!(&self.core, c => gather(c, |c, k| c.fields().h[k].to_f64()))
    }

    /// Elevation of the surface (of the bed where dry) above datum in metres at every sample, row-major.
    pub fn elevations(&self) -> Vec<f64> {
        each!(&self.core, c => gather(c, |c, k| c.elevation(k)))
    }

    /// Elevation of the surface (of the bed where dry) above datum in metres at sample `(i, j)`.
    pub fn elevation_at(&self, i: usize, j: usize) -> f64 {
        each!(&self.core, c => c.elevation(c.layout().at(i, j)))
    }

    /// Momentum per area (depth times velocity) along X and Z in m²/s at every sample, row-major, exactly as held.
    pub fn discharges(&self) -> Vec<[f64; 2]> {
        each!(&self.core, c => gather(c, |c, k| [c.fields().qx[k].to_f64(), c.fields().qz[k].to_f64()]))
    }

    /// The unit in metres of which every depth is a whole multiple, so that volumes add up exactly.
    pub fn quantum(&self) -> f64 {
        each!(&self.core, c => c.quantum().length())
    }

    /// Depth in metres below which water is a film whose velocity fades and which frames show as dry.
    pub fn film_depth(&self) -> f64 {
        each!(&self.core, c => c.film())
    }

    /// What droplets took out of the water or brought into it from elsewhere; all 0 without splashes.
    pub fn ledger(&self) -> Ledger {
        self.splash.as_ref().map(Splash::ledger).unwrap_or_default()
    }

    /// Everything that the further run depends on.
    pub fn checkpoint(&self) -> Checkpoint {
        let mut checkpoint = scheme!(&self.core, s => Checkpoint::new(s, &self.spec, self.settings.precision, self.time, self.speed));
        checkpoint.splash = self.splash.as_ref().map(Splash::memory);
        #[cfg(feature = "bodies")]
        {
            checkpoint.bodies = self.floats.checkpoint();
        }
        checkpoint
    }

    /// Continues from a checkpoint of a solver with the same settings: bit-identical to a run without interruption.
    ///
    /// # Errors
    /// [`CheckpointError`] if the checkpoint is of another grid or precision or damaged; the state is then unchanged.
    pub fn restore(&mut self, checkpoint: &Checkpoint) -> Result<(), CheckpointError> {
        match (&self.splash, &checkpoint.splash) {
            (Some(splash), Some(memory)) => memory.check(splash)?,
            (None, None) => {}
            _ => return Err(CheckpointError::Splash),
        }
        let moved = self.bed.is_some();
        let before: Option<Vec<f64>> =
            moved.then(|| each!(&self.core, c => c.bed().iter().map(|z| z.to_f64()).collect()));
        scheme!(&mut self.core, s => checkpoint.apply(s, &self.spec, self.settings.precision))?;
        if let Some(before) = before {
            each!(&mut self.core, c => c.lift_edges(&before));
        }
        #[cfg(feature = "bodies")]
        self.floats.restore(checkpoint.bodies.as_ref(), checkpoint.time)?;
        if let (Some(splash), Some(memory)) = (&mut self.splash, &checkpoint.splash) {
            splash.resume(memory);
        }
        if let Some(bed) = &mut self.bed {
            bed.resume(&mut self.ground, checkpoint.time);
            #[cfg(feature = "bodies")]
            self.floats.know_ground(&self.ground);
        }
        self.time = checkpoint.time;
        self.speed = checkpoint.speed;
        Ok(())
    }

    fn spacing(&self) -> f64 {
        f64::from(self.spec.spacing)
    }

    fn totals(&self) -> Totals {
        let (level, area) = (self.level, self.spec.cell_area());
        let mut totals = each!(&self.core, c => totals::totals(c, level - c.base(), area));
        if let Some(splash) = &self.splash {
            let held = splash.held(level);
            totals.mass += held.mass;
            totals.momentum = std::array::from_fn(|a| totals.momentum[a] + held.momentum[a]);
            totals.energy += held.energy;
        }
        totals
    }

    fn state_report(&self, speed: f64) -> StepReport {
        let totals = self.totals();
        StepReport {
            substeps: 0,
            largest_stable_step: self.stable_step(speed),
            mass: totals.mass - self.floats.displaced_mass(self.spec.cell_area()),
            momentum: totals.momentum,
            energy: totals.energy + self.floats.energy(self.level),
            courant: 0.0,
            froude: totals.froude,
            clamps: 0,
        }
    }

    /// Puts the ground where it is at `time`, if any of it moves.
    fn move_bed(&mut self, time: f64) {
        if let Some(bed) = &mut self.bed {
            let changed = each!(&mut self.core, c => bed.move_to(c, &mut self.ground, time));
            if changed {
                self.floats.move_ground(&self.ground);
            }
        }
    }

    fn stable_step(&self, speed: f64) -> f64 {
        if speed > 0.0 {
            self.settings.courant * self.spacing() / speed
        } else {
            f64::INFINITY
        }
    }

    /// The error that names the place where the state went wrong.
    fn unstable(&self, speed: f64) -> StepError {
        let worst = each!(&self.core, c => c.worst());
        let (i, j, quantity, value) = worst.unwrap_or((0, 0, "fastest signal in m/s", speed));
        StepError::Unstable {
            quantity,
            value,
            limit: super::finite_volume::SPEED_LIMIT,
            i,
            j,
            time: self.time,
            remedy: "look at ground and events there, or lower `solver.courant` or raise `solver.film_depth`"
                .into(),
        }
    }
}

/// The moving ground that the settings ask for.
fn moving_bed(
    spec: &GridSpec,
    initial: &Initial,
    settings: &Settings,
) -> Result<Option<MovingBed>, SetupError> {
    if settings.bed.is_empty() {
        return Ok(None);
    }
    for motion in &settings.bed {
        motion.check(spec)?;
    }
    Ok(Some(MovingBed::new(
        settings.bed.clone(),
        *spec,
        initial.ground.clone(),
    )))
}

/// A scheme in the initial state.
fn start<T: Real>(layout: Layout, spec: &GridSpec, initial: &Initial, settings: &Settings) -> Scheme<T> {
    let spacing = f64::from(spec.spacing);
    let start = storage::quantise::<T>(layout, initial, spacing);
    let film = settings.film_depth.unwrap_or(1e-5 * start.reference_depth);
    let mut water = FiniteVolume::new(
        layout,
        spacing,
        settings.edges.clone(),
        start,
        film,
        settings.manning,
    );
    if settings.smagorinsky > 0.0 {
        water.eddies = Some(Eddies::new(settings.smagorinsky, layout));
    }
    Scheme::new(water, settings)
}

/// One value for each cell of the domain.
fn gather<T: Real, V: Send>(
    core: &FiniteVolume<T>,
    value: impl Fn(&FiniteVolume<T>, usize) -> V + Sync,
) -> Vec<V> {
    let layout = core.layout();
    (0..layout.nz)
        .into_par_iter()
        .flat_map_iter(|j| layout.row(j))
        .map(|k| value(core, k))
        .collect()
}

impl Solver for ShallowWater {
    fn name(&self) -> &'static str {
        "shallow-water"
    }

    fn spec(&self) -> GridSpec {
        self.spec
    }

    fn time(&self) -> f64 {
        self.time
    }

    fn offers(&self) -> Channels {
        let mut channels = Channels::DEPTH | Channels::VELOCITY;
        if let Some(splash) = &self.splash {
            if splash.has_droplets() {
                channels |= Channels::DROPLETS;
            }
            if splash.has_foam() {
                channels |= Channels::FOAM;
            }
        }
        if self.floats.poses().is_some() {
            channels |= Channels::BODIES;
        }
        channels
    }

    fn advance(&mut self, dt: f32) -> Result<StepReport, StepError> {
        StepError::check_step(dt)?;
        let (start, dt) = (self.time, f64::from(dt));
        let clamped_bodies = self.floats.clamps();
        let (spacing, courant) = (self.spacing(), self.settings.courant);
        let mut done = 0.0;
        let mut substeps = 0_u64;
        let mut largest = 0.0_f64;
        let mut clamps = 0_u64;
        let mut speed = match self.speed {
            Some(speed) => speed,
            None => scheme!(&mut self.core, s => s.probe(start)),
        };
        let mut retries = 0;
        self.stages.clear();
        let mut clock = Instant::now();
        let (has_eddies, has_bodies) = (self.settings.smagorinsky > 0.0, self.floats.poses().is_some());
        while done < dt {
            let left = dt - done;
            let mut longest = self.stable_step(speed).min(self.floats.largest_step(spacing));
            if let Some(bed) = &self.bed {
                longest = longest.min(bed.largest_step(self.time));
            }
            let needed = (left / longest).ceil().max(1.0);
            if !(substeps as f64 + needed <= self.settings.max_substeps as f64) {
                self.speed = None;
                return Err(StepError::TooManySubsteps {
                    dt,
                    needed: substeps.saturating_add(needed as u64),
                    allowed: self.settings.max_substeps,
                    remedy: "advance by a shorter time, or use a coarser `solver.spacing`".into(),
                });
            }
            let step = left / needed;
            self.move_bed(self.time + 0.5 * step);
            if self.bed.is_some() {
                self.stages.lap("moving ground", &mut clock);
            }
            let stepped = scheme!(&mut self.core, s => s.try_step(self.time, step, courant, TOLERATED));
            self.stages.lap("flow", &mut clock);
            match stepped {
                Ok(stepped) => {
                    let (time, spec) = (self.time, self.spec);
                    each!(&mut self.core, c => c.mix_eddies(step));
                    if has_eddies {
                        self.stages.lap("eddies", &mut clock);
                    }
                    each!(&mut self.core, c => self.floats.follow(c, &spec, time, step))
                        .map_err(StepError::from)?;
                    if has_bodies {
                        self.stages.lap("bodies", &mut clock);
                    }
                    speed = stepped.speed;
                    largest = largest.max(stepped.signal * step / spacing);
                    done = if needed <= 1.0 { dt } else { done + step };
                    self.time = start + done;
                    self.move_bed(self.time);
                    substeps += 1;
                    retries = 0;
                    if let Some(splash) = &mut self.splash {
                        let level = self.level;
                        clamps += each!(&mut self.core, c => {
                            let film = c.film();
                            splash.step(c, film, level, step)
                        });
                        self.stages.lap("splashes", &mut clock);
                    }
                }
                Err(Refusal::TooFast(faster)) if retries < RETRIES => {
                    speed = faster;
                    retries += 1;
                }
                Err(Refusal::TooFast(_) | Refusal::Broken) => {
                    self.speed = None;
                    return Err(self.unstable(speed));
                }
                Err(Refusal::OutOfRange {
                    quantity,
                    value,
                    limit,
                    at: [i, j],
                    remedy,
                }) => {
                    self.speed = None;
                    return Err(StepError::OutOfRange {
                        quantity,
                        value,
                        limit,
                        i,
                        j,
                        time: self.time,
                        remedy: remedy.into(),
                    });
                }
            }
        }
        self.speed = Some(speed);
        let report = self.state_report(speed);
        self.stages.lap("totals", &mut clock);
        Ok(StepReport {
            substeps: u32::try_from(substeps).unwrap_or(u32::MAX),
            courant: largest,
            clamps: clamps + self.floats.clamps() - clamped_bodies,
            ..report
        })
    }

    fn stages(&self) -> &[(&'static str, f64)] {
        self.stages.as_slice()
    }

    fn extract(&self, want: Channels, out: &mut Frame) {
        out.prepare(self.spec, want & self.offers());
        out.time = self.time;
        each!(&self.core, c => extract(c, &self.ground, out));
        if let Some(splash) = &self.splash {
            if let Some(droplets) = &mut out.droplets {
                splash.show_droplets(droplets);
            }
            if let Some(foam) = &mut out.foam {
                splash.show_foam(foam);
            }
        }
        if out.bodies.is_some() {
            out.bodies = self.floats.poses();
        }
    }

    fn apply(&mut self, action: &Action) -> Result<(), EventError> {
        action.check()?;
        if action.is_on_body() {
            return self.floats.apply(action).unwrap_or(Err(EventError::Unsupported {
                solver: "shallow-water",
                action: action.name(),
                remedy: "give the scene an object that moves freely, and build with the Cargo feature `bodies`",
            }));
        }
        self.speed = None;
        each!(&mut self.core, c => actions::apply(c, &self.spec, action))
    }

    fn report(&self) -> StepReport {
        let speed = self
            .speed
            .unwrap_or_else(|| scheme!(&self.core, s => s.estimated_speed()));
        self.state_report(speed)
    }

    fn bytes(&self) -> u64 {
        let core = scheme!(&self.core, s => s.bytes());
        let splash = self.splash.as_ref().map_or(0, Splash::bytes);
        let bed = self.bed.as_ref().map_or(0, MovingBed::bytes);
        (core + splash + bed + self.spec.len() * size_of::<f32>()) as u64
    }

    fn extras(&self) -> Vec<Extra> {
        match self.floats.poses() {
            Some(poses) => vec![Extra {
                name: "bodies",
                reason: format!("{} objects, at least one of which moves", poses.len()),
                bytes: self.floats.bytes(),
            }],
            None => Vec::new(),
        }
    }
}

/// Writes elevation and the channels that `out` was prepared for.
fn extract<T: Real>(core: &FiniteVolume<T>, ground: &Grid<f32>, out: &mut Frame) {
    let (layout, fields) = (core.layout(), core.fields());
    let (film, nx) = (T::from_f64(core.film()), layout.nx);
    let mut wet = Grid::filled(*ground.spec(), 0.0_f32);
    let elevation = out.elevation.as_mut_slice().par_chunks_mut(nx);
    let any_dry = elevation
        .zip(wet.as_mut_slice().par_chunks_mut(nx))
        .enumerate()
        .map(|(j, (elevation, wet))| {
            let mut any_dry = false;
            for (i, k) in layout.row(j).enumerate() {
                let h = fields.h[k];
                elevation[i] = core.elevation(k) as f32;
                if h > film {
                    wet[i] = h.to_f64() as f32;
                } else {
                    any_dry = true;
                }
            }
            any_dry
        })
        .reduce(|| false, |a, b| a | b);
    if any_dry {
        extend_into_dry(&mut out.elevation, &wet, ground, SHORE);
    }
    if let Some(depth) = &mut out.depth {
        depth
            .as_mut_slice()
            .par_chunks_mut(nx)
            .enumerate()
            .for_each(|(j, row)| {
                for (depth, k) in row.iter_mut().zip(layout.row(j)) {
                    *depth = fields.h[k].to_f64() as f32;
                }
            });
    }
    if let Some(velocity) = &mut out.velocity {
        velocity
            .as_mut_slice()
            .par_chunks_mut(nx)
            .enumerate()
            .for_each(|(j, row)| {
                for (velocity, k) in row.iter_mut().zip(layout.row(j)) {
                    let inverse = if fields.h[k] > film {
                        1.0 / fields.h[k].to_f64()
                    } else {
                        0.0
                    };
                    *velocity = Vec2::new(
                        (fields.qx[k].to_f64() * inverse) as f32,
                        (fields.qz[k].to_f64() * inverse) as f32,
                    );
                }
            });
    }
}
