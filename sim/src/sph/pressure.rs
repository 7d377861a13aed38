//! Pressures that push and never pull, for which no particle is compressed: a linear complementarity problem.
//!
//! Sought are p ≥ 0 such that s + c D a(p) ≤ 0, and = 0 where p > 0, with s the compression that is not to be, D the rate
//! of compression and a(p) = −Dᵀ p the accelerations of p. The matrix c D Dᵀ is symmetric. Conjugate gradients with the
//! diagonal as preconditioner run on the particles that push, or should, until one of them would have to pull; those are
//! let go and the set is taken anew. Residuals of both signs count: a pressure that is too high is an error as well.

use super::boundary::Touch;
use super::correction::Local;
use super::fluid::TASK;
use super::mirrors::Mirrors;
use super::neighbours::{Near, Neighbours};
use crate::reduce;
use glam::{Vec3, Vec4};
use rayon::prelude::*;

/// Applications of the matrix at most.
const MOST: u32 = 300;
/// Conjugate directions before the set is taken anew.
const RUN: u32 = 40;

const UNIT: [Vec4; 3] = [Vec4::X, Vec4::Y, Vec4::Z];

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
}

/// Buffers of the solution; the arrays with images are longer than the particles are many.
#[derive(Debug, Default)]
pub(crate) struct Buffers {
    /// Pressures, with images.
    pub(crate) pressure: Vec<f32>,
    /// Accelerations of the pressures, with images.
    pub(crate) acceleration: Vec<Vec4>,
    pub(crate) source: Vec<f32>,
    residual: Vec<f32>,
    direction: Vec<f32>,
    product: Vec<f32>,
    pushed: Vec<Vec4>,
    partial: Vec<f64>,
}

impl Buffers {
    pub(crate) fn bytes(&self) -> usize {
        4 * (self.pressure.capacity()
            + self.source.capacity()
            + self.residual.capacity()
            + self.direction.capacity()
            + self.product.capacity())
            + 16 * (self.acceleration.capacity() + self.pushed.capacity())
            + 8 * self.partial.capacity()
    }
}

