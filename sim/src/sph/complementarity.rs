//! Pressures that push and never pull, for which no particle is compressed: a linear complementarity problem.
//!
//! Sought are p ≥ 0 such that r = s + c (D a(p) − R p) ≤ 0, and = 0 where p > 0, with s the compression that is not to be
//! and R a little of what keeps pressures smooth (`pressure`). Conjugate gradients with the diagonal as preconditioner run on the
//! particles that push, or should. Those that come to pull are let go when that spoils no longer little beside what is
//! left to solve. That does not end the run: what letting them go changes is found together with what the next direction
//! does, in one pass over the pairs, and that direction is made conjugate to the last one on the particles that are left.
//! Accelerations are summed up on the way.
//! Residuals of both signs count: a pressure that is too high is an error as well.

use super::floating::Carried;
use super::fluid::TASK;
use super::pressure::{Applied, System};
use glam::Vec4;
use rayon::prelude::*;

/// Applications of the matrix at most.
const MOST: u32 = 300;
/// What letting go of particles that pull may spoil, over the residual that is left, before it is done. With none, the
/// directions lose on single particles at the surface what they had gained.
const BEARABLE: f64 = 0.05;
/// Share of R that counts for the guess; of the rest only what the pressure has changed by since does, so that what R takes from
/// the pressure in the long run is less by as much.
const KEPT: f32 = 0.3;

/// Buffers of the solution.
#[derive(Debug, Default)]
pub(crate) struct Buffers {
    /// Accelerations of the pressures.
    pub(crate) acceleration: Vec<Vec4>,
    /// What bodies do under the pressures.
    pub(crate) carried: Carried,
    /// Velocities times a step, with images.
    moved: Vec<Vec4>,
    state: State,
    /// The direction at hand, and the same with what is added to pressures that pull.
    one: Applied<1>,
    two: Applied<2>,
}

/// Where the solution stands, by particle.
#[derive(Debug, Default)]
struct State {
    pressure: Vec<f32>,
    residual: Vec<f32>,
    /// Inverse of the diagonal but for the factor c, m².
    inverse: Vec<f32>,
    /// The residual after preconditioning, 0 of particles that take no part.
    descent: Vec<f32>,
    direction: Vec<f32>,
    /// What the last direction added to the compression.
    product: Vec<f32>,
    /// What is to be added to pressures that pull.
    added: Vec<f32>,
}

impl Buffers {
    pub(crate) fn bytes(&self) -> usize {
        let s = &self.state;
        let lists = [
            &s.pressure,
            &s.residual,
            &s.inverse,
            &s.descent,
            &s.direction,
            &s.product,
            &s.added,
        ];
        16 * (self.acceleration.capacity() + self.moved.capacity())
            + 4 * lists.into_iter().map(Vec::capacity).sum::<usize>()
            + self.carried.bytes()
            + self.one.bytes()
            + self.two.bytes()
    }
}

impl System<'_> {
    /// Solves for `pressure`, which holds a guess, and leaves its accelerations in `work`. The compression that is not to be
    /// is `besides` of every particle and what `flow`, with images, does in `dt` seconds. Returns the applications of the matrix
    /// and the mean residual.
    pub(crate) fn solve(
        &self,
        pressure: &mut [f32],
        (flow, dt): (&[Vec4], f32),
        besides: impl Fn(usize) -> f32 + Sync,
        work: &mut Buffers,
        tolerance: f64,
    ) -> (u32, f64) {
        let n = self.n();
        let mut iterations = 1;
        let [mut left, mut spoilt] = self.begin(pressure, (flow, dt), besides, work);
        let Buffers {
            acceleration,
            state,
            carried,
            one,
            two,
            ..
        } = work;
        let mut curvature = f64::INFINITY;
        // A guess that will do is left alone: what changes it moves still water.
        let all = tolerance * n as f64;
        let mut within = self.solution.guess * all;
        let [least, most] = self.solution.enough.map(|share| share * all);
        let enough = (self.solution.share * left).clamp(least, most);
        while left + spoilt > within && iterations < MOST {
            within = enough;
            let clip = spoilt > BEARABLE * left;
            let keep = -state.descend(self.gain, clip) / curvature;
            state.turn(keep as f32);
            let (direction, residual) = (&state.direction, &state.residual);
            let weight = |i: usize, residual: f32, product: f32| {
                let s = f64::from(direction[i]);
                [s * f64::from(residual), -s * f64::from(product)]
            };
            let fall;
            [fall, curvature] = if clip {
                two.pressure.clear();
                let both = direction.iter().zip(&state.added).map(|(s, added)| [*s, *added]);
                two.pressure.extend(both);
                self.apply(two, |i, [q, added]| weight(i, residual[i] + added, q))
            } else {
                one.pressure.clear();
                one.pressure.extend(direction.iter().map(|s| [*s]));
                self.apply(one, |i, [q]| weight(i, residual[i], q))
            };
            iterations += 1;
            if !(curvature > 0.0) {
                break;
            }
            let along = (fall / curvature) as f32;
            [left, spoilt] = if clip {
                state.advance(self.gain, two, along, acceleration)
            } else {
                state.advance(self.gain, one, along, acceleration)
            };
        }
        let p = &state.pressure;
        self.carry(|i| p[i], carried);
        for (pressure, p) in pressure.iter_mut().zip(p) {
            *pressure = p.max(0.0);
        }
        (iterations, (left + spoilt) / n as f64)
    }

    /// Takes `pressure` as the guess. Returns what [`State::advance`] does.
    fn begin(
        &self,
        pressure: &[f32],
        (flow, dt): (&[Vec4], f32),
        besides: impl Fn(usize) -> f32 + Sync,
        work: &mut Buffers,
    ) -> [f64; 2] {
        let n = self.n();
        let (state, one) = (&mut work.state, &mut work.one);
        one.pressure.clear();
        one.pressure.extend(pressure.iter().map(|p| [*p]));
        self.accelerate(one);
        // The flow and what the guess makes of it compress together, in one pass.
        let both = one.pushed.iter().zip(flow);
        work.moved.clear();
        let own = Vec4::ONE.with_w(KEPT) * self.gain;
        work.moved
            .extend(both.map(|(a, v)| own * a[0] + dt * v.with_w(0.0)));
        let (moved, carried) = (&work.moved, &one.carried[0]);
        one.product.resize(n, [0.0]);
        self.neighbours.map(&mut one.product, |near| {
            [besides(near.i) + self.rate(&near, moved) - self.gain * carried.at(near.i)]
        });
        for list in [&mut state.direction, &mut state.added, &mut state.residual] {
            list.clear();
            list.resize(n, 0.0);
        }
        for list in [&mut state.descent, &mut state.product] {
            list.resize(n, 0.0);
        }
        state.pressure.clear();
        state.pressure.extend_from_slice(pressure);
        state.inverse.clear();
        state.inverse.extend((0..n).map(|i| self.inverse(i)));
        work.acceleration.clear();
        work.acceleration.resize(n, Vec4::ZERO);
        state.advance(self.gain, one, 1.0, &mut work.acceleration)
    }
}

