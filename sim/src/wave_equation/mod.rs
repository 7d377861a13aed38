//! Linear waves on a grid: ∂²η/∂t² = ∇·(c²∇η) − damping ∂η/∂t, with c² = g · depth or a constant.
//!
//! The equation is stepped as the pair from which it comes, the linear shallow-water equations
//!
//! ```text
//! ∂η/∂t = −∇·q        ∂q/∂t = −c²∇η − damping q
//! ```
//!
//! with the elevation above rest η at the samples and the flux q = depth · velocity (m²/s) on the faces between them.
//! Volume is conserved by construction, whatever c² does, and velocity and momentum come for free. Two schemes:
//! [`explicit`](description::WaveScheme::Explicit) leap-frog, second order, with a Courant limit; and
//! [`implicit`](description::WaveScheme::Implicit) alternating directions after Kass & Miller 1990
//! (doi:10.1145/97880.97884), stable at any step.
//!
//! Land and fixed objects that pierce the surface have no flux through their faces. A wall stands half a spacing
//! beyond the outermost samples. The linear equation knows the bed only through c², so a trough may reach below it;
//! such samples are dry in the frame.

mod explicit;
mod footprint;
mod implicit;
mod kick;
mod medium;
mod shore;
mod state;
mod totals;
mod tridiagonal;

pub use totals::Energies;

use crate::events::stamp::Stamp;
use crate::events::{Action, EventError};
use crate::frame::{Channels, Frame};
use crate::grid::GridSpec;
use crate::scene::Scene;
use crate::scene::description::{self, Initial, WaveScheme};
use crate::solver::{Solver, StepError, StepReport};
use crate::solvers::{BuildError, GRAVITY, name_of};
use glam::Vec2;
use medium::Medium;
use shore::Shore;
use state::State;

/// Share of the Courant limit that sub-steps take when the scene names no step.
const DEFAULT_COURANT: f64 = 0.95;

/// Weight of the new state in an implicit step: centred in time, or wholly implicit.
const CENTRED: f64 = 0.5;
const BACKWARD: f64 = 1.0;

/// Most sub-steps one call of `advance` takes.
const MAX_SUBSTEPS: u64 = 1_000_000;

/// Elevation above rest, in depths of the deepest water, beyond which a state counts as run away. Far outside of
/// what the linear equation means, and far inside of what `f32` holds.
const RUNAWAY_DEPTHS: f64 = 1e4;

/// Elevation above rest in metres beyond which a state counts as run away, however deep the water.
const RUNAWAY_METRES: f64 = 1e6;

/// The wave-equation solver.
pub struct WaveEquation {
    medium: Medium,
    shore: Shore,
    state: State,
    explicit: explicit::Work,
    implicit: implicit::Work,
    stamp: Stamp,
    /// Elevation of still water above datum, metres.
    level: f32,
    scheme: WaveScheme,
    /// Longest sub-step in seconds, as the scene gives it.
    step: Option<f64>,
    time: f64,
    substeps: u32,
    courant: f64,
}

impl WaveEquation {
    /// The solver of a scene with `solver.kind = "wave-equation"`, in its initial state.
    ///
    /// # Errors
    /// [`BuildError`] for impossible values; an explicit `step` above the Courant limit is one, and names the limit.
    pub fn from_scene(scene: &Scene) -> Result<Self, BuildError> {
        let description::Solver::WaveEquation(parameters) = &scene.description.solver else {
            return Err(BuildError::WrongSolver {
                expected: "wave-equation",
                found: name_of(&scene.description.solver),
            });
        };
        if let Some(step) = parameters.step.filter(|s| !(s.is_finite() && *s > 0.0)) {
            return Err(BuildError::impossible(
                "solver.step",
                format!("{step} s is not a positive time"),
                "give a step in seconds, or leave it out",
            ));
        }
        let medium = Medium::from_scene(scene, parameters)?;
        let ground = scene.ground_on_grid();
        let mut solver = Self {
            shore: Shore::new(&medium, ground, scene.description.water.level),
            state: State::new(&medium),
            explicit: explicit::Work::default(),
            implicit: implicit::Work::default(),
            stamp: Stamp::default(),
            level: scene.description.water.level,
            scheme: parameters.scheme,
            step: parameters.step.map(f64::from),
            time: 0.0,
            substeps: 0,
            courant: 0.0,
            medium,
        };
        if let (WaveScheme::Explicit, Some(step)) = (solver.scheme, solver.step) {
            solver.check_limit(step)?;
        }
        solver.set_initial(scene)?;
        Ok(solver)
    }

    /// The largest stable step of the explicit scheme in seconds, for this medium.
    pub fn courant_limit(&self) -> f64 {
        self.medium.limit()
    }

    /// Elevation above rest, metres; 0 on land.
    pub fn deviation(&self) -> &[f32] {
        &self.state.eta
    }

    /// Volume above rest in m³, negative below.
    pub fn volume(&self) -> f64 {
        totals::volume(&self.medium, &self.state)
    }

