//! Many rays at once: every stage runs over the whole batch before the next begins.
//!
//! Stages have no branches that depend on a single ray, so the processor overlaps the rays of a stage, which hides the
//! latency of loads and divisions. A ray that a stage does not settle is queued for the stage that it needs next. Where the
//! arithmetic is long, rays leave the queue in packets of eight ([`super::packet`]).

use super::blocks::{Blocks, PairBounds};
use super::column::{Columns, Side};
use super::filter::Strip;
use super::packet::{LANES, Packet};
use super::route::Route;
use super::surface::{Layout, Patch, Surface};
use super::walk::{Walk, Walks};
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
        self.begin(simd, rays, hits);
        while self.windows.len + self.inside.len + self.exact.len > 0 {
            self.look_at_windows(simd);
            self.look_into_blocks(simd);
            self.solve_columns(simd, rays, hits);
        }
    }

    /// Finds the sides of all rays and queues them.
    #[inline(always)]
    fn begin<S: Simd>(&mut self, simd: S, rays: &[Ray], hits: &mut [Option<Hit>]) {
        let mut within = Queue::new();
        for (k, hit) in hits.iter_mut().enumerate().take(rays.len().min(BATCH)) {
            *hit = None;
            let Some(walk) = self.walks.get(k) else {
                continue;
            };
            within.push_if(k as u8, walk.enters == Side::On);
            if walk.enters != Side::On {
                self.enter(k, &walk, walk.enters, walk.first);
            }
        }
        let (within, len) = within.take();
        let (packets, rest) = within[..len.min(BATCH)].as_chunks();
        for &packet in packets {
            self.begin_within(simd, packet, LANES, rays, hits);
        }
        if let Some(packet) = filled_up(rest) {
            self.begin_within(simd, packet, rest.len(), rays, hits);
        }
    }

    /// Finds the sides of the first `len` rays of a packet, which start where the surface may be.
    #[inline(always)]
    fn begin_within<S: Simd>(
        &mut self,
        simd: S,
        packet: [u8; LANES],
        len: usize,
        rays: &[Ray],
        hits: &mut [Option<Hit>],
    ) {
        let columns = packet.map(|ray| self.walks.first[usize::from(ray) % BATCH].floor());
        let starts = match self.surface.patch {
            Patch::Bilinear => Packet::new(simd, self.surface, &self.walks, packet, columns).starts(),
            Patch::Triangles => None,
        };
        let above = starts.unwrap_or([0.0; LANES]);
        for lane in 0..len {
            let k = usize::from(packet[lane]) % BATCH;
            let Some(walk) = self.walks.get(k) else {
                continue;
            };
            if above[lane].abs() > walk.rounding {
                let side = if above[lane] > 0.0 {
                    Side::Above
                } else {
                    Side::Below
                };
                self.enter(k, &walk, side, walk.first);
            } else if let (Some(ray), Some(hit)) = (rays.get(k), hits.get_mut(k)) {
                self.leave_surface(k, ray, hit);
            }
        }
    }

    /// Walks a ray that starts on the surface until it has left it, which decides its side.
    #[inline(never)]
    fn leave_surface(&mut self, k: usize, ray: &Ray, hit: &mut Option<Hit>) {
        let Some(walk) = self.walks.get(k) else {
            return;
        };
        let (layout, _) = self.axes[usize::from(walk.major_is_x)];
        let mut columns = Columns::new(layout, &walk);
        let mut column = walk.first;
        while columns.side == Side::On {
            let found = columns.crossing(column);
            if found.is_some() || column == walk.last {
                *hit = found.map(|crossing| crossing.hit(self.surface, ray, &walk));
                return;
            }
            column = if walk.forward() { column + 1 } else { column - 1 };
        }
        self.enter(k, &walk, columns.side, column);
    }

    /// Queues a ray whose side is known.
    #[inline(always)]
    fn enter(&mut self, k: usize, walk: &Walk, side: Side, column: u32) {
        self.sides[k] = side;
        self.strips[k] = Strip::new(walk, side == Side::Below);
        self.routes[k] = Route::new(walk, column);
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

    /// Solves a column of every ray that waits for one; those that do not fill a packet wait while there is other work.
    #[inline(always)]
    fn solve_columns<S: Simd>(&mut self, simd: S, rays: &[Ray], hits: &mut [Option<Hit>]) {
        let (queued, len) = self.exact.take();
        let queued = &queued[..len.min(BATCH)];
        if self.surface.patch != Patch::Bilinear {
            for &ray in queued {
                let column = self.routes[usize::from(ray) % BATCH].next_column();
                self.solve_one(ray, column, rays, hits);
            }
            return;
        }
        let (packets, rest) = queued.as_chunks();
        for &packet in packets {
            self.solve_packet(simd, packet, LANES, rays, hits);
        }
        if self.windows.len + self.inside.len > 0 {
            for &ray in rest {
                self.exact.push_if(ray, true);
            }
        } else if let Some(packet) = filled_up(rest) {
            self.solve_packet(simd, packet, rest.len(), rays, hits);
        }
    }

    /// Solves the next columns of the first `len` rays of a packet.
    #[inline(always)]
    fn solve_packet<S: Simd>(
        &mut self,
        simd: S,
        packet: [u8; LANES],
        len: usize,
        rays: &[Ray],
        hits: &mut [Option<Hit>],
    ) {
        let (mut columns, mut lines, mut mirror) = ([0; LANES], [0.0; LANES], [1.0; LANES]);
        for (lane, &ray) in packet.iter().enumerate() {
            let k = usize::from(ray) % BATCH;
            // Lanes beyond `len` repeat the first.
            columns[lane] = if lane < len {
                self.routes[k].next_column()
            } else {
                columns[0]
            };
            lines[lane] = f64::from(columns[lane]);
            mirror[lane] = if self.sides[k] == Side::Below { -1.0 } else { 1.0 };
        }
        let packet_of_walks = Packet::new(simd, self.surface, &self.walks, packet, lines);
        let Some(found) = packet_of_walks.solve(&self.walks, mirror) else {
            for (&ray, column) in packet.iter().zip(columns).take(len) {
                self.solve_one(ray, column, rays, hits);
            }
            return;
        };
        for lane in 0..len {
            let ray = packet[lane];
            let k = usize::from(ray) % BATCH;
            if found.unsolved >> lane & 1 != 0 {
                self.solve_one(ray, columns[lane], rays, hits);
                continue;
            }
            let (Some(source), Some(hit)) = (rays.get(k), hits.get_mut(k)) else {
                continue;
            };
            if found.hits >> lane & 1 != 0 {
                let x_is_major = self.walks.major_is_x(k);
                *hit = Some(found.hit(lane, columns[lane], x_is_major, source));
            } else {
                self.queue(ray);
            }
        }
    }

    /// As [`Self::solve_packet`] for one ray, of which there are few.
    #[inline(never)]
    fn solve_one(&mut self, ray: u8, column: u32, rays: &[Ray], hits: &mut [Option<Hit>]) {
        let k = usize::from(ray) % BATCH;
        let (Some(walk), Some(source), Some(hit)) = (self.walks.get(k), rays.get(k), hits.get_mut(k)) else {
            return;
        };
        let (layout, _) = self.axes[usize::from(walk.major_is_x)];
        match Columns::on_side(layout, &walk, self.sides[k]).crossing(column) {
            Some(crossing) => *hit = Some(crossing.hit(self.surface, source, &walk)),
            None => self.queue(ray),
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

/// A packet of too few rays: the first stands in for those that are missing.
#[inline(always)]
fn filled_up(rays: &[u8]) -> Option<[u8; LANES]> {
    let mut packet = [*rays.first()?; LANES];
    for (to, &ray) in packet.iter_mut().zip(rays) {
        *to = ray;
    }
    Some(packet)
}
