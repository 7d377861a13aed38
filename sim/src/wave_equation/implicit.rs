//! Alternating directions after Kass & Miller 1990 (doi:10.1145/97880.97884): each direction is an implicit step of the
//! one-dimensional equation, a tridiagonal system a row or column. Stable at any step.
//!
//! Kass & Miller step backwards in time (first order, and strongly damped at large steps). Here each direction is a
//! θ-step of elevation and flux, centred for θ = ½, and the directions are composed symmetrically (Strang: half X,
//! whole Z, half X). At θ = ½ the scheme is second order and every one-dimensional step conserves kinetic plus
//! potential energy exactly, so nothing grows and nothing decays at any step; what suffers is the phase: a wave of
//! frequency ω turns by 2 atan(ω step/2) instead of ω step. For θ > ½ a wave is damped by the factor
//! |1 + i(1 − θ)ω step| / |1 − iθω step| a step, short waves most.
//!
//! The unknown of the systems is the mean flux q̄ through each face over the step: the surface follows from it by
//! differences, so the volume is conserved however the systems are rounded.

use super::medium::Medium;
use super::state::State;
use super::tridiagonal::{Face, LANES, Lanes, Lines};
use crate::scene::description::Edge;
use crate::solvers::GRAVITY;
use rayon::prelude::*;

/// Rows a block of the update after a sweep along Z.
const BLOCK: usize = 16;

/// Work arrays, reused from step to step.
#[derive(Default)]
pub(super) struct Work {
    /// Mean flux along Z: for each strip of columns its face rows, `LANES` values each.
    strips: Vec<Lanes>,
}

impl Work {
    pub(super) fn bytes(&self) -> u64 {
        (self.strips.len() * size_of::<Lanes>()) as u64
    }
}

/// `count` steps of `dt` seconds.
pub(super) fn steps(medium: &Medium, state: &mut State, work: &mut Work, dt: f64, count: u64, theta: f64) {
    let (half, whole) = (Sweep::new(medium, 0.5 * dt, theta), Sweep::new(medium, dt, theta));
    half.along_x(state);
    for n in 0..count {
        whole.along_z(state, work);
        // The half step that ends a step and the one that begins the next are one whole step.
        if n + 1 < count {
            whole.along_x(state)
        } else {
            half.along_x(state)
        }
    }
}

/// How the flux through a face answers to a surface held at its mean over the step: it relaxes at a rate r towards
/// −drive · (difference of elevation)/r, and that is solved exactly. Inner faces relax by damping alone.
#[derive(Clone, Copy)]
struct Answer {
    /// Share of the flux before in the mean flux over the step.
    mean: f64,
    /// Mean flux per difference of elevation and drive, seconds.
    gain: f64,
    /// Share of the flux before in the flux after.
    end: f64,
    /// Distance of the flux after from its share, over that of the mean flux from its.
    ratio: f64,
}

impl Answer {
    /// The answer over `duration` seconds. θ shifts the mean flux from the true mean (½) to the flux after (1).
    fn new(rate: f64, duration: f64, theta: f64) -> Self {
        let x = rate * duration;
        let end = (-x).exp();
        // (1 − e^{−x})/x and (x − 1 + e^{−x})/x², by series where they cancel.
        let (first, second) = if x < 1e-3 {
            (1.0 - x / 2.0 + x * x / 6.0, 0.5 - x / 6.0 + x * x / 24.0)
        } else {
            let first = -(-x).exp_m1() / x;
            (first, (1.0 - first) / x)
        };
        let shift = 2.0 * theta - 1.0;
        // 1 − mean = x · lost.
        let lost = second + shift * (first - second);
        Self {
            mean: 1.0 - x * lost,
            gain: duration * lost,
            end,
            ratio: first / lost,
        }
    }

    /// Flux after the step from the one before and the mean.
    fn after(&self, before: f32, mean: f64) -> f32 {
        let before = f64::from(before);
        (self.end * before + self.ratio * (mean - self.mean * before)) as f32
    }
}

/// The face of an open edge: its answer and its drive, m/s².
type Outlet = (Answer, f64);

/// A one-dimensional step along one direction.
struct Sweep<'a> {
    medium: &'a Medium,
    /// Duration over spacing, s/m.
    scale: f64,
    /// The same times θ.
    reach: f64,
    inner: Answer,
    /// For each open edge and each of its samples. The flux relaxes to ±cη, as in an explicit step.
    open: [Vec<Outlet>; 4],
}

