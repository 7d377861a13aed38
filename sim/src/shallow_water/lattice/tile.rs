//! One tile through a step of the lattice: whole where all its water is calm, else with finite-volume faces wherever
//! one of the six cells around a face is not.

use super::super::finite_volume::kernels::{
    self as volumes, Cells, Faces, LANES, Row, RowView as VolumeRow, Velocities, flag,
};
use super::super::finite_volume::volume_step::{self, Extent, HALO, Outcome};
use super::super::real::Real;
use super::kernels::{self, Constants, Links, New, RowView, Star};

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
    stars: [Box<Star<T>>; 5],
    links: [Box<Links<T>>; 4],
    face_x: Box<Row<T>>,
    most: [Box<Row<T>>; 2],
    calm: [Box<Row<T>>; 4],
    pub(super) volumes: volume_step::Scratch<T>,
    mixed: [Box<Mixed<T>>; 3],
    pure: Box<Row<T>>,
}

/// Which faces of a row, to +X and to +Z, are the lattice's, and what goes through those.
#[derive(Clone)]
struct Mixed<T> {
    x: LatticeFaces<T>,
    z: LatticeFaces<T>,
}

/// Faces of the lattice along one axis; fluxes of momentum in m³/s² less the pressure of the cell that sees them.
#[derive(Clone)]
struct LatticeFaces<T> {
    /// 1 where the face is the lattice's.
    on: Row<T>,
    mass: Row<T>,
    before: Row<T>,
    behind: Row<T>,
    /// Of transverse momentum, which the bed of the corners beside the face makes different for the two cells.
    across_before: Row<T>,
    across_behind: Row<T>,
}

impl<T: Real> LatticeFaces<T> {
    const ZERO: Self = Self {
        on: [T::ZERO; LANES],
        mass: [T::ZERO; LANES],
        before: [T::ZERO; LANES],
        behind: [T::ZERO; LANES],
        across_before: [T::ZERO; LANES],
        across_behind: [T::ZERO; LANES],
    };
}

