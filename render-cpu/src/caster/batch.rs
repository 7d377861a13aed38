//! Many rays at once: every stage runs over the whole batch before the next begins.
//!
//! Stages have no branches that depend on a single ray, so the processor overlaps the rays of a stage, which hides the
//! latency of loads and divisions. A ray that a stage does not settle is queued for the stage that it needs next.

use super::blocks::{BLOCK, Blocks, PairBounds, WINDOW};
use super::column::{Columns, Crossing, Side};
use super::filter::{Strip, between, next};
use super::surface::Surface;
use super::walk::Walk;
use super::{Hit, Ray};
use fearless_simd::Simd;

/// Rays of a batch.
pub(crate) const BATCH: usize = 128;

/// Rays that are clipped together.
const LANES: usize = 8;

/// Where a ray is on its walk.
#[derive(Clone, Copy, Debug, Default)]
struct Cursor {
    /// First column that is not excluded.
    column: u32,
    /// First block column of the window, and those of its block columns that are left, as bits.
    window: u32,
    blocks: u32,
    /// First column of the block at hand, and those of its columns that are left, as bits.
    base: u32,
    columns: u32,
    below: bool,
}

/// Indices of rays that wait for a stage.
struct Queue {
    rays: [u8; BATCH],
    len: usize,
}

impl Queue {
    fn new() -> Self {
        Self {
            rays: [0; BATCH],
            len: 0,
        }
    }

    /// Appends without a branch: the entry counts only if `wanted`.
    #[inline(always)]
    fn push_if(&mut self, ray: u8, wanted: bool) {
        if let Some(place) = self.rays.get_mut(self.len) {
            *place = ray;
        }
        self.len += usize::from(wanted);
    }

    /// Takes all entries out.
    #[inline(always)]
    fn take(&mut self) -> ([u8; BATCH], usize) {
        (self.rays, std::mem::take(&mut self.len))
    }
}

/// State of one batch, reused for the next.
pub(crate) struct Batch<'a> {
    surface: &'a Surface,
    blocks: &'a Blocks,
    walks: [Walk; BATCH],
    strips: [Strip; BATCH],
    cursors: [Cursor; BATCH],
    /// Rays that need another window of blocks, have blocks to be looked into, or columns to be solved.
    windows: Queue,
    inside: Queue,
    exact: Queue,
    found: [Option<Crossing>; BATCH],
}

impl<'a> Batch<'a> {
    pub(crate) fn new(surface: &'a Surface, blocks: &'a Blocks) -> Self {
        Self {
            surface,
            blocks,
            walks: [Walk::default(); BATCH],
            strips: [Strip::default(); BATCH],
            cursors: [Cursor::default(); BATCH],
            windows: Queue::new(),
            inside: Queue::new(),
            exact: Queue::new(),
            found: [None; BATCH],
        }
    }

    /// Casts up to [`BATCH`] rays.
    #[inline(always)]
    pub(crate) fn cast<S: Simd>(
        &mut self,
        simd: S,
        rays: &[Ray],
        t_min: f64,
        t_max: f64,
        hits: &mut [Option<Hit>],
    ) {
        self.found = [None; BATCH];
        self.start(rays, t_min, t_max);
        while self.windows.len + self.inside.len + self.exact.len > 0 {
            self.look_at_windows(simd);
            self.look_into_blocks(simd);
            self.solve_columns();
        }
        for (k, (ray, hit)) in rays.iter().zip(hits).enumerate() {
            let k = k % BATCH;
            *hit = self.found[k].map(|crossing| crossing.hit(self.surface, ray, &self.walks[k]));
        }
    }

    /// Clips the rays and finds the side of each.
    #[inline(always)]
    fn start(&mut self, rays: &[Ray], t_min: f64, t_max: f64) {
        let nothing = Ray {
            origin: glam::DVec3::NAN,
            direction: glam::DVec3::NAN,
        };
        for (group, walks) in rays.chunks(LANES).zip(self.walks.as_chunks_mut::<LANES>().0) {
            // A ray that is not finite is not valid, so it may fill up the last group.
            let mut lanes = [nothing; LANES];
            lanes[..group.len()].copy_from_slice(group);
            let valid = Walk::clip(self.surface, &lanes, t_min, t_max, walks);
            for (k, walk) in walks.iter_mut().enumerate() {
                if valid & (1 << k) == 0 {
                    walk.end = f64::NEG_INFINITY;
                }
            }
        }
        for k in 0..rays.len().min(BATCH) {
            if self.walks[k].end > f64::NEG_INFINITY {
                self.begin(k);
            }
        }
    }

