//! Packets of eight rays in lockstep: one column of each is solved at the same time, a ray a lane.
//!
//! The arithmetic is that of [`Columns::crossing`](super::column::Columns::crossing) and
//! [`Crossing::hit`](super::column::Crossing::hit) on bilinear patches, operation for operation in the same order, so that
//! answers agree to the last bit; only the branches are gone, which a ray alone cannot predict. The rays of a packet need
//! nothing in common but that each waits for a column.

use super::batch::BATCH;
use super::lanes::{Axis, Pieces, Quads, Strides, larger, lerp, pick, select, smaller, wide};
use super::surface::Surface;
use super::walk::Walks;
use super::{Hit, Ray};
use fearless_simd::prelude::*;
use fearless_simd::{Simd, f64x8, i32x8, i64x8, mask64x8};
use glam::DVec3;

/// Rays of a packet.
pub(crate) const LANES: usize = 8;

/// What the rays of a packet have found. Bits and entries stand for lanes.
#[derive(Debug)]
pub(crate) struct Found {
    /// Rays that meet the surface in their column.
    pub(crate) hits: u32,
    /// Rays that are left to the scalar code: by rounding they cross more than one row.
    pub(crate) unsolved: u32,
    pub(crate) t: [f64; LANES],
    /// Of the surface, metres.
    pub(crate) height: [f64; LANES],
    pub(crate) normal: [[f64; LANES]; 3],
    /// Cell along the minor axis.
    pub(crate) row: [i64; LANES],
}

impl Found {
    /// What the caller of a ray that hits is told.
    #[inline(always)]
    pub(crate) fn hit(&self, lane: usize, column: u32, major_is_x: bool, ray: &Ray) -> Hit {
        let t = self.t[lane];
        let point = ray.at(t);
        let [x, y, z] = &self.normal;
        let row = self.row[lane] as u32;
        Hit {
            t,
            position: DVec3::new(point.x, self.height[lane], point.z),
            normal: DVec3::new(x[lane], y[lane], z[lane]),
            cell: if major_is_x { (column, row) } else { (row, column) },
        }
    }
}

/// Eight walks, as [`Walk`](super::walk::Walk) is one, and the columns that they are in.
#[derive(Clone, Copy)]
pub(crate) struct Packet<'a, S: Simd> {
    simd: S,
    samples: &'a [f32],
    spacing: f64,
    rays: [usize; LANES],
    major: Axis<S>,
    minor: Axis<S>,
    y: f64x8<S>,
    dy: f64x8<S>,
    start: f64x8<S>,
    column: f64x8<S>,
    forward: mask64x8<S>,
    along_x: mask64x8<S>,
    last_row: f64x8<S>,
    along: Strides<S>,
    across: Strides<S>,
}

impl<'a, S: Simd> Packet<'a, S> {
    /// Ray `rays[k]` in column `columns[k]`, for all `k`.
    #[inline(always)]
    pub(crate) fn new(
        simd: S,
        surface: &'a Surface,
        walks: &Walks<BATCH>,
        rays: [u8; LANES],
        columns: [f64; LANES],
    ) -> Self {
        let layouts = [surface.layout(false), surface.layout(true)];
        let mut places = [0; LANES];
        let (mut is_x, mut last_row, mut strides) = ([0.0; LANES], [0.0; LANES], [[0; LANES]; 4]);
        for k in 0..LANES {
            let ray = usize::from(rays[k]) % BATCH;
            let x = usize::from(walks.major_is_x[ray]);
            let layout = &layouts[x];
            places[k] = ray;
            is_x[k] = x as f64;
            last_row[k] = f64::from(layout.minor_cells) - 1.0;
            strides[0][k] = layout.along.fine as i32;
            strides[1][k] = layout.along.coarse as i32;
            strides[2][k] = layout.across.fine as i32;
            strides[3][k] = layout.across.coarse as i32;
        }
        let major = Axis::of(simd, &walks.major, places);
        Self {
            simd,
            samples: layouts[0].samples,
            spacing: surface.spacing(),
            rays: places,
            major,
            minor: Axis::of(simd, &walks.minor, places),
            y: pick(simd, &walks.y, places),
            dy: pick(simd, &walks.dy, places),
            start: pick(simd, &walks.start, places),
            column: columns.simd_into(simd),
            forward: major.step.simd_ge(0.0),
            along_x: f64x8::simd_from(simd, is_x).simd_gt(0.0),
            last_row: last_row.simd_into(simd),
            along: Strides {
                fine: strides[0].simd_into(simd),
                coarse: strides[1].simd_into(simd),
            },
            across: Strides {
                fine: strides[2].simd_into(simd),
                coarse: strides[3].simd_into(simd),
            },
        }
    }

    #[inline(always)]
    fn height(&self, t: f64x8<S>) -> f64x8<S> {
        self.y + self.dy * t
    }

    /// How far the rays are within their columns.
    #[inline(always)]
    fn ahead(&self, t: f64x8<S>) -> f64x8<S> {
        let within = self.major.at(t) - self.column;
        self.forward.select(within, 1.0 - within)
    }

    /// The cell that holds a position along the minor axis.
    #[inline(always)]
    fn row(&self, z: f64x8<S>) -> f64x8<S> {
        smaller(larger(z, f64x8::splat(self.simd, 0.0)), self.last_row).floor()
    }

    /// The lines at which the rays enter and leave their columns.
    #[inline(always)]
    fn lines(&self) -> [f64x8<S>; 2] {
        let (here, next) = (self.column, self.column + 1.0);
        [self.forward.select(here, next), self.forward.select(next, here)]
    }

