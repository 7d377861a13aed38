//! One tile through a step of the lattice: whole where all its water is calm, else with finite-volume faces wherever
//! one of the six cells around a face is not.

mod faces;
mod mixed;

pub(super) use mixed::mix;

use super::kernels::{self, Between, Constants, Found, New, Old, RowView, Stage, Star};
use crate::shallow_water::finite_volume::kernels::{self as volumes, LANES, Row, flag};
use crate::shallow_water::finite_volume::volume_step::{self, Extent, Outcome};
use crate::shallow_water::real::Real;
use faces::Mixed;

/// Padded arrays of the state and the bed, `stride` values a row.
pub(super) struct Source<'a, T> {
    pub(super) h: &'a [T],
    pub(super) qx: &'a [T],
    pub(super) qz: &'a [T],
    pub(super) z: &'a [T],
    pub(super) moments: [&'a [T]; 3],
    pub(super) stride: usize,
    /// The padded columns beyond which no cell is calm: the domain's, and more where its edges mirror or repeat it.
    pub(super) columns: std::ops::Range<usize>,
    /// The same of rows.
    pub(super) rows: std::ops::Range<usize>,
}

impl<'a, T> Source<'a, T> {
    /// `n` cells of row `r` from column `left`.
    #[inline(always)]
    pub(super) fn row(&self, r: usize, left: usize, n: usize) -> RowView<'a, T> {
        let at = r * self.stride + left..r * self.stride + left + n;
        RowView {
            h: &self.h[at.clone()],
            z: &self.z[at.clone()],
            qx: &self.qx[at.clone()],
            qz: &self.qz[at.clone()],
            moments: self.moments.map(|m| &m[at.clone()]),
        }
    }
}

/// Where the new state goes: whole padded rows, the first of them being row `first_row` of the source.
pub(super) struct Sink<'a, T> {
    pub(super) h: &'a mut [T],
    pub(super) qx: &'a mut [T],
    pub(super) qz: &'a mut [T],
    pub(super) moments: [&'a mut [T]; 3],
    pub(super) first_row: usize,
}

impl<T> Sink<'_, T> {
    #[inline(always)]
    fn row(&mut self, r: usize, stride: usize, extent: Extent) -> New<'_, T> {
        let from = (r - self.first_row) * stride + extent.first_column;
        let at = from..from + extent.columns;
        New {
            h: &mut self.h[at.clone()],
            qx: &mut self.qx[at.clone()],
            qz: &mut self.qz[at.clone()],
            moments: self.moments.each_mut().map(|m| &mut m[at.clone()]),
        }
    }
}

/// Rows between the stages; the newest is last in each array.
pub(super) struct Scratch<T> {
    stars: [Star<T>; 5],
    between: [Between<T>; 4],
    face_x: Box<Row<T>>,
    calm: [Box<Row<T>>; 4],
    pub(super) volumes: volume_step::Scratch<T>,
    mixed: [Box<Mixed<T>>; 3],
    pure: Box<Row<T>>,
}

impl<T: Real> Scratch<T> {
    pub(super) fn new() -> Self {
        let row = || Box::new([T::ZERO; LANES]);
        Self {
            stars: std::array::from_fn(|_| Star::new(LANES)),
            between: std::array::from_fn(|_| Between::new(LANES)),
            face_x: row(),
            calm: std::array::from_fn(|_| row()),
            volumes: volume_step::Scratch::new(),
            mixed: std::array::from_fn(|_| Box::new(Mixed::ZERO)),
            pure: row(),
        }
    }
}

/// How much of a tile and the ring around it is calm.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Water {
    /// Every cell.
    Calm,
    /// Some cells.
    Mixed,
    /// None.
    Restless,
}

/// Looks whether a tile's water is calm.
#[inline(always)]
pub(super) fn look<T: Real>(
    k: &Constants<T>,
    source: &Source<'_, T>,
    extent: Extent,
    scratch: &mut Scratch<T>,
) -> Water {
    let n = extent.columns + 4;
    let left = extent.first_column - 2;
    let (mut any, mut all) = (false, true);
    for r in extent.first_row - 1..extent.first_row + extent.rows + 1 {
        let row = |r: usize| source.row(r, left, n);
        let calm = &mut scratch.calm[0];
        kernels::calm(k, [row(r - 1), row(r), row(r + 1)], calm);
        forget_unknown(source, r, left, n, calm);
        let (mut some, mut missing) = (0_u32, 0_u32);
        for c in &calm[1..n - 1] {
            let fine = u32::from(*c > T::ZERO);
            some |= fine;
            missing |= fine ^ 1;
        }
        any |= some != 0;
        all &= missing == 0;
        if any && !all {
            return Water::Mixed;
        }
    }
    if all { Water::Calm } else { Water::Restless }
}

