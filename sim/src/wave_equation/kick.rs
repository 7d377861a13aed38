//! The flux under a fixed surface: ∂q/∂t = −c²∇η − damping q, solved exactly over a time.
//!
//! On inner faces q(t) = e^{−γt} q − (1 − e^{−γt})/γ · c²∇η, so two kicks in a row are one longer kick and damping
//! of any strength is stable. An open edge ends in a half cell whose far side lets out q = ±cη, the characteristic of
//! outgoing waves: ∂q/∂t = −(2c/spacing)(q ∓ cη) − γq. It takes energy and never gives any.

use super::medium::Medium;
use super::state::State;
use crate::scene::description::Edge;
use crate::solvers::GRAVITY;

/// The factors of a kick of a certain length.
#[derive(Clone, Debug, Default)]
pub(super) struct Kick {
    duration: f64,
    /// e^{−γt}.
    keep: f32,
    /// (1 − e^{−γt})/γ, seconds.
    gain: f32,
    /// For each open edge (x_min, x_max, z_min, z_max), at each of its samples: what is kept of the flux, and the
    /// outward flux per elevation that replaces the rest, m/s.
    open: [Vec<[f32; 2]>; 4],
}

impl Kick {
    /// A kick of `duration` seconds.
    pub(super) fn new(medium: &Medium, duration: f64) -> Self {
        let mut kick = Self {
            duration: -1.0,
            ..Self::default()
        };
        kick.prepare(medium, duration);
        kick
    }

    /// Makes this a kick of `duration` seconds.
    pub(super) fn prepare(&mut self, medium: &Medium, duration: f64) {
        if self.duration == duration {
            return;
        }
        self.duration = duration;
        let gamma = medium.damping;
        self.keep = (-gamma * duration).exp() as f32;
        self.gain = share(gamma, duration) as f32;
        let (w, h) = (medium.spec.width(), medium.spec.height());
        let spacing = f64::from(medium.spec.spacing);
        for (side, list) in self.open.iter_mut().enumerate() {
            list.clear();
            if medium.edges[side] != Edge::Open {
                continue;
            }
            let along = if side < 2 { h } else { w };
            list.extend((0..along).map(|n| {
                let k = medium.edge_sample(side, n);
                let squared = GRAVITY * f64::from(medium.depth[k]);
                let rate = 2.0 * squared.sqrt() / spacing + gamma;
                let gain = 2.0 * squared / spacing * share(rate, duration);
                [(-rate * duration).exp() as f32, gain as f32]
            }));
        }
    }

    /// Kicks the faces along X of row `j`.
    pub(super) fn row_x(&self, medium: &Medium, j: usize, eta: &[f32], q: &mut [f32]) {
        let w = eta.len();
        let pull = &medium.pull_x[j * (w + 1)..(j + 1) * (w + 1)];
        self.inner(&pull[1..w], &eta[..w - 1], &eta[1..], &mut q[1..w]);
        if medium.wrap.x {
            self.inner(&pull[..1], &eta[w - 1..], &eta[..1], &mut q[..1]);
            q[w] = q[0];
            return;
        }
        if let Some(&[keep, gain]) = self.open[0].get(j) {
            q[0] = keep * q[0] - gain * eta[0];
        }
        if let Some(&[keep, gain]) = self.open[1].get(j) {
            q[w] = keep * q[w] + gain * eta[w - 1];
        }
    }

    /// Kicks the faces along Z of face row `j`, 0 to the number of rows.
    pub(super) fn row_z(&self, medium: &Medium, j: usize, eta: &[f32], q: &mut [f32]) {
        let (w, h) = (medium.spec.width(), medium.spec.height());
        let row = |j: usize| &eta[j * w..(j + 1) * w];
        let pull = &medium.pull_z[j * w..(j + 1) * w];
        if j > 0 && j < h {
            self.inner(pull, row(j - 1), row(j), q);
        } else if medium.wrap.z {
            self.inner(pull, row(h - 1), row(0), q);
        } else if j == 0 {
            for ((q, &[keep, gain]), eta) in q.iter_mut().zip(&self.open[2]).zip(row(0)) {
                *q = keep * *q - gain * eta;
            }
        } else {
            for ((q, &[keep, gain]), eta) in q.iter_mut().zip(&self.open[3]).zip(row(h - 1)) {
                *q = keep * *q + gain * eta;
            }
        }
    }

    /// Kicks faces between the samples `low` and `high`.
    pub(super) fn inner(&self, pull: &[f32], low: &[f32], high: &[f32], q: &mut [f32]) {
        let (keep, gain) = (self.keep, self.gain);
        for (((q, p), l), r) in q.iter_mut().zip(pull).zip(low).zip(high) {
            *q = keep * *q - (gain * p) * (r - l);
        }
    }
}

/// (1 − e^{−rate·t})/rate, also for rate 0.
fn share(rate: f64, t: f64) -> f64 {
    if rate * t < 1e-12 {
        t
    } else {
        -(-rate * t).exp_m1() / rate
    }
}

/// The flux at the time of the elevation, row by row, where the state's lags behind.
pub(super) struct Synchronised<'a> {
    medium: &'a Medium,
    state: &'a State,
    kick: Kick,
}

impl<'a> Synchronised<'a> {
    pub(super) fn new(medium: &'a Medium, state: &'a State) -> Self {
        Self {
            medium,
            state,
            kick: Kick::new(medium, state.lag),
        }
    }

    /// Writes the flux through the faces along X of row `j` to `out`.
    pub(super) fn row_x(&self, j: usize, out: &mut Vec<f32>) {
        let w = self.medium.spec.width();
        out.clear();
        out.extend_from_slice(&self.state.qx[j * (w + 1)..(j + 1) * (w + 1)]);
        if self.state.lag > 0.0 {
            self.kick
                .row_x(self.medium, j, &self.state.eta[j * w..(j + 1) * w], out);
        }
    }

    /// Writes the flux through the faces along Z of face row `j` to `out`.
    pub(super) fn row_z(&self, j: usize, out: &mut Vec<f32>) {
        let w = self.medium.spec.width();
        out.clear();
        out.extend_from_slice(&self.state.qz[j * w..(j + 1) * w]);
        if self.state.lag > 0.0 {
            self.kick.row_z(self.medium, j, &self.state.eta, out);
        }
    }
}
