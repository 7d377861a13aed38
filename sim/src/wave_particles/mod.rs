//! Wave particles (Yuksel, House & Keyser 2007, doi:10.1145/1276377.1276501): fronts of small round waves that run
//! straight at one speed.
//!
//! The surface is a sum of particles ([`kernel`]), each an amplitude and a radius on a ray ([`particle`]). What happens to
//! them happens at times that are closed forms ([`flight`]): a front whose particles are too far apart splits each into
//! three, a wall mirrors them ([`walls`], [`shore`]), small ones are dropped. So there is no step to be stable at: any time
//! is reached in one stride, and the front speed is exact for ever. Drops, pushes, presses and moving objects make them
//! ([`sources`], [`hull`]); frames are gathered from them ([`gather`]), walls included ([`beams`]).
//!
//! Two laws for how a front falls as it spreads: the *volume* law of the paper (1/R), and the *energy* law (1/√R) with the
//! crest-and-trough train that the linear wave equation leaves far from a disturbance ([`far_field`]).
//!
//! The particles are those of a long wave: the speed is one number, whatever the wavelength and the depth under it.

mod beams;
mod build;
mod far_field;
mod flight;
mod gather;
mod hull;
pub mod kernel;
mod ledger;
mod particle;
mod shore;
mod sources;
mod surface;
mod walls;

pub use build::{Checkpoint, RestoreError};
pub use ledger::Ledger;

use crate::events::{Action, EventError};
use crate::frame::{Channels, Frame};
use crate::grid::{Grid, GridSpec};
use crate::mesh::TriangleMesh;
use crate::optics::WATER_DENSITY;
use crate::reduce;
use crate::scene::description::{Object, WaveFront};
use crate::solver::{Solver, StepError, StepReport, Stirring};
use crate::solvers::GRAVITY;
use flight::{Course, Overrun};
use gather::{BandSums, Wanted, Workspace};
use glam::Vec2;
use hull::Wake;
use kernel::VOLUME;
use particle::Particles;
use sources::{Emission, Maker};
use std::sync::Mutex;
use surface::Surface;

/// Amplitude in metres beyond which a wave counts as none of water.
const RUNAWAY: f64 = 1e6;

/// An object on a path and its geometry.
struct Mover {
    object: Object,
    mesh: TriangleMesh,
}

/// The wave-particle solver.
pub struct WaveParticles {
    spec: GridSpec,
    course: Course,
    surface: Surface,
    rest_volume: f64,
    maker: Maker,
    wake: Wake,
    movers: Vec<Mover>,
    /// Share of the horizontal motion.
    horizontal: f32,
    particles: Particles,
    /// What is still to start, by time.
    pending: Vec<(f64, Emission)>,
    ledger: Ledger,
    /// Fronts that moving objects have sent off so far.
    wakes: u64,
    time: f64,
    events: u64,
    workspace: Mutex<Workspace>,
}

/// Particles, volume, momentum and energy.
#[derive(Clone, Copy, Default)]
struct Totals {
    volume: f64,
    momentum: [f64; 2],
    energy: f64,
}

impl WaveParticles {
    /// Number of wave particles.
    pub fn count(&self) -> usize {
        self.particles.len()
    }

    /// Wave speed in m/s.
    pub fn speed(&self) -> f64 {
        self.course.speed
    }

