//! Leap-frog: kick the flux with the surface, move the surface with the flux. Second order in time and space.

use super::kick::Kick;
use super::medium::Medium;
use super::state::State;
use rayon::prelude::*;

/// Rows of a block. A block's rows of all five arrays stay in the second-level cache between kick and drift.
const BLOCK: usize = 16;

/// Fewest samples for which threads pay.
const PARALLEL: usize = 1 << 15;

/// Work arrays of the scheme, reused from step to step.
#[derive(Default)]
pub(super) struct Work {
    kick: Kick,
    /// Kicked flux through the first face row of each block and through the last one: these need the old surface on
    /// both sides of a block boundary.
    seams: Vec<f32>,
}

impl Work {
    pub(super) fn bytes(&self) -> u64 {
        4 * self.seams.len() as u64
    }
}

/// Number of a block with its rows of elevation and of flux along X and Z.
type Block<'a> = (usize, ((&'a mut [f32], &'a mut [f32]), &'a mut [f32]));

/// One step of `dt` seconds. The flux is taken from its time to half a step after the surface's, then the surface
/// follows; the flux then lags by half a step.
pub(super) fn step(medium: &Medium, state: &mut State, work: &mut Work, dt: f64) {
    let (w, h) = (medium.spec.width(), medium.spec.height());
    let Work { kick, seams } = work;
    kick.prepare(medium, state.lag + 0.5 * dt);
    let kick = &*kick;
    let scale = (dt / f64::from(medium.spec.spacing)) as f32;
    let blocks = h.div_ceil(BLOCK);
    seams.resize((blocks + 1) * w, 0.0);

    // Face rows between blocks, from the old surface on both sides.
    let State { eta, qx, qz, lag } = state;
    for (b, seam) in seams.chunks_mut(w).enumerate() {
        let j = (b * BLOCK).min(h);
        seam.copy_from_slice(&qz[j * w..(j + 1) * w]);
        kick.row_z(medium, j, eta, seam);
    }
    let seams = &*seams;
    qz[h * w..].copy_from_slice(&seams[blocks * w..]);

    let block = |(b, ((eta, qx), qz)): Block<'_>| {
        let rows = eta.len() / w;
        let first = b * BLOCK;
        qz[..w].copy_from_slice(&seams[b * w..(b + 1) * w]);
        for r in 0..rows {
            let j = first + r;
            let (this, after) = eta[r * w..].split_at_mut(w);
            let qx = &mut qx[r * (w + 1)..(r + 1) * (w + 1)];
            kick.row_x(medium, j, this, qx);
            let (low, rest) = qz[r * w..].split_at_mut(w);
            let high = if r + 1 < rows {
                let high = &mut rest[..w];
                kick.inner(&medium.pull_z[(j + 1) * w..(j + 2) * w], this, &after[..w], high);
                &*high
            } else {
                &seams[(b + 1) * w..(b + 2) * w]
            };
            drift(scale, qx, low, high, this);
        }
    };
    let inner_qz = &mut qz[..h * w];
    if w * h < PARALLEL {
        eta.chunks_mut(BLOCK * w)
            .zip(qx.chunks_mut(BLOCK * (w + 1)))
            .zip(inner_qz.chunks_mut(BLOCK * w))
            .enumerate()
            .for_each(block);
    } else {
        eta.par_chunks_mut(BLOCK * w)
            .zip(qx.par_chunks_mut(BLOCK * (w + 1)))
            .zip(inner_qz.par_chunks_mut(BLOCK * w))
            .enumerate()
            .for_each(block);
    }
    *lag = 0.5 * dt;
}

/// Moves the surface of a row by what flows through its faces. The order of the operations is the same for X and Z,
/// so that a transposed state gives the transposed result, bit for bit.
fn drift(scale: f32, qx: &[f32], low: &[f32], high: &[f32], eta: &mut [f32]) {
    let w = eta.len();
    let (left, right) = (&qx[..w], &qx[1..]);
    for ((((eta, l), r), a), b) in eta.iter_mut().zip(left).zip(right).zip(low).zip(high) {
        *eta += scale * ((l - r) + (a - b));
    }
}

/// Brings the flux to the time of the surface.
pub(super) fn synchronise(medium: &Medium, state: &mut State) {
    if state.lag <= 0.0 {
        return;
    }
    let (w, h) = (medium.spec.width(), medium.spec.height());
    let kick = Kick::new(medium, state.lag);
    let State { eta, qx, qz, lag } = state;
    for j in 0..h {
        kick.row_x(
            medium,
            j,
            &eta[j * w..(j + 1) * w],
            &mut qx[j * (w + 1)..(j + 1) * (w + 1)],
        );
    }
    for j in 0..=h {
        kick.row_z(medium, j, eta, &mut qz[j * w..(j + 1) * w]);
    }
    *lag = 0.0;
}
