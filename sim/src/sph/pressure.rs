//! Pressures that push and never pull, for which no particle is compressed: a linear complementarity problem.
//!
//! Sought are p ≥ 0 such that s + c D a(p) ≤ 0, and = 0 where p > 0, with s the compression that is not to be, D the rate
//! of compression and a(p) = −Dᵀ p the accelerations of p. The matrix c D Dᵀ is symmetric. Conjugate gradients with the
//! diagonal as preconditioner run on the particles that push, or should. Those that come to pull are let go, and the set is
//! taken anew, when what letting them go spoils is no longer little beside what is left to solve. Residuals of both signs
//! count: a pressure that is too high is an error as well.

use super::boundary::Touch;
use super::correction::Local;
use super::floating::{Carried, Floating};
use super::fluid::TASK;
use super::mirrors::Mirrors;
use super::neighbours::{Near, Neighbours};
use crate::reduce;
use glam::Vec4;
use rayon::prelude::*;

/// Applications of the matrix at most.
const MOST: u32 = 300;
/// What letting go of particles that pull may spoil, over the residual that is left. With none, most runs end at their
/// first steps on single particles at the surface; from 0.2 on the sets begin to come back and some solutions stall.
const BEARABLE: f64 = 0.03;
/// Conjugate directions before the set is taken anew.
const RUN: u32 = 100;

/// One system: what it sees of the particles.
pub(crate) struct System<'a> {
    pub(crate) neighbours: &'a Neighbours,
    pub(crate) mirrors: &'a Mirrors,
    pub(crate) local: &'a [Local],
    pub(crate) touch: &'a [Touch],
    /// With L, or with the plain gradients of the density.
    pub(crate) corrected: bool,
    /// The factor c.
    pub(crate) gain: f32,
    /// Bodies that the pressure accelerates as well, and the mass of a particle in kg.
    pub(crate) floating: Option<(&'a Floating, f64)>,
    /// Share of the tolerance at which a run may end.
    pub(crate) enough: f64,
}

/// Buffers of the solution; the arrays with images are longer than the particles are many.
#[derive(Debug, Default)]
pub(crate) struct Buffers {
    /// Pressures, with images.
    pub(crate) pressure: Vec<f32>,
    /// Accelerations of the pressures, with images.
    pub(crate) acceleration: Vec<Vec4>,
    pub(crate) source: Vec<f32>,
    /// What bodies move with the pressures or directions at hand.
    pub(crate) carried: Carried,
    residual: Vec<f32>,
    direction: Vec<f32>,
    product: Vec<f32>,
    weight: Vec<f32>,
    pushed: Vec<Vec4>,
    partial: Vec<f64>,
}

impl Buffers {
    pub(crate) fn bytes(&self) -> usize {
        4 * (self.pressure.capacity()
            + self.source.capacity()
            + self.residual.capacity()
            + self.direction.capacity()
            + self.product.capacity()
            + self.weight.capacity())
            + 16 * (self.acceleration.capacity() + self.pushed.capacity())
            + 8 * self.partial.capacity()
            + self.carried.bytes()
    }
}

/// Σ_j (v_i − v_j) ⊗ g_ij: columns belong to the components of g.
#[inline]
pub(crate) fn differences(near: &Near<'_>, v: &[Vec4]) -> [Vec4; 3] {
    let own = v[near.i];
    let mut sum = [Vec4::ZERO; 3];
    for (j, g) in near.pairs() {
        let dv = own - v[j];
        sum[0] += g.x * dv;
        sum[1] += g.y * dv;
        sum[2] += g.z * dv;
    }
    sum
}

