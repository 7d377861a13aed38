//! From sums over particles to frames: rest level, ground, and the surface continued below the shore.

use crate::grid::{Grid, GridSpec};

/// Rings of dry samples into which the surface is continued.
const RINGS: usize = 2;

/// What stands where there is no water.
#[derive(Clone, Debug)]
pub(super) struct Surface {
    /// Elevation of still water above datum, metres.
    pub(super) level: f32,
    pub(super) wet: Vec<bool>,
    pub(super) ground: Option<Grid<f32>>,
    /// Depth at rest where there is no ground, metres.
    pub(super) depth: f32,
    /// Dry samples that show the ground.
    bare: Vec<u32>,
    /// Dry samples that continue the surface, ring by ring, each with its neighbours known by then.
    rings: Vec<(u32, Vec<u32>)>,
}

impl Surface {
    pub(super) fn new(
        spec: &GridSpec,
        wet: Vec<bool>,
        ground: Option<Grid<f32>>,
        level: f32,
        depth: f32,
    ) -> Self {
        let (w, h) = (spec.width(), spec.height());
        let mut known = wet.clone();
        let mut rings = Vec::new();
        for _ in 0..RINGS {
            let before = known.clone();
            for k in 0..before.len() {
                if before[k] {
                    continue;
                }
                let (i, j) = (k % w, k / w);
                let rows = j.saturating_sub(1)..(j + 2).min(h);
                let columns = i.saturating_sub(1)..(i + 2).min(w);
                let around = rows.flat_map(|j| columns.clone().map(move |i| j * w + i));
                let neighbours: Vec<u32> = around.filter(|&n| before[n]).map(|n| n as u32).collect();
                if !neighbours.is_empty() {
                    known[k] = true;
                    rings.push((k as u32, neighbours));
                }
            }
        }
        let bare = match &ground {
            Some(ground) => (0..wet.len())
                .filter(|&k| !wet[k] && ground.as_slice()[k] >= level)
                .map(|k| k as u32)
                .collect(),
            None => Vec::new(),
        };
        Self {
            level,
            wet,
            ground,
            depth,
            bare,
            rings,
        }
    }

    /// Replaces what the sums say about dry samples: land shows its ground, and the surface goes on a little way below
    /// the shore, as if nothing stood there inside an object.
    pub(super) fn finish(&self, elevation: &mut Grid<f32>) {
        let values = elevation.as_mut_slice();
        let ground = self.ground.as_ref().map(Grid::as_slice);
        if let Some(ground) = ground {
            for &k in &self.bare {
                values[k as usize] = ground[k as usize];
            }
        }
        for (k, neighbours) in &self.rings {
            let k = *k as usize;
            let mean = neighbours.iter().map(|&n| values[n as usize]).sum::<f32>() / neighbours.len() as f32;
            values[k] = match ground {
                Some(g) if g[k] >= self.level => mean.min(g[k]),
                _ => mean,
            };
        }
    }

    /// Depth from the elevation.
    pub(super) fn depth(&self, elevation: &Grid<f32>, out: &mut Grid<f32>) {
        let (surface, ground) = (elevation.as_slice(), self.ground.as_ref().map(Grid::as_slice));
        for (k, out) in out.as_mut_slice().iter_mut().enumerate() {
            let bed = ground.map_or(self.level - self.depth, |g| g[k]);
            *out = if self.wet[k] {
                (surface[k] - bed).max(0.0)
            } else {
                0.0
            };
        }
    }

    /// Volume of water at rest in m³; 0 where there is no bed.
    pub(super) fn rest_volume(&self, spec: &GridSpec) -> f64 {
        let Some(ground) = &self.ground else {
            return 0.0;
        };
        let ground = ground.as_slice();
        let depth = |k: usize| {
            if self.wet[k] {
                f64::from(self.level) - f64::from(ground[k])
            } else {
                0.0
            }
        };
        crate::reduce::sum(self.wet.len(), depth) * spec.cell_area()
    }

    pub(super) fn bytes(&self) -> u64 {
        let rings: usize = self.rings.iter().map(|(_, n)| 32 + 4 * n.len()).sum();
        let ground = self.ground.as_ref().map_or(0, |g| 4 * g.spec().len());
        (self.wet.len() + ground + 4 * self.bare.len() + rings) as u64
    }
}