    /// The energies of the present state.
    pub fn energies(&self) -> Energies {
        totals::totals(&self.medium, &self.state).energies
    }

    /// Refuses a step above the Courant limit.
    fn check_limit(&self, step: f64) -> Result<(), StepError> {
        let limit = self.medium.limit();
        if step <= limit {
            return Ok(());
        }
        Err(StepError::TooLarge {
            dt: step,
            limit,
            reason: format!(
                "Courant limit of the explicit scheme for waves of {:.4} m/s on a spacing of {} m",
                self.medium.fastest(),
                self.medium.spec.spacing
            ),
            remedy: "use a step of at most the limit, leave `step` out, or use scheme = \"implicit\""
                .to_owned(),
        })
    }

    /// Puts the scene's initial water in place.
    fn set_initial(&mut self, scene: &Scene) -> Result<(), BuildError> {
        let spec = self.medium.spec;
        let level = self.level;
        let above = |i: usize, j: usize| -> f32 {
            let p = spec.position(i, j);
            match &scene.description.water.initial {
                Initial::Still => 0.0,
                Initial::Dam { min, max, level: dam } => {
                    let inside = p.cmpge(*min).all() && p.cmple(*max).all();
                    if inside { dam - level } else { 0.0 }
                }
                Initial::Disturbance {
                    position,
                    radius,
                    height,
                } => {
                    let d = (p - *position) / *radius;
                    height * (-0.5 * d.length_squared()).exp()
                }
                Initial::Array { .. } => scene
                    .initial_elevation
                    .as_ref()
                    .and_then(|e| (*e.spec() == spec).then(|| e[(i, j)] - level))
                    .unwrap_or(f32::NAN),
            }
        };
        for j in 0..spec.height() {
            for i in 0..spec.width() {
                let k = spec.index(i, j);
                if self.medium.wet[k] {
                    let value = above(i, j);
                    if value.is_nan() || f64::from(value).abs() > self.runaway() {
                        return Err(BuildError::impossible(
                            "water.initial",
                            format!("the surface starts {value} m above rest at sample ({i}, {j})"),
                            format!("it must be a number within ±{:e} m there", self.runaway()),
                        ));
                    }
                    self.state.eta[k] = value;
                }
            }
        }
        Ok(())
    }

    /// Elevation above rest that no state may pass, metres.
    fn runaway(&self) -> f64 {
        (RUNAWAY_DEPTHS * self.medium.deepest()).min(RUNAWAY_METRES)
    }

    /// Fails if an elevation has run away. A NaN counts as run away.
    fn check_state(&self) -> Result<(), StepError> {
        let limit = self.runaway();
        let eta = &self.state.eta;
        let Some((k, _)) = crate::reduce::arg_max(eta.len(), |k| f64::from(eta[k].abs())) else {
            return Ok(());
        };
        let value = f64::from(eta[k]);
        if value.abs() <= limit {
            return Ok(());
        }
        let w = self.medium.spec.width();
        Err(StepError::Unstable {
            quantity: "elevation above rest (m)",
            value,
            limit,
            i: k % w,
            j: k / w,
            time: self.time,
            remedy: "look for an event or an initial state that adds more water than the basin can hold"
                .to_owned(),
        })
    }

    /// Number and length of the sub-steps that cover `dt`.
    fn divide(&self, dt: f64) -> Result<(u64, f64), StepError> {
        let longest = match self.scheme {
            WaveScheme::Explicit => self.step.unwrap_or(DEFAULT_COURANT * self.medium.limit()),
            WaveScheme::Implicit | WaveScheme::ImplicitDamped => self.step.unwrap_or(f64::INFINITY),
        };
        // A step that is meant to divide dt must not cost one more for a rounding.
        let needed = (dt / longest * (1.0 - 1e-6)).ceil().max(1.0);
        if needed > MAX_SUBSTEPS as f64 {
            return Err(StepError::TooManySubsteps {
                dt,
                needed: needed as u64,
                allowed: MAX_SUBSTEPS,
                remedy: "advance by less at a time, use a coarser spacing, or use scheme = \"implicit\""
                    .to_owned(),
            });
        }
        Ok((needed as u64, dt / needed))
    }
}

