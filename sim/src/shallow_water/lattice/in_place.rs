//! A step of water that is calm everywhere, in place: rows go through the stages at their whole length, and what a row
//! held before lives on in a few rows of scratch until its neighbours are done. Half the memory traffic of a step into
//! other arrays, with the same bits.

use super::Lattice;
use super::kernels::{self, Between, Constants, Found, New, Old, RowView, Stage, Star};
use super::tile::{self, Source};
use crate::shallow_water::finite_volume::kernels::{self as volumes, Row, flag};
use crate::shallow_water::finite_volume::volume_step::{Extent, Outcome};
use crate::shallow_water::finite_volume::{Tile, part};
use crate::shallow_water::real::Real;
use crate::shallow_water::storage::{GHOSTS, Layout};
use rayon::prelude::*;

/// Depth, momentum and moments.
const PLANES: usize = 6;

/// Values of a row in each plane.
type Rows<T> = [Vec<T>; PLANES];

/// Rows between the stages, as long as the grid's; the newest is last in each array.
struct Scratch<T> {
    stars: [Star<T>; 3],
    between: [Between<T>; 2],
    /// Depths before the step.
    depths: [Vec<T>; 3],
}

impl<T: Real> Scratch<T> {
    fn new(n: usize) -> Self {
        Self {
            stars: std::array::from_fn(|_| Star::new(n)),
            between: std::array::from_fn(|_| Between::new(n)),
            depths: std::array::from_fn(|_| vec![T::ZERO; n]),
        }
    }
}

/// One band of rows.
struct Band<'a, T> {
    k: &'a Constants<T>,
    volume: &'a volumes::Constants<T>,
    layout: Layout,
    bed: &'a [T],
    /// The rows of the band in each plane.
    planes: [&'a mut [T]; PLANES],
    /// The rows before and behind it, as they were.
    rims: [Rows<T>; 2],
    first_row: usize,
    tiles: &'a mut [Tile<T>],
    moved: &'a mut [bool],
    scratch: &'a mut Scratch<T>,
}

impl<T: Real> pulp::WithSimd for Band<'_, T> {
    type Output = bool;

    /// Steps the band; whether the new state is calm amid it.
    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) -> bool {
        let Self {
            k,
            volume,
            layout: Layout { nx, stride, .. },
            bed,
            mut planes,
            rims: [before, behind],
            first_row,
            tiles,
            moved,
            scratch,
        } = self;
        let rows = planes[0].len() / stride;
        let (start, end) = (first_row, first_row + rows);
        let ground = |r: usize| &bed[r * stride..(r + 1) * stride];
        let local = |r: usize| (r - start) * stride..(r - start + 1) * stride;
        let Scratch {
            stars,
            between,
            depths,
        } = scratch;
        let mut found = vec![Found::nothing(); tiles.len()];
        let mut calm = true;
        for newest in start - 1..=end {
            stars.rotate_left(1);
            depths.rotate_left(1);
            let [h, qx, qz, xx, zz, xz] = if newest < start {
                before.each_ref().map(Vec::as_slice)
            } else if newest == end {
                behind.each_ref().map(Vec::as_slice)
            } else {
                planes.each_ref().map(|p| &p[local(newest)])
            };
            let row = RowView {
                h,
                z: ground(newest),
                qx,
                qz,
                moments: [xx, zz, xz],
            };
            kernels::collided(k, row, &mut stars[2]);
            depths[2].copy_from_slice(h);
            if newest < start {
                continue;
            }
            between.rotate_left(1);
            let r = newest - 1;
            kernels::between(
                k,
                GHOSTS,
                nx,
                [(&depths[1], ground(r)), (&depths[2], ground(newest))],
                [&stars[1], &stars[2]],
                &mut between[1],
            );
            if r < start {
                continue;
            }
            for (t, found) in found.iter_mut().enumerate() {
                let (from, to) = (part(nx, tiles.len(), t), part(nx, tiles.len(), t + 1));
                let first = GHOSTS + from;
                let at = local(r).start + first..local(r).start + GHOSTS + to;
                let before = Old {
                    h: &depths[1],
                    z: ground(r),
                };
                let stage = Stage::new(first, to - from, before, &stars[1], [&between[0], &between[1]]);
                let [h, qx, qz, xx, zz, xz] = planes.each_mut().map(|p| &mut p[at.clone()]);
                let new = New {
                    h,
                    qx,
                    qz,
                    moments: [xx, zz, xz],
                };
                tile::stream_row(k, volume, &stage, new, found);
            }
            // Friction only slows water that was found slow.
            let inner = |r: usize| local(r).start + GHOSTS..local(r).start + GHOSTS + nx;
            let new = |r: usize| (&planes[0][inner(r)], &ground(r)[GHOSTS..GHOSTS + nx]);
            calm &= kernels::level(k, new(r.max(start + 1) - 1), new(r));
        }
        calm &= found.iter().all(|found| !found.restless);
        for ((tile, moved), found) in tiles.iter_mut().zip(moved).zip(found) {
            tile.outcome = Outcome {
                speed: found.signal(k),
                flags: found.flags | (u32::from(*moved | found.moves) * flag::ALIVE),
            };
            *moved = found.moves;
        }
        calm
    }
}

