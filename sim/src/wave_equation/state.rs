//! The moving part: elevation at the samples and flux on the faces between them.

use super::kick::Synchronised;
use super::medium::Medium;
use crate::grid::Grid;
use glam::Vec2;
use rayon::prelude::*;

/// Elevation and flux; laid out as the faces of [`Medium`].
pub(super) struct State {
    /// Elevation above rest, metres; 0 on land.
    pub(super) eta: Vec<f32>,
    /// Depth times velocity through the faces along X, m²/s.
    pub(super) qx: Vec<f32>,
    /// The same along Z.
    pub(super) qz: Vec<f32>,
    /// By how many seconds the flux lies before the elevation: half a step after a leap-frog step, 0 after an
    /// implicit one.
    pub(super) lag: f64,
}

impl State {
    /// Still water.
    pub(super) fn new(medium: &Medium) -> Self {
        let (w, h) = (medium.spec.width(), medium.spec.height());
        Self {
            eta: vec![0.0; w * h],
            qx: vec![0.0; (w + 1) * h],
            qz: vec![0.0; w * (h + 1)],
            lag: 0.0,
        }
    }

    /// Adds `velocity` times the weight of each sample to the flux; each sample gives half of its push to each of
    /// its faces that lets water through.
    pub(super) fn push(&mut self, medium: &Medium, weights: &[(usize, f64)], velocity: Vec2) {
        let (w, h) = (medium.spec.width(), medium.spec.height());
        let spacing = f64::from(medium.spec.spacing);
        let add = |q: &mut f32, pull: f32, weight: f64, velocity: f32| {
            // pull · spacing / g is the depth on the face.
            let depth = f64::from(pull) * spacing / crate::solvers::GRAVITY;
            *q = (f64::from(*q) + 0.5 * depth * weight * f64::from(velocity)) as f32;
        };
        for &(k, weight) in weights {
            let (i, j) = (k % w, k / w);
            let x = j * (w + 1) + i;
            // A wrapping face is stored at both ends of its row.
            let mut along_x = [Some(x), Some(x + 1), None, None];
            let mut along_z = [Some(k), Some(k + w), None, None];
            if medium.wrap.x {
                along_x[2] = (i == 0).then_some(x + w);
                along_x[3] = (i + 1 == w).then_some(x + 1 - w);
            }
            if medium.wrap.z {
                along_z[2] = (j == 0).then_some(k + h * w);
                along_z[3] = (j + 1 == h).then_some(i);
            }
            for face in along_x.into_iter().flatten() {
                add(&mut self.qx[face], medium.pull_x[face], weight, velocity.x);
            }
            for face in along_z.into_iter().flatten() {
                add(&mut self.qz[face], medium.pull_z[face], weight, velocity.y);
            }
        }
    }

    pub(super) fn bytes(&self) -> u64 {
        4 * (self.eta.len() + self.qx.len() + self.qz.len()) as u64
    }
}

/// Velocity at the samples: the mean flux of its two faces along each axis over the depth at rest; 0 on land.
pub(super) fn velocity(medium: &Medium, state: &State, out: &mut Grid<Vec2>) {
    let w = medium.spec.width();
    let flux = Synchronised::new(medium, state);
    out.as_mut_slice().par_chunks_mut(w).enumerate().for_each_init(
        <[Vec<f32>; 3]>::default,
        |[x, low, high], (j, row)| {
            flux.row_x(j, x);
            flux.row_z(j, low);
            flux.row_z(j + 1, high);
            let depth = &medium.depth[j * w..(j + 1) * w];
            for (i, out) in row.iter_mut().enumerate() {
                let q = 0.5 * Vec2::new(x[i] + x[i + 1], low[i] + high[i]);
                *out = if depth[i] > 0.0 { q / depth[i] } else { Vec2::ZERO };
            }
        },
    );
}
