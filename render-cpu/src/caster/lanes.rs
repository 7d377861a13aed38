//! Arithmetic on eight rays at once, a ray a lane, for [packets](super::packet).
//!
//! Each formula has its counterpart for a single ray in [`column`](super::column) or [`walk`](super::walk), with the same
//! operations in the same order.

use super::batch::BATCH;
use super::filter::gather;
use super::packet::LANES;
use super::walk::Axes;
use fearless_simd::prelude::*;
use fearless_simd::{Simd, f64x8, i32x8, i64x8, mask64x8};

/// One horizontal axis of eight walks; see [`Axis`](super::walk::Axis).
#[derive(Clone, Copy)]
pub(crate) struct Axis<S: Simd> {
    pub(crate) origin: f64x8<S>,
    pub(crate) step: f64x8<S>,
    pub(crate) inverse: f64x8<S>,
}

/// Where samples along one axis are; see [`Stride`](super::samples::Stride).
#[derive(Clone, Copy)]
pub(crate) struct Strides<S: Simd> {
    pub(crate) fine: i32x8<S>,
    pub(crate) coarse: i32x8<S>,
}

impl<S: Simd> Strides<S> {
    /// The places of samples, given as whole numbers.
    #[inline(always)]
    pub(crate) fn place(&self, index: f64x8<S>) -> i32x8<S> {
        let index = integers(index);
        (index >> 2) * self.coarse + (index & 3) * self.fine
    }
}

impl<S: Simd> Axis<S> {
    #[inline(always)]
    pub(crate) fn of(simd: S, axes: &Axes<BATCH>, rays: [usize; LANES]) -> Self {
        Self {
            origin: pick(simd, &axes.origin, rays),
            step: pick(simd, &axes.step, rays),
            inverse: pick(simd, &axes.inverse, rays),
        }
    }

    #[inline(always)]
    pub(crate) fn at(&self, t: f64x8<S>) -> f64x8<S> {
        self.origin + self.step * t
    }

    #[inline(always)]
    pub(crate) fn time(&self, line: f64x8<S>) -> f64x8<S> {
        (line - self.origin) * self.inverse
    }
}

/// Four samples of a cell of each ray; see [`Quad`](super::column::Quad).
#[derive(Clone, Copy)]
pub(crate) struct Quads<S: Simd> {
    pub(crate) near: [f64x8<S>; 2],
    pub(crate) far: [f64x8<S>; 2],
}

impl<S: Simd> Quads<S> {
    /// From the samples of two rows, each on the line where the ray enters and on that where it leaves.
    #[inline(always)]
    pub(crate) fn new(lower: [f64x8<S>; 2], upper: [f64x8<S>; 2]) -> Self {
        Self {
            near: [lower[0], upper[0]],
            far: [lower[1], upper[1]],
        }
    }

    #[inline(always)]
    pub(crate) fn select(mask: mask64x8<S>, a: Self, b: Self) -> Self {
        Self {
            near: select(mask, a.near, b.near),
            far: select(mask, a.far, b.far),
        }
    }

    #[inline(always)]
    pub(crate) fn twist(&self) -> f64x8<S> {
        (self.near[0] - self.far[0]) - (self.near[1] - self.far[1])
    }

    /// Slopes of the bilinear patches in the direction of travel and along the minor axis, metres a cell.
    #[inline(always)]
    pub(crate) fn slopes(&self, u: f64x8<S>, v: f64x8<S>) -> (f64x8<S>, f64x8<S>) {
        let ([a, c], [b, d]) = (self.near, self.far);
        (lerp(b - a, d - c, v), lerp(c - a, d - b, u))
    }

    /// Height of the bilinear patches.
    #[inline(always)]
    pub(crate) fn height(&self, u: f64x8<S>, v: f64x8<S>) -> f64x8<S> {
        lerp(
            lerp(self.near[0], self.far[0], u),
            lerp(self.near[1], self.far[1], u),
            v,
        )
    }
}

/// A stretch of each ray within one cell: when and how far above the surface (mirrored below it) it begins and ends, and by
/// how much the surface leaves its chord.
#[derive(Clone, Copy)]
pub(crate) struct Pieces<S: Simd> {
    pub(crate) t: [f64x8<S>; 2],
    pub(crate) f: [f64x8<S>; 2],
    pub(crate) c: f64x8<S>,
}