    /// Positions of the particles in metres with their amplitudes in metres and radii, at the present time.
    pub fn particles(&self) -> impl Iterator<Item = (glam::DVec2, f64, f64)> + '_ {
        (0..self.particles.len()).map(|k| {
            let p = self.particles.get(k);
            let speed = self.course.speed;
            (p.position(self.time, speed), p.shown(self.time, speed), p.radius)
        })
    }

    /// What was made and what was lost since the start.
    pub fn ledger(&self) -> Ledger {
        self.ledger
    }

    /// Events (splits, reflections, edges) since the start.
    pub fn events(&self) -> u64 {
        self.events
    }

    /// Volume above rest in m³.
    pub fn volume(&self) -> f64 {
        self.totals().volume
    }

    /// Starts a front at its own time, or now if that has passed.
    ///
    /// # Errors
    /// [`EventError`] for values that are no front, or if there would be more particles than the limit.
    pub fn launch(&mut self, front: &WaveFront) -> Result<(), EventError> {
        build::check_front(front)?;
        let (time, emission) = self.maker.front(front);
        self.start(
            "front",
            "width",
            front.width,
            vec![(time.max(self.time), emission)],
        )
    }

    /// Puts emissions on the list and starts those that are due.
    fn start(
        &mut self,
        action: &'static str,
        quantity: &'static str,
        value: f32,
        emissions: Vec<(f64, Emission)>,
    ) -> Result<(), EventError> {
        let (now, later): (Vec<_>, Vec<_>) = emissions.into_iter().partition(|(t, _)| *t <= self.time);
        let mut new = Vec::new();
        let mut ledger = self.ledger;
        for (_, emission) in &now {
            let missed = emission.particles(&self.course, self.time, &mut new);
            ledger.missed += missed;
        }
        if new.iter().any(|p| !(p.amplitude.abs() <= RUNAWAY)) {
            return Err(EventError::Impossible {
                action,
                quantity,
                value,
                remedy: "its waves would be higher than 1e6 m; give a smaller one or a larger radius",
            });
        }
        ledger.made += made(&new, self.time, self.course.speed);
        let speed_and_time = self.time;
        match self
            .course
            .launch(&mut self.particles, &new, speed_and_time, &mut ledger)
        {
            Ok(events) => self.events += events,
            Err(_) => {
                return Err(EventError::Impossible {
                    action,
                    quantity,
                    value,
                    remedy: "there would be more wave particles than solver.limit; raise it, or raise solver.smallest so \
                             that small waves are dropped earlier",
                });
            }
        }
        self.ledger = ledger;
        self.pending.extend(later);
        self.pending.sort_by(|a, b| a.0.total_cmp(&b.0));
        Ok(())
    }

    /// The particles that start up to `until`, each with its time: pending fronts and wakes of objects, in order.
    fn starting(&self, until: f64, ledger: &mut Ledger) -> (Vec<(f64, Vec<particle::Particle>)>, u64) {
        let mut out = Vec::new();
        for (time, emission) in self.pending.iter().take_while(|(t, _)| *t <= until) {
            let mut new = Vec::new();
            ledger.missed += emission.particles(&self.course, *time, &mut new);
            out.push((*time, new));
        }
        let interval = self.wake.interval(self.course.speed);
        let mut wakes = self.wakes;
        if !self.movers.is_empty() {
            let last = self
                .movers
                .iter()
                .filter_map(Mover::last_time)
                .fold(0.0, f64::max);
            // Beyond the last way point nothing moves any more; the count alone goes on.
            let due = (until / interval).floor().max(0.0) as u64;
            let moving = ((last / interval).ceil() as u64 + 1).min(due);
            while wakes < moving {
                let span = [interval * wakes as f64, interval * (wakes + 1) as f64];
                let mut new = Vec::new();
                for mover in &self.movers {
                    let at = |share: f64| mover.object.pose_at(span[0] + share * (span[1] - span[0]));
                    let poses = [at(0.0), at(0.5), at(1.0)];
                    ledger.missed += self
                        .wake
                        .particles(&mover.mesh, &poses, &self.course, span, &mut new);
                }
                out.push((span[1], new));
                wakes += 1;
            }
            wakes = wakes.max(due);
            out.sort_by(|a, b| a.0.total_cmp(&b.0));
        }
        (out, wakes)
    }

    /// Everything up to `until`; on failure nothing is changed but what cannot be seen.
    fn run_to(&mut self, until: f64) -> Result<u64, Overrun> {
        let mut ledger = self.ledger;
        let (starting, wakes) = self.starting(until, &mut ledger);
        let taken = self.pending.iter().take_while(|(t, _)| *t <= until).count();
        let fresh: usize = starting.iter().map(|(_, new)| new.len()).sum();
        // The particles that are there go first: they fail without having changed, or have nothing to fail after.
        let backup = (fresh > 0).then(|| self.particles.clone());
        let mut events = self.course.advance(&mut self.particles, until, &mut ledger)?;
        for (time, new) in &starting {
            ledger.made += made(new, *time, self.course.speed);
            match self.course.launch(&mut self.particles, new, until, &mut ledger) {
                Ok(more) => events += more,
                Err(overrun) => {
                    if let Some(backup) = backup {
                        self.particles = backup;
                    }
                    return Err(overrun);
                }
            }
        }
        self.pending.drain(..taken);
        self.wakes = wakes;
        self.ledger = ledger;
        Ok(events)
    }

    /// The error for more particles or events than allowed.
    fn overrun(&self, overrun: &Overrun, time: f64) -> StepError {
        match overrun {
            Overrun::Particles => StepError::Crowded {
                what: "wave particles",
                allowed: self.course.limit as u64,
                time,
                remedy: "raise solver.smallest so that small waves are dropped earlier, raise solver.limit, or raise \
                         solver.split"
                    .to_owned(),
            },
            Overrun::Events => StepError::Crowded {
                what: "splits and reflections in one step",
                allowed: flight::MOST_EVENTS,
                time,
                remedy: "advance by less at a time, or raise solver.smallest so that waves do not run so long".to_owned(),
            },
        }
    }

    fn totals(&self) -> Totals {
        let (time, speed) = (self.time, self.course.speed);
        let of = |k: usize| {
            let p = self.particles.get(k);
            let volume = VOLUME * p.radius * p.radius * p.shown(time, speed);
            // The flux of a wave is c η along its direction.
            let momentum = WATER_DENSITY * speed * volume * p.direction;
            Totals {
                volume,
                momentum: momentum.to_array(),
                energy: ledger::energy(&p, time, speed),
            }
        };
        let add = |a: Totals, b: Totals| Totals {
            volume: a.volume + b.volume,
            momentum: [a.momentum[0] + b.momentum[0], a.momentum[1] + b.momentum[1]],
            energy: a.energy + b.energy,
        };
        reduce::reduce(self.particles.len(), Totals::default(), of, add)
    }

    fn report_of(&self, substeps: u32, strandings: u64) -> StepReport {
        let totals = self.totals();
        StepReport {
            substeps,
            largest_stable_step: f64::INFINITY,
            mass: WATER_DENSITY * (self.rest_volume + totals.volume),
            momentum: totals.momentum,
            energy: totals.energy,
            courant: 0.0,
            froude: 0.0,
            clamps: strandings,
        }
    }
}

