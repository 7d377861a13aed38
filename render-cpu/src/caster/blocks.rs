//! Bounds of the surface over blocks of 8 × 8 cells: what lets a walk pass over columns without looking at samples.
//!
//! A walk along one axis sees blocks as *block columns* (eight columns of cells) of *block rows*. Within a block column it
//! moves at most one block along the other axis, so bounds are kept for pairs of neighbouring block rows, once for each
//! axis, with the block columns side by side: eight block columns are tested at once.

use super::surface::{Patch, Surface};
use fearless_simd::{Level, Simd, dispatch};
use meniscus_sim::Grid;
use rayon::prelude::*;

/// Cells along a side of a block.
pub(crate) const BLOCK: usize = 8;

/// Block columns that are tested at once.
pub(crate) const WINDOW: usize = 8;

/// Bounds for the walks along one axis. An entry covers block rows `row` and `row + 1`; the entries of a row stand side by
/// side, with room on both sides for windows that reach beyond the grid.
#[derive(Clone, Debug, Default)]
pub(crate) struct PairBounds {
    /// From one block row to the next.
    pub(crate) stride: u32,
    /// Block rows.
    pub(crate) rows: u32,
    /// No point of the surface is above the first, and none of its mirror image −h above the second: metres.
    pub(crate) ceiling: [Vec<f32>; 2],
    /// How far the surface leaves its chord between the two lines of a column, along any walk: metres.
    pub(crate) bulge: Vec<f32>,
}

/// Bounds of all blocks.
#[derive(Clone, Debug, Default)]
pub(crate) struct Blocks {
    /// For walks along X.
    along_x: PairBounds,
    /// For walks along Z.
    along_z: PairBounds,
    /// One value a block, X fastest: largest h, largest −h, bulge, largest step between neighbours.
    single: Vec<[f32; 4]>,
    /// Running maxima over the rows of a block, one set a row of blocks.
    scratch: Vec<Maxima>,
}

/// Maxima over some rows of samples, at every sample along X.
#[derive(Clone, Debug, Default)]
struct Maxima {
    high: Vec<f32>,
    deep: Vec<f32>,
    kink: Vec<f32>,
    twist: Vec<f32>,
    step: Vec<f32>,
}

impl Blocks {
    /// Measures the samples and sets the surface's extremes. Returns whether all samples are finite; if not, the bounds are
    /// unspecified. Allocates nothing if the size is unchanged.
    pub(crate) fn rebuild(&mut self, elevation: &Grid<f32>, surface: &mut Surface) -> bool {
        let blocks = |cells: u32| cells.div_ceil(BLOCK as u32) as usize;
        let (nx, nz) = (blocks(surface.cells_x()), blocks(surface.cells_z()));
        self.along_x.resize(nx, nz);
        self.along_z.resize(nz, nx);
        self.single.resize(nx * nz, [0.0; 4]);
        self.scratch.resize_with(nz, Maxima::default);
        if nx == 0 || nz == 0 {
            return elevation.find_non_finite().is_none();
        }
        let patch = surface.patch;
        self.single
            .par_chunks_exact_mut(nx)
            .zip(&mut self.scratch)
            .enumerate()
            .for_each(|(row, (blocks, maxima))| maxima.measure(elevation, patch, row, blocks));

        // A maximum is exact, so its order does not matter.
        let [high, deep, _, step] = self.single.iter().fold([f32::NEG_INFINITY; 4], |acc, block| {
            std::array::from_fn(|k| {
                if block[k] > acc[k] || block[k].is_nan() {
                    block[k]
                } else {
                    acc[k]
                }
            })
        });
        if !(high.is_finite() && deep.is_finite()) {
            return false;
        }
        surface.set_extremes(-f64::from(deep), f64::from(high), f64::from(step));

        let pads = Pads::of(surface);
        let single = &self.single;
        self.along_x
            .fill(pads, |column, row| single[row * nx + column], nx);
        self.along_z
            .fill(pads, |column, row| single[column * nx + row], nz);
        true
    }

    #[inline(always)]
    pub(crate) fn along(&self, x: bool) -> &PairBounds {
        if x { &self.along_x } else { &self.along_z }
    }

    pub(crate) fn bytes(&self) -> usize {
        let scratch: usize = self
            .scratch
            .iter()
            .map(|m| 5 * m.high.capacity() * size_of::<f32>())
            .sum();
        let single = self.single.capacity() * size_of::<[f32; 4]>();
        self.along_x.bytes() + self.along_z.bytes() + single + scratch
    }
}

/// What `f32` arithmetic may lose in a test, added to the bounds (metres).
///
/// Positions are kept relative to the block at hand, so they are wrong by some 10⁻⁶ blocks; heights by some units in the
/// last place of the largest height, and of a ray's change of height over a window of 64 lines. A ray walks more than one
/// column only if it crosses at most the whole slab in each.
#[derive(Clone, Copy, Debug)]
struct Pads {
    ceiling: f32,
    bulge: f32,
}

impl Pads {
    fn of(surface: &Surface) -> Self {
        let size = surface.high.abs().max(surface.low.abs());
        let slab = surface.high - surface.low;
        let common = 1e-6 * size + 1e-30;
        Self {
            ceiling: (common + 2e-5 * slab + 1e-4 * surface.steepest) as f32,
            bulge: (common + 4e-6 * slab + 4e-6 * surface.steepest) as f32,
        }
    }
}

impl PairBounds {
    /// Entries on either side of a row.
    const MARGIN: u32 = WINDOW as u32 - 1;

