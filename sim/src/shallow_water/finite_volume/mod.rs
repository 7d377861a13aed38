//! Well-balanced MUSCL-Hancock finite volumes: the grid in tiles, tiles in bands, bands over threads.

mod exchange;
pub(crate) mod kernels;
pub(crate) mod tile;

use super::boundary::Boundary;
use super::checkpoint::TileMemory;
use super::eddies::Eddies;
use super::edges::Edges;
use super::real::Real;
use super::storage::{Fields, Layout, Quantised, Quantum};
use crate::solvers::GRAVITY;
use kernels::Constants;
pub(super) use kernels::flag;
use rayon::prelude::*;
pub(super) use tile::{self as volume_step, Outcome};
use tile::{Extent, HALO, Scratch, Sink, Source, TILE_WIDTH};

/// Rows of a band, which one thread steps at a time: each band reconstructs four rows and computes two rows of faces
/// more than it keeps.
const BAND: usize = 64;

/// A tile's memory of its last step.
#[derive(Clone, Copy, Debug)]
pub(super) struct Tile<T> {
    pub(super) outcome: Outcome<T>,
    /// Whether it must be stepped: something moves in it or beside it.
    pub(super) awake: bool,
}

/// State and machinery of the scheme.
pub(crate) struct FiniteVolume<T> {
    pub(super) layout: Layout,
    pub(super) spacing: f64,
    pub(super) boundary: Boundary,
    /// Height above datum of bed 0, m.
    pub(super) base: f64,
    pub(super) bed: Vec<T>,
    pub(super) now: Fields<T>,
    pub(super) next: Fields<T>,
    pub(super) quantum: Quantum,
    film: f64,
    manning: f64,
    pub(super) tiles: Vec<Tile<T>>,
    pub(super) tiles_x: usize,
    /// Whether the state was changed from outside since the last step.
    pub(super) touched: bool,
    pub(super) eddies: Option<Eddies<T>>,
}

/// Why a sub-step did not succeed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Refusal {
    /// The fastest signal would cross more of a cell than allowed; its speed in m/s.
    TooFast(f64),
    /// A value left its range.
    Broken,
    /// The state left the range in which the scheme can be trusted.
    OutOfRange {
        /// Which quantity, with its unit.
        quantity: &'static str,
        /// Its value.
        value: f64,
        /// The value that it must not pass.
        limit: f64,
        /// Sample along X and Z.
        at: [usize; 2],
        /// What to change.
        remedy: &'static str,
    },
}

/// What a sub-step did.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Stepped {
    /// Fastest signal during the step, m/s, weighted by what the scheme allows: steps are chosen by it.
    pub(crate) speed: f64,
    /// Fastest signal during the step, m/s.
    pub(crate) signal: f64,
    /// Whether some depth has outgrown the quantum.
    pub(crate) deep: bool,
}

/// Fastest signal that is believed, m/s.
pub(crate) const SPEED_LIMIT: f64 = 1e5;

impl<T: Real> FiniteVolume<T> {
    pub(crate) fn new(
        layout: Layout,
        spacing: f64,
        edges: Edges,
        start: Quantised<T>,
        film: f64,
        manning: f64,
    ) -> Self {
        let Quantised {
            fields,
            mut bed,
            quantum,
            base,
            ..
        } = start;
        let mut boundary = Boundary::new(layout, edges);
        boundary.fill_bed(&mut bed);
        boundary.remember(&fields.h, &bed);
        let tiles_x = layout.nx.div_ceil(TILE_WIDTH);
        let bands = layout.nz.div_ceil(BAND);
        let fresh = Tile {
            outcome: Outcome {
                speed: T::ZERO,
                flags: flag::ALIVE,
            },
            awake: true,
        };
        Self {
            layout,
            spacing,
            boundary,
            base,
            bed,
            next: fields.clone(),
            now: fields,
            quantum,
            film,
            manning,
            tiles: vec![fresh; tiles_x * bands],
            tiles_x,
            touched: true,
            eddies: None,
        }
    }

    pub(crate) fn layout(&self) -> Layout {
        self.layout
    }

    pub(crate) fn fields(&self) -> &Fields<T> {
        &self.now
    }

    /// The state, to be changed from outside; everything wakes.
    pub(crate) fn fields_mut(&mut self) -> &mut Fields<T> {
        for tile in &mut self.tiles {
            tile.awake = true;
        }
        self.touched = true;
        &mut self.now
    }