impl<T: Real> Scratch<T> {
    pub(super) fn new() -> Self {
        let row = || Box::new([T::ZERO; LANES]);
        Self {
            stars: std::array::from_fn(|_| Box::new(Star::ZERO)),
            links: std::array::from_fn(|_| Box::new(Links::ZERO)),
            face_x: row(),
            most: [row(), row()],
            calm: std::array::from_fn(|_| row()),
            volumes: volume_step::Scratch::new(),
            mixed: std::array::from_fn(|_| {
                Box::new(Mixed {
                    x: LatticeFaces::ZERO,
                    z: LatticeFaces::ZERO,
                })
            }),
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
    let n = extent.columns + 2;
    let left = extent.first_column - 1;
    let (start, end) = (extent.first_row, extent.first_row + extent.rows);
    let s = scratch;
    s.most.iter_mut().for_each(|m| m.fill(T::ZERO));
    let mut flags = 0;
    let row = |r: usize| source.row(r, left, n);
    for newest in start - 1..=end {
        s.stars[..3].rotate_left(1);
        kernels::collided(k, row(newest), &mut s.stars[2]);
        if newest < start {
            continue;
        }
        s.links[..2].rotate_left(1);
        kernels::links(
            k,
            [row(newest - 1), row(newest)],
            [&s.stars[1], &s.stars[2]],
            &mut s.links[1],
        );
        let r = newest - 1;
        if r < start {
            continue;
        }
        kernels::faces_x(k, n, [&s.links[0], &s.links[1]], &mut s.face_x);
        let new = sink.row(r, source.stride, extent);
        let New { h, qx, qz, moments } = new;
        let [xx, zz, xz] = moments;
        let [deepest, fastest] = &mut s.most;
        kernels::stream(
            k,
            row(r).h,
            [&s.stars[0], &s.stars[1], &s.stars[2]],
            [&s.links[0], &s.links[1]],
            &s.face_x,
            New {
                h: &mut *h,
                qx: &mut *qx,
                qz: &mut *qz,
                moments: [&mut *xx, &mut *zz, &mut *xz],
            },
            [deepest, fastest],
        );
        if volume.friction > T::ZERO {
            volumes::rub(volume, h, qx, qz);
        }
        let old = source.row(r, extent.first_column, extent.columns);
        flags |= volumes::inspect(volume, (old.h, old.qx, old.qz), (h, qx, qz));
        flags |= stressed(old.moments) | stressed([xx, zz, xz]);
    }
    let most = s
        .most
        .each_ref()
        .map(|m| m[..extent.columns].iter().fold(T::ZERO, |a, &b| a.larger(b)));
    Outcome {
        speed: most[1] + (k.gravity * most[0]).sqrt(),
        flags,
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

/// Steps a tile with finite volumes and lattice side by side. The stages are those of the finite-volume tile; the
/// lattice's faces take the place of the others where all six cells around them are calm.
#[inline(always)]
pub(super) fn mix<T: Real>(
    k: &Constants<T>,
    volume: &volumes::Constants<T>,
    source: &Source<'_, T>,
    sink: &mut Sink<'_, T>,
    extent: Extent,
    scratch: &mut Scratch<T>,
) -> Outcome<T> {
    let n = extent.columns + 2 * HALO;
    let left = extent.first_column - HALO;
    let (start, end) = (extent.first_row, extent.first_row + extent.rows);
    let Scratch {
        stars,
        links,
        face_x,
        calm,
        volumes: s,
        mixed,
        pure,
        ..
    } = scratch;
    s.speed.fill(T::ZERO);
    let mut flags = 0;
    let mut short = [false; 2];
    let row = |r: usize| source.row(r, left, n);

    for newest in start - HALO..end + HALO {
        let latest = row(newest);
        s.velocities.rotate_left(1);
        volumes::velocities(volume, latest.h, latest.qx, latest.qz, &mut s.velocities[2]);
        stars.rotate_left(1);
        kernels::collided(k, latest, &mut stars[4]);
        calm.rotate_left(1);
        if newest < start + 1 - HALO || newest + 1 >= end + HALO {
            calm[3].fill(T::ZERO);
        } else {
            kernels::calm(k, [row(newest - 1), latest, row(newest + 1)], &mut calm[3]);
            calm[3][0] = T::ZERO;
            calm[3][n - 1] = T::ZERO;
            forget_unknown(source, newest, left, n, &mut calm[3]);
        }
        if newest + HALO == start {
            continue;
        }
        // Links between the two newest rows, and the lattice's faces along Z there.
        links.rotate_left(1);
        kernels::links(
            k,
            [row(newest - 1), latest],
            [&stars[3], &stars[4]],
            &mut links[3],
        );
        if newest + 1 < start {
            continue;
        }
        let r = newest - 1;
        s.cells.rotate_left(1);
        let [v0, v1, v2] = &s.velocities;
        let (above, here) = (row(r - 1), row(r));
        volumes::reconstruct(
            volume,
            volume_row(&above, v0, n),
            volume_row(&here, v1, n),
            volume_row(&latest, v2, n),
            &mut s.cells[2],
        );
        if volume.friction > T::ZERO {
            volumes::rub_half(volume, volume_row(&here, v1, n), &mut s.cells[2]);
        }
        if r + 1 < start {
            continue;
        }
        mixed.rotate_left(1);
        s.z.rotate_left(1);
        volumes::faces_z(
            volume,
            (above.z, here.z),
            (&s.cells[1], &s.cells[2]),
            &mut s.z[2],
            &mut s.speed,
        );
        // Z faces between rows r − 1 and r.
        lattice_z(
            k,
            n,
            [above, here],
            [&stars[2], &stars[3]],
            &links[2],
            [&calm[1], &calm[2]],
            &mut mixed[2].z,
        );
        put(n, &mixed[2].z, &mut s.z[2]);
        s.x.rotate_left(1);
        volumes::faces_x(volume, here.z, &s.cells[2], &mut s.x[2], &mut s.speed);
        kernels::faces_x(k, n, [&links[2], &links[3]], face_x);
        lattice_x(
            k,
            n,
            [above, here, latest],
            [&stars[2], &stars[3], &stars[4]],
            face_x,
            &links[3],
            [&calm[1], &calm[2], &calm[3]],
            &mut mixed[2].x,
        );
        put(n, &mixed[2].x, &mut s.x[2]);

        let m = r - 1;
        if m + 1 < start {
            continue;
        }
        s.share.rotate_left(1);
        let [z_oldest, z_before, z_behind] = &mut s.z;
        let pays = volumes::shares(volume, row(m).h, &s.x[1], (z_before, z_behind), &mut s.share[1]);
        short = [short[1], pays];
        if short[1] {
            volumes::drain_x(volume, n, &s.share[1], &mut s.x[1]);
            put(n, &mixed[1].x, &mut s.x[1]);
        }
        if m < start {
            continue;
        }
        if short[0] || short[1] {
            if !short[0] {
                s.share[0].fill(T::ONE);
            }
            if !short[1] {
                s.share[1].fill(T::ONE);
            }
            volumes::drain_z(volume, n, (&s.share[0], &s.share[1]), z_before);
            put(n, &mixed[1].z, z_before);
        }

        let u = m - 1;
        if u < start {
            continue;
        }
        let old = row(u);
        let New { h, qx, qz, moments } = sink.row(u, source.stride, extent);
        update(
            volume,
            old,
            &s.cells[0],
            (&*s.x[0], &mixed[0].x),
            [(&**z_oldest, &mixed[0].z), (&**z_before, &mixed[1].z)],
            [&mut *h, &mut *qx, &mut *qz],
            pure,
        );
        let [xx, zz, xz] = moments;
        let slopes = &s.cells[0];
        kernels::stream_moments(
            k,
            HALO,
            [old.h, h],
            pure,
            &calm[0],
            kernels::Shear([&slopes.x.u, &slopes.x.v, &slopes.z.u, &slopes.z.v]),
            [&stars[0], &stars[1], &stars[2]],
            [&links[0], &links[1]],
            [&mut *xx, &mut *zz, &mut *xz],
        );
        let old = source.row(u, extent.first_column, extent.columns);
        flags |= volumes::finish(volume, (old.h, old.qx, old.qz), h, qx, qz);
        flags |= stressed(old.moments) | stressed([xx, zz, xz]);
    }
    let speed = s.speed[1..n - 1].iter().fold(T::ZERO, |a, &b| a.larger(b));
    Outcome { speed, flags }
}

#[inline(always)]
fn volume_row<'a, T>(row: &RowView<'a, T>, velocities: &'a Velocities<T>, n: usize) -> VolumeRow<'a, T> {
    VolumeRow {
        h: row.h,
        z: row.z,
        u: &velocities.u[..n],
        v: &velocities.v[..n],
    }
}

/// Puts the lattice's mass in the place of the finite volumes' where the face is the lattice's.
#[inline(always)]
fn put<T: Real>(n: usize, from: &LatticeFaces<T>, into: &mut Faces<T>) {
    for c in 0..n {
        into.mass[c] = if from.on[c] > T::ZERO {
            from.mass[c]
        } else {
            into.mass[c]
        };
    }
}

/// The surface term of a link as the cell `a` sees it: λ (g̃/6)(hₐ + h_b)(η_b − ηₐ).
#[inline(always)]
fn surface<T: Real>(weight: T, a: (T, T), b: (T, T)) -> T {
    weight * (a.0 + b.0) * ((b.0 - a.0) + (b.1 - a.1))
}

/// Depth and bed of a cell.
#[inline(always)]
fn cell<T: Real>(row: &RowView<'_, T>, c: usize) -> (T, T) {
    (row.h[c], row.z[c])
}

/// The lattice's faces to +X of a row. Each diagonal link goes by halves through both corners; as the corner cell sees
/// it, less its own pressure, it has the surface terms to both ends.
#[inline(always)]
#[expect(
    clippy::too_many_arguments,
    reason = "rows before, at and behind of everything that a face touches"
)]
fn lattice_x<T: Real>(
    k: &Constants<T>,
    n: usize,
    rows: [RowView<'_, T>; 3],
    stars: [&Star<T>; 3],
    mass: &Row<T>,
    links: &Links<T>,
    calm: [&Row<T>; 3],
    out: &mut LatticeFaces<T>,
) {
    let diagonal = T::QUARTER * k.sixth;
    let scale = k.speed * k.speed;
    let [fb, f, ff] = stars.map(|s| &s.0);
    for c in 1..n - 2 {
        let d = c + 1;
        let on = calm[0][c] * calm[1][c] * calm[2][c] * calm[0][d] * calm[1][d] * calm[2][d];
        out.on[c] = on;
        if !(on > T::ZERO) {
            continue;
        }
        out.mass[c] = mass[c];
        let (l, r) = (cell(&rows[1], c), cell(&rows[1], d));
        let (lb, rb) = (cell(&rows[0], c), cell(&rows[0], d));
        let (lf, rf) = (cell(&rows[2], c), cell(&rows[2], d));
        let s = |a, b| surface(diagonal, a, b);
        // Sums of the two populations that meet on each link: the axis, then the diagonals from the left cell to the
        // rows before and behind, then those from there to the right cell.
        let axis = f[0][c] + f[1][d];
        let (from_b, from_f) = (f[6][c] + fb[7][d], f[4][c] + ff[5][d]);
        let (to_b, to_f) = (fb[4][c] + f[5][d], ff[6][c] + f[7][d]);
        let axis_surface = links.surface[0][c];
        // As the left cell sees them: it is the end of the first two and the corner of the others.
        let (lr, l_lb, l_lf) = (s(l, r), s(l, lb), s(l, lf));
        let seen = [
            from_b + s(l, rb),
            from_f + s(l, rf),
            to_b + (l_lb + lr),
            to_f + (l_lf + lr),
        ];
        out.before[c] =
            scale * ((axis + axis_surface) + T::HALF * ((seen[0] + seen[1]) + (seen[2] + seen[3])));
        out.across_before[c] = scale * (T::HALF * ((seen[1] - seen[0]) + (seen[2] - seen[3])));
        // As the right cell sees them.
        let (rl, r_rb, r_rf) = (s(r, l), s(r, rb), s(r, rf));
        let seen = [
            from_b + (r_rb + rl),
            from_f + (r_rf + rl),
            to_b + s(r, lb),
            to_f + s(r, lf),
        ];
        out.behind[c] =
            scale * ((axis - axis_surface) + T::HALF * ((seen[0] + seen[1]) + (seen[2] + seen[3])));
        out.across_behind[c] = scale * (T::HALF * ((seen[1] - seen[0]) + (seen[2] - seen[3])));
    }
}

/// The lattice's faces between two rows.
#[inline(always)]
fn lattice_z<T: Real>(
    k: &Constants<T>,
    n: usize,
    rows: [RowView<'_, T>; 2],
    stars: [&Star<T>; 2],
    links: &Links<T>,
    calm: [&Row<T>; 2],
    out: &mut LatticeFaces<T>,
) {
    let diagonal = T::QUARTER * k.sixth;
    let scale = k.speed * k.speed;
    let [f, g] = stars.map(|s| &s.0);
    for c in 1..n - 1 {
        let (w, e) = (c - 1, c + 1);
        let on = calm[0][w] * calm[0][c] * calm[0][e] * calm[1][w] * calm[1][c] * calm[1][e];
        out.on[c] = on;
        if !(on > T::ZERO) {
            continue;
        }
        out.mass[c] = links.face_z[c];
        let (l, r) = (cell(&rows[0], c), cell(&rows[1], c));
        let (lb, rb) = (cell(&rows[0], w), cell(&rows[1], w));
        let (lf, rf) = (cell(&rows[0], e), cell(&rows[1], e));
        let s = |a, b| surface(diagonal, a, b);
        let axis = f[2][c] + g[3][c];
        let (from_b, from_f) = (f[7][c] + g[6][w], f[4][c] + g[5][e]);
        let (to_b, to_f) = (f[4][w] + g[5][c], f[7][e] + g[6][c]);
        let axis_surface = links.surface[1][c];
        let (lr, l_lb, l_lf) = (s(l, r), s(l, lb), s(l, lf));
        let seen = [
            from_b + s(l, rb),
            from_f + s(l, rf),
            to_b + (l_lb + lr),
            to_f + (l_lf + lr),
        ];
        out.before[c] =
            scale * ((axis + axis_surface) + T::HALF * ((seen[0] + seen[1]) + (seen[2] + seen[3])));
        out.across_before[c] = scale * (T::HALF * ((seen[1] - seen[0]) + (seen[2] - seen[3])));
        let (rl, r_rb, r_rf) = (s(r, l), s(r, rb), s(r, rf));
        let seen = [
            from_b + (r_rb + rl),
            from_f + (r_rf + rl),
            to_b + s(r, lb),
            to_f + s(r, lf),
        ];
        out.behind[c] =
            scale * ((axis - axis_surface) + T::HALF * ((seen[0] + seen[1]) + (seen[2] + seen[3])));
        out.across_behind[c] = scale * (T::HALF * ((seen[1] - seen[0]) + (seen[2] - seen[3])));
    }
}

/// What goes through one face as the two cells beside it see it: momentum normal to it, less the pressure of the
/// cell, and along it.
#[derive(Clone, Copy)]
struct Seen<T> {
    normal: T,
    across: T,
}

/// A face at the larger side of a cell whose depth was `old` and is `h` at the half step, with halves of the
/// differences of surface and bed across it.
#[inline(always)]
fn seen<T: Real>(
    k: &volumes::Constants<T>,
    (volume, lattice): (&Faces<T>, &LatticeFaces<T>),
    c: usize,
    upper: bool,
    (h, old): (T, T),
    (e, z): (T, T),
) -> Seen<T> {
    if lattice.on[c] > T::ZERO {
        return if upper {
            Seen {
                normal: lattice.before[c],
                across: lattice.across_before[c],
            }
        } else {
            Seen {
                normal: lattice.behind[c],
                across: lattice.across_behind[c],
            }
        };
    }
    // From the pressure at the face to that of the cell's mean, over the part of its bed between; both ½ g h².
    let half = T::HALF * k.gravity;
    let rise = half * (h - old) * (h + old);
    let twice = h + h;
    if upper {
        Seen {
            normal: volume.before[c] + half * (twice + (e - z)) * e + rise,
            across: volume.across[c],
        }
    } else {
        Seen {
            normal: volume.behind[c] - half * (twice - (e - z)) * e + rise,
            across: volume.across[c],
        }
    }
}

/// Adds the fluxes to one row: cells HALO .. n − HALO of the views; `pure` becomes 1 where all four faces are the
/// lattice's.
#[inline(always)]
fn update<T: Real>(
    k: &volumes::Constants<T>,
    old: RowView<'_, T>,
    cells: &Cells<T>,
    x: (&Faces<T>, &LatticeFaces<T>),
    z: [(&Faces<T>, &LatticeFaces<T>); 2],
    [h, qx, qz]: [&mut [T]; 3],
    pure: &mut Row<T>,
) {
    for i in 0..h.len() {
        let c = i + HALO;
        let depths = (cells.h[c], old.h[c]);
        let along_x = (cells.x.e[c], cells.x.z[c]);
        let along_z = (cells.z.e[c], cells.z.z[c]);
        let west = seen(k, x, c - 1, false, depths, along_x);
        let east = seen(k, x, c, true, depths, along_x);
        let first = seen(k, z[0], c, false, depths, along_z);
        let last = seen(k, z[1], c, true, depths, along_z);
        let mass_x = x.0.mass[c - 1] - x.0.mass[c];
        let mass_z = z[0].0.mass[c] - z[1].0.mass[c];
        h[i] = (old.h[c] + mass_x) + mass_z;
        qx[i] = old.qx[c] + k.lambda * ((west.normal - east.normal) + (first.across - last.across));
        qz[i] = old.qz[c] + k.lambda * ((first.normal - last.normal) + (west.across - east.across));
        pure[c] = x.1.on[c - 1] * x.1.on[c] * z[0].1.on[c] * z[1].1.on[c];
    }
}
