//! Storage of samples in tiles of 4 × 4, one cache line each.
//!
//! A ray that crosses eight cells in any direction touches three or four tiles; in row-major order it would touch up to ten
//! cache lines. Most of the time of an incoherent ray is waiting for those.

use bytemuck::{Pod, Zeroable};
use meniscus_sim::Grid;
use rayon::prelude::*;

/// Samples along a side of a tile.
pub(crate) const TILE: usize = 4;

#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C, align(64))]
struct Tile([f32; TILE * TILE]);

/// A grid of samples in tiles, with room for whole blocks of 8 × 8 cells and the line beyond; what is beyond the grid is 0.
#[derive(Clone, Debug, Default)]
pub(crate) struct Samples {
    tiles: Vec<Tile>,
    pub(crate) x: Stride,
    pub(crate) z: Stride,
}

/// Where samples along one axis are. The place of sample `(i, j)` is the sum of those of `i` and of `j`.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Stride {
    /// From a sample to its neighbour in the same tile.
    pub(crate) fine: u32,
    /// From a tile to the next.
    pub(crate) coarse: u32,
    /// From the first sample of a block to the eight that a walk comes to, first increasing, then decreasing: samples 1 to 8,
    /// and samples 7 to 0.
    pub(crate) ahead: [[i32; 2 * TILE]; 2],
}

impl Stride {
    fn new(fine: usize, coarse: usize) -> Self {
        let mut stride = Self {
            fine: fine as u32,
            coarse: coarse as u32,
            ahead: [[0; 2 * TILE]; 2],
        };
        stride.ahead = [
            std::array::from_fn(|k| stride.place(k as u32 + 1) as i32),
            std::array::from_fn(|k| stride.place((2 * TILE - 1 - k) as u32) as i32),
        ];
        stride
    }

    #[inline(always)]
    pub(crate) fn place(&self, index: u32) -> u32 {
        (index / TILE as u32) * self.coarse + (index % TILE as u32) * self.fine
    }
}

impl Samples {
    /// Takes the samples of a grid. Allocates nothing if the size is unchanged.
    pub(crate) fn copy_from(&mut self, grid: &Grid<f32>) {
        let (width, depth) = (grid.spec().width(), grid.spec().height());
        // Two tiles a block, and one for the last line.
        let tiles = |samples: usize| 2 * (samples - 1).div_ceil(2 * TILE) + 1;
        let (nx, nz) = (tiles(width), tiles(depth));
        let (tile, row) = (TILE * TILE, TILE * TILE * nx);
        // A grid has at most 2²⁸ samples, so that places fit.
        self.x = Stride::new(1, tile);
        self.z = Stride::new(TILE, row);
        self.tiles.resize(nx * nz, Tile::default());
        self.tiles
            .par_chunks_exact_mut(nx)
            .enumerate()
            .for_each(|(tile_row, tiles)| {
                for k in 0..TILE {
                    let j = tile_row * TILE + k;
                    let samples = if j < depth { grid.row(j) } else { &[] };
                    let (whole, rest) = samples.as_chunks::<TILE>();
                    for (n, tile) in tiles.iter_mut().enumerate() {
                        let quad = whole.get(n).copied().unwrap_or_else(|| {
                            let rest = if n == whole.len() { rest } else { &[] };
                            std::array::from_fn(|i| rest.get(i).copied().unwrap_or(0.0))
                        });
                        tile.0[k * TILE..(k + 1) * TILE].copy_from_slice(&quad);
                    }
                }
            });
    }

    #[inline(always)]
    pub(crate) fn as_slice(&self) -> &[f32] {
        bytemuck::cast_slice(&self.tiles)
    }

    pub(crate) fn bytes(&self) -> usize {
        self.tiles.capacity() * size_of::<Tile>()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use meniscus_sim::GridSpec;
    use meniscus_sim::glam::{UVec2, Vec2};

    #[test]
    fn every_sample_is_found_at_its_place() {
        let mut samples = Samples::default();
        for (w, d) in [(1, 1), (2, 9), (9, 2), (17, 33), (64, 5)] {
            let spec = GridSpec::new(Vec2::ZERO, 1.0, UVec2::new(w, d)).unwrap();
            let grid = Grid::from_fn(spec, |i, j| (1000 * j + i) as f32);
            samples.copy_from(&grid);
            for (j, i) in (0..d).flat_map(|j| (0..w).map(move |i| (j, i))) {
                let place = samples.x.place(i) + samples.z.place(j);
                assert_eq!(samples.as_slice()[place as usize], grid[(i as usize, j as usize)]);
            }
        }
    }
}