impl<S: Simd> Pieces<S> {
    #[inline(always)]
    pub(crate) fn select(mask: mask64x8<S>, a: Self, b: Self) -> Self {
        Self {
            t: select(mask, a.t, b.t),
            f: select(mask, a.f, b.f),
            c: mask.select(a.c, b.c),
        }
    }

    /// `b` and the discriminant of `fa + b s − c s²`.
    #[inline(always)]
    pub(crate) fn quadratic(&self) -> (f64x8<S>, f64x8<S>) {
        let [fa, fb] = self.f;
        let b = (fb - fa) + self.c;
        (b, b * b + self.c * 4.0 * fa)
    }

    /// Whether [`first_root`](super::column::first_root) finds one.
    #[inline(always)]
    pub(crate) fn have_root(&self) -> mask64x8<S> {
        let ([fa, fb], c) = (self.f, self.c);
        let (b, discriminant) = self.quadratic();
        let no_dip = c.simd_ge(0.0) | b.simd_ge(0.0) | (b - c * 2.0).simd_le(0.0);
        fa.simd_le(0.0) | !((fb.simd_gt(0.0) & no_dip) | discriminant.simd_lt(0.0))
    }

    /// The time of the root where there is one.
    #[inline(always)]
    pub(crate) fn root(&self, simd: S) -> f64x8<S> {
        let (fa, c) = (self.f[0], self.c);
        let (b, discriminant) = self.quadratic();
        let root = discriminant.sqrt();
        let falls = b.simd_lt(0.0);
        let s = falls.select(fa * 2.0, b + root) / falls.select(root - b, c * 2.0);
        let (zero, one) = (f64x8::splat(simd, 0.0), f64x8::splat(simd, 1.0));
        // What is not a number compares with nothing and becomes 1.
        let s = s.simd_lt(0.0).select(zero, s.simd_le(1.0).select(s, one));
        lerp(self.t[0], self.t[1], fa.simd_le(0.0).select(zero, s))
    }
}

/// The values of some rays of a batch.
#[inline(always)]
pub(crate) fn pick<S: Simd>(simd: S, values: &[f64; BATCH], rays: [usize; LANES]) -> f64x8<S> {
    let mut lanes = [0.0; LANES];
    for (lane, ray) in lanes.iter_mut().zip(rays) {
        *lane = values[ray % BATCH];
    }
    lanes.simd_into(simd)
}

#[inline(always)]
fn integers<S: Simd>(x: f64x8<S>) -> i32x8<S> {
    let simd = x.simd;
    let whole: [i64; LANES] = x.to_int::<i64x8<S>>().into();
    let mut lanes = [0; LANES];
    for (lane, n) in lanes.iter_mut().zip(whole) {
        *lane = n as i32;
    }
    lanes.simd_into(simd)
}

/// Samples in double precision; `None` if a place is outside, which callers rule out.
#[inline(always)]
pub(crate) fn wide<S: Simd>(simd: S, samples: &[f32], at: i32x8<S>) -> Option<f64x8<S>> {
    let (a, b) = gather(simd, samples, at.into())?.widen();
    Some(a.combine(b))
}

#[inline(always)]
pub(crate) fn lerp<S: Simd>(a: f64x8<S>, b: f64x8<S>, s: f64x8<S>) -> f64x8<S> {
    a + (b - a) * s
}

#[inline(always)]
pub(crate) fn larger<S: Simd>(a: f64x8<S>, b: f64x8<S>) -> f64x8<S> {
    a.simd_gt(b).select(a, b)
}

#[inline(always)]
pub(crate) fn smaller<S: Simd>(a: f64x8<S>, b: f64x8<S>) -> f64x8<S> {
    a.simd_lt(b).select(a, b)
}

#[inline(always)]
pub(crate) fn select<S: Simd>(mask: mask64x8<S>, a: [f64x8<S>; 2], b: [f64x8<S>; 2]) -> [f64x8<S>; 2] {
    [mask.select(a[0], b[0]), mask.select(a[1], b[1])]
}