impl Solver for WaveEquation {
    fn name(&self) -> &'static str {
        "wave-equation"
    }

    fn spec(&self) -> GridSpec {
        self.medium.spec
    }

    fn time(&self) -> f64 {
        self.time
    }

    fn offers(&self) -> Channels {
        Channels::DEPTH | Channels::VELOCITY
    }

    fn advance(&mut self, dt: f32) -> Result<StepReport, StepError> {
        StepError::check_step(dt)?;
        let dt = f64::from(dt);
        let (count, step) = self.divide(dt)?;
        let theta = match self.scheme {
            WaveScheme::Explicit => None,
            WaveScheme::Implicit => Some(CENTRED),
            WaveScheme::ImplicitDamped => Some(BACKWARD),
        };
        let (medium, state) = (&self.medium, &mut self.state);
        match theta {
            None => (0..count).for_each(|_| explicit::step(medium, state, &mut self.explicit, step)),
            Some(theta) => implicit::steps(medium, state, &mut self.implicit, step, count, theta),
        }
        self.time += dt;
        self.substeps = count as u32;
        self.courant = step / self.medium.limit();
        self.check_state()?;
        Ok(self.report_of(self.substeps, self.courant))
    }

    fn extract(&self, want: Channels, out: &mut Frame) {
        let spec = self.medium.spec;
        out.prepare(spec, want & self.offers());
        out.time = self.time;
        self.shore
            .elevation(&self.medium, &self.state.eta, self.level, &mut out.elevation);
        if let Some(depth) = &mut out.depth {
            self.shore
                .depth(&self.medium, &self.state.eta, &out.elevation, depth);
        }
        if let Some(velocity) = &mut out.velocity {
            state::velocity(&self.medium, &self.state, velocity);
        }
    }

    fn apply(&mut self, action: &Action) -> Result<(), EventError> {
        action.check()?;
        // The flux lags half a step behind; bring it here with the surface as it was before the action.
        explicit::synchronise(&self.medium, &mut self.state);
        let Medium { spec, wrap, wet, .. } = &self.medium;
        let is_wet = |k: usize| wet[k];
        match *action {
            Action::Drop {
                position,
                radius,
                volume,
            } => self.stamp.drop(spec, *wrap, position, radius, volume, is_wet),
            Action::Press {
                position,
                radius,
                depth,
            } => self.stamp.press(spec, *wrap, position, radius, depth, is_wet),
            Action::Push {
                position,
                radius,
                velocity,
            } => {
                self.stamp.bump(spec, *wrap, position, radius, is_wet);
                return self.push(velocity);
            }
            Action::Drag { .. } | Action::Release { .. } | Action::Shove { .. } => {
                return Err(EventError::Unsupported {
                    solver: self.name(),
                    action: action.name(),
                    remedy: "choose a solver with bodies, such as `shallow-water`",
                });
            }
            Action::Tilt { .. } => return Err(EventError::upright(self.name())),
        }
        self.lift(action)
    }

    fn report(&self) -> StepReport {
        self.report_of(0, 0.0)
    }

    fn bytes(&self) -> u64 {
        self.medium.bytes()
            + self.state.bytes()
            + self.shore.bytes()
            + self.explicit.bytes()
            + self.implicit.bytes()
    }
}

impl WaveEquation {
    /// Totals of the present state after `substeps` sub-steps.
    fn report_of(&self, substeps: u32, courant: f64) -> StepReport {
        let totals = totals::totals(&self.medium, &self.state);
        let rest = self.shore.rest_volume();
        StepReport {
            substeps,
            largest_stable_step: match self.scheme {
                WaveScheme::Explicit => self.medium.limit(),
                WaveScheme::Implicit | WaveScheme::ImplicitDamped => f64::INFINITY,
            },
            mass: crate::optics::WATER_DENSITY * (rest + totals.volume),
            momentum: totals.momentum,
            energy: totals.energies.physical,
            courant,
            froude: 0.0,
            clamps: 0,
        }
    }

    /// Adds the stamp to the elevation, unless that would make it run away.
    fn lift(&mut self, action: &Action) -> Result<(), EventError> {
        let limit = self.runaway();
        let (quantity, value) = match *action {
            Action::Drop { volume, .. } => ("volume", volume),
            Action::Press { depth, .. } => ("depth", depth),
            _ => return Ok(()),
        };
        // A wrapping stamp may meet a sample more than once; each meeting is far below the limit of f32.
        let most = self
            .stamp
            .weights
            .iter()
            .map(|(_, w)| w.abs())
            .fold(0.0, f64::max);
        if most > limit {
            return Err(EventError::Impossible {
                action: action.name(),
                quantity,
                value,
                remedy: "the surface would rise or fall by more than 10 000 depths; give a smaller one or a larger radius",
            });
        }
        for &(k, weight) in &self.stamp.weights {
            self.state.eta[k] = (f64::from(self.state.eta[k]) + weight) as f32;
        }
        Ok(())
    }

    /// Adds the stamp times `velocity` to the flux.
    fn push(&mut self, velocity: Vec2) -> Result<(), EventError> {
        let fastest = RUNAWAY_DEPTHS * self.medium.fastest().max(1.0);
        for value in [velocity.x, velocity.y] {
            if f64::from(value.abs()) > fastest {
                return Err(EventError::Impossible {
                    action: "push",
                    quantity: "velocity",
                    value,
                    remedy: "give less than 10 000 times the speed of the waves",
                });
            }
        }
        self.state.push(&self.medium, &self.stamp.weights, velocity);
        Ok(())
    }
}

/// Depth that gives waves of speed `c` (m/s), metres.
fn depth_of_speed(c: f64) -> f64 {
    c * c / GRAVITY
}

#[cfg(test)]
mod tests;
