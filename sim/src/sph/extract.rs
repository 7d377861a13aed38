//! The surface of the particles as a heightfield.
//!
//! Cords 2007, equations 5 and 6: a potential φ(x) = Σ √(1 − r²/h²) over the particles nearer than h; the surface of a
//! column is the highest point where φ reaches a value, here the one that gives a lattice with a level top its true
//! height. Columns in which it never does are dry. Walls and ground mirror the particles before them, so that the
//! surface meets them level and a single layer of particles is as deep as it is.
//!
//! Particles are binned by column. Each bin is searched downwards from its highest particle, taking up particles as
//! they come within reach, so the cost grows with the number of columns and not with the depth of the water.

use super::boundary::{Boundary, Outline};
use super::fluid::Fluid;
use super::mirrors::{Inner, mirror};
use crate::frame::{Channels, Frame, extend_into_dry};
use crate::grid::{Grid, GridSpec};
use glam::{Vec2, Vec3, Vec4};
use rayon::prelude::*;

/// Radius h of the potential in particle spacings.
const RADIUS: f32 = 2.0;
/// Width of a bin in particle spacings: wider ones share their candidates among more columns, but not all are near each.
const BIN: f32 = 2.0;
/// Radius of the sphere that holds a particle's water, in spacings: (3/4π)^⅓.
const DROPLET: f32 = 0.620_35;
/// Samples by which the surface continues below the shore.
const SHORE: usize = 3;
/// Candidates are kept in whole groups of this many, which one evaluation takes side by side.
const LANES: usize = 8;
/// Secants of a fast root.
const FAST: usize = 5;
/// Where the candidates stand that fill up a group: out of everyone's reach.
const NOWHERE: f32 = 1e15;

/// How the crossing is found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Root {
    /// Steps of half a spacing, then up to five secants: within a few 1e-3 of a spacing.
    Fast,
    /// Steps of an eighth of a spacing, then to the precision of the numbers.
    Exact,
}

/// Makes heightfields of particles, keeping its buffers.
#[derive(Debug)]
pub struct Extractor {
    spec: GridSpec,
    spacing: f32,
    radius: f32,
    /// Value of φ at the surface.
    level: f32,
    root: Root,
    /// Columns along each side of a bin, and bins along X and Z.
    columns: usize,
    bins: [usize; 2],
    /// Bins to look at on each side.
    reach: isize,
    start: Vec<u32>,
    bin: Vec<u32>,
    order: Vec<u32>,
    sorted: Vec<Vec4>,
    flow: Vec<[f32; 3]>,
}

impl Extractor {
    /// For particles of that `spacing`, on the samples of `spec`.
    pub fn new(spec: GridSpec, spacing: f32, root: Root) -> Self {
        let columns = ((BIN * spacing / spec.spacing).round() as usize).max(1);
        let radius = RADIUS * spacing;
        let width = spec.spacing * columns as f32;
        Self {
            spec,
            spacing,
            radius,
            level: level(RADIUS),
            root,
            columns,
            bins: [spec.width().div_ceil(columns), spec.height().div_ceil(columns)],
            reach: ((radius - 0.5 * spec.spacing) / width).ceil().max(1.0) as isize,
            start: Vec::new(),
            bin: Vec::new(),
            order: Vec::new(),
            sorted: Vec::new(),
            flow: Vec::new(),
        }
    }

    /// Value of the potential at the surface.
    pub fn level(&self) -> f32 {
        self.level
    }

    /// Radius of the potential in metres.
    pub fn radius(&self) -> f32 {
        self.radius
    }

    /// Radius in metres of the sphere that holds a particle's water.
    pub fn droplet(&self) -> f32 {
        DROPLET * self.spacing
    }