    #[inline(always)]
    fn begin(&mut self, k: usize) {
        let walk = &self.walks[k];
        let layout = self.surface.layout(walk.major_is_x);
        let mut columns = Columns::new(layout, walk);
        let (mut column, last) = (walk.first as usize, walk.last as usize);
        // What starts on the surface must find its side first.
        while columns.side == Side::On {
            self.found[k] = columns.crossing(column);
            if self.found[k].is_some() || column == last {
                return;
            }
            column = if walk.forward() { column + 1 } else { column - 1 };
        }
        let below = columns.side == Side::Below;
        self.strips[k] = Strip::new(walk, below);
        // A walk of one or two columns is not worth filtering.
        let short = column.abs_diff(last) < 2;
        let base = if short { column.min(last) } else { 0 };
        let bounds = self.blocks.along(walk.major_is_x);
        let window = bounds.window(column / BLOCK, walk.forward());
        self.cursors[k] = Cursor {
            column: column as u32,
            window: if short {
                (last / BLOCK) as u32
            } else {
                window as u32
            },
            blocks: 0,
            base: base as u32,
            columns: if short { between(column, last, base) } else { 0 },
            below,
        };
        self.exact.push_if(k as u8, short);
        self.windows.push_if(k as u8, !short);
    }

    /// Queues a ray whose block and columns are done with for whatever is left of its walk.
    #[inline(always)]
    fn resume(&mut self, k: u8, bounds: &PairBounds) {
        let walk = &self.walks[usize::from(k) % BATCH];
        let cursor = &mut self.cursors[usize::from(k) % BATCH];
        let more = cursor.blocks != 0;
        // Beyond this window?
        let last = walk.last / BLOCK as u32;
        let is_last = last.wrapping_sub(cursor.window) < WINDOW as u32;
        let forward = walk.forward();
        let block = if forward {
            cursor.window + WINDOW as u32
        } else {
            cursor.window.wrapping_sub(1)
        };
        if !more && !is_last {
            cursor.window = bounds.window(block as usize, forward) as u32;
            cursor.column = if forward {
                block * BLOCK as u32
            } else {
                block * BLOCK as u32 + (BLOCK as u32 - 1)
            };
        }
        self.inside.push_if(k, more);
        self.windows.push_if(k, !more & !is_last);
    }

    #[inline(always)]
    fn look_at_windows<S: Simd>(&mut self, simd: S) {
        let (rays, len) = self.windows.take();
        for &k in &rays[..len.min(BATCH)] {
            let i = usize::from(k) % BATCH;
            let walk = &self.walks[i];
            let bounds = self.blocks.along(walk.major_is_x);
            let cursor = &mut self.cursors[i];
            let window = cursor.window as usize;
            let places = between(cursor.column as usize / BLOCK, walk.last as usize / BLOCK, window);
            cursor.blocks = self.strips[i].block_columns(simd, bounds, window) & places;
            self.resume(k, bounds);
        }
    }

    #[inline(always)]
    fn look_into_blocks<S: Simd>(&mut self, simd: S) {
        let (rays, len) = self.inside.take();
        for &k in &rays[..len.min(BATCH)] {
            let i = usize::from(k) % BATCH;
            let walk = &self.walks[i];
            let bounds = self.blocks.along(walk.major_is_x);
            let layout = self.surface.layout(walk.major_is_x);
            let cursor = &mut self.cursors[i];
            let block = cursor.window as usize + next(&mut cursor.blocks, walk.forward());
            let base = block * BLOCK;
            let places = between(cursor.column as usize, walk.last as usize, base);
            cursor.base = base as u32;
            cursor.columns = self.strips[i].columns(simd, bounds, &layout, block) & places;
            if cursor.columns != 0 {
                self.exact.push_if(k, true);
            } else {
                self.resume(k, bounds);
            }
        }
    }

    #[inline(always)]
    fn solve_columns(&mut self) {
        let (rays, len) = self.exact.take();
        for &k in &rays[..len.min(BATCH)] {
            let i = usize::from(k) % BATCH;
            let walk = &self.walks[i];
            let layout = self.surface.layout(walk.major_is_x);
            let cursor = &mut self.cursors[i];
            let column = cursor.base as usize + next(&mut cursor.columns, walk.forward());
            let side = if cursor.below { Side::Below } else { Side::Above };
            let found = Columns::on_side(layout, walk, side).crossing(column);
            self.found[i] = found;
            if found.is_some() {
                continue;
            }
            if cursor.columns != 0 {
                self.exact.push_if(k, true);
            } else {
                self.resume(k, self.blocks.along(walk.major_is_x));
            }
        }
    }
}
