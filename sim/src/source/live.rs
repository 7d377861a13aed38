//! A solver driven through time, with the scene's events delivered at their times.

use super::{FrameSource, Progress, SourceError};
use crate::events::{Action, EventError, Schedule};
use crate::frame::{Channels, Frame};
use crate::scene::Scene;
use crate::scene::description::Object;
use crate::solver::{Solver, StepError, StepReport};
use crate::stages::Stages;
use std::time::Instant;

/// Share of a frame's duration below which two moments count as the same: steps are `f32`, so the solver's clock is
/// off by their rounding (and corrected by the next step).
const SAME_MOMENT: f64 = 1e-6;

/// Frames of a live solver: frame `k` is the state at `k / recording.rate` seconds, frame 0 the initial state.
///
/// The scene's events act at their own times between frames; an event at exactly a frame's time acts after that
/// frame. The poses of fixed and moving objects are added where the channel `bodies` is asked for.
pub struct LiveSource {
    solver: Box<dyn Solver>,
    schedule: Schedule,
    objects: Vec<Object>,
    channels: Channels,
    rate: f64,
    next: u64,
    end: Option<u64>,
    /// What ended the run: the state after it must not be used.
    failed: Option<SourceError>,
    pending: Vec<(f64, Action)>,
    /// What was sent live, with the time of the frame after which it was.
    acted: Vec<(f64, Action)>,
    /// What is to be sent again, in order of time, the next one last.
    again: Vec<(f64, Action)>,
    stages: Stages,
}

impl LiveSource {
    /// Drives `solver` through `scene` and hands out `channels`, as far as they are offered. Endless; see
    /// [`Self::until`].
    pub fn new(scene: &Scene, solver: Box<dyn Solver>, channels: Channels) -> Self {
        let description = &scene.description;
        Self {
            schedule: Schedule::new(&description.events, description.seed, solver.spec()),
            objects: description.objects.clone(),
            channels,
            rate: description.recording.rate,
            solver,
            next: 0,
            end: None,
            failed: None,
            pending: Vec::new(),
            acted: Vec::new(),
            again: Vec::new(),
            stages: Stages::default(),
        }
    }

    /// Sends again what [`Self::acted`] gave of another run of the same scene, which this one then repeats exactly.
    #[must_use]
    pub fn repeating(mut self, acted: &[(f64, Action)]) -> Self {
        self.again = acted.iter().rev().cloned().collect();
        self
    }

    /// What was sent by [`Self::act`] and when, in order of time.
    pub fn acted(&self) -> &[(f64, Action)] {
        &self.acted
    }

    /// Ends after the last frame whose time is at most `duration` seconds.
    #[must_use]
    pub fn until(mut self, duration: f64) -> Self {
        // A duration that is meant to be a whole number of frames must not lose one to rounding.
        let last = (duration * self.rate + SAME_MOMENT).floor();
        self.end = Some(if last >= 0.0 { last as u64 + 1 } else { 0 });
        self
    }

    /// Number of frames until the end, if there is one.
    pub fn frames(&self) -> Option<u64> {
        self.end
    }

    /// The optional channels that its frames can hold: the solver's, and the poses of the scene's objects.
    pub fn offers(&self) -> Channels {
        if self.objects.is_empty() {
            self.solver.offers()
        } else {
            self.solver.offers() | Channels::BODIES
        }
    }

    /// The optional channels that its frames do hold.
    pub fn channels(&self) -> Channels {
        self.channels & self.offers()
    }

    /// The solver.
    pub fn solver(&self) -> &dyn Solver {
        self.solver.as_ref()
    }

    /// Where the time of the latest frame went: the solver's stages, and making a frame of its state; named, with seconds.
    pub fn stages(&self) -> &[(&'static str, f64)] {
        self.stages.as_slice()
    }

    /// Acts on the water now, at the time of the latest frame: for a pointer in a window.
    ///
    /// # Errors
    /// [`EventError`] if the solver cannot do such a thing; the state is then unchanged.
    pub fn act(&mut self, action: &Action) -> Result<(), EventError> {
        self.solver.apply(action)?;
        let latest = self.next.saturating_sub(1) as f64 / self.rate;
        self.acted.push((latest, action.clone()));
        Ok(())
    }

    /// Steps the solver to `time`, adding what it did to `total`.
    fn advance_to(&mut self, time: f64, total: &mut Option<StepReport>) -> Result<(), StepError> {
        let dt = time - self.solver.time();
        if dt <= SAME_MOMENT / self.rate {
            return Ok(());
        }
        let mut clock = Instant::now();
        let report = self.solver.advance(dt as f32)?;
        self.stages.of(&*self.solver, &mut clock);
        *total = Some(match total.take() {
            Some(before) => merge(before, report),
            None => report,
        });
        Ok(())
    }

    /// Brings the solver to `time`, the scene's events included.
    fn run_to(&mut self, time: f64) -> Result<StepReport, SourceError> {
        while let Some((_, action)) = self.again.pop_if(|(moment, _)| *moment < time) {
            self.act(&action)?;
        }
        let mut actions = std::mem::take(&mut self.pending);
        actions.clear();
        self.schedule.take_until(time, &mut actions);
        let mut total = None;
        for (moment, action) in &actions {
            self.advance_to(*moment, &mut total)?;
            self.solver.apply(action)?;
        }
        self.advance_to(time, &mut total)?;
        self.pending = actions;
        Ok(total.unwrap_or_else(|| self.solver.report()))
    }
}

impl FrameSource for LiveSource {
    fn read_into(&mut self, out: &mut Frame) -> Result<Progress, SourceError> {
        if let Some(error) = self.failed.as_ref().and_then(again) {
            return Err(error);
        }
        if self.end.is_some_and(|end| self.next >= end) {
            return Ok(Progress::End);
        }
        let time = self.next as f64 / self.rate;
        self.stages.clear();
        let report = if self.next == 0 {
            self.solver.report()
        } else {
            match self.run_to(time) {
                Ok(report) => report,
                Err(error) => {
                    self.failed = again(&error);
                    return Err(error);
                }
            }
        };
        let mut clock = Instant::now();
        let poses = self.channels() - self.solver.offers();
        self.solver.extract(self.channels - poses, out);
        if poses.contains(Channels::BODIES) {
            out.bodies = Some(self.objects.iter().map(|o| o.pose_at(time)).collect());
        }
        out.time = time;
        out.index = self.next;
        out.check_finite()?;
        self.stages.lap("frame", &mut clock);
        self.next += 1;
        Ok(Progress::Frame(Some(report)))
    }
}

/// The same error once more, where it ends the run.
fn again(error: &SourceError) -> Option<SourceError> {
    match error {
        SourceError::Step(e) => Some(SourceError::Step(e.clone())),
        SourceError::Event(e) => Some(SourceError::Event(e.clone())),
        _ => None,
    }
}

/// One report for two steps in sequence: what was done adds up, the state is the later one.
fn merge(before: StepReport, after: StepReport) -> StepReport {
    StepReport {
        substeps: before.substeps.saturating_add(after.substeps),
        courant: before.courant.max(after.courant),
        froude: before.froude.max(after.froude),
        clamps: before.clamps.saturating_add(after.clamps),
        ..after
    }
}