    pub(crate) fn bed(&self) -> &[T] {
        &self.bed
    }

    pub(crate) fn quantum(&self) -> Quantum {
        self.quantum
    }

    /// Depth below which velocities fade, m: what was asked for, but enough quanta to resolve it.
    pub(crate) fn film(&self) -> f64 {
        self.film.max(32.0 * self.quantum.length())
    }

    /// Depth up to which a cell counts as dry, m.
    pub(crate) fn dry(&self) -> f64 {
        (1e-3 * self.film()).max(4.0 * self.quantum.length())
    }

    pub(crate) fn bytes(&self) -> usize {
        7 * self.layout.len() * size_of::<T>()
            + self.tiles.len() * size_of::<Tile<T>>()
            + self.boundary.bytes()
            + self.eddies.as_ref().map_or(0, Eddies::bytes)
    }

    pub(super) fn constants(&self, dt: f64) -> Constants<T> {
        let of = T::from_f64;
        Constants {
            gravity: of(GRAVITY),
            lambda: of(dt / self.spacing),
            rounder: self.quantum.rounder(),
            quantum: of(self.quantum.length()),
            film: of(self.film()),
            dry: of(self.dry()),
            depth_limit: of(self.quantum.depth_limit::<T>()),
            momentum_limit: of(self.quantum.depth_limit::<T>() * SPEED_LIMIT),
            friction: of(GRAVITY * self.manning * self.manning * dt),
        }
    }

    /// Fastest signal of the last step, m/s.
    pub(super) fn fastest(&self) -> f64 {
        self.tiles
            .iter()
            .fold(0.0, |all: f64, tile| all.max(tile.outcome.speed.to_f64()))
    }

    /// Fastest signal of the present state, m/s.
    pub(crate) fn probe(&mut self, time: f64) -> f64 {
        self.sweep(time, 0.0).0
    }

    /// An upper bound of the fastest signal without a sweep, m/s: |u| + 2c of every cell.
    pub(crate) fn estimated_speed(&self) -> f64 {
        let film = self.film();
        let row = |j: usize| {
            self.layout.row(j).fold(0.0_f64, |fastest, k| {
                let h = self.now.h[k].to_f64();
                let thick = h.max(film);
                let factor = 2.0 * h / (h * h + thick * thick);
                let (u, v) = (factor * self.now.qx[k].to_f64(), factor * self.now.qz[k].to_f64());
                fastest.max(u.abs().max(v.abs()) + 2.0 * (GRAVITY * h).sqrt())
            })
        };
        crate::reduce::fold_blocks(self.layout.nz, row, f64::max).unwrap_or(0.0)
    }

    /// The first cell of the last attempted step whose value left its range: sample, quantity, value.
    pub(crate) fn worst(&self) -> Option<(usize, usize, &'static str, f64)> {
        let limit = self.quantum.depth_limit::<T>() * SPEED_LIMIT;
        for j in 0..self.layout.nz {
            for (i, k) in self.layout.row(j).enumerate() {
                let (h, qx, qz) = (
                    self.next.h[k].to_f64(),
                    self.next.qx[k].to_f64(),
                    self.next.qz[k].to_f64(),
                );
                if !(h >= 0.0) {
                    return Some((i, j, "depth in m", h));
                }
                for q in [qx, qz] {
                    if !(q.abs() < limit) {
                        return Some((i, j, "depth times velocity in m²/s", q));
                    }
                }
            }
        }
        None
    }

    /// Puts the bed of a cell at `z` m above datum, with the water that stands on it; returns whether that is a change.
    /// [`Self::settle_bed`] must follow before the next step.
    pub(crate) fn set_bed(&mut self, i: usize, j: usize, z: f64) -> bool {
        let at = self.layout.at(i, j);
        let (before, z) = (self.bed[at], T::from_f64(self.quantum.round(z - self.base)));
        if z == before {
            return false;
        }
        self.bed[at] = z;
        self.boundary.lift(i, j, z.to_f64() - before.to_f64());
        self.touch(i, j);
        true
    }