    /// The samples of a row on two lines, whose places are given.
    #[inline(always)]
    fn on_row(&self, lines: [i32x8<S>; 2], row: f64x8<S>) -> Option<[f64x8<S>; 2]> {
        let row = self.across.place(row);
        Some([
            wide(self.simd, self.samples, lines[0] + row)?,
            wide(self.simd, self.samples, lines[1] + row)?,
        ])
    }

    /// Heights of the rays above the surface, within a cell.
    #[inline(always)]
    fn inside(&self, quads: &Quads<S>, row: f64x8<S>, t: f64x8<S>) -> f64x8<S> {
        self.height(t) - quads.height(self.ahead(t), self.minor.at(t) - row)
    }

    /// A stretch within one cell.
    #[inline(always)]
    fn piece(&self, mirror: f64x8<S>, quads: &Quads<S>, t: [f64x8<S>; 2], f: [f64x8<S>; 2]) -> Pieces<S> {
        let span = t[1] - t[0];
        let (du, dv) = (self.major.step.abs() * span, self.minor.step * span);
        Pieces {
            t,
            f: [mirror * f[0], mirror * f[1]],
            c: mirror * (quads.twist() * du * dv),
        }
    }

    /// How far above the surface each ray starts, metres. `None` if a sample is outside the grid, which callers rule out.
    #[inline(always)]
    pub(crate) fn starts(&self) -> Option<[f64; LANES]> {
        let lines = self.lines();
        let places = [self.along.place(lines[0]), self.along.place(lines[1])];
        let row = self.row(self.minor.at(self.start));
        let quads = Quads::new(self.on_row(places, row)?, self.on_row(places, row + 1.0)?);
        Some(self.inside(&quads, row, self.start).into())
    }

    /// Solves the columns; `mirror` is -1 for rays below the surface, else 1. `None` as for [`Self::starts`].
    #[inline(always)]
    pub(crate) fn solve(&self, walks: &Walks<BATCH>, mirror: [f64; LANES]) -> Option<Found> {
        let (simd, minor, start) = (self.simd, &self.minor, self.start);
        let end = pick(simd, &walks.end, self.rays);
        let (zero, one) = (f64x8::splat(simd, 0.0), f64x8::splat(simd, 1.0));
        let is_first = pick(simd, &walks.first, self.rays).floor().simd_eq(self.column);
        let is_last = pick(simd, &walks.last, self.rays).floor().simd_eq(self.column);
        let lines = self.lines();
        let t_near = smaller(larger(self.major.time(lines[0]), start), end);
        let t_far = smaller(larger(self.major.time(lines[1]), start), end);
        let (t_near, t_far) = (is_first.select(start, t_near), is_last.select(end, t_far));
        let (z_near, z_far) = (minor.at(t_near), minor.at(t_far));
        let (row, row_far) = (self.row(z_near), self.row(z_far));
        let crosses = !row.simd_eq(row_far);
        let up = row_far.simd_gt(row);
        let unsolved = (row_far - row).abs().simd_gt(1.0);
        let t_row = smaller(larger(minor.time(row + up.select(one, zero)), t_near), t_far);
        let t_row = crosses.select(t_row, t_far);

        // Samples of both cells: the rows on either side of the first, and the other row of the second.
        let beyond = crosses.select(up.select(row + 2.0, row - 1.0), row);
        let beyond = smaller(larger(beyond, zero), self.last_row + 1.0);
        let places = [self.along.place(lines[0]), self.along.place(lines[1])];
        let (lower, upper) = (self.on_row(places, row)?, self.on_row(places, row + 1.0)?);
        let next = self.on_row(places, beyond)?;
        let shared = select(up, upper, lower);
        let first = Quads::new(lower, upper);
        let second = Quads::select(up, Quads::new(upper, next), Quads::new(next, lower));
        let second = Quads::select(crosses, second, first);

        // Heights above the surface where the ray enters, crosses a row, and leaves.
        let [a, b] = first.near;
        let f_near = self.height(t_near) - lerp(a, b, z_near - row);
        let f_near = is_first.select(self.inside(&first, row, t_near), f_near);
        let [a, b] = second.far;
        let f_far = self.height(t_far) - lerp(a, b, z_far - row_far);
        let f_far = is_last.select(self.inside(&second, row_far, t_far), f_far);
        let f_row = self.height(t_row) - lerp(shared[0], shared[1], self.ahead(t_row));
        let f_row = crosses.select(f_row, f_far);

        let mirror = mirror.simd_into(simd);
        let before = self.piece(mirror, &first, [t_near, t_row], [f_near, f_row]);
        let after = self.piece(mirror, &second, [t_row, t_far], [f_row, f_far]);
        let in_first = before.have_root();
        let hits = in_first | (crosses & after.have_root());
        let t = Pieces::select(in_first, before, after).root(simd);
        let (quads, row) = (
            Quads::select(in_first, first, second),
            in_first.select(row, row_far),
        );

        // The points that were hit.
        let (u, v) = (self.ahead(t), minor.at(t) - row);
        let (along, across) = quads.slopes(u, v);
        let along = self.forward.select(along, -along);
        let (x, z) = (
            -self.along_x.select(along, across),
            -self.along_x.select(across, along),
        );
        let y = f64x8::splat(simd, self.spacing);
        let scale = 1.0 / (x * x + y * y + z * z).sqrt();
        Some(Found {
            hits: hits.to_bitmask() as u32,
            unsolved: unsolved.to_bitmask() as u32,
            t: t.into(),
            height: quads.height(u, v).into(),
            normal: [(x * scale).into(), (y * scale).into(), (z * scale).into()],
            row: row.to_int::<i64x8<S>>().into(),
        })
    }
}
