//! From elevation above rest to frames: the ground, the depth, and the surface continued below the shore.

use super::medium::Medium;
use crate::grid::Grid;
use crate::reduce;
use rayon::prelude::*;

/// Rings of dry samples into which the surface is continued.
const RINGS: usize = 2;

/// Ground under the grid and the dry samples near the shore.
pub(super) struct Shore {
    ground: Option<Grid<f32>>,
    /// Volume of water at rest in m³, 0 without ground.
    rest_volume: f64,
    /// Dry samples that continue the surface, ring by ring: the sample and its already known neighbours.
    rings: Vec<(usize, Vec<usize>)>,
}

impl Shore {
    pub(super) fn new(medium: &Medium, ground: Option<Grid<f32>>, level: f32) -> Self {
        let (w, h) = (medium.spec.width(), medium.spec.height());
        let mut known = medium.wet.clone();
        let mut rings = Vec::new();
        for _ in 0..RINGS {
            let before = known.clone();
            for k in 0..before.len() {
                if before[k] {
                    continue;
                }
                let neighbours: Vec<usize> = around(k % w, k / w, w, h).filter(|&n| before[n]).collect();
                if !neighbours.is_empty() {
                    known[k] = true;
                    rings.push((k, neighbours));
                }
            }
        }
        let rest_volume = ground.as_ref().map_or(0.0, |ground| {
            let depth = |k: usize| {
                if medium.wet[k] {
                    f64::from(level) - f64::from(ground.as_slice()[k])
                } else {
                    0.0
                }
            };
            reduce::sum(medium.wet.len(), depth) * medium.spec.cell_area()
        });
        Self {
            ground,
            rest_volume,
            rings,
        }
    }

    /// Volume at rest, m³; 0 where there is no bed.
    pub(super) fn rest_volume(&self) -> f64 {
        self.rest_volume
    }

    pub(super) fn bytes(&self) -> u64 {
        let ground = self.ground.as_ref().map_or(0, |g| 4 * g.spec().len());
        let rings: usize = self.rings.iter().map(|(_, n)| 32 + 8 * n.len()).sum();
        (ground + rings) as u64
    }

    /// Elevation above datum. Dry samples near the water take the mean of their known neighbours, but never more
    /// than the ground there, so they stay dry; dry samples farther away take the ground.
    pub(super) fn elevation(&self, medium: &Medium, eta: &[f32], level: f32, out: &mut Grid<f32>) {
        let values = out.as_mut_slice();
        values
            .par_iter_mut()
            .with_min_len(1 << 14)
            .zip(eta)
            .for_each(|(out, eta)| *out = level + eta);
        if self.rings.is_empty() {
            return;
        }
        let ground = self.ground.as_ref().map(|g| g.as_slice());
        if let Some(ground) = ground {
            for (k, out) in values.iter_mut().enumerate() {
                if !medium.wet[k] && ground[k] >= level {
                    *out = ground[k];
                }
            }
        }
        for (k, neighbours) in &self.rings {
            let mean = neighbours.iter().map(|&n| values[n]).sum::<f32>() / neighbours.len() as f32;
            // Inside an object the surface goes on as if nothing stood there; on land it stays below the ground.
            values[*k] = match ground {
                Some(g) if g[*k] >= level => mean.min(g[*k]),
                _ => mean,
            };
        }
    }

    /// Depth from the elevation: down to the ground where there is one, else to the depth that gives the wave speed.
    pub(super) fn depth(&self, medium: &Medium, eta: &[f32], elevation: &Grid<f32>, out: &mut Grid<f32>) {
        let (surface, ground) = (elevation.as_slice(), self.ground.as_ref().map(Grid::as_slice));
        out.as_mut_slice()
            .par_iter_mut()
            .with_min_len(1 << 14)
            .enumerate()
            .for_each(|(k, out)| {
                let depth = ground.map_or(medium.depth[k] + eta[k], |g| surface[k] - g[k]);
                *out = if medium.wet[k] { depth.max(0.0) } else { 0.0 };
            });
    }
}

/// The up to eight neighbours of a sample.
fn around(i: usize, j: usize, w: usize, h: usize) -> impl Iterator<Item = usize> {
    const OFFSETS: [(isize, isize); 8] = [
        (-1, 0),
        (1, 0),
        (0, -1),
        (0, 1),
        (-1, -1),
        (1, -1),
        (-1, 1),
        (1, 1),
    ];
    OFFSETS.into_iter().filter_map(move |(di, dj)| {
        let (i, j) = (i.wrapping_add_signed(di), j.wrapping_add_signed(dj));
        (i < w && j < h).then(|| j * w + i)
    })
}
