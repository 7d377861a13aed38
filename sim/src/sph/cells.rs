//! A dense grid of cells by counting sort: particles of one cell, and cells of one row, are neighbours in memory.

use super::counting;
use super::eight::{LANES, Machine};
use glam::{UVec3, Vec3, Vec4};
use rayon::prelude::*;
use std::ops::Range;

/// Cells a grid may have for each particle, beside [`FEWEST`]; beyond it the outermost cells grow instead.
const CELLS_A_PARTICLE: usize = 16;
const FEWEST: usize = 1 << 16;

/// Parts of a cell along X: runs end close to what is within reach, and cost no more for it.
const PARTS: f32 = 4.0;
/// Share of a cell by which its sides may be off, from rounding.
const ROUNDING: f32 = 1e-3;

/// Cells as wide as the kernel's support, a quarter of it along X, numbered along X, then Z, then Y: what is within reach of
/// a particle lies in 9 runs of memory at most. X, Y and Z are those of the grid, which may lie along others of space.
///
/// Particles outside the box of cells count to the nearest one. Two particles within one support are still in
/// neighbouring cells then, so nothing is missed.
#[derive(Debug, Default)]
pub(crate) struct Cells {
    /// Axes of space that X, Y and Z of the grid lie along.
    axes: [usize; 3],
    low: Vec3,
    width: f32,
    /// Cells a metre.
    inverse: Vec3,
    size: UVec3,
    /// First particle of each cell, and their number at the end.
    start: Vec<u32>,
    cell: Vec<u32>,
    /// Old number of each particle in the new order.
    order: Vec<u32>,
}

impl Cells {
    /// Sorts `positions` into cells of `width`. [`Self::order`] then says which particle goes where; the caller moves
    /// them.
    pub(crate) fn sort(&mut self, positions: &[Vec4], width: f32) {
        self.sort_along([0, 1, 2], bounds(positions), positions, width);
    }

    /// The same with layers, of which Y counts, across the longest side of the box of all positions: as many and as
    /// small ones as there can be.
    pub(crate) fn sort_in_layers(&mut self, positions: &[Vec4], width: f32) {
        let (low, high) = bounds(positions);
        let side = (high - low).to_array();
        let mut axes = [0, 1, 2];
        axes.sort_by(|a: &usize, b| side[*b].total_cmp(&side[*a]));
        let [longest, middle, shortest] = axes;
        self.sort_along([middle, longest, shortest], (low, high), positions, width);
    }

    /// Sorts what is between the corners `low` and `high`.
    fn sort_along(&mut self, axes: [usize; 3], (low, high): (Vec3, Vec3), positions: &[Vec4], width: f32) {
        let n = positions.len();
        let (low, high) = (turned(axes, low), turned(axes, high));
        self.axes = axes;
        self.low = low;
        self.width = width;
        self.inverse = Vec3::new(PARTS, 1.0, 1.0) / width;
        let most = (CELLS_A_PARTICLE * n + FEWEST) as f64;
        let mut size = ((high - low) * self.inverse).floor().as_dvec3() + 1.0;
        // A few particles far away must not cost memory: axes are cut, the longest first.
        while size.x * size.y * size.z > most {
            let largest = size.max_element();
            let cut = |c: f64| {
                if c == largest {
                    (0.5 * c).floor().max(1.0)
                } else {
                    c
                }
            };
            size = glam::DVec3::new(cut(size.x), cut(size.y), cut(size.z));
        }
        self.size = size.as_uvec3().max(UVec3::ONE);
        let cells = self.size.x as usize * self.size.y as usize * self.size.z as usize;
        self.cell.resize(n, 0);
        let (grid, low, inverse) = (self.size, self.low, self.inverse);
        self.cell
            .par_iter_mut()
            .with_min_len(4096)
            .zip(positions)
            .for_each(|(cell, p)| {
                let c = coordinates(turned(axes, p.truncate()), low, inverse, grid);
                *cell = (c.y * grid.z + c.z) * grid.x + c.x;
            });
        self.order.resize(n, 0);
        let order = &mut self.order;
        counting::sort(&self.cell, cells, &mut self.start, |k, at| order[at] = k as u32);
    }