impl<T: Real> Lattice<T> {
    /// Steps the whole grid in place; whether the new state is calm wherever that can be seen without the ghosts.
    pub(super) fn step_in_place(
        &mut self,
        k: &Constants<T>,
        volume: &volumes::Constants<T>,
        weight: T,
    ) -> bool {
        let water = &mut self.water;
        let layout = water.layout;
        let Layout { nx, nz, stride } = layout;
        let tiles_x = water.tiles_x;
        let bands = water.tiles.len() / tiles_x;
        let [xx, zz, xz] = &mut self.moments[..] else {
            return false;
        };
        let now = &mut water.now;
        let whole: [&mut Vec<T>; PLANES] = [&mut now.h, &mut now.qx, &mut now.qz, xx, zz, xz];
        let copy = |r: usize| -> Rows<T> {
            let at = r * stride..(r + 1) * stride;
            std::array::from_fn(|p| whole[p][at.clone()].to_vec())
        };
        let rims: Vec<[Rows<T>; 2]> = (0..bands)
            .map(|b| {
                let (from, to) = (part(nz, bands, b), part(nz, bands, b + 1));
                [copy(from + GHOSTS - 1), copy(to + GHOSTS)]
            })
            .collect();
        let mut rest = whole.map(|p| &mut p[layout.interior()]);
        let mut jobs = Vec::with_capacity(bands);
        let tiles = water
            .tiles
            .chunks_mut(tiles_x)
            .zip(self.moved.chunks_mut(tiles_x));
        for ((b, rims), (tiles, moved)) in rims.into_iter().enumerate().zip(tiles) {
            let (from, to) = (part(nz, bands, b), part(nz, bands, b + 1));
            let values = (to - from) * stride;
            let planes = rest
                .each_mut()
                .map(|p| p.split_off_mut(..values).unwrap_or_default());
            jobs.push((planes, rims, from + GHOSTS, tiles, moved));
        }
        let bed = &water.bed[..];
        let arch = pulp::Arch::new();
        // A thread keeps its scratch over several bands.
        let together = bands.div_ceil(4 * rayon::current_num_threads());
        let calm = jobs
            .into_par_iter()
            .with_min_len(together)
            .map_init(
                || Scratch::new(stride),
                |scratch, (planes, rims, first_row, tiles, moved)| {
                    arch.dispatch(Band {
                        k,
                        volume,
                        layout,
                        bed,
                        planes,
                        rims,
                        first_row,
                        tiles,
                        moved,
                        scratch,
                    })
                },
            )
            .reduce(|| true, |a, b| a & b);
        for tile in &mut water.tiles {
            tile.outcome.speed = tile.outcome.speed * weight;
        }
        let row = |r: usize| {
            let at = r * stride + GHOSTS..r * stride + GHOSTS + nx;
            (&water.now.h[at.clone()], &bed[at])
        };
        calm && (1..bands).all(|b| {
            let r = part(nz, bands, b) + GHOSTS;
            kernels::level(k, row(r - 1), row(r))
        })
    }
}

/// Whether all cells at the edges of the domain and beside them beyond are calm; the ghosts are filled.
pub(super) fn calm_at_edges<T: Real>(k: &Constants<T>, source: &Source<'_, T>, layout: Layout) -> bool {
    let Layout { nx, nz, .. } = layout;
    let mut row = Box::new([T::ZERO; volumes::LANES]);
    let mut calm = |first_row: usize, rows: usize, first_column: usize, columns: usize| {
        (first_row..first_row + rows).all(|r| {
            let mut at = first_column;
            while at < first_column + columns {
                let m = (first_column + columns - at).min(volumes::LANES - 2);
                let view = |r: usize| source.row(r, at - 1, m + 2);
                kernels::calm(k, [view(r - 1), view(r), view(r + 1)], &mut row);
                if !all(&row, m) {
                    return false;
                }
                at += m;
            }
            true
        })
    };
    let (left, top) = (GHOSTS - 1, GHOSTS - 1);
    calm(top, 2, left, nx + 2)
        && calm(GHOSTS + nz - 1, 2, left, nx + 2)
        && calm(top, nz + 2, left, 2)
        && calm(top, nz + 2, GHOSTS + nx - 1, 2)
}

fn all<T: Real>(row: &Row<T>, m: usize) -> bool {
    row[1..=m].iter().all(|c| *c > T::ZERO)
}

/// A tile's extent in padded indices.
pub(super) fn extent(layout: Layout, tiles_x: usize, bands: usize, t: usize) -> Extent {
    let (i, j) = (t % tiles_x, t / tiles_x);
    let (from, to) = (part(layout.nx, tiles_x, i), part(layout.nx, tiles_x, i + 1));
    let (top, bottom) = (part(layout.nz, bands, j), part(layout.nz, bands, j + 1));
    Extent {
        first_column: from + GHOSTS,
        columns: to - from,
        first_row: top + GHOSTS,
        rows: bottom - top,
    }
}
