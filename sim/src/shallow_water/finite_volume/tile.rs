//! One tile of cells through a whole step: rows stream through the kernels, and everything between the old and the new
//! state lives in a few rows of scratch that stay in the cache.

use super::super::real::Real;
use super::kernels::{self, Cells, Constants, Faces, LANES, Row, RowView, State, Velocities};

/// Rings of cells around a tile that its step reads.
pub(in super::super) const HALO: usize = 3;
/// Most cells of a tile along X.
pub(in super::super) const TILE_WIDTH: usize = LANES - 2 * HALO;

/// Padded arrays of the state and the bed, `stride` values a row.
#[derive(Clone, Copy)]
pub(in super::super) struct Source<'a, T> {
    pub(in super::super) h: &'a [T],
    pub(in super::super) qx: &'a [T],
    pub(in super::super) qz: &'a [T],
    pub(in super::super) z: &'a [T],
    pub(in super::super) stride: usize,
}

/// Where the new state goes: whole padded rows, the first of them being row `first_row` of the source.
pub(in super::super) struct Sink<'a, T> {
    pub(in super::super) h: &'a mut [T],
    pub(in super::super) qx: &'a mut [T],
    pub(in super::super) qz: &'a mut [T],
    pub(in super::super) first_row: usize,
}

/// Which cells, in padded indices.
#[derive(Clone, Copy, Debug)]
pub(in super::super) struct Extent {
    pub(in super::super) first_column: usize,
    pub(in super::super) columns: usize,
    pub(in super::super) first_row: usize,
    pub(in super::super) rows: usize,
}

/// What a tile's step found.
#[derive(Clone, Copy, Debug)]
pub(in super::super) struct Outcome<T> {
    /// Fastest signal, m/s.
    pub(in super::super) speed: T,
    /// Bits of [`kernels::flag`].
    pub(in super::super) flags: u32,
}

/// Rows between the stages; the newest is last in each array.
pub(in super::super) struct Scratch<T> {
    pub(in super::super) velocities: [Box<Velocities<T>>; 3],
    pub(in super::super) cells: [Box<Cells<T>>; 3],
    pub(in super::super) x: [Box<Faces<T>>; 3],
    pub(in super::super) z: [Box<Faces<T>>; 3],
    pub(in super::super) share: [Box<Row<T>>; 2],
    pub(in super::super) speed: Box<Row<T>>,
}

impl<T: Real> Scratch<T> {
    pub(in super::super) fn new() -> Self {
        Self {
            velocities: std::array::from_fn(|_| Box::new(Velocities::ZERO)),
            cells: std::array::from_fn(|_| Box::new(Cells::ZERO)),
            x: std::array::from_fn(|_| Box::new(Faces::ZERO)),
            z: std::array::from_fn(|_| Box::new(Faces::ZERO)),
            share: std::array::from_fn(|_| Box::new([T::ONE; LANES])),
            speed: Box::new([T::ZERO; LANES]),
        }
    }
}

/// Steps the cells of `extent` from `source` to `sink`.
///
/// When row `r + 1` has its velocities, row `r` is reconstructed and its faces are known; row `r − 1` then has all its
/// faces and can pay its shares; row `r − 2` has nothing but settled faces and is updated.
#[inline(always)]
pub(in super::super) fn step<T: Real>(
    k: &Constants<T>,
    source: Source<'_, T>,
    sink: &mut Sink<'_, T>,
    extent: Extent,
    scratch: &mut Scratch<T>,
) -> Outcome<T> {
    let n = extent.columns + 2 * HALO;
    let left = extent.first_column - HALO;
    let stride = source.stride;
    let span = |r: usize| r * stride + left..r * stride + left + n;
    let (start, end) = (extent.first_row, extent.first_row + extent.rows);
    let s = scratch;
    s.speed.fill(T::ZERO);
    let mut flags = 0;
    // Whether the rows of shares hold a cell that cannot pay.
    let mut short = [false; 2];

    for newest in start - HALO..end + HALO {
        s.velocities.rotate_left(1);
        let at = span(newest);
        kernels::velocities(
            k,
            &source.h[at.clone()],
            &source.qx[at.clone()],
            &source.qz[at],
            &mut s.velocities[2],
        );

        if newest + 1 < start {
            continue;
        }
        let r = newest - 1;
        s.cells.rotate_left(1);
        let view = |r: usize, w: usize| RowView {
            h: &source.h[span(r)],
            z: &source.z[span(r)],
            u: &s.velocities[w].u[..n],
            v: &s.velocities[w].v[..n],
        };
        kernels::reconstruct(k, view(r - 1, 0), view(r, 1), view(r + 1, 2), &mut s.cells[2]);
        if k.friction > T::ZERO {
            kernels::rub_half(k, view(r, 1), &mut s.cells[2]);
        }
        if r + 1 < start {
            continue;
        }
        s.z.rotate_left(1);
        kernels::faces_z(
            k,
            (&source.z[span(r - 1)], &source.z[span(r)]),
            (&s.cells[1], &s.cells[2]),
            &mut s.z[2],
            &mut s.speed,
        );
        s.x.rotate_left(1);
        kernels::faces_x(k, &source.z[span(r)], &s.cells[2], &mut s.x[2], &mut s.speed);

        let m = r - 1;
        if m + 1 < start {
            continue;
        }
        s.share.rotate_left(1);
        let [z_oldest, z_before, z_behind] = &mut s.z;
        let pays = kernels::shares(
            k,
            &source.h[span(m)],
            &s.x[1],
            (z_before, z_behind),
            &mut s.share[1],
        );
        short = [short[1], pays];
        if short[1] {
            kernels::drain_x(k, n, &s.share[1], &mut s.x[1]);
        }
        if m < start {
            continue;
        }
        if short[0] || short[1] {
            // A row that can pay everything has no shares written.
            if !short[0] {
                s.share[0].fill(T::ONE);
            }
            if !short[1] {
                s.share[1].fill(T::ONE);
            }
            kernels::drain_z(k, n, (&s.share[0], &s.share[1]), z_before);
        }

        let u = m - 1;
        if u < start {
            continue;
        }
        let into = (u - sink.first_row) * stride + extent.first_column;
        let into = into..into + extent.columns;
        let at = span(u);
        flags |= kernels::update(
            k,
            State {
                h: &source.h[at.clone()],
                qx: &source.qx[at.clone()],
                qz: &source.qz[at],
            },
            &s.cells[0],
            &s.x[0],
            (z_oldest, z_before),
            &mut sink.h[into.clone()],
            &mut sink.qx[into.clone()],
            &mut sink.qz[into],
        );
    }
    let speed = s.speed[1..n - 1].iter().fold(T::ZERO, |a, &b| a.larger(b));
    Outcome { speed, flags }
}