    /// Old number of each particle, in the new order.
    #[cfg(test)]
    pub(crate) fn order(&self) -> &[u32] {
        &self.order
    }

    /// Moves `values` into the new order through `spare`.
    pub(crate) fn reorder<T: Copy + Default + Send + Sync>(&self, values: &mut Vec<T>, spare: &mut Vec<T>) {
        spare.resize(values.len(), T::default());
        spare
            .par_iter_mut()
            .with_min_len(4096)
            .zip(&self.order)
            .for_each(|(to, &from)| *to = values[from as usize]);
        std::mem::swap(values, spare);
    }

    /// Ranges of particles, in order, that hold all within a width of `p`.
    #[inline]
    pub(crate) fn runs_around(&self, p: Vec3) -> Runs {
        let p = turned(self.axes, p);
        let c = coordinates(p, self.low, self.inverse, self.size);
        let mut runs = Runs::default();
        for y in rows(c.y, self.size.y) {
            for z in rows(c.z, self.size.z) {
                runs.push(self.run(p, c, y, z));
            }
        }
        runs
    }

    /// The same for what follows particle `i` in memory, which is at `p` of the grid's axes: of two particles, this finds the
    /// later one from the earlier one alone. The rows it looks at, side by side: its own, the next one, and three of the
    /// next layer.
    #[inline(always)]
    pub(crate) fn runs_ahead<M: Machine>(&self, m: M, i: usize, p: Vec3) -> Ahead {
        let c = coordinates(p, self.low, self.inverse, self.size);
        let (x, y, z) = (p.x - self.low.x, p.y - self.low.y, p.z - self.low.z);
        let above = m.all(self.gap(y, c.y + 1, c.y));
        let before = m.all(self.gap(z, c.z.wrapping_sub(1), c.z));
        let after = m.all(self.gap(z, c.z + 1, c.z));
        let lanes = |lanes: [f32; 5]| {
            let mut all = [0.0; LANES];
            all[..5].copy_from_slice(&lanes);
            m.eight(&all)
        };
        let dy = above * lanes([0.0, 0.0, 1.0, 1.0, 1.0]);
        let dz = after * lanes([0.0, 1.0, 0.0, 0.0, 1.0]) + before * lanes([0.0, 0.0, 1.0, 0.0, 0.0]);
        let left = m.all(self.width * self.width) - dy * dy - dz * dz;
        let half = left.max(m.all(0.0)).sqrt() + m.all(ROUNDING * self.width);
        let (x, inverse) = (m.all(x), m.all(self.inverse.x));
        let (low, high) = (((x - half) * inverse).whole(), ((x + half) * inverse).whole());
        let reached = m.all(0.0).less(left);
        let (row, layer) = (self.size.x, self.size.x * self.size.z);
        let own = c.y * layer + c.z * row;
        let inside = [true, c.z + 1 < self.size.z, c.z > 0, true, c.z + 1 < self.size.z];
        let firsts = [own, own + row, own + layer - row, own + layer, own + layer + row];
        let last = self.size.y * layer - row;
        let rows = if c.y + 1 < self.size.y { 5 } else { 2 };
        let mut runs = Runs::default();
        for k in 0..rows {
            // Of rows that are not there, any will do.
            let first = firsts[k].min(last);
            let column = |c: i32| c.cast_unsigned().min(row - 1);
            let from = self.start[(first + column(low[k])) as usize];
            let to = self.start[(first + column(high[k])) as usize + 1];
            let from = if k == 0 { i as u32 + 1 } else { from };
            let there = inside[k] && (reached >> k) & 1 > 0;
            runs.push((from, if there { to } else { 0 }));
        }
        runs
    }