/// Volume of particles at their start, m³.
fn made(new: &[particle::Particle], time: f64, speed: f64) -> f64 {
    reduce::sum(new.len(), |k| {
        VOLUME * new[k].radius.powi(2) * new[k].shown(time, speed)
    })
}

impl Mover {
    /// When its path ends.
    fn last_time(&self) -> Option<f64> {
        match &self.object.motion {
            crate::scene::description::Motion::Path { points } => points.last().map(|p| p.time),
            _ => None,
        }
    }
}

/// Rows of one band of an optional channel: all of one length, or empty.
fn bands<T>(grid: Option<&mut Grid<T>>, values: usize, count: usize) -> Vec<&mut [T]>
where
    T: Copy,
{
    match grid {
        Some(grid) => grid.as_mut_slice().chunks_mut(values).collect(),
        None => (0..count).map(|_| <&mut [T]>::default()).collect(),
    }
}

impl Solver for WaveParticles {
    fn name(&self) -> &'static str {
        "wave-particles"
    }

    fn spec(&self) -> GridSpec {
        self.spec
    }

    fn time(&self) -> f64 {
        self.time
    }

    fn offers(&self) -> Channels {
        let all = Channels::DEPTH | Channels::VELOCITY;
        if self.horizontal > 0.0 {
            all | Channels::DISPLACEMENT
        } else {
            all
        }
    }

    fn advance(&mut self, dt: f32) -> Result<StepReport, StepError> {
        StepError::check_step(dt)?;
        let until = self.time + f64::from(dt);
        let before = self.ledger.strandings;
        match self.run_to(until) {
            Ok(events) => {
                self.time = until;
                self.events += events;
                Ok(self.report_of(1, self.ledger.strandings - before))
            }
            Err(overrun) => Err(self.overrun(&overrun, until)),
        }
    }

    fn extract(&self, want: Channels, out: &mut Frame) {
        let want = want & self.offers();
        out.prepare(self.spec, want);
        out.time = self.time;
        let (w, level) = (self.spec.width(), self.surface.level);
        let wanted = Wanted {
            velocity: want.contains(Channels::VELOCITY),
            displacement: want.contains(Channels::DISPLACEMENT),
        };
        // A panic in another thread leaves buffers that are filled anew anyway.
        let mut workspace = self
            .workspace
            .lock()
            .unwrap_or_else(std::sync::PoisonError::into_inner);
        workspace.prepare(&self.course, &self.spec, &self.particles, self.time);
        let (count, values) = (Workspace::bands(&self.spec), w * Workspace::band_rows());
        let elevation = bands(Some(&mut out.elevation), values, count);
        let velocity = bands(out.velocity.as_mut(), values, count);
        let displacement = bands(out.displacement.as_mut(), values, count);
        let outputs: Vec<_> = elevation.into_iter().zip(velocity).zip(displacement).collect();
        let flow = (GRAVITY / self.course.speed) as f32;
        let wet = &self.surface.wet;
        workspace.sum(
            &self.spec,
            wanted,
            outputs,
            |((elevation, velocity), displacement), first, sums: &BandSums| {
                for (j, row) in elevation.chunks_mut(w).enumerate() {
                    let [height, cx, cz, mx, mz] = sums.row(j, w);
                    let wet = &wet[(first + j) * w..(first + j + 1) * w];
                    for (i, out) in row.iter_mut().enumerate() {
                        *out = if wet[i] { level + height[i] } else { level };
                    }
                    let pairs = |out: &mut [Vec2], x: &[f32], z: &[f32], factor: f32| {
                        for (i, out) in out.iter_mut().enumerate() {
                            *out = if wet[i] {
                                factor * Vec2::new(x[i], z[i])
                            } else {
                                Vec2::ZERO
                            };
                        }
                    };
                    if !cx.is_empty() {
                        pairs(&mut velocity[j * w..(j + 1) * w], cx, cz, flow);
                    }
                    if !mx.is_empty() {
                        pairs(&mut displacement[j * w..(j + 1) * w], mx, mz, self.horizontal);
                    }
                }
            },
        );
        self.surface.finish(&mut out.elevation);
        if let Some(depth) = &mut out.depth {
            self.surface.depth(&out.elevation, depth);
        }
    }

    fn apply(&mut self, action: &Action) -> Result<(), EventError> {
        action.check()?;
        let (quantity, value) = match *action {
            Action::Drop { volume, .. } => ("volume", volume),
            Action::Press { depth, .. } => ("depth", depth),
            Action::Push { velocity, .. } => ("velocity", velocity.length()),
            Action::Drag { .. } | Action::Release { .. } | Action::Shove { .. } => {
                return Err(EventError::Unsupported {
                    solver: self.name(),
                    action: action.name(),
                    remedy: "give the scene an object that moves freely",
                });
            }
            Action::Tilt { .. } => return Err(EventError::upright(self.name())),
        };
        let mut emissions = Vec::new();
        self.maker
            .action(action, self.time, self.course.speed, &mut emissions);
        self.start(action.name(), quantity, value, emissions)
    }

    fn report(&self) -> StepReport {
        self.report_of(0, 0)
    }

    fn stirred_every(&self) -> Option<f64> {
        Some(self.wake.interval(self.course.speed))
    }

    fn stir(&mut self, by: &Stirring<'_>) -> Result<bool, StepError> {
        let mut new = Vec::new();
        let mut ledger = self.ledger;
        let missed = self
            .wake
            .particles(by.mesh, &by.poses, &self.course, [by.since, self.time], &mut new);
        let highest = new.iter().map(|p| p.amplitude.abs()).fold(0.0, f64::max);
        if missed == 0.0 && highest < self.course.smallest {
            return Ok(false);
        }
        ledger.missed += missed;
        ledger.made += made(&new, self.time, self.course.speed);
        let launched = self
            .course
            .launch(&mut self.particles, &new, self.time, &mut ledger);
        self.events += launched.map_err(|overrun| self.overrun(&overrun, self.time))?;
        self.ledger = ledger;
        Ok(true)
    }

    fn bytes(&self) -> u64 {
        let workspace = self.workspace.lock().map_or(0, |w| w.bytes());
        self.particles.bytes() + self.surface.bytes() + self.course.walls.bytes() + workspace
    }
}
