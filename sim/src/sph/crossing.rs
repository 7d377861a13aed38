//! Where the potential of the particles first reaches a level on the way down, for a tile of columns side by side.
//!
//! Each tile is searched downwards from the highest particle near it in steps, taking up particles as they come within reach, so
//! the cost grows with the number of columns and not with the depth of the water. Of every candidate and column
//! 1 − ρ²/h² is kept, ρ being the horizontal distance: φ at any height then is one root a candidate, for all columns of the
//! tile at once.

use super::bins::Bins;
use super::boundary::Boundary;
use super::candidates::{Candidates, Gathered, LANES, Lanes, Source, TILE, Tile};
use super::mirrors::Inner;
use crate::grid::{Grid, GridSpec};

/// Columns that have crossed wait for others to go on together, until those are so many radii farther down.
const APART: f32 = 1.0;
/// Share of the level below which φ cannot be said to reach it, for all that sums are rounded.
const HARDLY: f32 = 0.999;
/// Share of the level below which φ does not reach it and fall back within two steps: particles that are a spacing apart have
/// no peak so narrow.
const FAR: f32 = 0.6;

/// How crossings are searched for.
#[derive(Clone, Copy, Debug)]
pub(super) struct Search {
    /// Radius h of the potential, m.
    pub(super) radius: f32,
    pub(super) level: f32,
    /// Step of the way down, m.
    pub(super) step: f32,
    /// Evaluations after that at most.
    pub(super) most: usize,
    /// Move of the crossing, in metres, at which it is found.
    pub(super) close: f32,
}

/// Buffers of a search.
#[derive(Debug, Default)]
pub(super) struct Buffers {
    gathered: Gathered,
    candidates: Candidates,
}

impl Buffers {
    pub(super) fn bytes(&self) -> usize {
        self.gathered.bytes() + self.candidates.bytes()
    }
}

/// A row of blocks under search.
pub(super) struct Row<'a> {
    pub(super) search: &'a Search,
    pub(super) bins: &'a Bins,
    pub(super) spec: &'a GridSpec,
    pub(super) boundary: &'a Boundary,
    pub(super) ground: &'a Grid<f32>,
    /// Number of the first row of samples.
    pub(super) first: usize,
    /// Columns along a block.
    pub(super) across: usize,
    pub(super) buffers: &'a mut Buffers,
    /// Heights of the samples of the row.
    pub(super) out: &'a mut [f32],
}

impl pulp::WithSimd for Row<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(mut self, _: S) {
        self.out.fill(f32::NEG_INFINITY);
        let radius = self.search.radius;
        let from = Source {
            bins: self.bins,
            boundary: self.boundary,
            inner: &Inner::new(self.boundary, radius),
            radius,
        };
        let (width, rows) = (self.spec.width(), self.out.len() / self.spec.width());
        for block in (0..width).step_by(self.across) {
            let end = (block + self.across).min(width);
            let low = self.spec.position(block, self.first);
            let high = self.spec.position(end - 1, self.first + rows - 1);
            if !self.buffers.gathered.open(low, high, &from) {
                continue;
            }
            for row in (0..rows).step_by(TILE[1]) {
                for i in (block..end).step_by(TILE[0]) {
                    self.tile(i, row, &from);
                }
            }
        }
    }
}

/// Heights between which columns cross, and φ less the level there.
#[derive(Clone, Copy, Debug, Default)]
struct Brackets {
    /// Whether a column waits for its crossing to be made exact, 1 or 0.
    waits: Lanes,
    low: Lanes,
    below: Lanes,
    high: Lanes,
    above: Lanes,
}