    /// What of row (`y`, `z`) may be within a width of `p` in cell `c`.
    #[inline(always)]
    fn run(&self, p: Vec3, c: UVec3, y: u32, z: u32) -> (u32, u32) {
        let dy = self.gap(p.y - self.low.y, y, c.y);
        let dz = self.gap(p.z - self.low.z, z, c.z);
        let left = self.width * self.width - dy * dy - dz * dz;
        if left < 0.0 {
            return (0, 0);
        }
        let half = left.sqrt() + ROUNDING * self.width;
        let column = |x: f32| (((x - self.low.x) * self.inverse.x) as u32).min(self.size.x - 1);
        let row = (y * self.size.z + z) * self.size.x;
        let from = self.start[(row + column(p.x - half)) as usize];
        let to = self.start[(row + column(p.x + half) + 1) as usize];
        (from, to)
    }

    /// Axes of space that X, Y and Z of the grid lie along.
    pub(crate) fn axes(&self) -> [usize; 3] {
        self.axes
    }

    /// Number of layers of cells: what is within reach of a particle is in its own layer or in one beside it.
    pub(crate) fn layers(&self) -> usize {
        self.size.y as usize
    }

    /// First particle of layer `k`, or their number if there is no such layer.
    pub(crate) fn layer(&self, k: usize) -> usize {
        let cells = self.size.x as usize * self.size.z as usize;
        self.start[(k.min(self.layers())) * cells] as usize
    }

    /// Distance of row `k` from what stands `x` from the first one's side, in row `own`. The outermost rows go on for ever.
    #[inline]
    fn gap(&self, x: f32, k: u32, own: u32) -> f32 {
        let gap = match k.cmp(&own) {
            std::cmp::Ordering::Less => x - self.width * (k + 1) as f32,
            std::cmp::Ordering::Equal => 0.0,
            std::cmp::Ordering::Greater => self.width * k as f32 - x,
        };
        (gap - ROUNDING * self.width).max(0.0)
    }

    pub(crate) fn bytes(&self) -> usize {
        4 * (self.start.capacity() + self.cell.capacity() + self.order.capacity())
    }
}

/// Ranges of particles about a point: `N` - 1 at most, since the next one is written before it is known to hold any.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Runs<const N: usize = 10> {
    list: [(u32, u32); N],
    count: u32,
}

/// Ranges of particles that follow one of them.
pub(crate) type Ahead = Runs<6>;

impl<const N: usize> Default for Runs<N> {
    #[inline(always)]
    fn default() -> Self {
        Self {
            list: [(0, 0); N],
            count: 0,
        }
    }
}

impl<const N: usize> Runs<N> {
    /// Adds a range, unless it is empty.
    #[inline(always)]
    pub(crate) fn push(&mut self, (from, to): (u32, u32)) {
        self.list[self.count as usize] = (from, to);
        self.count += u32::from(from < to);
    }

    #[inline(always)]
    pub(crate) fn iter(&self) -> impl Iterator<Item = Range<usize>> {
        let runs = self.list.iter().take(self.count as usize);
        runs.map(|&(from, to)| from as usize..to as usize)
    }
}

/// `c` and what is beside it.
#[inline(always)]
fn rows(c: u32, size: u32) -> Range<u32> {
    c.saturating_sub(1)..(c + 2).min(size)
}

/// `p` along other axes.
#[inline(always)]
fn turned(axes: [usize; 3], p: Vec3) -> Vec3 {
    match axes {
        [0, 1, 2] => p,
        _ => Vec3::from_array(axes.map(|k| p[k])),
    }
}

fn coordinates(p: Vec3, low: Vec3, inverse: Vec3, size: UVec3) -> UVec3 {
    // Conversion to unsigned saturates at 0.
    ((p - low) * inverse).as_uvec3().min(size - 1)
}