impl<'a> Sweep<'a> {
    fn new(medium: &'a Medium, duration: f64, theta: f64) -> Self {
        let (w, h) = (medium.spec.width(), medium.spec.height());
        let spacing = f64::from(medium.spec.spacing);
        let outlets = |side: usize| -> Vec<Outlet> {
            if medium.edges[side] != Edge::Open {
                return Vec::new();
            }
            let along = if side < 2 { h } else { w };
            (0..along)
                .map(|n| {
                    let squared = GRAVITY * f64::from(medium.depth[medium.edge_sample(side, n)]);
                    let rate = 2.0 * squared.sqrt() / spacing + medium.damping;
                    (Answer::new(rate, duration, theta), 2.0 * squared / spacing)
                })
                .collect()
        };
        Self {
            medium,
            scale: duration / spacing,
            reach: theta * duration / spacing,
            inner: Answer::new(medium.damping, duration, theta),
            open: [outlets(0), outlets(1), outlets(2), outlets(3)],
        }
    }

    /// An inner face between samples of elevation `low` and `high`.
    fn inner(&self, pull: Lanes, q: Lanes, low: Lanes, high: Lanes) -> Face {
        let mut face = Face {
            neighbours: 2.0,
            ..Face::WALL
        };
        for n in 0..LANES {
            let gain = self.inner.gain * pull[n];
            face.g[n] = gain * self.reach;
            face.right[n] = self.inner.mean * q[n] - gain * (high[n] - low[n]);
        }
        face
    }

    /// The face of an open edge; `outward` is its direction, `eta` the elevation inside.
    fn outlet(&self, outlets: [Outlet; LANES], q: Lanes, eta: Lanes, outward: f64) -> Face {
        let mut face = Face {
            neighbours: 1.0,
            ..Face::WALL
        };
        for n in 0..LANES {
            let (answer, drive) = outlets[n];
            let gain = answer.gain * drive;
            face.g[n] = gain * self.reach;
            face.right[n] = answer.mean * q[n] + outward * gain * eta[n];
        }
        face
    }

    /// Flux after the step through face `n` of edge `side`.
    fn after_at_edge(&self, side: usize, n: usize, before: f32, mean: f64) -> f32 {
        let answer = self.open[side].get(n).map_or(&self.inner, |(answer, _)| answer);
        answer.after(before, mean)
    }

    fn along_x(&self, state: &mut State) {
        let w = self.medium.spec.width();
        let State { eta, qx, .. } = state;
        eta.par_chunks_mut(LANES * w)
            .zip(qx.par_chunks_mut(LANES * (w + 1)))
            .enumerate()
            .for_each_init(Lines::default, |lines, (strip, (eta, qx))| {
                self.rows(lines, strip * LANES, eta, qx);
            });
    }

    /// Steps up to `LANES` rows from row `first` on.
    fn rows(&self, lines: &mut Lines, first: usize, eta: &mut [f32], qx: &mut [f32]) {
        let medium = self.medium;
        let w = medium.spec.width();
        let rows = eta.len() / w;
        let pull = &medium.pull_x[first * (w + 1)..(first + rows) * (w + 1)];
        let lanes = |values: &[f32], stride: usize, i: usize| -> Lanes {
            std::array::from_fn(|n| {
                if n < rows {
                    f64::from(values[n * stride + i])
                } else {
                    0.0
                }
            })
        };
        let outlets = |side: usize| -> [Outlet; LANES] {
            std::array::from_fn(|n| self.open[side][first + n.min(rows - 1)])
        };
        lines.solve(w, medium.wrap.x, |i| {
            if i > 0 && i < w {
                let (low, high) = (lanes(eta, w, i - 1), lanes(eta, w, i));
                self.inner(lanes(pull, w + 1, i), lanes(qx, w + 1, i), low, high)
            } else if medium.wrap.x {
                let (low, high) = (lanes(eta, w, w - 1), lanes(eta, w, 0));
                self.inner(lanes(pull, w + 1, 0), lanes(qx, w + 1, 0), low, high)
            } else if i == 0 && !self.open[0].is_empty() {
                self.outlet(outlets(0), lanes(qx, w + 1, 0), lanes(eta, w, 0), -1.0)
            } else if i == w && !self.open[1].is_empty() {
                self.outlet(outlets(1), lanes(qx, w + 1, w), lanes(eta, w, w - 1), 1.0)
            } else {
                Face::WALL
            }
        });
        for n in 0..rows {
            let mean = |i: usize| lines.value[i][n];
            let eta = &mut eta[n * w..(n + 1) * w];
            for (i, eta) in eta.iter_mut().enumerate() {
                *eta = (f64::from(*eta) - self.scale * (mean(i + 1) - mean(i))) as f32;
            }
            let q = &mut qx[n * (w + 1)..(n + 1) * (w + 1)];
            let edges = [q[0], q[w]];
            for (i, q) in q.iter_mut().enumerate() {
                *q = self.inner.after(*q, mean(i));
            }
            q[0] = self.after_at_edge(0, first + n, edges[0], mean(0));
            q[w] = self.after_at_edge(1, first + n, edges[1], mean(w));
        }
    }