    /// Takes note at open edges of how the bed differs from `before`, a padded array.
    pub(crate) fn lift_edges(&mut self, before: &[f64]) {
        let Layout { nx, nz, .. } = self.layout;
        let corners_once = (0..nx)
            .flat_map(|i| [[i, 0], [i, nz - 1]])
            .chain((1..nz - 1).flat_map(|j| [[0, j], [nx - 1, j]]));
        for [i, j] in corners_once {
            let at = self.layout.at(i, j);
            self.boundary.lift(i, j, self.bed[at].to_f64() - before[at]);
        }
    }

    /// Gives the ghosts the bed that [`Self::set_bed`] has made.
    pub(crate) fn settle_bed(&mut self) {
        self.boundary.fill_bed(&mut self.bed);
    }

    /// Height above datum of bed 0, m.
    pub(crate) fn base(&self) -> f64 {
        self.base
    }

    /// Height of the surface (the bed, where it is dry) above datum at a padded index, m.
    pub(crate) fn elevation(&self, at: usize) -> f64 {
        self.base + (self.bed[at].to_f64() + self.now.h[at].to_f64())
    }

    /// What each tile remembers, for a checkpoint.
    pub(crate) fn tile_memory(&self) -> Vec<TileMemory> {
        let memory = |tile: &Tile<T>| TileMemory {
            awake: tile.awake,
            speed: tile.outcome.speed.to_f64(),
        };
        self.tiles.iter().map(memory).collect()
    }

    /// Goes on from a checkpoint whose state is in [`Self::fields_mut`] already.
    pub(crate) fn resume(&mut self, bed: Vec<T>, quantum: Quantum, base: f64, tiles: &[TileMemory]) {
        self.bed = bed;
        self.quantum = quantum;
        self.base = base;
        self.boundary.fill_bed(&mut self.bed);
        // A sleeping tile's two states are the same.
        self.next = self.now.clone();
        for (tile, memory) in self.tiles.iter_mut().zip(tiles) {
            tile.awake = memory.awake;
            tile.outcome = Outcome {
                speed: T::from_f64(memory.speed),
                flags: if memory.awake { flag::ALIVE } else { 0 },
            };
        }
    }

    /// Takes one step of `dt` seconds unless the fastest signal would then cross more than `courant` of a cell.
    pub(crate) fn try_step(&mut self, time: f64, dt: f64, courant: f64) -> Result<Stepped, Refusal> {
        let (speed, flags) = self.sweep(time, dt);
        if flags & flag::BROKEN != 0 || !(speed < SPEED_LIMIT) {
            return Err(Refusal::Broken);
        }
        if speed * dt > courant * self.spacing {
            return Err(Refusal::TooFast(speed));
        }
        std::mem::swap(&mut self.now, &mut self.next);
        self.wake();
        let deep = flags & flag::DEEP != 0;
        if deep {
            self.coarsen(self.deepest());
        }
        Ok(Stepped {
            speed,
            signal: speed,
            deep,
        })
    }

    /// Steps every tile that is awake from `now` to `next`; the fastest signal and all flags.
    fn sweep(&mut self, time: f64, dt: f64) -> (f64, u32) {
        let constants = self.constants(dt);
        let layout = self.layout;
        self.boundary
            .fill(time + 0.5 * dt, self.base, self.film(), &self.bed, &mut self.now);
        let source = Source {
            h: &self.now.h,
            qx: &self.now.qx,
            qz: &self.now.qz,
            z: &self.bed,
            stride: layout.stride,
        };
        let tiles_x = self.tiles_x;
        let bands = self.tiles.len() / tiles_x;
        let interior = layout.interior();
        let (mut h, mut qx, mut qz) = (
            &mut self.next.h[interior.clone()],
            &mut self.next.qx[interior.clone()],
            &mut self.next.qz[interior],
        );
        let mut jobs = Vec::with_capacity(bands);
        for (band, tiles) in self.tiles.chunks_mut(tiles_x).enumerate() {
            let (from, to) = (part(layout.nz, bands, band), part(layout.nz, bands, band + 1));
            let values = (to - from) * layout.stride;
            let sink = Sink {
                h: h.split_off_mut(..values).unwrap_or_default(),
                qx: qx.split_off_mut(..values).unwrap_or_default(),
                qz: qz.split_off_mut(..values).unwrap_or_default(),
                first_row: from + HALO,
            };
            jobs.push((sink, tiles, to - from));
        }
        let arch = pulp::Arch::new();
        jobs.into_par_iter()
            .for_each_init(Scratch::new, |scratch, (mut sink, tiles, rows)| {
                for (t, tile) in tiles.iter_mut().enumerate() {
                    if !tile.awake {
                        continue;
                    }
                    let (from, to) = (part(layout.nx, tiles_x, t), part(layout.nx, tiles_x, t + 1));
                    let extent = Extent {
                        first_column: from + HALO,
                        columns: to - from,
                        first_row: sink.first_row,
                        rows,
                    };
                    tile.outcome = arch.dispatch(TileStep {
                        constants: &constants,
                        source,
                        sink: &mut sink,
                        extent,
                        scratch,
                    });
                }
            });
        let mut all = (0.0_f64, 0);
        for tile in &self.tiles {
            all.0 = all.0.max(tile.outcome.speed.to_f64());
            all.1 |= tile.outcome.flags;
        }
        all
    }

