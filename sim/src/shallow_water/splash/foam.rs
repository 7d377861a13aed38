//! Foam: the share of the surface that it covers, carried along by the water and fading.

use rayon::prelude::*;

/// Distance that foam may travel between two advections, in spacings: what frames may lag behind by.
const LAG: f64 = 0.5;
/// How much faster full foam thins out than the last of it: what has just broken is a plume of bubbles that bursts open
/// within a fraction of the time that the thin foam after it lasts (stages A and B of whitecaps: Monahan & Lu 1990).
const DENSE: f32 = 4.0;
/// Coverage below which there is no foam.
const LEAST: f32 = 1e-3;

/// Cells along a side of the tiles that are passed over where there is no foam.
const TILE: usize = 16;

/// Foam over a grid.
#[derive(Clone, Debug)]
pub(crate) struct Foam {
    width: usize,
    height: usize,
    spacing: f64,
    wraps: [bool; 2],
    life: f64,
    cover: Vec<f32>,
    next: Vec<f32>,
    /// Tiles in which there is any, row by row.
    tiles: Vec<bool>,
    /// Time since the last advection, s.
    pending: f64,
}

impl Foam {
    /// No foam yet. `life` is the time in seconds in which thin foam fades to 1/e: whitecaps decay exponentially
    /// (Monahan & Zietlow 1969), fresh ones faster, see [`thinned`].
    pub(crate) fn new(size: [usize; 2], spacing: f64, wraps: [bool; 2], life: f64) -> Self {
        let [width, height] = size;
        Self {
            width,
            height,
            spacing,
            wraps,
            life,
            cover: vec![0.0; width * height],
            next: vec![0.0; width * height],
            tiles: vec![false; width.div_ceil(TILE) * height.div_ceil(TILE)],
            pending: 0.0,
        }
    }

    pub(crate) fn bytes(&self) -> usize {
        2 * self.cover.len() * size_of::<f32>() + self.tiles.len()
    }

    /// Coverage of row `j` now.
    pub(crate) fn show(&self, j: usize, into: &mut [f32]) {
        let fade = self.fade();
        for (into, cover) in into.iter_mut().zip(&self.cover[j * self.width..]) {
            *into = thinned(*cover, fade).clamp(0.0, 1.0);
        }
    }

    fn fade(&self) -> f32 {
        (-self.pending / self.life).exp() as f32
    }

    /// State for a checkpoint.
    pub(crate) fn memory(&self) -> (f64, &[f32]) {
        (self.pending, &self.cover)
    }

    /// Goes on from a checkpoint of the same size.
    pub(crate) fn resume(&mut self, pending: f64, cover: &[f32]) {
        self.pending = pending;
        self.cover.copy_from_slice(cover);
        self.tiles.fill(false);
        for (k, _) in cover.iter().enumerate().filter(|(_, c)| **c != 0.0) {
            let tile = self.tile(k % self.width, k / self.width);
            self.tiles[tile] = true;
        }
    }

    /// The tile of a cell.
    fn tile(&self, i: usize, j: usize) -> usize {
        j / TILE * self.width.div_ceil(TILE) + i / TILE
    }

    /// Covers `share` more of what is still free in a cell.
    pub(crate) fn cover(&mut self, i: usize, j: usize, share: f64) {
        let tile = self.tile(i, j);
        let cover = &mut self.cover[j * self.width + i];
        *cover += (1.0 - *cover).max(0.0) * share.clamp(0.0, 1.0) as f32;
        self.tiles[tile] |= *cover != 0.0;
    }

    /// Adds a disc of foam of `radius` m about a place given in cells. Its area is that of the disc however coarse the
    /// grid is: a disc smaller than a cell covers a part of the cells around it.
    pub(crate) fn splat(&mut self, at: [f64; 2], radius: f64) {
        let reach = (radius / self.spacing).max(1.0);
        let height = self.height;
        let range = |centre: f64, count: usize| {
            let first = (centre - reach).ceil().clamp(0.0, count as f64) as usize;
            let last = ((centre + reach).floor() + 1.0).clamp(0.0, count as f64) as usize;
            first..last.max(first)
        };
        let weight = |i: usize, j: usize| {
            let (dx, dz) = (i as f64 - at[0], j as f64 - at[1]);
            (1.0 - (dx * dx + dz * dz) / (reach * reach)).max(0.0)
        };
        let (columns, rows) = (range(at[0], self.width), range(at[1], height));
        let mut sum = 0.0;
        for j in rows.clone() {
            sum += columns.clone().map(|i| weight(i, j)).sum::<f64>();
        }
        if sum <= 0.0 {
            return;
        }
        let area = std::f64::consts::PI * (radius / self.spacing).powi(2);
        for j in rows {
            for i in columns.clone() {
                self.cover(i, j, area * weight(i, j) / sum);
            }
        }
    }