/// The box of all positions; a point if there is none.
pub(super) fn bounds(positions: &[Vec4]) -> (Vec3, Vec3) {
    let Some(first) = positions.first() else {
        return (Vec3::ZERO, Vec3::ZERO);
    };
    let (mut low, mut high) = (*first, *first);
    for p in positions {
        low = low.min(*p);
        high = high.max(*p);
    }
    (low.truncate(), high.truncate())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rng::Rng;

    /// 503 particles, two of them far away, and one at a great distance.
    fn positions() -> Vec<Vec4> {
        let mut rng = Rng::new(3, 0);
        let mut positions: Vec<Vec4> = (0..500)
            .map(|_| {
                let mut u = || rng.uniform_f32();
                Vec4::new(u(), 2.0 * u(), 0.1 * u(), 0.0)
            })
            .collect();
        positions.push(Vec4::new(90.0, 0.0, 0.0, 0.0));
        positions.push(Vec4::new(90.05, 0.0, 0.0, 0.0));
        positions.push(Vec4::new(0.0, 1e6, 0.0, 0.0));
        positions
    }

    #[test]
    fn every_pair_within_a_cell_width_is_found_even_far_outside() {
        let (width, mut cells, mut spare, mut positions) = (0.12, Cells::default(), Vec::new(), positions());
        cells.sort(&positions, width);
        let mut seen: Vec<u32> = cells.order().to_vec();
        seen.sort_unstable();
        assert_eq!(seen, (0..503).collect::<Vec<u32>>());
        cells.reorder(&mut positions, &mut spare);
        for p in &positions {
            let near = |q: &Vec4| p.distance_squared(*q) < width * width;
            let expected = positions.iter().filter(|q| near(q)).count();
            let mut found = 0;
            for run in cells.runs_around(p.truncate()).iter() {
                found += positions[run].iter().filter(|q| near(q)).count();
            }
            assert_eq!(found, expected);
        }
    }

    #[test]
    fn each_pair_is_found_once_from_its_earlier_particle() {
        // Along each axis, without what would make one the longest, and with it.
        for (turn, count) in [(0, 500), (1, 500), (2, 500), (0, 502), (1, 503)] {
            let turned = |p: &Vec4| {
                Vec4::from_array([0, 1, 2, 3].map(|k| if k < 3 { p[(k + turn) % 3] } else { 0.0 }))
            };
            let mut positions: Vec<Vec4> = positions()[..count].iter().map(turned).collect();
            let (width, mut cells, mut spare) = (0.12, Cells::default(), Vec::new());
            cells.sort_in_layers(&positions, width);
            cells.reorder(&mut positions, &mut spare);
            let near = |p: &Vec4, q: &Vec4| p.distance_squared(*q) < width * width;
            for (i, p) in positions.iter().enumerate() {
                let own = Vec3::from_array(cells.axes().map(|k| p[k]));
                let mut found: Vec<usize> = cells
                    .runs_ahead(pulp::Scalar256b, i, own)
                    .iter()
                    .flatten()
                    .collect();
                found.retain(|j| near(p, &positions[*j]));
                found.sort_unstable();
                let later = (i + 1..count).filter(|j| near(p, &positions[*j]));
                assert_eq!(found, later.collect::<Vec<usize>>());
            }
            // Nothing reaches beyond the next layer.
            assert_eq!(cells.layer(cells.layers() + 1), count);
            for k in 0..cells.layers() {
                for i in cells.layer(k)..cells.layer(k + 1) {
                    let own = Vec3::from_array(cells.axes().map(|k| positions[i][k]));
                    let last = cells
                        .runs_ahead(pulp::Scalar256b, i, own)
                        .iter()
                        .map(|run| run.end)
                        .max();
                    assert!(last.is_none_or(|last| last <= cells.layer(k + 2)));
                }
            }
        }
    }
}