    /// A tile sleeps once neither it nor a neighbour changed in a step and nothing in them carries momentum: its next
    /// step would change nothing either, whatever its length.
    pub(super) fn wake(&mut self) {
        let (w, h) = (self.tiles_x, self.tiles.len() / self.tiles_x);
        let (driven, wraps) = (self.boundary.driven(), self.boundary.wraps());
        let alive: Vec<bool> = self
            .tiles
            .iter()
            .map(|t| t.outcome.flags & flag::ALIVE != 0)
            .collect();
        for (k, tile) in self.tiles.iter_mut().enumerate() {
            let (i, j) = (k % w, k / w);
            let at_driven_edge = (driven[0] && i == 0)
                || (driven[1] && i == w - 1)
                || (driven[2] && j == 0)
                || (driven[3] && j == h - 1);
            let beside = |k: usize, count: usize, wraps: bool| {
                let (first, last) = (k == 0, k + 1 == count);
                let before = if first {
                    wraps.then_some(count - 1)
                } else {
                    Some(k - 1)
                };
                let behind = if last { wraps.then_some(0) } else { Some(k + 1) };
                [before, Some(k), behind].into_iter().flatten()
            };
            tile.awake = at_driven_edge
                || beside(j, h, wraps[1]).any(|j| beside(i, w, wraps[0]).any(|i| alive[j * w + i]));
        }
    }

    pub(super) fn deepest(&self) -> f64 {
        (0..self.layout.nz)
            .flat_map(|j| &self.now.h[self.layout.row(j)])
            .fold(0.0, |a, h| a.max(h.to_f64()))
    }

    /// Takes the quantum for a depth, unless it is finer than the present one. The rounding is carried from cell to
    /// cell, so that the volume changes by less than one quantum in one cell.
    pub(super) fn coarsen(&mut self, depth: f64) {
        let layout = self.layout;
        let quantum = Quantum::for_depth::<T>(depth);
        if quantum.length() <= self.quantum.length() {
            return;
        }
        self.quantum = quantum;
        let mut carry = 0.0;
        for j in 0..layout.nz {
            for k in layout.row(j) {
                let (h, z) = (self.now.h[k].to_f64(), self.bed[k].to_f64());
                self.bed[k] = T::from_f64(quantum.round(z));
                if h <= 0.0 {
                    continue;
                }
                let rounded = quantum.round(h + carry).max(0.0);
                carry += h - rounded;
                self.now.h[k] = T::from_f64(rounded);
            }
        }
        self.boundary.fill_bed(&mut self.bed);
        self.touched = true;
        for tile in &mut self.tiles {
            tile.awake = true;
        }
    }
}

/// [`tile::step`] as something that can be compiled for several instruction sets and chosen from at run time. The
/// results are the same to the bit: no set contracts or reorders an operation.
struct TileStep<'a, 'b, T> {
    constants: &'a Constants<T>,
    source: Source<'a, T>,
    sink: &'a mut Sink<'b, T>,
    extent: Extent,
    scratch: &'a mut Scratch<T>,
}

impl<T: Real> pulp::WithSimd for TileStep<'_, '_, T> {
    type Output = Outcome<T>;

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) -> Outcome<T> {
        tile::step(self.constants, self.source, self.sink, self.extent, self.scratch)
    }
}

/// Where part `k` of `count` parts of a length begins.
pub(super) fn part(length: usize, count: usize, k: usize) -> usize {
    length * k / count
}