    /// Where block column `column` stands within its row.
    #[inline(always)]
    pub(crate) fn place(&self, column: u32) -> u32 {
        column + Self::MARGIN
    }

    fn resize(&mut self, columns: usize, rows: usize) {
        self.stride = columns as u32 + 2 * Self::MARGIN;
        self.rows = rows as u32;
        let len = self.stride as usize * rows;
        let [above, below] = &mut self.ceiling;
        for values in [above, below, &mut self.bulge] {
            values.clear();
            values.resize(len, 0.0);
        }
    }

    fn fill(&mut self, pads: Pads, block: impl Fn(usize, usize) -> [f32; 4], columns: usize) {
        let rows = self.rows as usize;
        let [above, below] = &mut self.ceiling;
        for row in 0..rows {
            let next = (row + 1).min(rows - 1);
            let first = row * self.stride as usize + Self::MARGIN as usize;
            for column in 0..columns {
                let (a, b) = (block(column, row), block(column, next));
                above[first + column] = a[0].max(b[0]) + pads.ceiling;
                below[first + column] = a[1].max(b[1]) + pads.ceiling;
                self.bulge[first + column] = a[2].max(b[2]) + pads.bulge;
            }
        }
    }

    fn bytes(&self) -> usize {
        3 * self.bulge.capacity() * size_of::<f32>()
    }
}

#[inline(always)]
fn raise(acc: &mut f32, value: f32) {
    // Unlike `f32::max`, one instruction; a NaN that it passes over is found among the heights.
    if value > *acc {
        *acc = value;
    }
}

impl Maxima {
    /// Measures one row of blocks.
    ///
    /// The bulge: along a walk through one cell of twist `T = h00 − h10 − h01 + h11`, a bilinear surface leaves its chord by
    /// at most ¼ |T|, and where the walk crosses a row of samples by at most ¼ of the second difference across that row
    /// more. Two triangles leave the bilinear patch by at most another ¼ |T|.
    fn measure(&mut self, elevation: &Grid<f32>, patch: Patch, row: usize, blocks: &mut [[f32; 4]]) {
        dispatch!(Level::new(), simd => self.measure_with(simd, elevation, patch, row, blocks));
    }

    /// Plain loops, which become as wide as the processor's vectors where they are compiled for them.
    #[inline(always)]
    fn measure_with<S: Simd>(
        &mut self,
        _: S,
        elevation: &Grid<f32>,
        patch: Patch,
        row: usize,
        blocks: &mut [[f32; 4]],
    ) {
        let (width, depth) = (elevation.spec().width(), elevation.spec().height());
        let line = |j: usize| elevation.row(j);
        for (values, start) in [
            (&mut self.high, f32::NEG_INFINITY),
            (&mut self.deep, f32::NEG_INFINITY),
            (&mut self.kink, 0.0),
            (&mut self.twist, 0.0),
            (&mut self.step, 0.0),
        ] {
            values.clear();
            values.resize(width, start);
        }
        let from = row * BLOCK;
        let to = (from + BLOCK).min(depth - 1);
        for j in from..=to {
            self.extremes(line(j));
            if j > 0 && j < depth - 1 {
                self.kinks_across(line(j - 1), line(j), line(j + 1));
            }
            if j < to {
                self.twists(line(j), line(j + 1));
            }
        }

        let share_of_twist = match patch {
            Patch::Bilinear => 0.25,
            Patch::Triangles => 0.5,
        };
        let max = |values: &[f32]| {
            values
                .iter()
                .fold(f32::NEG_INFINITY, |a, &b| if b > a { b } else { a })
        };
        for (column, block) in blocks.iter_mut().enumerate() {
            let from = column * BLOCK;
            let to = (from + BLOCK).min(width - 1);
            let vertices = from..to + 1;
            *block = [
                max(&self.high[vertices.clone()]),
                max(&self.deep[vertices.clone()]),
                0.25 * max(&self.kink[vertices.clone()]) + share_of_twist * max(&self.twist[from..to]),
                max(&self.step[vertices]),
            ];
        }
    }

    /// Heights, second differences along X and steps along X of one row of samples.
    #[inline(always)]
    fn extremes(&mut self, h: &[f32]) {
        for ((high, deep), &h) in self.high.iter_mut().zip(&mut self.deep).zip(h) {
            // NaN and infinity both make the maximum infinite, which the caller takes as not finite.
            let checked = if h.is_finite() { h } else { f32::INFINITY };
            raise(high, checked);
            raise(deep, -h);
        }
        for (step, pair) in self.step.iter_mut().zip(h.windows(2)) {
            raise(step, (pair[1] - pair[0]).abs());
        }
        for (kink, h) in self.kink.iter_mut().skip(1).zip(h.windows(3)) {
            raise(kink, (h[0] - 2.0 * h[1] + h[2]).abs());
        }
    }

    /// Second differences along Z.
    #[inline(always)]
    fn kinks_across(&mut self, before: &[f32], h: &[f32], after: &[f32]) {
        for (((kink, a), b), c) in self.kink.iter_mut().zip(before).zip(h).zip(after) {
            raise(kink, (a - 2.0 * b + c).abs());
        }
    }

    /// Twists of the cells between two rows, and steps along Z.
    #[inline(always)]
    fn twists(&mut self, h: &[f32], after: &[f32]) {
        for ((step, a), b) in self.step.iter_mut().zip(h).zip(after) {
            raise(step, (b - a).abs());
        }
        for ((twist, a), b) in self.twist.iter_mut().zip(h.windows(2)).zip(after.windows(2)) {
            raise(twist, ((a[0] - a[1]) - (b[0] - b[1])).abs());
        }
    }
}