    /// Writes surface and wanted channels of `fluid` to `out`, over ground of these heights. With `all`, every
    /// particle is a droplet of the frame, not only those clear of the surface.
    pub fn extract(&mut self, fluid: &Fluid, ground: &Grid<f32>, want: Channels, all: bool, out: &mut Frame) {
        let offered = Channels::DEPTH | Channels::VELOCITY | Channels::DROPLETS;
        out.prepare(self.spec, want & offered);
        self.sort(fluid);
        self.heights(fluid.boundary(), ground, &mut out.elevation);
        if let Some(droplets) = &mut out.droplets {
            let elevation = &out.elevation;
            for (p, v) in fluid.positions().iter().zip(fluid.velocities()) {
                let p = p.truncate();
                if all || p.y - 0.5 * self.spacing > self.highest_near(elevation, p) {
                    droplets.position.push(p);
                    droplets.velocity.push(v.truncate());
                    droplets.radius.push(self.droplet());
                }
            }
        }
        // Dry columns hold −∞ so far.
        let wet = |k: usize, e: &Grid<f32>| e.as_slice()[k] > ground.as_slice()[k];
        let depth = Grid::from_fn(self.spec, |i, j| {
            let k = self.spec.index(i, j);
            if wet(k, &out.elevation) {
                out.elevation.as_slice()[k] - ground.as_slice()[k]
            } else {
                0.0
            }
        });
        extend_into_dry(&mut out.elevation, &depth, ground, SHORE);
        if let Some(velocity) = &mut out.velocity {
            self.flows(fluid, &depth, velocity);
        }
        if out.depth.is_some() {
            out.depth = Some(depth);
        }
    }

    fn bin_of(&self, p: Vec2) -> usize {
        let g = (self.spec.to_grid(p) + 0.5) / self.columns as f32;
        let [nx, nz] = self.bins;
        // Conversion saturates at 0.
        (g.y as usize).min(nz - 1) * nx + (g.x as usize).min(nx - 1)
    }

    /// Sorts the particles into bins, the highest first in each.
    fn sort(&mut self, fluid: &Fluid) {
        let positions = fluid.positions();
        let bins = self.bins[0] * self.bins[1];
        self.bin.clear();
        for p in positions {
            let bin = self.bin_of(Vec2::new(p.x, p.z));
            self.bin.push(bin as u32);
        }
        self.start.clear();
        self.start.resize(bins + 1, 0);
        for &b in &self.bin {
            self.start[b as usize + 1] += 1;
        }
        for b in 0..bins {
            self.start[b + 1] += self.start[b];
        }
        self.order.clear();
        self.order.extend_from_slice(&self.start[..bins]);
        self.sorted.resize(positions.len(), Vec4::ZERO);
        for (p, &b) in positions.iter().zip(&self.bin) {
            let at = &mut self.order[b as usize];
            self.sorted[*at as usize] = *p;
            *at += 1;
        }
        for b in 0..bins {
            let run = &mut self.sorted[self.start[b] as usize..self.start[b + 1] as usize];
            // Of equal heights any order will do: it is the same for any number of threads.
            run.sort_unstable_by(|p, q| q.y.total_cmp(&p.y));
        }
    }

    /// Heights of all columns; −∞ where there is no surface.
    fn heights(&self, boundary: &Boundary, ground: &Grid<f32>, elevation: &mut Grid<f32>) {
        let (width, rows) = (self.spec.width(), self.columns);
        elevation
            .as_mut_slice()
            .par_chunks_mut(width * rows)
            .enumerate()
            .for_each_init(Candidates::default, |candidates, (bz, out)| {
                out.fill(f32::NEG_INFINITY);
                pulp::Arch::new().dispatch(Row {
                    from: self,
                    bz,
                    boundary,
                    ground,
                    candidates,
                    out,
                });
            });
    }

    /// Heights of the columns of one bin. `out` holds the rows of the bin.
    #[inline(always)]
    fn search_bin(
        &self,
        bx: usize,
        bz: usize,
        boundary: &Boundary,
        ground: &Grid<f32>,
        candidates: &mut Candidates,
        out: &mut [f32],
    ) {
        let h = self.radius;
        let width = self.spec.width();
        let i_range = bx * self.columns..((bx + 1) * self.columns).min(width);
        let j_range = bz * self.columns..((bz + 1) * self.columns).min(self.spec.height());
        let top = candidates.open(self, bx, bz);
        if top == f32::NEG_INFINITY {
            return;
        }
        let mut lowest = f32::MAX;
        candidates.columns.clear();
        for j in j_range.clone() {
            for i in i_range.clone() {
                lowest = lowest.min(ground[(i, j)]);
                candidates.columns.push(Column {
                    at: self.spec.position(i, j),
                    out: (j - j_range.start) * width + i,
                    found: false,
                });
            }
        }
        let step = match self.root {
            Root::Fast => 0.5 * self.spacing,
            Root::Exact => 0.125 * self.spacing,
        };
        let tile = (self.spec.position(i_range.start, j_range.start), {
            self.spec.position(i_range.end - 1, j_range.end - 1)
        });
        let mut y = top + h;
        let mut open = candidates.columns.len();
        while open > 0 && y > lowest {
            y = (y - step).max(lowest);
            candidates.take_down_to(y - h, y + h + step, tile, self, boundary);
            // No column has more than this, nor will before the next particle is within reach.
            if candidates.most() < self.level {
                y = y.min(candidates.next(self) + h);
                continue;
            }
            for c in 0..candidates.columns.len() {
                let column = candidates.columns[c];
                if column.found {
                    continue;
                }
                let value = candidates.potential(column.at, y, h);
                if value >= self.level {
                    out[column.out] = self.root(candidates, column, y, step, value);
                    candidates.columns[c].found = true;
                    open -= 1;
                }
            }
        }
    }