    fn along_z(&self, state: &mut State, work: &mut Work) {
        let (w, h) = (self.medium.spec.width(), self.medium.spec.height());
        let State { eta, qz, .. } = state;
        work.strips.resize(w.div_ceil(LANES) * (h + 1), [0.0; LANES]);
        let (eta_before, qz_before) = (&*eta, &*qz);
        work.strips
            .par_chunks_mut(h + 1)
            .enumerate()
            .for_each_init(Lines::default, |lines, (strip, out)| {
                self.columns(lines, strip * LANES, eta_before, qz_before);
                out.copy_from_slice(&lines.value[..=h]);
            });

        let strips = &*work.strips;
        let mean = |i: usize, j: usize| strips[i / LANES * (h + 1) + j][i % LANES];
        let (inner, last) = qz.split_at_mut(h * w);
        for (i, q) in last.iter_mut().enumerate() {
            *q = self.after_at_edge(3, i, *q, mean(i, h));
        }
        eta.par_chunks_mut(BLOCK * w)
            .zip(inner.par_chunks_mut(BLOCK * w))
            .enumerate()
            .for_each(|(block, (eta, qz))| {
                for (r, (eta, qz)) in eta.chunks_mut(w).zip(qz.chunks_mut(w)).enumerate() {
                    let j = block * BLOCK + r;
                    for (i, (eta, q)) in eta.iter_mut().zip(qz).enumerate() {
                        *eta = (f64::from(*eta) - self.scale * (mean(i, j + 1) - mean(i, j))) as f32;
                        *q = if j == 0 {
                            self.after_at_edge(2, i, *q, mean(i, j))
                        } else {
                            self.inner.after(*q, mean(i, j))
                        };
                    }
                }
            });
    }

    /// Solves for the mean flux of up to `LANES` columns from column `first` on.
    fn columns(&self, lines: &mut Lines, first: usize, eta: &[f32], qz: &[f32]) {
        let medium = self.medium;
        let (w, h) = (medium.spec.width(), medium.spec.height());
        let count = LANES.min(w - first);
        let lanes = |values: &[f32], j: usize| -> Lanes {
            let row = &values[j * w + first..j * w + first + count];
            std::array::from_fn(|n| row.get(n).map_or(0.0, |&v| f64::from(v)))
        };
        let outlets = |side: usize| -> [Outlet; LANES] {
            std::array::from_fn(|n| self.open[side][first + n.min(count - 1)])
        };
        lines.solve(h, medium.wrap.z, |j| {
            if j > 0 && j < h {
                self.inner(
                    lanes(&medium.pull_z, j),
                    lanes(qz, j),
                    lanes(eta, j - 1),
                    lanes(eta, j),
                )
            } else if medium.wrap.z {
                self.inner(
                    lanes(&medium.pull_z, 0),
                    lanes(qz, 0),
                    lanes(eta, h - 1),
                    lanes(eta, 0),
                )
            } else if j == 0 && !self.open[2].is_empty() {
                self.outlet(outlets(2), lanes(qz, 0), lanes(eta, 0), -1.0)
            } else if j == h && !self.open[3].is_empty() {
                self.outlet(outlets(3), lanes(qz, h), lanes(eta, h - 1), 1.0)
            } else {
                Face::WALL
            }
        });
    }
}