impl System<'_> {
    fn n(&self) -> usize {
        self.local.len()
    }

    /// Rate of compression of particle `near.i` in the field `v`, walls at rest.
    #[inline]
    pub(crate) fn rate(&self, near: &Near<'_>, v: &[Vec4]) -> f32 {
        let own = v[near.i];
        let wall = self.touch[near.i].gradient;
        let (gradients, wall) = if self.corrected {
            (near.own, self.local[near.i].correct(wall.extend(0.0)).truncate())
        } else {
            (near.pair, wall)
        };
        let sum = near.sum(gradients, |j, g| (own - v[j]) * g);
        sum.truncate().element_sum() + own.truncate().dot(wall)
    }

    /// What the motion of walls takes from [`Self::rate`].
    pub(crate) fn moving(&self, i: usize) -> f32 {
        let touch = &self.touch[i];
        let g = touch.gradient;
        if self.corrected && touch.moving != 0.0 {
            let along = g.dot(self.local[i].correct(g.extend(0.0)).truncate());
            touch.moving * along / g.length_squared().max(1e-20)
        } else {
            touch.moving
        }
    }

    /// Accelerations of `pressure`, both with images, and of bodies.
    fn accelerate(&self, pressure: &mut Vec<f32>, out: &mut Vec<Vec4>, carried: &mut Carried) {
        let n = self.n();
        self.mirrors.extend_scalars(pressure, n);
        out.resize(n + self.mirrors.len(), Vec4::ZERO);
        let p: &[f32] = pressure;
        self.neighbours.map(&mut out[..n], |near| {
            let (own, local) = (p[near.i], &self.local[near.i]);
            let (gradients, sum) = if self.corrected {
                (near.other, local.correct(local.sum.extend(0.0)).truncate())
            } else {
                (near.pair, local.sum)
            };
            let others = near.sum(gradients, |j, g| p[j] * g);
            (-others.truncate() - own * sum).extend(0.0)
        });
        self.mirrors.extend_vectors(out, n);
        match self.floating {
            Some((floating, mass)) => floating.accelerate(p, mass, n, carried),
            None => carried.clear(),
        }
    }

    /// How far particle `i` is from a solution: compression that is left, or what a pressure too high opens.
    #[inline]
    fn error(&self, i: usize, residual: f32, pressure: f32) -> f64 {
        let error = if residual > 0.0 {
            residual
        } else {
            (-residual).min(pressure * self.gain / self.inverse(i))
        };
        f64::from(error)
    }

    #[inline]
    fn inverse(&self, i: usize) -> f32 {
        self.local[i].inverse[usize::from(!self.corrected)]
    }

    /// Solves for `pressure`, which holds a guess, and leaves its accelerations in `work`. Returns the applications of
    /// the matrix and the mean residual.
    pub(crate) fn solve(&self, pressure: &mut [f32], work: &mut Buffers, tolerance: f64) -> (u32, f64) {
        let n = self.n();
        for list in [&mut work.residual, &mut work.product, &mut work.weight] {
            list.resize(n, 0.0);
        }
        work.pressure.clear();
        work.pressure.extend_from_slice(pressure);
        let mut iterations = 0;
        let left = loop {
            self.accelerate(&mut work.pressure, &mut work.acceleration, &mut work.carried);
            let (a, p, source) = (&work.acceleration, &work.pressure, &work.source);
            let carried = &work.carried;
            let left = self
                .neighbours
                .map_sum(&mut work.residual, &mut work.partial, |near| {
                    let rate = self.rate(&near, a) - carried.at(near.i);
                    let residual = source[near.i] + self.gain * rate;
                    (residual, self.error(near.i, residual, p[near.i]))
                })
                / n as f64;
            iterations += 1;
            if left <= tolerance || iterations >= MOST || !left.is_finite() {
                break left;
            }
            iterations += self.descend(work, self.enough * tolerance * n as f64);
        };
        pressure.copy_from_slice(&work.pressure[..n]);
        (iterations, left)
    }

    /// Conjugate gradients on one set of particles, until the sum of the residuals is `enough` or less than what letting
    /// go of those that pull would add. Returns the steps taken.
    fn descend(&self, work: &mut Buffers, enough: f64) -> u32 {
        let n = self.n();
        // The preconditioner; particles that take no part have the weight 0, and so no direction.
        let (p, r) = (&work.pressure, &work.residual);
        let tasks = work.weight.par_iter_mut().with_min_len(TASK).enumerate();
        tasks.for_each(|(i, weight)| {
            *weight = if r[i] < 0.0 && p[i] <= 0.0 {
                0.0
            } else {
                self.inverse(i)
            };
        });
        work.direction.clear();
        work.direction.resize(n, 0.0);
        let weight = &work.weight;
        let mut size = reduce::sum(n, |i| f64::from(r[i] * r[i] * weight[i]));
        let (mut keep, mut steps) = (0.0, 0);
        while steps < RUN && size > 0.0 {
            let (r, weight) = (&work.residual, &work.weight);
            let tasks = work.direction[..n].par_iter_mut().with_min_len(TASK).enumerate();
            tasks.for_each(|(i, s)| *s = r[i] * weight[i] + keep * *s);
            self.accelerate(&mut work.direction, &mut work.pushed, &mut work.carried);
            let (pushed, direction, carried) = (&work.pushed, &work.direction, &work.carried);
            let curvature = self
                .neighbours
                .map_sum(&mut work.product, &mut work.partial, |near| {
                    let product = -self.gain * (self.rate(&near, pushed) - carried.at(near.i));
                    (product, f64::from(product * direction[near.i]))
                });
            steps += 1;
            if !(curvature > 0.0) {
                break;
            }
            let along = (size / curvature) as f32;
            let product = &work.product;
            let tasks = work.pressure[..n].par_iter_mut().zip(&mut work.residual);
            tasks.with_min_len(TASK).enumerate().for_each(|(i, (p, r))| {
                *p += along * direction[i];
                *r -= along * product[i];
            });
            let (p, r) = (&work.pressure, &work.residual);
            let [spoilt, left, next] = reduce::reduce(
                n,
                [0.0; 3],
                |i| {
                    let share = f64::from(r[i] * r[i] * weight[i]);
                    let pull = f64::from((-p[i]).max(0.0) * self.gain / self.inverse(i));
                    let left = if weight[i] > 0.0 { r[i].abs() } else { 0.0 };
                    [pull, f64::from(left), share]
                },
                |a, b| [a[0] + b[0], a[1] + b[1], a[2] + b[2]],
            );
            if left <= enough || spoilt > BEARABLE * left {
                break;
            }
            keep = (next / size) as f32;
            size = next;
        }
        let tasks = work.pressure[..n].par_iter_mut().with_min_len(TASK);
        tasks.for_each(|p| *p = p.max(0.0));
        steps
    }
}

/// Inverse of the diagonal of D Dᵀ, m², with L and without, from the sums of the squares of g and of L g; `least` bounds
/// the diagonal from below.
pub(crate) fn inverse_diagonal([plain, corrected]: [f32; 2], local: &Local, least: f32) -> [f32; 2] {
    let sum = local.correct(local.sum.extend(0.0));
    [
        1.0 / (corrected + sum.length_squared()).max(least),
        1.0 / (plain + local.sum.length_squared()).max(least),
    ]
}