    /// The crossing between `y` and `y + step`, by regula falsi (Illinois).
    #[inline(always)]
    fn root(&self, candidates: &mut Candidates, column: Column, y: f32, step: f32, value: f32) -> f32 {
        candidates.narrow(column.at, self.radius);
        let (most, close) = match self.root {
            Root::Fast => (FAST, 2e-3 * self.spacing),
            Root::Exact => (60, 1e-6 * self.spacing),
        };
        let (mut low, mut f_low) = (y, value - self.level);
        // A step that ends at the ground may begin above a surface thinner than itself, which then is what is found.
        let above = candidates.narrowed(y + step, self.radius) - self.level;
        let (mut high, mut f_high) = (y + step, above.min(-f32::MIN_POSITIVE));
        let mut at = low;
        for _ in 0..most {
            let next = low + (high - low) * (f_low / (f_low - f_high));
            let moved = (next - at).abs();
            at = next;
            if moved < close {
                break;
            }
            let f = candidates.narrowed(at, self.radius) - self.level;
            if f >= 0.0 {
                (low, f_low) = (at, f);
                f_high *= 0.5;
            } else {
                (high, f_high) = (at, f);
                f_low *= 0.5;
            }
        }
        at
    }

    /// Height of the highest surface among the four columns about `p`.
    fn highest_near(&self, elevation: &Grid<f32>, p: Vec3) -> f32 {
        let g = self.spec.to_grid(Vec2::new(p.x, p.z)).max(Vec2::ZERO);
        let (w, h) = (self.spec.width(), self.spec.height());
        let (i, j) = ((g.x as usize).min(w - 1), (g.y as usize).min(h - 1));
        let (i1, j1) = ((i + 1).min(w - 1), (j + 1).min(h - 1));
        let at = |i, j| elevation[(i, j)];
        at(i, j).max(at(i1, j)).max(at(i, j1)).max(at(i1, j1))
    }

    /// Mean horizontal velocity over the particles about each column.
    fn flows(&mut self, fluid: &Fluid, depth: &Grid<f32>, out: &mut Grid<Vec2>) {
        let side = (self.spacing / self.spec.spacing).round().max(1.0);
        let bins = |columns: usize| columns.div_ceil(side as usize);
        let [nx, nz] = [bins(self.spec.width()), bins(self.spec.height())];
        self.flow.clear();
        self.flow.resize(nx * nz, [0.0; 3]);
        for (p, v) in fluid.positions().iter().zip(fluid.velocities()) {
            let g = (self.spec.to_grid(Vec2::new(p.x, p.z)) + 0.5) / side;
            // Conversion saturates at 0.
            let bin = (g.y as usize).min(nz - 1) * nx + (g.x as usize).min(nx - 1);
            let flow = &mut self.flow[bin];
            flow[0] += v.x;
            flow[1] += v.z;
            flow[2] += 1.0;
        }
        for j in 0..self.spec.height() {
            for i in 0..self.spec.width() {
                out[(i, j)] = Vec2::ZERO;
                if depth[(i, j)] <= 0.0 {
                    continue;
                }
                // Where the column stands between the centres of bins.
                let g = (Vec2::new(i as f32, j as f32) + 0.5) / side - 0.5;
                let base = g.floor();
                let (mut sum, mut weight) = (Vec2::ZERO, 0.0);
                for (dx, dz) in [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)] {
                    let b = base + Vec2::new(dx, dz);
                    if b.min_element() < 0.0 || b.x as usize >= nx || b.y as usize >= nz {
                        continue;
                    }
                    let tent = (1.0 - (g - b).abs()).max(Vec2::splat(1e-3));
                    let flow = self.flow[b.y as usize * nx + b.x as usize];
                    sum += tent.x * tent.y * Vec2::new(flow[0], flow[1]);
                    weight += tent.x * tent.y * flow[2];
                }
                if weight > 0.0 {
                    out[(i, j)] = sum / weight;
                }
            }
        }
    }

    /// Bytes held.
    pub fn bytes(&self) -> u64 {
        let ones = self.start.capacity() + self.bin.capacity() + self.order.capacity();
        (4 * ones + 16 * self.sorted.capacity() + 12 * self.flow.capacity()) as u64
    }
}