impl Row<'_> {
    /// Searches the tile whose first column is `i` of that `row` of the block.
    #[inline(always)]
    fn tile(&mut self, i: usize, row: usize, from: &Source) {
        let (search, width) = (self.search, self.spec.width());
        let (columns, rows) = (TILE[0].min(width - i), TILE[1].min(self.out.len() / width - row));
        let corner = |i: usize, j: usize| self.spec.position(i, self.first + row + j);
        let mut tile = Tile {
            x: [0.0; LANES],
            z: [0.0; LANES],
            low: corner(i, 0),
            high: corner(i + columns - 1, rows - 1),
        };
        // Columns beyond the last one are found before the search begins.
        let mut open = [0.0_f32; LANES];
        let mut lowest = f32::MAX;
        for k in 0..LANES {
            let (a, b) = (k % TILE[0], k / TILE[0]);
            let (column, down) = (a.min(columns - 1), b.min(rows - 1));
            let at = corner(i + column, down);
            (tile.x[k], tile.z[k]) = (at.x, at.y);
            open[k] = if (column, down) == (a, b) { 1.0 } else { 0.0 };
            lowest = lowest.min(self.ground[(i + column, self.first + row + down)]);
        }
        let Buffers { gathered, candidates } = &mut *self.buffers;
        let out = &mut self.out[row * width..];
        candidates.open();
        let h = search.radius;
        let mut left: f32 = open.iter().sum();
        let mut found = Brackets::default();
        let mut highest = f32::NEG_INFINITY;
        let mut y = candidates.next(gathered, self.bins) + h;
        // Where φ is known to be too low in all columns that are open.
        let mut last: Option<(f32, Lanes)> = None;
        let mut step = search.step;
        while left > 0.0 && y > lowest {
            y = (y - step).max(lowest);
            candidates.drop_above((y + step).max(highest) + h);
            candidates.take_down_to(y - h, &tile, gathered, from);
            if !any(&open, candidates.most(), HARDLY * search.level) {
                y = y.min(candidates.next(gathered, self.bins) + h);
                (last, step) = (None, search.step);
                continue;
            }
            let value = candidates.potential_at(y, h);
            if any(&open, &value, search.level) {
                let (high, above) = last.unwrap_or_else(|| {
                    let high = y + step;
                    (high, candidates.potential_at(high, h))
                });
                for k in 0..LANES {
                    let crosses = open[k] > 0.0 && value[k] >= search.level;
                    if crosses {
                        open[k] = 0.0;
                        found.waits[k] = 1.0;
                        (found.low[k], found.below[k]) = (y, value[k] - search.level);
                        // A step after a leap may begin above a surface thinner than itself, which then is what is found.
                        found.high[k] = high;
                        found.above[k] = (above[k] - search.level).min(-f32::MIN_POSITIVE);
                    }
                }
                highest = highest.max(high);
                left = open.iter().sum();
            }
            last = Some((y, value));
            let far = !any(&open, &value, FAR * search.level);
            step = if far { 2.0 } else { 1.0 } * search.step;
            if highest - y > APART * h {
                search.write(candidates, &mut found, i, width, out);
                highest = f32::NEG_INFINITY;
            }
        }
        if highest > f32::NEG_INFINITY {
            search.write(candidates, &mut found, i, width, out);
        }
    }
}

/// Whether one of the columns that are `open` has a value of `least` or more.
#[inline(always)]
fn any(open: &Lanes, value: &Lanes, least: f32) -> bool {
    let mut most = 0.0_f32;
    for k in 0..LANES {
        let value = open[k] * value[k];
        most = if value > most { value } else { most };
    }
    most >= least
}

impl Search {
    /// Writes the crossings of the columns that wait, of a tile at sample `i` of rows of `width`.
    #[inline(always)]
    fn write(&self, candidates: &Candidates, found: &mut Brackets, i: usize, width: usize, out: &mut [f32]) {
        let at = self.roots(candidates, found);
        for k in 0..LANES {
            if found.waits[k] > 0.0 {
                out[k / TILE[0] * width + i + k % TILE[0]] = at[k];
            }
        }
        found.waits = [0.0; LANES];
    }

    /// The crossings within brackets, by regula falsi with the weights of Anderson & Björck 1973. The last point is not evaluated.
    #[inline(always)]
    fn roots(&self, candidates: &Candidates, found: &Brackets) -> Lanes {
        let Brackets {
            mut waits,
            mut low,
            mut below,
            mut high,
            mut above,
        } = *found;
        let mut at = low;
        for evaluations in 0..=self.most {
            let mut left = 0.0;
            for k in 0..LANES {
                let next = low[k] + (high[k] - low[k]) * (below[k] / (below[k] - above[k]));
                let next = if waits[k] > 0.0 { next } else { at[k] };
                waits[k] = if (next - at[k]).abs() < self.close {
                    0.0
                } else {
                    waits[k]
                };
                at[k] = next;
                left += waits[k];
            }
            if left == 0.0 || evaluations == self.most {
                break;
            }
            let value = candidates.potential(&at, self.radius);
            for k in 0..LANES {
                let f = value[k] - self.level;
                let under = f >= 0.0;
                let (x, b, a) = (at[k], below[k], above[k]);
                // What the end that stays counts, less the flatter the function is near the other one.
                let weight = 1.0 - f / if under { b } else { a };
                let weight = if weight > 0.0 { weight } else { 0.5 };
                low[k] = if under { x } else { low[k] };
                high[k] = if under { high[k] } else { x };
                below[k] = if under { f } else { weight * b };
                above[k] = if under { weight * a } else { f };
            }
        }
        at
    }
}
