//! The seam between a solver and everything else.

use crate::events::{Action, EventError};
use crate::frame::{BodyPose, Channels, Frame};
use crate::grid::GridSpec;
use crate::mesh::TriangleMesh;
use serde::{Deserialize, Serialize};

/// A method that moves water through time and hands out heightfield frames.
pub trait Solver: Send {
    /// Name of the method as in scene files, for reports.
    fn name(&self) -> &'static str;

    /// Where the samples of its frames stand.
    fn spec(&self) -> GridSpec;

    /// Simulated time in seconds.
    fn time(&self) -> f64;

    /// The optional channels that [`Self::extract`] can fill.
    fn offers(&self) -> Channels;

    /// Advances by `dt` seconds (> 0), in as many stable sub-steps as that takes.
    ///
    /// # Errors
    /// [`StepError`] if no stable sub-step can cover `dt` or the state would leave what the method can represent.
    /// The state is then the one before the call or, for [`StepError::Unstable`], must not be used any more.
    /// No NaN, negative depth or runaway value ever leaves `advance` as `Ok`.
    fn advance(&mut self, dt: f32) -> Result<StepReport, StepError>;

    /// Writes the present state into `out`, with the channels `want & offers()` and no others, reusing allocations.
    /// `out.time` is set; `out.index` is the caller's.
    fn extract(&self, want: Channels, out: &mut Frame);

    /// Acts on the water now: a drop, a push. The state changes at once.
    ///
    /// # Errors
    /// [`EventError`] if this method cannot do such a thing or the values are impossible.
    fn apply(&mut self, action: &Action) -> Result<(), EventError>;

    /// Totals of the present state, with `substeps` 0: what [`Self::advance`] reports, before the first step.
    fn report(&self) -> StepReport;

    /// Bytes held for state and work arrays.
    fn bytes(&self) -> u64;

    /// Where the time of the latest [`Self::advance`] went: named stages with their seconds, in order; empty where the method
    /// has but one.
    fn stages(&self) -> &[(&'static str, f64)] {
        &[]
    }

    /// How often in seconds the solver wants to be told what floating bodies displace ([`Self::stir`]); `None` if it
    /// leaves them their waves.
    fn stirred_every(&self) -> Option<f64> {
        None
    }

    /// Makes the waves of a body that moved; `false` if they are too small to be made, so that what it displaced can be
    /// counted with the next.
    ///
    /// # Errors
    /// [`StepError`] if there would be more of them than the method can hold.
    fn stir(&mut self, _: &Stirring<'_>) -> Result<bool, StepError> {
        Ok(false)
    }

    /// What is held besides [`Self::bytes`] because the scene asks for it.
    fn extras(&self) -> Vec<Extra> {
        Vec::new()
    }
}

/// A body that moved through the surface.
#[derive(Clone, Copy, Debug)]
pub struct Stirring<'a> {
    /// Its closed hull, body axes.
    pub mesh: &'a TriangleMesh,
    /// Where it was, about halfway, and is.
    pub poses: [BodyPose; 3],
    /// Simulated time of the first pose in seconds; the last is that of the present.
    pub since: f64,
}

/// Something that a solver holds because the scene asks for it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Extra {
    /// What it is.
    pub name: &'static str,
    /// What of the scene asks for it.
    pub reason: String,
    /// Bytes held.
    pub bytes: u64,
}

/// What a step did and what the state is now; the same for every method, so that a study or a plot need not know it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct StepReport {
    /// Sub-steps taken.
    pub substeps: u32,
    /// Largest stable step in seconds for the present state; infinite where the method has no limit.
    pub largest_stable_step: f64,
    /// Mass of water in kg (density 1000 kg/m³), droplets included. Methods without a bed report the mass relative
    /// to rest, which may be negative.
    pub mass: f64,
    /// Momentum along X and Z in kg m/s.
    pub momentum: [f64; 2],
    /// Kinetic plus potential energy in J, potential energy relative to still water; with bodies, theirs included.
    pub energy: f64,
    /// Largest Courant number of the sub-steps taken.
    pub courant: f64,
    /// Largest Froude number, 0 where the method has none.
    pub froude: f64,
    /// How many times a clamp or limiter of last resort fired (never counted as normal operation).
    pub clamps: u64,
}

/// Why a step was refused or failed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum StepError {
    /// The step is not a positive finite time.
    #[error("step of {dt} s is not a positive finite time")]
    InvalidStep {
        /// The step asked for, seconds.
        dt: f32,
    },
    /// The step is above the method's limit and the method does not sub-step.
    #[error("step of {dt} s exceeds the stability limit of {limit:.6e} s ({reason}); {remedy}")]
    TooLarge {
        /// The step asked for, seconds.
        dt: f64,
        /// The largest stable step, seconds.
        limit: f64,
        /// What sets the limit.
        reason: String,
        /// What to change.
        remedy: String,
    },
    /// Covering the step would take more sub-steps than allowed.
    #[error("step of {dt} s needs {needed} sub-steps, more than the {allowed} allowed; {remedy}")]
    TooManySubsteps {
        /// The step asked for, seconds.
        dt: f64,
        /// Sub-steps that the stability limit asks for.
        needed: u64,
        /// Sub-steps allowed.
        allowed: u64,
        /// What to change.
        remedy: String,
    },
    /// The state lies outside the range in which the method can be trusted. It is as it was before the sub-step that was
    /// refused.
    #[error(
        "{quantity} is {value:e} at sample ({i}, {j}) at t = {time} s, and the method reaches to {limit:e}; {remedy}"
    )]
    OutOfRange {
        /// Which quantity, with its unit.
        quantity: &'static str,
        /// Its value.
        value: f64,
        /// The value up to which the method is trusted.
        limit: f64,
        /// Sample along X.
        i: usize,
        /// Sample along Z.
        j: usize,
        /// Simulated time, seconds.
        time: f64,
        /// What to change.
        remedy: String,
    },
    /// The step would make more of something than allowed. The state is the one before the call.
    #[error("there would be more than {allowed} {what} by t = {time} s; {remedy}")]
    Crowded {
        /// What there would be too many of.
        what: &'static str,
        /// How many are allowed.
        allowed: u64,
        /// The time that was to be reached, seconds.
        time: f64,
        /// What to change.
        remedy: String,
    },
    /// A body could not be moved; the state must not be used.
    #[cfg(feature = "bodies")]
    #[error(transparent)]
    Body(#[from] crate::bodies::MotionError),
    /// A quantity left its range; the state must not be used.
    #[error("{quantity} is {value:e} at sample ({i}, {j}) at t = {time} s, beyond {limit:e}; {remedy}")]
    Unstable {
        /// Which quantity, with its unit.
        quantity: &'static str,
        /// Its value.
        value: f64,
        /// The value that it must not pass.
        limit: f64,
        /// Sample along X.
        i: usize,
        /// Sample along Z.
        j: usize,
        /// Simulated time, seconds.
        time: f64,
        /// What to change.
        remedy: String,
    },
}

impl From<std::convert::Infallible> for StepError {
    fn from(never: std::convert::Infallible) -> Self {
        match never {}
    }
}

impl StepError {
    /// Checks that `dt` is a positive finite time: the first line of every `advance`.
    ///
    /// # Errors
    /// [`StepError::InvalidStep`] otherwise.
    pub fn check_step(dt: f32) -> Result<(), Self> {
        if dt.is_finite() && dt > 0.0 {
            Ok(())
        } else {
            Err(Self::InvalidStep { dt })
        }
    }
}