/// A row of bins under search.
struct Row<'a> {
    from: &'a Extractor,
    bz: usize,
    boundary: &'a Boundary,
    ground: &'a Grid<f32>,
    candidates: &'a mut Candidates,
    out: &'a mut [f32],
}

impl pulp::WithSimd for Row<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) {
        for bx in 0..self.from.bins[0] {
            self.from
                .search_bin(bx, self.bz, self.boundary, self.ground, self.candidates, self.out);
        }
    }
}

/// One column of a bin under search.
#[derive(Clone, Copy, Debug)]
struct Column {
    at: Vec2,
    /// Where its height goes.
    out: usize,
    found: bool,
}

/// The particles within reach of a bin, between the height under search and a radius above and below.
#[derive(Debug, Default)]
struct Candidates {
    x: Vec<f32>,
    y: Vec<f32>,
    z: Vec<f32>,
    /// The most that each adds to the potential of any column of the tile.
    weight: Vec<f32>,
    /// Entries that are particles.
    count: usize,
    /// Next particle of each bin about, and the end of the bin.
    runs: Vec<(usize, usize)>,
    columns: Vec<Column>,
    /// Of one column: 1 − ρ²/h² and height.
    near: Vec<f32>,
    near_y: Vec<f32>,
    /// How many of them there are, filled up to whole groups.
    narrowed: usize,
}

impl Candidates {
    /// Begins with a bin. Returns the height of the highest particle within reach, −∞ if there is none.
    fn open(&mut self, from: &Extractor, bx: usize, bz: usize) -> f32 {
        self.runs.clear();
        self.count = 0;
        let mut top = f32::NEG_INFINITY;
        let [nx, nz] = from.bins;
        for dz in -from.reach..=from.reach {
            for dx in -from.reach..=from.reach {
                let (Some(x), Some(z)) = (bx.checked_add_signed(dx), bz.checked_add_signed(dz)) else {
                    continue;
                };
                if x >= nx || z >= nz {
                    continue;
                }
                let b = z * nx + x;
                let run = (from.start[b] as usize, from.start[b + 1] as usize);
                if run.0 < run.1 {
                    top = top.max(from.sorted[run.0].y);
                    self.runs.push(run);
                }
            }
        }
        top
    }

    /// Drops what is above `high` and takes up the particles not below `low` that are within reach of the columns
    /// between the corners `tile`, with their mirror images.
    #[inline(always)]
    fn take_down_to(
        &mut self,
        low: f32,
        high: f32,
        tile: (Vec2, Vec2),
        from: &Extractor,
        boundary: &Boundary,
    ) {
        let h = from.radius;
        // Written before it is known whether they stay, without branches that are a matter of chance.
        let (n, mut kept) = (self.count, 0);
        let (xs, ys, zs) = (&mut self.x[..n], &mut self.y[..n], &mut self.z[..n]);
        let weights = &mut self.weight[..n];
        for k in 0..n {
            let keeps = ys[k] < high;
            (xs[kept], ys[kept], zs[kept], weights[kept]) = (xs[k], ys[k], zs[k], weights[k]);
            kept += usize::from(keeps);
        }
        self.count = kept;
        let inner = Inner::new(boundary, h);
        let mut runs = std::mem::take(&mut self.runs);
        for run in &mut runs {
            while run.0 < run.1 && from.sorted[run.0].y >= low {
                let p = from.sorted[run.0].truncate();
                run.0 += 1;
                if p.y >= high {
                    continue;
                }
                let near = self.push(p, tile, h);
                // Images in upright planes are farther from what is before them than the particle itself.
                if (near || boundary.outline == Outline::Round) && !inner.holds(p) {
                    mirror(boundary, p, h, |image| {
                        self.push(image, tile, h);
                    });
                }
            }
        }
        self.runs = runs;
        let end = self.count.next_multiple_of(LANES);
        self.room(end);
        for list in [&mut self.x, &mut self.y, &mut self.z] {
            list[self.count..end].fill(NOWHERE);
        }
    }

