//! One step of all rows: collision, links, what arrives, a band of rows at a time.

use super::Bgk;
use super::extremes::Largest;
use super::kernels::{self, Constants, DIRECTIONS, Lanes, Links, New, RowView, Star};
use crate::shallow_water::finite_volume::kernels as volumes;
use crate::shallow_water::finite_volume::part;
use crate::shallow_water::real::Real;
use crate::shallow_water::storage::{Fields, GHOSTS, Layout};
use rayon::prelude::*;

/// Rows of a band, which one thread steps at a time.
const BAND: usize = 64;

/// The state before a step, with its ghosts filled.
struct Before<'a, T> {
    k: Constants<T>,
    friction: volumes::Constants<T>,
    layout: Layout,
    now: &'a Fields<T>,
    bed: &'a [T],
    /// Edges beyond which something is prescribed: −X, +X, −Z, +Z.
    foreign: [bool; 4],
}

impl<T: Real> Before<'_, T> {
    fn row(&self, r: usize) -> RowView<'_, T> {
        let at = r * self.layout.stride..(r + 1) * self.layout.stride;
        RowView {
            h: &self.now.h[at.clone()],
            z: &self.bed[at.clone()],
            qx: &self.now.qx[at.clone()],
            qz: &self.now.qz[at],
        }
    }

    /// Finds the cells of a row that take part.
    #[inline(always)]
    fn open(&self, r: usize, out: &mut [T]) {
        let (Layout { nx, nz, .. }, thin) = (self.layout, self.k.thin);
        kernels::openings(thin, [self.row(r - 1), self.row(r), self.row(r + 1)], out);
        // Beyond an edge that prescribes something there is only water beside water: the bed there is made up.
        let both = |a: T, b: T| if a > thin && b > thin { T::ONE } else { T::ZERO };
        let inside = r.clamp(GHOSTS, GHOSTS + nz - 1);
        let here = self.row(r).h;
        if (r < inside && self.foreign[2]) || (r > inside && self.foreign[3]) {
            let inside = self.row(inside).h;
            for (c, open) in out.iter_mut().enumerate() {
                *open = both(here[c], inside[c]);
            }
        }
        let (west, east) = (GHOSTS, GHOSTS + nx - 1);
        for c in (0..GHOSTS).filter(|_| self.foreign[0]) {
            out[c] = both(here[c], here[west]);
        }
        for c in (east + 1..=east + GHOSTS).filter(|_| self.foreign[1]) {
            out[c] = both(here[c], here[east]);
        }
    }

    /// Collides a row, whose populations these are.
    #[inline(always)]
    fn collide(&self, r: usize, phi: [&[T]; DIRECTIONS], out: &mut Star<T>) {
        self.open(r, &mut out.open);
        kernels::collide(&self.k, self.row(r), phi, out);
    }

    #[inline(always)]
    fn link(&self, r: usize, stars: [&Star<T>; 2], out: &mut Links<T>) {
        kernels::links(&self.k, [self.row(r), self.row(r + 1)], stars, out);
    }
}

/// Rows between the stages; the newest is last in each array.
struct Scratch<T> {
    stars: [Star<T>; 3],
    links: [Links<T>; 2],
}

impl<T: Real> Scratch<T> {
    fn new(n: usize) -> Self {
        Self {
            stars: std::array::from_fn(|_| Star::new(n)),
            links: std::array::from_fn(|_| Links::new(n)),
        }
    }
}