/// No cell beyond an edge that prescribes something is calm.
#[inline(always)]
fn forget_unknown<T: Real>(source: &Source<'_, T>, r: usize, left: usize, n: usize, calm: &mut Row<T>) {
    if !source.rows.contains(&r) {
        calm[..n].fill(T::ZERO);
        return;
    }
    let known = &source.columns;
    if known.start > left {
        calm[..(known.start - left).min(n)].fill(T::ZERO);
    }
    if known.end < left + n {
        calm[known.end.saturating_sub(left)..n].fill(T::ZERO);
    }
}

/// Steps a tile whose water is all calm.
#[inline(always)]
pub(super) fn stream<T: Real>(
    k: &Constants<T>,
    volume: &volumes::Constants<T>,
    source: &Source<'_, T>,
    sink: &mut Sink<'_, T>,
    extent: Extent,
    scratch: &mut Scratch<T>,
) -> Outcome<T> {
    let Extent { columns, .. } = extent;
    // Whole vectors: what the last one has too many reaches into the next row and is not used.
    let n = (columns + 2).next_multiple_of(16);
    let left = extent.first_column - 1;
    let (start, end) = (extent.first_row, extent.first_row + extent.rows);
    let Scratch { stars, between, .. } = scratch;
    let mut found = Found::nothing();
    let mut moved = false;
    let row = |r: usize| source.row(r, left, n);
    for newest in start - 1..=end {
        stars[..3].rotate_left(1);
        kernels::collided(k, row(newest), &mut stars[2]);
        if newest < start {
            continue;
        }
        between[..2].rotate_left(1);
        let rows = [row(newest - 1), row(newest)].map(|r| (r.h, r.z));
        kernels::between(k, 1, columns, rows, [&stars[1], &stars[2]], &mut between[1]);
        let r = newest - 1;
        if r < start {
            continue;
        }
        let old = Old {
            h: row(r).h,
            z: row(r).z,
        };
        let stage = Stage::new(1, columns, old, &stars[1], [&between[0], &between[1]]);
        let new = sink.row(r, source.stride, extent);
        stream_row(k, volume, &stage, new, &mut found);
        moved |= kernels::moves(&source.row(r, extent.first_column, columns));
    }
    Outcome {
        speed: found.signal(k),
        flags: found.flags | (u32::from(moved | found.moves) * flag::ALIVE),
    }
}

/// Whether momentum or stress is anywhere in a tile.
#[inline(always)]
pub(super) fn moves<T: Real>(source: &Source<'_, T>, extent: Extent) -> bool {
    (extent.first_row..extent.first_row + extent.rows)
        .any(|r| kernels::moves(&source.row(r, extent.first_column, extent.columns)))
}

/// Streams a row of a tile, friction included.
#[inline(always)]
pub(super) fn stream_row<T: Real>(
    k: &Constants<T>,
    volume: &volumes::Constants<T>,
    stage: &Stage<'_, T>,
    new: New<'_, T>,
    found: &mut Found<T>,
) {
    let New { h, qx, qz, moments } = new;
    let limits = [volume.depth_limit, volume.momentum_limit];
    let into = New {
        h: &mut *h,
        qx: &mut *qx,
        qz: &mut *qz,
        moments,
    };
    kernels::stream(k, limits, stage, into, found);
    if volume.friction > T::ZERO {
        volumes::rub(volume, h, qx, qz);
    }
}

/// [`flag::ALIVE`] if any moment is not 0.
#[inline(always)]
fn stressed<T: Real>(moments: [&[T]; 3]) -> u32 {
    let mut any = 0_u32;
    for moment in moments {
        for m in moment {
            any |= u32::from(m.abs() > T::ZERO);
        }
    }
    any * flag::ALIVE
}

/// Steps a tile without calm water: finite volumes alone.
#[inline(always)]
pub(super) fn restless<T: Real>(
    volume: &volumes::Constants<T>,
    source: &Source<'_, T>,
    sink: &mut Sink<'_, T>,
    extent: Extent,
    scratch: &mut Scratch<T>,
) -> Outcome<T> {
    let from = volume_step::Source {
        h: source.h,
        qx: source.qx,
        qz: source.qz,
        z: source.z,
        stride: source.stride,
    };
    let mut into = volume_step::Sink {
        h: &mut *sink.h,
        qx: &mut *sink.qx,
        qz: &mut *sink.qz,
        first_row: sink.first_row,
    };
    let mut outcome = volume_step::step(volume, from, &mut into, extent, &mut scratch.volumes);
    for r in extent.first_row..extent.first_row + extent.rows {
        outcome.flags |= stressed(source.row(r, extent.first_column, extent.columns).moments);
        let New { moments, .. } = sink.row(r, source.stride, extent);
        for moment in moments {
            moment.fill(T::ZERO);
        }
    }
    outcome
}
