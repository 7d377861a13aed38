//! Many rays at once: every stage runs over the whole batch before the next begins.
//!
//! Stages have no branches that depend on a single ray, so the processor overlaps the rays of a stage, which hides the
//! latency of loads and divisions. A ray that a stage does not settle is queued for the stage that it needs next.

use super::blocks::{Blocks, PairBounds};
use super::column::{Columns, Side};
use super::filter::Strip;
use super::route::Route;
use super::surface::{Layout, Surface};
use super::walk::Walks;
use super::{Hit, Ray};
use fearless_simd::Simd;

/// Rays of a batch.
pub(crate) const BATCH: usize = 128;

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
    /// The samples and bounds for walks along Z and along X.
    axes: [(Layout<'a>, &'a PairBounds); 2],
    walks: Walks<BATCH>,
    strips: [Strip; BATCH],
    routes: [Route; BATCH],
    sides: [Side; BATCH],
    /// Rays that need another window of blocks, have blocks to be looked into, or columns to be solved.
    windows: Queue,
    inside: Queue,
    exact: Queue,
}

impl<'a> Batch<'a> {
    pub(crate) fn new(surface: &'a Surface, blocks: &'a Blocks) -> Self {
        Self {
            surface,
            axes: [false, true].map(|x| (surface.layout(x), blocks.along(x))),
            walks: Walks::new(),
            strips: [Strip::default(); BATCH],
            routes: [Route::default(); BATCH],
            sides: [Side::On; BATCH],
            windows: Queue::new(),
            inside: Queue::new(),
            exact: Queue::new(),
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
        self.walks.clip(self.surface, rays, t_min, t_max);
        for (k, (ray, hit)) in rays.iter().zip(hits.iter_mut()).enumerate().take(BATCH) {
            *hit = None;
            self.begin(k, ray, hit);
        }
        while self.windows.len + self.inside.len + self.exact.len > 0 {
            self.look_at_windows(simd);
            self.look_into_blocks(simd);
            self.solve_columns(rays, hits);
        }
    }

    /// Finds the side of a ray and queues it.
    #[inline(always)]
    fn begin(&mut self, k: usize, ray: &Ray, hit: &mut Option<Hit>) {
        let Some(walk) = self.walks.get(k) else {
            return;
        };
        let (layout, _) = self.axes[usize::from(walk.major_is_x)];
        let mut columns = Columns::new(layout, &walk);
        let mut column = walk.first;
        // What starts on the surface must find its side first.
        while columns.side == Side::On {
            let found = columns.crossing(column);
            if found.is_some() || column == walk.last {
                *hit = found.map(|crossing| crossing.hit(self.surface, ray, &walk));
                return;
            }
            column = if walk.forward() { column + 1 } else { column - 1 };
        }
        self.sides[k] = columns.side;
        self.strips[k] = Strip::new(&walk, columns.side == Side::Below);
        self.routes[k] = Route::new(&walk, column);
        let short = self.routes[k].is_short();
        self.exact.push_if(k as u8, short);
        self.windows.push_if(k as u8, !short);
    }

    #[inline(always)]
    fn look_at_windows<S: Simd>(&mut self, simd: S) {
        let (rays, len) = self.windows.take();
        for &ray in &rays[..len.min(BATCH)] {
            let k = usize::from(ray) % BATCH;
            let (_, bounds) = self.axes[usize::from(self.walks.major_is_x(k))];
            let route = &mut self.routes[k];
            route.set_blocks(self.strips[k].block_columns(simd, bounds, route.window()));
            let look_inside = route.has_blocks();
            self.inside.push_if(ray, look_inside);
            self.windows.push_if(ray, !look_inside && route.next_window());
        }
    }

    #[inline(always)]
    fn look_into_blocks<S: Simd>(&mut self, simd: S) {
        let (rays, len) = self.inside.take();
        for &ray in &rays[..len.min(BATCH)] {
            let k = usize::from(ray) % BATCH;
            let (layout, bounds) = &self.axes[usize::from(self.walks.major_is_x(k))];
            let route = &mut self.routes[k];
            let (block, in_walk) = route.next_block();
            route.set_columns(self.strips[k].columns(simd, bounds, layout, block) & in_walk);
            self.queue(ray);
        }
    }

    #[inline(always)]
    fn solve_columns(&mut self, rays: &[Ray], hits: &mut [Option<Hit>]) {
        let (queued, len) = self.exact.take();
        for &ray in &queued[..len.min(BATCH)] {
            let k = usize::from(ray) % BATCH;
            let (Some(walk), Some(source), Some(hit)) = (self.walks.get(k), rays.get(k), hits.get_mut(k))
            else {
                continue;
            };
            let (layout, _) = self.axes[usize::from(walk.major_is_x)];
            let column = self.routes[k].next_column();
            match Columns::on_side(layout, &walk, self.sides[k]).crossing(column) {
                Some(crossing) => *hit = Some(crossing.hit(self.surface, source, &walk)),
                None => self.queue(ray),
            }
        }
    }

    /// Queues a ray for what is left of its route.
    #[inline(always)]
    fn queue(&mut self, ray: u8) {
        let route = &mut self.routes[usize::from(ray) % BATCH];
        let solve = route.has_columns();
        let look = !solve & route.has_blocks();
        self.exact.push_if(ray, solve);
        self.inside.push_if(ray, look);
        self.windows
            .push_if(ray, !solve & !look && !route.is_short() && route.next_window());
    }
}