    /// Makes room for `len` entries.
    fn room(&mut self, len: usize) {
        if self.x.len() < len {
            for list in [&mut self.x, &mut self.y, &mut self.z, &mut self.weight] {
                list.resize(2 * len, NOWHERE);
            }
        }
    }

    /// Takes up `p` if it is within reach of the tile, and returns whether it is.
    #[inline(always)]
    fn push(&mut self, p: Vec3, tile: (Vec2, Vec2), h: f32) -> bool {
        let at = Vec2::new(p.x, p.z);
        let left = 1.0 - at.distance_squared(at.clamp(tile.0, tile.1)) / (h * h);
        self.room(self.count + 1);
        let k = self.count;
        (self.x[k], self.y[k], self.z[k]) = (p.x, p.y, p.z);
        self.weight[k] = left.max(0.0).sqrt();
        self.count += usize::from(left > 0.0);
        left > 0.0
    }

    /// The most that the potential of a column of the tile can be.
    #[inline(always)]
    fn most(&self) -> f32 {
        self.weight[..self.count].iter().sum()
    }

    /// Height of the highest particle not taken up yet, −∞ if there is none.
    fn next(&self, from: &Extractor) -> f32 {
        let heads = self.runs.iter().filter(|run| run.0 < run.1);
        heads.fold(f32::NEG_INFINITY, |top, run| top.max(from.sorted[run.0].y))
    }

    /// φ at height `y` of a column.
    #[inline(always)]
    fn potential(&self, at: Vec2, y: f32, h: f32) -> f32 {
        let scale = 1.0 / (h * h);
        let mut sums = [0.0_f32; LANES];
        let end = self.count.next_multiple_of(LANES);
        let groups = self.x[..end]
            .chunks_exact(LANES)
            .zip(self.y[..end].chunks_exact(LANES));
        for ((px, py), pz) in groups.zip(self.z[..end].chunks_exact(LANES)) {
            for k in 0..LANES {
                let (dx, dy, dz) = (at.x - px[k], y - py[k], at.y - pz[k]);
                sums[k] += (1.0 - scale * (dx * dx + dy * dy + dz * dz)).max(0.0).sqrt();
            }
        }
        sums.iter().sum()
    }

    /// Keeps beside the candidates those of one column.
    #[inline(always)]
    fn narrow(&mut self, at: Vec2, h: f32) {
        let scale = 1.0 / (h * h);
        let room = self.count + LANES;
        if self.near.len() < room {
            self.near.resize(2 * room, 0.0);
            self.near_y.resize(2 * room, 0.0);
        }
        let mut count = 0;
        for k in 0..self.count {
            let (dx, dz) = (at.x - self.x[k], at.y - self.z[k]);
            let left = 1.0 - scale * (dx * dx + dz * dz);
            (self.near[count], self.near_y[count]) = (left, self.y[k]);
            count += usize::from(left > 0.0);
        }
        self.narrowed = count.next_multiple_of(LANES);
        self.near[count..self.narrowed].fill(0.0);
        self.near_y[count..self.narrowed].fill(NOWHERE);
    }

    /// φ at height `y` of the column of [`Self::narrow`].
    #[inline(always)]
    fn narrowed(&self, y: f32, h: f32) -> f32 {
        let scale = 1.0 / (h * h);
        let mut sums = [0.0_f32; LANES];
        let (near, height) = (&self.near[..self.narrowed], &self.near_y[..self.narrowed]);
        for (near, height) in near.chunks_exact(LANES).zip(height.chunks_exact(LANES)) {
            for k in 0..LANES {
                let dy = y - height[k];
                sums[k] += (near[k] - scale * dy * dy).max(0.0).sqrt();
            }
        }
        sums.iter().sum()
    }
}

/// Mean of φ, with a radius in spacings, over the level plane half a spacing above a half-space of lattice.
fn level(radius: f32) -> f32 {
    const PLACES: i32 = 8;
    let reach = radius.ceil() as i32 + 1;
    let mut sum = 0.0;
    for a in 0..PLACES {
        for b in 0..PLACES {
            let x = (a as f32 + 0.5) / PLACES as f32;
            let z = (b as f32 + 0.5) / PLACES as f32;
            for k in 0..reach {
                for i in -reach..=reach {
                    for j in -reach..=reach {
                        let r2 = (x - i as f32).powi(2) + (z - j as f32).powi(2) + (0.5 + k as f32).powi(2);
                        sum += (1.0 - r2 / (radius * radius)).max(0.0).sqrt();
                    }
                }
            }
        }
    }
    sum / (PLACES * PLACES) as f32
}
