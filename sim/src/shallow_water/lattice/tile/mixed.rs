//! A tile with calm and other water: finite volumes and lattice side by side.

use super::faces::{self, LatticeFaces};
use super::{Scratch, Sink, Source, forget_unknown, stressed};
use crate::shallow_water::chunks::{in_chunks, of};
use crate::shallow_water::finite_volume::kernels::{
    self as volumes, Cells, Faces, Row, RowView as VolumeRow, Velocities,
};
use crate::shallow_water::finite_volume::volume_step::{Extent, HALO, Outcome};
use crate::shallow_water::lattice::kernels::{self, Constants, New, Old, RowView, Shear, Stage};
use crate::shallow_water::real::Real;

/// Steps a tile with finite volumes and lattice side by side. The stages are those of the finite-volume tile; the
/// lattice's faces take the place of the others where all six cells around them are calm.
#[inline(always)]
pub(in super::super) fn mix<T: Real>(
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
        between,
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
        between.rotate_left(1);
        let rows = [row(newest - 1), latest].map(|r| (r.h, r.z));
        kernels::between(k, 1, n - 2, rows, [&stars[3], &stars[4]], &mut between[3]);
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
        let band: [&Row<T>; 2] = [&calm[1], &calm[2]];
        faces::along_z(
            k,
            n,
            [above, here],
            [&stars[2], &stars[3]],
            &between[2].face,
            band,
            &mut mixed[2].z,
        );
        put(n, &mixed[2].z, &mut s.z[2]);
        s.x.rotate_left(1);
        volumes::faces_x(volume, here.z, &s.cells[2], &mut s.x[2], &mut s.speed);
        let old = Old { h: here.h, z: here.z };
        let stage = Stage::new(1, n - 2, old, &stars[3], [&between[2], &between[3]]);
        kernels::faces_x(k, n - 2, &stage, face_x);
        faces::along_x(
            k,
            n,
            [above, here, latest],
            [&stars[2], &stars[3], &stars[4]],
            face_x,
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
        let stage = Stage::new(
            HALO,
            extent.columns,
            Old { h: old.h, z: old.z },
            &stars[1],
            [&between[0], &between[1]],
        );
        kernels::stream_moments(
            k,
            HALO,
            h,
            [pure, &calm[0]],
            Shear([&slopes.x.u, &slopes.x.v, &slopes.z.u, &slopes.z.v]),
            &stage,
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

/// What goes through some faces as the cells on one side of them see it: momentum normal to them, less the pressure of
/// the cell, and along them.
struct Seen<'a, T, const N: usize> {
    on: &'a [T; N],
    /// As the finite volumes have it, less the pressure at the face, and as the lattice has it.
    normal: [&'a [T; N]; 2],
    across: [&'a [T; N]; 2],
}

impl<'a, T: Real, const N: usize> Seen<'a, T, N> {
    /// `N` faces from column `first`, as the cells before them see them, or those behind.
    #[inline(always)]
    fn new(first: usize, upper: bool, (volume, lattice): (&'a Faces<T>, &'a LatticeFaces<T>)) -> Self {
        let (from_volume, from_lattice, across) = if upper {
            (&volume.before, &lattice.before, &lattice.across_before)
        } else {
            (&volume.behind, &lattice.behind, &lattice.across_behind)
        };
        Self {
            on: of(&lattice.on, first),
            normal: [of(from_volume, first), of(from_lattice, first)],
            across: [of(&volume.across, first), of(across, first)],
        }
    }

    /// Of face `c`; `pressure` is the part of the cell's that finite volumes have on the bed and `rise` that of its mean
    /// depth over its old one.
    #[inline(always)]
    fn at(&self, c: usize, pressure: T, rise: T) -> [T; 2] {
        let lattice = self.on[c] > T::ZERO;
        let of = |volume: T, other: T| if lattice { other } else { volume };
        [
            of((self.normal[0][c] + pressure) + rise, self.normal[1][c]),
            of(self.across[0][c], self.across[1][c]),
        ]
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
    mut into: [&mut [T]; 3],
    pure: &mut Row<T>,
) {
    let m = into[0].len();
    in_chunks!(HALO..HALO + m, update_chunk(k, old, cells, x, z, &mut into, pure));
}

#[inline(always)]
#[expect(clippy::too_many_arguments, reason = "a row through one stage")]
fn update_chunk<T: Real, const N: usize>(
    first: usize,
    k: &volumes::Constants<T>,
    old: RowView<'_, T>,
    cells: &Cells<T>,
    x: (&Faces<T>, &LatticeFaces<T>),
    z: [(&Faces<T>, &LatticeFaces<T>); 2],
    into: &mut [&mut [T]; 3],
    pure: &mut Row<T>,
) {
    let sides = [
        Seen::<T, N>::new(first - 1, false, x),
        Seen::new(first, true, x),
        Seen::new(first, false, z[0]),
        Seen::new(first, true, z[1]),
    ];
    let [west, east, front, back] = &sides;
    let mass = [
        of::<T, N>(&x.0.mass, first - 1),
        of(&x.0.mass, first),
        of(&z[0].0.mass, first),
        of(&z[1].0.mass, first),
    ];
    let [h, qx, qz] = [old.h, old.qx, old.qz].map(|v| of::<T, N>(v, first));
    let mean = of::<T, N>(&cells.h, first);
    let [ex, zx, ez, zz] = [&cells.x.e, &cells.x.z, &cells.z.e, &cells.z.z].map(|v| of::<T, N>(v, first));
    let mut new = [[T::ZERO; N]; 3];
    let mut all = [T::ZERO; N];
    let half = T::HALF * k.gravity;
    for c in 0..N {
        // From the pressure at a face to that of the cell's mean, over the part of its bed between; both ½ g h².
        let rise = half * (mean[c] - h[c]) * (mean[c] + h[c]);
        let twice = mean[c] + mean[c];
        let lower = |e: T, z: T| -(half * (twice - (e - z)) * e);
        let upper = |e: T, z: T| half * (twice + (e - z)) * e;
        let [west_normal, west_across] = west.at(c, lower(ex[c], zx[c]), rise);
        let [east_normal, east_across] = east.at(c, upper(ex[c], zx[c]), rise);
        let [front_normal, front_across] = front.at(c, lower(ez[c], zz[c]), rise);
        let [back_normal, back_across] = back.at(c, upper(ez[c], zz[c]), rise);
        let (mass_x, mass_z) = (mass[0][c] - mass[1][c], mass[2][c] - mass[3][c]);
        new[0][c] = (h[c] + mass_x) + mass_z;
        new[1][c] = qx[c] + k.lambda * ((west_normal - east_normal) + (front_across - back_across));
        new[2][c] = qz[c] + k.lambda * ((front_normal - back_normal) + (west_across - east_across));
        all[c] = west.on[c] * east.on[c] * front.on[c] * back.on[c];
    }
    for (into, new) in into.iter_mut().zip(&new) {
        into[first - HALO..first - HALO + N].copy_from_slice(new);
    }
    pure[first..first + N].copy_from_slice(&all);
}
