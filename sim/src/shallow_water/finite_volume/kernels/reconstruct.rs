//! From cell means to a slope in each cell, and half a step on in time.

use super::{Cells, Constants, Halves, RowView};
use crate::shallow_water::real::Real;

/// Steepest slope in units of the smaller one-sided difference. The monotonised central limiter has 2; a little less
/// keeps a standing jump from ringing and costs hardly anything elsewhere (measured in `docs/numerics-shallow-water.md`).
const STEEPEST: f64 = 1.8;

/// Half of the central difference (a + b)/2, within [`STEEPEST`] times a and b, 0 at an extremum (van Leer 1977).
#[inline(always)]
fn limited_half<T: Real>(a: T, b: T) -> T {
    // Divided by STEEPEST / 2, so that the bounds are a and b themselves.
    let central = T::from_f64(0.5 / STEEPEST) * (a + b);
    let most = a.smaller(b).larger(T::ZERO);
    let least = a.larger(b).smaller(T::ZERO);
    T::from_f64(0.5 * STEEPEST) * central.smaller(most).larger(least)
}

/// A cell or its neighbour.
#[derive(Clone, Copy)]
struct Cell<T> {
    h: T,
    z: T,
    u: T,
    v: T,
}

/// Half differences across a cell along one axis.
struct Difference<T> {
    h: T,
    e: T,
    u: T,
    v: T,
}

/// Limited half differences of a cell between two neighbours; none where it is dry or its bed breaks.
///
/// Where the bed bends within a cell by as much as four fifths of the depth, faces see another depth than the middle
/// does. A slope of the surface would then push, and a slope of the velocity would then carry, more water in the half
/// step than the faces let through: waves in hollows would gain energy, puddles would shoot off. There the scheme is of
/// first order, whose hydrostatic reconstruction loses energy (Audusse et al. 2004, theorem 2.1). Even slopes, however
/// steep and however thin the water, keep their second order, and films run down them as fast as they should.
#[inline(always)]
fn differences<T: Real>(k: &Constants<T>, from: Cell<T>, here: Cell<T>, to: Cell<T>) -> Difference<T> {
    let (h1, h2) = (here.h - from.h, to.h - here.h);
    let (z1, z2) = (here.z - from.z, to.z - here.z);
    let bend = (z2 - z1).abs();
    let smooth = here.h > (bend + T::QUARTER * bend).larger(k.dry);
    let gate = |slope: T| if smooth { slope } else { T::ZERO };
    Difference {
        h: gate(limited_half(h1, h2)),
        e: gate(limited_half(h1 + z1, h2 + z2)),
        u: gate(limited_half(here.u - from.u, to.u - here.u)),
        v: gate(limited_half(here.v - from.v, to.v - here.v)),
    }
}

impl<'a, T: Real> RowView<'a, T> {
    /// `m` cells from number `first` on.
    #[inline(always)]
    fn part(self, first: usize, m: usize) -> Self {
        let end = first + m;
        Self {
            h: &self.h[first..end],
            z: &self.z[first..end],
            u: &self.u[first..end],
            v: &self.v[first..end],
        }
    }

    #[inline(always)]
    fn cell(&self, c: usize) -> Cell<T> {
        Cell {
            h: self.h[c],
            z: self.z[c],
            u: self.u[c],
            v: self.v[c],
        }
    }
}

/// The places of `m` cells from number 1 on, one slice a quantity: e, z, u, v.
#[inline(always)]
fn places<T>(halves: &mut Halves<T>, m: usize) -> [&mut [T]; 4] {
    let Halves { e, z, u, v } = halves;
    [&mut e[1..=m], &mut z[1..=m], &mut u[1..=m], &mut v[1..=m]]
}

/// Limited differences across each cell and the half step in time (Toro 2001, eq. 9.44, in primitive variables).
#[inline(always)]
pub(crate) fn reconstruct<T: Real>(
    k: &Constants<T>,
    before: RowView<'_, T>,
    here: RowView<'_, T>,
    behind: RowView<'_, T>,
    out: &mut Cells<T>,
) {
    let m = here.h.len() - 2;
    let (west, centre, east) = (here.part(0, m), here.part(1, m), here.part(2, m));
    let (first, last) = (before.part(1, m), behind.part(1, m));
    let (oh, ou, ov) = (&mut out.h[1..=m], &mut out.u[1..=m], &mut out.v[1..=m]);
    let [oxe, oxz, oxu, oxv] = places(&mut out.x, m);
    let [oze, ozz, ozu, ozv] = places(&mut out.z, m);
    let lambda = k.lambda;
    for c in 0..m {
        let cell = centre.cell(c);
        let Cell { h, u, v, .. } = cell;
        let x = differences(k, west.cell(c), cell, east.cell(c));
        let z = differences(k, first.cell(c), cell, last.cell(c));
        let outflow = lambda * (u * x.h + v * z.h + h * (x.u + z.v));
        // No side of the cell may run dry within the half step.
        let spare = h - x.h.abs().larger(z.h.abs());
        oh[c] = h - outflow.smaller(spare);
        ou[c] = u - lambda * (u * x.u + v * z.u + k.gravity * x.e);
        ov[c] = v - lambda * (u * x.v + v * z.v + k.gravity * z.e);
        oxe[c] = x.e;
        oxz[c] = x.e - x.h;
        oxu[c] = x.u;
        oxv[c] = x.v;
        oze[c] = z.e;
        ozz[c] = z.e - z.h;
        ozu[c] = z.u;
        ozv[c] = z.v;
    }
}

/// Manning's friction over the half step, so that a steady flow, in which it balances the bed's slope, stays steady.
#[inline(always)]
pub(crate) fn rub_half<T: Real>(k: &Constants<T>, here: RowView<'_, T>, out: &mut Cells<T>) {
    let m = here.h.len() - 2;
    let RowView { h, u, v, .. } = here.part(1, m);
    let (ou, ov) = (&mut out.u[1..=m], &mut out.v[1..=m]);
    let half = T::HALF * k.friction;
    for c in 0..m {
        let depth = h[c].larger(k.dry);
        let speed = (u[c] * u[c] + v[c] * v[c]).sqrt();
        let factor = T::ONE / (T::ONE + half * speed * depth.inverse_cube_root() / depth);
        ou[c] = ou[c] * factor;
        ov[c] = ov[c] * factor;
    }
}