    /// Carries the foam along for `dt` s in water of which nothing moves faster than `fastest` m/s: before it may
    /// have moved by half a spacing, so that it is interpolated as rarely as can be and never lags by more.
    pub(crate) fn advance(
        &mut self,
        dt: f64,
        fastest: f64,
        velocity: impl Fn(usize, usize) -> [f64; 2] + Sync,
    ) {
        self.pending += dt;
        // Another step like this one may be the one too many.
        if fastest * (self.pending + dt) < LAG * self.spacing && self.pending < self.life {
            return;
        }
        let (w, h) = (self.width, self.height);
        let (fade, scale) = (self.fade(), self.pending / self.spacing);
        self.pending = 0.0;
        let near = self.near((fastest * scale).ceil() as usize + 2);
        let (cover, wraps) = (&self.cover, self.wraps);
        let tiles_x = w.div_ceil(TILE);
        self.next
            .par_chunks_mut(TILE * w)
            .zip(self.tiles.par_chunks_mut(tiles_x))
            .zip(near.par_chunks(tiles_x))
            .enumerate()
            .for_each(|(band, ((rows, any), near))| {
                any.fill(false);
                for (k, value) in rows.iter_mut().enumerate() {
                    let (i, j) = (k % w, band * TILE + k / w);
                    if !near[i / TILE] {
                        *value = 0.0;
                        continue;
                    }
                    let (x, z) = (i as f64, j as f64);
                    // The velocity half way back (midpoint rule), to second order in the distance.
                    let here = velocity(i, j);
                    let half = [x - 0.5 * scale * here[0], z - 0.5 * scale * here[1]];
                    let v = mean_velocity(half, [w, h], wraps, &velocity);
                    let source = [x - scale * v[0], z - scale * v[1]];
                    let found = thinned(interpolate(cover, source, [w, h], wraps), fade);
                    *value = if found.abs() < LEAST { 0.0 } else { found };
                    any[i / TILE] |= *value != 0.0;
                }
            });
        std::mem::swap(&mut self.cover, &mut self.next);
    }

    /// Tiles within `reach` cells of foam.
    fn near(&self, reach: usize) -> Vec<bool> {
        let size = [self.width.div_ceil(TILE), self.height.div_ceil(TILE)];
        let around = |t: usize, count: usize, wraps: bool| {
            // A last tile that is cut short brings what lies beyond it nearer.
            let by = (reach.div_ceil(TILE) + usize::from(wraps)).min(count) as isize;
            (-by..=by).filter_map(move |d| inside(t as isize + d, count, wraps))
        };
        let tile = |t: usize| {
            let [x, z] = [t % size[0], t / size[0]];
            around(z, size[1], self.wraps[1])
                .any(|z| around(x, size[0], self.wraps[0]).any(|x| self.tiles[z * size[0] + x]))
        };
        (0..self.tiles.len()).map(tile).collect()
    }
}

/// What is left of coverage c after the time in which the thinnest foam fades to the share `fade`: the solution of
/// dc/dt = −c (1 + [`DENSE`] c) / life, so that the number of steps does not matter.
fn thinned(cover: f32, fade: f32) -> f32 {
    fade * cover / (1.0 + DENSE * cover.max(0.0) * (1.0 - fade))
}

/// A row or column number brought into the grid, if it belongs there.
fn inside(k: isize, count: usize, wraps: bool) -> Option<usize> {
    if wraps {
        Some(k.rem_euclid(count as isize) as usize)
    } else {
        (k >= 0 && k < count as isize).then_some(k as usize)
    }
}

/// The same, clamped to the grid where it does not repeat.
fn nearest(k: isize, count: usize, wraps: bool) -> usize {
    if wraps {
        k.rem_euclid(count as isize) as usize
    } else {
        k.clamp(0, count as isize - 1) as usize
    }
}

/// Bilinear velocity at a place in cells.
fn mean_velocity(
    at: [f64; 2],
    size: [usize; 2],
    wraps: [bool; 2],
    velocity: &impl Fn(usize, usize) -> [f64; 2],
) -> [f64; 2] {
    let (i, j) = (at[0].floor(), at[1].floor());
    let (x, z) = (at[0] - i, at[1] - j);
    let get = |di: isize, dj: isize| {
        velocity(
            nearest(i as isize + di, size[0], wraps[0]),
            nearest(j as isize + dj, size[1], wraps[1]),
        )
    };
    let (a, b, c, d) = (get(0, 0), get(1, 0), get(0, 1), get(1, 1));
    std::array::from_fn(|k| (a[k] * (1.0 - x) + b[k] * x) * (1.0 - z) + (c[k] * (1.0 - x) + d[k] * x) * z)
}