/// Σ_j (v_i − v_j) ⊗ g_ij: rows are the components of v.
#[inline]
pub(crate) fn differences(near: &Near<'_>, v: &[Vec4]) -> [Vec4; 3] {
    let own = v[near.i];
    let mut sum = [Vec4::ZERO; 3];
    for (j, g) in near.pairs() {
        let dv = own - v[j];
        sum[0] += dv.x * g;
        sum[1] += dv.y * g;
        sum[2] += dv.z * g;
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
        let rows = if self.corrected {
            &self.local[near.i].rows
        } else {
            &UNIT
        };
        let wall = self.touch[near.i].gradient;
        let own = v[near.i];
        let [x, y, z] = differences(near, v);
        let wall = wall.extend(0.0);
        rows[0].dot(x + own.x * wall) + rows[1].dot(y + own.y * wall) + rows[2].dot(z + own.z * wall)
    }

    /// What the motion of walls takes from [`Self::rate`].
    pub(crate) fn moving(&self, i: usize) -> f32 {
        let touch = &self.touch[i];
        let g = touch.gradient;
        if self.corrected && touch.moving != 0.0 {
            let along = g.dot(self.local[i].correct(g.extend(0.0)));
            touch.moving * along / g.length_squared().max(1e-20)
        } else {
            touch.moving
        }
    }

    /// Accelerations of `pressure`, both with images.
    fn accelerate(&self, pressure: &mut Vec<f32>, out: &mut Vec<Vec4>) {
        let n = self.n();
        self.mirrors.extend_scalars(pressure, n);
        out.resize(n + self.mirrors.len(), Vec4::ZERO);
        let p: &[f32] = pressure;
        self.neighbours.map(&mut out[..n], |near| {
            let (own, local) = (p[near.i], &self.local[near.i]);
            let mut sum = Vec4::ZERO;
            if self.corrected {
                for (&j, e) in near.index.iter().zip(near.other) {
                    sum += p[j as usize] * *e;
                }
                (-sum.truncate() - own * local.correct(local.sum.extend(0.0))).extend(0.0)
            } else {
                for (j, g) in near.pairs() {
                    sum += p[j] * g;
                }
                (-sum.truncate() - own * local.sum).extend(0.0)
            }
        });
        self.mirrors.extend_vectors(out, n);
    }

    /// Solves for `pressure`, which holds a guess, and leaves its accelerations in `work`. Returns the applications of
    /// the matrix and the mean residual.
    pub(crate) fn solve(&self, pressure: &mut [f32], work: &mut Buffers, tolerance: f64) -> (u32, f64) {
        let n = self.n();
        let c = self.gain;
        let which = usize::from(!self.corrected);
        for list in [&mut work.residual, &mut work.product] {
            list.resize(n, 0.0);
        }
        work.pressure.clear();
        work.pressure.extend_from_slice(pressure);
        let inverse = |i: usize| self.local[i].inverse[which];
        let mut iterations = 0;
        let left = loop {
            self.accelerate(&mut work.pressure, &mut work.acceleration);
            let (a, p, source) = (&work.acceleration, &work.pressure, &work.source);
            let left = self
                .neighbours
                .map_sum(&mut work.residual, &mut work.partial, |near| {
                    let i = near.i;
                    let residual = source[i] + c * self.rate(&near, a);
                    let error = if residual > 0.0 {
                        residual
                    } else {
                        (-residual).min(p[i] * c / inverse(i))
                    };
                    (residual, f64::from(error))
                })
                / n as f64;
            iterations += 1;
            if left <= tolerance || iterations >= MOST || !left.is_finite() {
                break left;
            }
            iterations += self.descend(work, tolerance, &inverse);
        };
        pressure.copy_from_slice(&work.pressure[..n]);
        (iterations, left)
    }

    /// Conjugate gradients on one set of particles, until one of them would pull. Returns the steps taken.
    fn descend(&self, work: &mut Buffers, tolerance: f64, inverse: &(impl Fn(usize) -> f32 + Sync)) -> u32 {
        let n = self.n();
        let c = self.gain;
        // A particle that takes no part has the residual 0.
        let p = &work.pressure;
        work.residual
            .par_iter_mut()
            .with_min_len(TASK)
            .enumerate()
            .for_each(|(i, r)| {
                if *r < 0.0 && p[i] <= 0.0 {
                    *r = f32::NEG_INFINITY;
                }
            });
        let out = f32::NEG_INFINITY;
        let r = &work.residual;
        work.direction.clear();
        work.direction
            .extend((0..n).map(|i| if r[i] == out { 0.0 } else { r[i] * inverse(i) }));
        let mut size = reduce::sum(n, |i| {
            if r[i] == out {
                0.0
            } else {
                f64::from(r[i] * r[i] * inverse(i))
            }
        });
        let mut steps = 0;
        while steps < RUN && size > 0.0 {
            self.accelerate(&mut work.direction, &mut work.pushed);
            let (pushed, direction, residual) = (&work.pushed, &work.direction, &work.residual);
            let curvature = self
                .neighbours
                .map_sum(&mut work.product, &mut work.partial, |near| {
                    let i = near.i;
                    if residual[i] == out {
                        return (0.0, 0.0);
                    }
                    let product = -c * self.rate(&near, pushed);
                    (product, f64::from(product * direction[i]))
                });
            steps += 1;
            if !(curvature > 0.0) {
                break;
            }
            let along = (size / curvature) as f32;
            let (direction, product) = (&work.direction, &work.product);
            work.pressure[..n]
                .par_iter_mut()
                .zip(&mut work.residual)
                .with_min_len(TASK)
                .enumerate()
                .for_each(|(i, (p, r))| {
                    if *r != out {
                        *p += along * direction[i];
                        *r -= along * product[i];
                    }
                });
            let (p, r) = (&work.pressure, &work.residual);
            let [pulls, left, next] = reduce::reduce(
                n,
                [0.0; 3],
                |i| {
                    if r[i] == out {
                        [0.0; 3]
                    } else {
                        let r2 = f64::from(r[i] * r[i] * inverse(i));
                        [f64::from(u8::from(p[i] < 0.0)), f64::from(r[i].abs()), r2]
                    }
                },
                |a, b| [a[0] + b[0], a[1] + b[1], a[2] + b[2]],
            );
            if pulls > 0.0 || left / (n as f64) < 0.5 * tolerance {
                break;
            }
            let keep = (next / size) as f32;
            size = next;
            let r = &work.residual;
            work.direction[..n]
                .par_iter_mut()
                .with_min_len(TASK)
                .enumerate()
                .for_each(|(i, s)| {
                    *s = if r[i] == out {
                        0.0
                    } else {
                        r[i] * inverse(i) + keep * *s
                    };
                });
        }
        work.pressure[..n]
            .par_iter_mut()
            .with_min_len(TASK)
            .for_each(|p| *p = p.max(0.0));
        steps
    }
}

/// Inverse of the diagonal of D Dᵀ, m²; `least` bounds the diagonal from below.
pub(crate) fn inverse_diagonal(near: &Near<'_>, local: &Local, least: f32) -> [f32; 2] {
    let (mut plain, mut corrected) = (local.sum.length_squared(), 0.0);
    corrected += local.correct(local.sum.extend(0.0)).length_squared();
    for g in near.pair {
        let g: Vec3 = g.truncate();
        plain += g.length_squared();
        corrected += local.correct(g.extend(0.0)).length_squared();
    }
    [1.0 / corrected.max(least), 1.0 / plain.max(least)]
}
