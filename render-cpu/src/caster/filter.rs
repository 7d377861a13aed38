//! The `f32` filter: which block columns, and then which columns, a ray can meet the surface in.
//!
//! Both tests look at eight places at once, in loops over arrays that become vector code. They may only err on the side of
//! keeping a column; comparisons are written so that NaN keeps it too.

use super::blocks::{BLOCK, PairBounds};
use super::surface::Layout;
use super::walk::Walk;
use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x8, i32x8};

/// A walk by grid line instead of by time: at line `k` its minor coordinate is `a + m k` and its height `p + q k`.
///
/// Heights are mirrored for a ray below the surface, so that the surface is always below the ray.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Strip {
    a: f64,
    m: f64,
    p: f64,
    q: f64,
    /// 1 above the surface, −1 below.
    mirror: f32,
}

/// Bits of the places from `a` to `b`, in either order, that lie in the eight from `base` on.
#[inline(always)]
pub(crate) fn between(a: usize, b: usize, base: usize) -> u32 {
    let (low, high) = (a.min(b).max(base), a.max(b).min(base + 7));
    if low > high {
        return 0;
    }
    (0xff >> (7 - (high - base))) & (0xff << (low - base))
}

/// Takes the next bit in the order of travel out of a mask that is not zero.
#[inline(always)]
pub(crate) fn next(mask: &mut u32, forward: bool) -> usize {
    let k = if forward {
        mask.trailing_zeros()
    } else {
        31 - mask.leading_zeros()
    };
    *mask ^= 1 << k;
    k as usize
}

impl Strip {
    #[inline(always)]
    pub(crate) fn new(walk: &Walk, below: bool) -> Self {
        let (major, minor) = (&walk.major, &walk.minor);
        let m = minor.step * major.inverse;
        let q = walk.dy * major.inverse;
        let mirror = if below { -1.0 } else { 1.0 };
        Self {
            a: minor.origin - m * major.origin,
            m,
            // Lower by what may be lost to rounding when the ray comes from far away.
            p: mirror * (walk.y - q * major.origin) - 4.0 * walk.rounding,
            q: mirror * q,
            mirror: mirror as f32,
        }
    }

    /// Bit `k` is set unless the ray certainly misses the surface in block column `window + k`.
    #[inline(always)]
    pub(crate) fn block_columns<S: Simd>(&self, simd: S, bounds: &PairBounds, window: usize) -> u32 {
        let (lanes, ordinals) = lanes(simd);
        let line = (window * BLOCK) as f64;
        let z = (self.a + self.m * line) * (1.0 / BLOCK as f64);
        let row = z.floor();
        let (m, rise) = (self.m as f32, (self.q * BLOCK as f64) as f32);
        // Lowest minor coordinate and lowest height within the block column.
        let z = lanes * m + ((z - row) as f32 + m.min(0.0));
        let height = lanes * rise + ((self.p + self.q * line) as f32 + rise.min(0.0));
        let rows = (z.floor().to_int::<i32x8<S>>() + row as i32)
            .max(0)
            .min(bounds.rows as i32 - 1);
        let at = rows * (bounds.columns as i32) + (ordinals + window as i32);
        let ceiling = bounds.ceiling[usize::from(self.mirror < 0.0)].as_slice();
        let Some(bound) = gather(simd, ceiling, at.into()) else {
            return ALL;
        };
        !(height.simd_gt(bound).to_bitmask() as u32) & ALL
    }

    /// Bit `k` is set unless the ray certainly misses the surface in the column `8 block + k`.
    #[inline(always)]
    pub(crate) fn columns<S: Simd>(
        &self,
        simd: S,
        bounds: &PairBounds,
        layout: &Layout<'_>,
        block: usize,
    ) -> u32 {
        let (lanes, ordinals) = lanes(simd);
        let line = block * BLOCK;
        let z = self.a + self.m * line as f64;
        let row = z.floor();
        let (m, q) = (self.m as f32, self.q as f32);
        let start = (z - row) as f32;
        let y = (self.p + self.q * line as f64) as f32;
        let row = row as i32;
        let last_row = layout.minor_cells as i32 - 1;
        let (along, across) = (layout.along, layout.across);

        // The block rows that the ray passes: the lower one stands for the pair.
        let lowest = row
            .wrapping_add((start + m.min(0.0) * BLOCK as f32).floor() as i32)
            .max(0) as usize
            / BLOCK;
        let bulge = bounds
            .bulge
            .get(lowest.min(bounds.rows - 1) * bounds.columns + block)
            .copied();
        let bulge = bulge.unwrap_or(f32::INFINITY);

        // Eight lines at once, and the ninth by itself.
        let z = lanes * m + start;
        let rows = (z.floor().to_int::<i32x8<S>>() + row).max(0).min(last_row);
        let share = z - (rows - row).to_float::<f32x8<S>>();
        let first = along.place(line) as i32;
        // A block's lines stand in two tiles.
        let lines = (ordinals & 3) * along.fine + (ordinals >> 2) * along.coarse + first;
        let at = (rows >> 2) * across.coarse + (rows & 3) * across.fine + lines;
        let next = rows + 1;
        let at_next = (next >> 2) * across.coarse + (next & 3) * across.fine + lines;
        let (Some(a), Some(b)) = (
            gather(simd, layout.samples, at.into()),
            gather(simd, layout.samples, at_next.into()),
        ) else {
            return ALL;
        };
        let f = (lanes * q + y) - (a + (b - a) * share) * self.mirror;
        let above = f.simd_gt(bulge).to_bitmask() as u32;

        let z = start + m * BLOCK as f32;
        let r = row.wrapping_add(z.floor() as i32).max(0).min(last_row);
        let share = z - r.wrapping_sub(row) as f32;
        let ninth = (first + 2 * along.coarse) as usize;
        let r = r as usize;
        let (a, b) = (
            layout.samples.get(ninth + across.place(r)),
            layout.samples.get(ninth + across.place(r + 1)),
        );
        let (Some(&a), Some(&b)) = (a, b) else {
            return ALL;
        };
        let f = (y + q * BLOCK as f32) - self.mirror * (a + (b - a) * share);
        let above = above | u32::from(f > bulge) << BLOCK;
        !(above & (above >> 1)) & ALL
    }
}

/// All of eight places.
const ALL: u32 = 0xff;

#[inline(always)]
fn lanes<S: Simd>(simd: S) -> (f32x8<S>, i32x8<S>) {
    let floats = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0_f32];
    (
        floats.simd_into(simd),
        [0, 1, 2, 3, 4, 5, 6, 7_i32].simd_into(simd),
    )
}

/// Eight values; `None` if a place is outside, which callers rule out.
#[inline(always)]
fn gather<S: Simd>(simd: S, values: &[f32], at: [i32; 8]) -> Option<f32x8<S>> {
    let mut out = [0.0_f32; 8];
    for (out, at) in out.iter_mut().zip(at) {
        *out = *values.get(at as usize)?;
    }
    Some(out.simd_into(simd))
}