/// Cubic convolution (Keys 1981). It keeps the sum and the middle of what it carries, and even foam even. Beside sharp
/// edges it swings a little beyond 0 and 1; that is kept, and cut only where foam is shown: held between its neighbours, or
/// cut at 0, a blob lags by 2 % of its way and gains area.
fn interpolate(values: &[f32], at: [f64; 2], size: [usize; 2], wraps: [bool; 2]) -> f32 {
    let (i, j) = (at[0].floor(), at[1].floor());
    let (wx, wz) = (weights((at[0] - i) as f32), weights((at[1] - j) as f32));
    let columns: [usize; 4] =
        std::array::from_fn(|k| nearest(i as isize + k as isize - 1, size[0], wraps[0]));
    let mut sum = 0.0_f32;
    for (m, wz) in wz.iter().enumerate() {
        let row = &values[nearest(j as isize + m as isize - 1, size[1], wraps[1]) * size[0]..];
        for (k, wx) in wx.iter().enumerate() {
            sum += wz * wx * row[columns[k]];
        }
    }
    sum
}

fn weights(f: f32) -> [f32; 4] {
    [
        0.5 * f * (-1.0 + f * (2.0 - f)),
        0.5 * (2.0 + f * f * (3.0 * f - 5.0)),
        0.5 * f * (1.0 + f * (4.0 - 3.0 * f)),
        0.5 * f * f * (f - 1.0),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Foam of a smooth blob; its mean place in cells and its largest value.
    fn centre(foam: &Foam) -> ([f64; 2], f32) {
        let (mut sum, mut at, mut top) = (0.0, [0.0; 2], 0.0_f32);
        for (k, &c) in foam.cover.iter().enumerate() {
            let weight = f64::from(c);
            sum += weight;
            at[0] += weight * (k % foam.width) as f64;
            at[1] += weight * (k / foam.width) as f64;
            top = top.max(c);
        }
        (at.map(|a| a / sum), top)
    }

    #[test]
    fn foam_moves_with_a_constant_flow_and_lags_by_half_a_sample_at_most() {
        let mut foam = Foam::new([96, 64], 0.5, [false; 2], 1e9);
        foam.splat([20.0, 20.0], 3.0);
        let before = foam.cover.iter().map(|&c| f64::from(c)).sum::<f64>();
        let (start, top) = centre(&foam);
        let mut worst = 0.0_f64;
        for step in 1..=400 {
            foam.advance(0.0107, 1.25, |_, _| [1.0, 0.75]);
            let (now, _) = centre(&foam);
            let moved = 0.0107 * f64::from(step) / 0.5;
            let lag = (start[0] + moved - now[0]).hypot(start[1] + 0.75 * moved - now[1]);
            worst = worst.max(lag);
        }
        // Between advections foam lags by what it has not been carried yet; the rest is numerical.
        println!("largest lag {worst} samples");
        assert!(worst < 0.5, "{worst} samples");
        let after = foam.cover.iter().map(|&c| f64::from(c)).sum::<f64>();
        assert!((after / before - 1.0).abs() < 0.02, "{before} {after}");
        assert!(centre(&foam).1 > 0.85 * top);
    }

    #[test]
    fn even_foam_stays_even_and_fades_as_its_life_says() {
        let mut foam = Foam::new([32, 24], 1.0, [true; 2], 3.0);
        foam.cover.fill(0.5);
        foam.tiles.fill(true);
        for _ in 0..100 {
            foam.advance(0.03, 2.0, |_, _| [-1.3, 1.4]);
        }
        let mut row = vec![0.0; 32];
        foam.show(7, &mut row);
        let fade = (-1.0_f64).exp();
        let truth = 0.5 * fade / (1.0 + f64::from(DENSE) * 0.5 * (1.0 - fade));
        assert!(
            row.iter().all(|&c| (f64::from(c) - truth).abs() < 1e-5),
            "{row:?}"
        );
    }

    #[test]
    fn a_disc_covers_its_area_on_any_grid() {
        for (spacing, radius) in [(1.0, 0.1), (0.01, 0.1), (0.05, 0.1)] {
            let mut foam = Foam::new([64, 64], spacing, [false; 2], 1.0);
            foam.splat([31.3, 30.8], radius);
            let area = foam.cover.iter().map(|&c| f64::from(c)).sum::<f64>() * spacing * spacing;
            // Where the middle of a well resolved disc would be covered more than whole, it is cut.
            let truth = std::f64::consts::PI * radius * radius;
            assert!(
                area <= 1.001 * truth && area > 0.7 * truth,
                "{spacing}: {area} of {truth}"
            );
        }
    }
}