/// One band of rows, as something that can be compiled for several instruction sets, with the same bits from each.
struct Band<'a, T> {
    before: &'a Before<'a, T>,
    /// The new state, and the populations that are streamed in place.
    fields: [&'a mut [T]; 3],
    planes: [&'a mut [T]; DIRECTIONS],
    /// The rows before and behind it after collision, from populations that nobody has overwritten.
    rim: [Star<T>; 2],
    first_row: usize,
    scratch: &'a mut Scratch<T>,
}

impl<T: Real> pulp::WithSimd for Band<'_, T> {
    type Output = Largest;

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) -> Largest {
        let Self {
            before,
            mut fields,
            mut planes,
            rim: [outer, mut behind],
            first_row: start,
            scratch: Scratch { stars, links },
        } = self;
        let Layout { nx, stride, .. } = before.layout;
        let end = start + planes[0].len() / stride;
        let local = |r: usize| (r - start) * stride..(r - start + 1) * stride;
        let mut found = Lanes::new();
        stars[0] = outer;
        before.collide(start, planes.each_ref().map(|p| &p[local(start)]), &mut stars[1]);
        before.link(start - 1, [&stars[0], &stars[1]], &mut links[0]);
        for r in start..end {
            if r + 1 < end {
                let phi = planes.each_ref().map(|p| &p[local(r + 1)]);
                before.collide(r + 1, phi, &mut stars[2]);
            } else {
                std::mem::swap(&mut stars[2], &mut behind);
            }
            before.link(r, [&stars[1], &stars[2]], &mut links[1]);
            let mut into = New {
                fields: fields.each_mut().map(|f| &mut f[local(r)]),
                phi: planes.each_mut().map(|p| &mut p[local(r)]),
            };
            kernels::gather(
                &before.k,
                &before.friction,
                GHOSTS..GHOSTS + nx,
                (before.row(r).h, &stars[1].open),
                [&links[0], &links[1]],
                &mut into,
                &mut found,
            );
            stars.rotate_left(1);
            links.swap(0, 1);
        }
        Largest::of(&found)
    }
}

/// The collision of one row beside a band.
struct Rim<'a, T> {
    before: &'a Before<'a, T>,
    populations: &'a [Vec<T>],
    row: usize,
}

impl<T: Real> pulp::WithSimd for Rim<'_, T> {
    type Output = Star<T>;

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) -> Star<T> {
        let Self {
            before,
            populations,
            row,
        } = self;
        let stride = before.layout.stride;
        let mut star = Star::new(stride);
        let phi = std::array::from_fn(|i| &populations[i][row * stride..(row + 1) * stride]);
        before.collide(row, phi, &mut star);
        star
    }
}

impl<T: Real> Bgk<T> {
    /// Steps every row from `now` to `next`, populations in place; the largest values of the new state.
    pub(super) fn sweep(&mut self, dt: f64) -> Largest {
        let before = Before {
            k: self.constants(dt),
            friction: self.water.constants(dt),
            layout: self.water.layout,
            now: &self.water.now,
            bed: &self.water.bed,
            foreign: self.water.boundary.foreign(),
        };
        let Layout { nz, stride, .. } = before.layout;
        let bands = nz.div_ceil(BAND);
        let arch = pulp::Arch::new();
        let populations = &self.populations[..];
        let rims: Vec<[Star<T>; 2]> = (0..bands)
            .into_par_iter()
            .map(|b| {
                let rows = [part(nz, bands, b) + GHOSTS - 1, part(nz, bands, b + 1) + GHOSTS];
                rows.map(|row| {
                    arch.dispatch(Rim {
                        before: &before,
                        populations,
                        row,
                    })
                })
            })
            .collect();
        let interior = before.layout.interior();
        let next = &mut self.water.next;
        let mut fields = [&mut next.h, &mut next.qx, &mut next.qz].map(|f| &mut f[interior.clone()]);
        let mut planes: Vec<&mut [T]> = self
            .populations
            .iter_mut()
            .map(|p| &mut p[interior.clone()])
            .collect();
        let mut jobs = Vec::with_capacity(bands);
        for (b, rim) in rims.into_iter().enumerate() {
            let from = part(nz, bands, b);
            let values = (part(nz, bands, b + 1) - from) * stride;
            let fields = fields
                .each_mut()
                .map(|f| f.split_off_mut(..values).unwrap_or_default());
            let mut parts = planes
                .iter_mut()
                .map(|p| p.split_off_mut(..values).unwrap_or_default());
            let planes = std::array::from_fn(|_| parts.next().unwrap_or_default());
            jobs.push((rim, from + GHOSTS, fields, planes));
        }
        jobs.into_par_iter()
            .map_init(
                || Scratch::new(stride),
                |scratch, (rim, first_row, fields, planes)| {
                    arch.dispatch(Band {
                        before: &before,
                        fields,
                        planes,
                        rim,
                        first_row,
                        scratch,
                    })
                },
            )
            .reduce(|| Largest::NOTHING, Largest::and)
    }
}
