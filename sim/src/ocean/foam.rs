//! Foam where the surface is pressed together: grows where the Jacobian is small, fades with time.
//!
//! Foam lives on a clock of its own, so that it depends on the time alone and not on when frames are asked for: its
//! state at whole steps follows from the one before, and frames interpolate between two of them. What came before the
//! first step is made up for by running some steps first.

use crate::scene::description::OceanFoam;

/// Longest step of foam in seconds.
const STEP: f64 = 0.05;
/// Time constants of fading that are run before the first state, and how many steps at most.
const MEMORY: f64 = 3.0;
const MOST_STEPS: f64 = 400.0;

/// Parameters and state of an ocean's foam.
#[derive(Debug)]
pub(super) struct Foam {
    how: OceanFoam,
    /// Seconds a step.
    step: f64,
    /// Steps a loop, for an ocean that repeats.
    steps_a_loop: Option<u64>,
    state: Option<State>,
    /// The state at the start of a loop.
    first: Vec<f32>,
}

/// Coverage at a step and at the next.
#[derive(Debug)]
struct State {
    step: u64,
    now: Vec<f32>,
    next: Vec<f32>,
}

impl Foam {
    pub(super) fn new(how: OceanFoam, loop_period: Option<f64>) -> Self {
        let steps_a_loop = loop_period.map(|t| (t / STEP).ceil().max(1.0) as u64);
        let step = match (loop_period, steps_a_loop) {
            (Some(period), Some(steps)) => period / steps as f64,
            _ => STEP,
        };
        Self {
            how,
            step,
            steps_a_loop,
            state: None,
            first: Vec::new(),
        }
    }

    pub(super) fn bytes(&self) -> u64 {
        let state = self.state.as_ref().map_or(0, |s| s.now.len() + s.next.len());
        4 * (state + self.first.len()) as u64
    }

    /// Grows and fades `foam` over one step in which the surface has the Jacobian `jacobian`.
    fn advance(&self, jacobian: &[f32], foam: &mut [f32]) {
        let (fade, growth) = (self.how.fade as f32, self.how.growth as f32);
        let threshold = self.how.threshold as f32;
        let step = self.step as f32;
        let faded = (-fade * step).exp();
        for (foam, j) in foam.iter_mut().zip(jacobian) {
            let source = growth * (threshold - j).max(0.0);
            *foam = if source > 0.0 {
                // Exact for a constant source, so it stays in [0, 1] whatever the rates.
                let full = source / (source + fade);
                full + (*foam - full) * (-(source + fade) * step).exp()
            } else {
                *foam * faded
            };
        }
    }

    /// Coverage at `time` seconds (of the loop, for an ocean that repeats) into `out`. `jacobian(t, out)` writes the
    /// Jacobian at the samples at time `t`, which may be negative.
    pub(super) fn at(&mut self, time: f64, jacobian: &mut dyn FnMut(f64, &mut Vec<f32>), out: &mut [f32]) {
        let whole = (time / self.step).floor();
        let mut step = whole as u64;
        if let Some(steps) = self.steps_a_loop {
            step %= steps;
        }
        let mut j = Vec::new();
        let mut state = match self.state.take() {
            Some(state) if state.step <= step && step - state.step < self.warm_up() => state,
            _ => self.begin(step, jacobian, &mut j, out.len()),
        };
        while state.step < step {
            std::mem::swap(&mut state.now, &mut state.next);
            state.step += 1;
            self.follow(&mut state, jacobian, &mut j);
        }
        let share = (time / self.step - whole) as f32;
        for ((out, now), next) in out.iter_mut().zip(&state.now).zip(&state.next) {
            *out = now + share * (next - now);
        }
        self.state = Some(state);
    }

    fn warm_up(&self) -> u64 {
        (MEMORY / (self.how.fade * self.step)).ceil().min(MOST_STEPS) as u64
    }

    /// The state at `step` from no foam some time before.
    fn begin(
        &mut self,
        step: u64,
        jacobian: &mut dyn FnMut(f64, &mut Vec<f32>),
        j: &mut Vec<f32>,
        samples: usize,
    ) -> State {
        // A loop always begins at its own start, so that the second round is the first.
        let target = if self.steps_a_loop.is_some() { 0 } else { step };
        let mut state = State {
            step: target,
            now: vec![0.0; samples],
            next: Vec::new(),
        };
        if self.first.len() == samples {
            state.now.copy_from_slice(&self.first);
        } else {
            let steps = self.warm_up();
            for k in 1..=steps {
                jacobian((target as f64 - (steps - k) as f64) * self.step, j);
                self.advance(j, &mut state.now);
            }
            if self.steps_a_loop.is_some() {
                self.first.clone_from(&state.now);
            }
        }
        self.follow(&mut state, jacobian, j);
        state
    }

    /// Fills in the state after the present one.
    fn follow(&self, state: &mut State, jacobian: &mut dyn FnMut(f64, &mut Vec<f32>), j: &mut Vec<f32>) {
        state.next.clone_from(&state.now);
        if self.steps_a_loop == Some(state.step + 1) {
            state.next.clone_from(&self.first);
            return;
        }
        jacobian((state.step + 1) as f64 * self.step, j);
        self.advance(j, &mut state.next);
    }
}