impl State {
    /// Preconditions the residual, with the factor `gain` c. With `clip`, lets go of those that pull: they take no part in
    /// the next direction. Returns the product of that, the last direction and what it added.
    fn descend(&mut self, gain: f32, clip: bool) -> f64 {
        let tasks = self
            .pressure
            .par_chunks_mut(TASK)
            .zip(self.added.par_chunks_mut(TASK))
            .zip(self.descent.par_chunks_mut(TASK))
            .zip(self.residual.par_chunks(TASK))
            .zip(self.inverse.par_chunks(TASK))
            .zip(self.product.par_chunks(TASK));
        total(tasks.map(|(((((p, added), descent), r), inverse), product)| {
            let mut sum = 0.0;
            for k in 0..p.len() {
                added[k] = if clip { (-p[k]).max(0.0) } else { 0.0 };
                p[k] += added[k];
                // Of what is added only the diagonal is known yet.
                let residual = r[k] - added[k] * gain / inverse[k];
                let part = residual >= 0.0 || p[k] > 0.0;
                descent[k] = if part { residual * inverse[k] } else { 0.0 };
                sum -= f64::from(descent[k] * product[k]);
            }
            [sum, 0.0]
        }))[0]
    }

    /// Takes the next direction, with a share of the last one.
    fn turn(&mut self, keep: f32) {
        let tasks = self
            .direction
            .par_iter_mut()
            .zip(&self.descent)
            .with_min_len(TASK);
        tasks.for_each(|(s, z)| *s = if *z == 0.0 { 0.0 } else { z + keep * *s });
    }

    /// Goes so far `along` the direction of which `applied` says what it does, with what is added besides. Returns the
    /// sums of the errors and of what letting go of those that pull would add.
    fn advance<const K: usize>(
        &mut self,
        gain: f32,
        applied: &Applied<K>,
        along: f32,
        acceleration: &mut [Vec4],
    ) -> [f64; 2] {
        let tasks = self
            .pressure
            .par_chunks_mut(TASK)
            .zip(self.residual.par_chunks_mut(TASK))
            .zip(self.product.par_chunks_mut(TASK))
            .zip(acceleration.par_chunks_mut(TASK))
            .zip(self.direction.par_chunks(TASK))
            .zip(self.inverse.par_chunks(TASK))
            .zip(applied.product.par_chunks(TASK))
            .zip(applied.pushed[..self.inverse.len()].par_chunks(TASK));
        total(
            tasks.map(|(((((((p, r), product), a), s), inverse), q), pushed)| {
                let (mut left, mut spoilt) = (0.0, 0.0);
                for k in 0..p.len() {
                    let (q, pushed) = (&q[k], &pushed[k]);
                    product[k] = q[0];
                    r[k] += along * q[0] + q[1..].iter().sum::<f32>();
                    a[k] += along * pushed[0] + pushed[1..].iter().sum::<Vec4>();
                    p[k] += along * s[k];
                    // Compression that is left, or what a pressure too high opens.
                    let own = p[k] * gain / inverse[k];
                    left += f64::from(r[k].max((-r[k]).min(own.max(0.0))));
                    spoilt += f64::from((-own).max(0.0));
                }
                [left, spoilt]
            }),
        )
    }
}

/// Sum over tasks in their order, so that it does not depend on threads.
fn total(tasks: impl IndexedParallelIterator<Item = [f64; 2]>) -> [f64; 2] {
    let sums: Vec<[f64; 2]> = tasks.collect();
    sums.iter().fold([0.0; 2], |a, b| [a[0] + b[0], a[1] + b[1]])
}
