//! The `f32` filter: which block columns, and then which columns, a ray can meet the surface in.
//!
//! Both tests look at eight places at once, in the order of travel. They may only err on the side of keeping a place;
//! comparisons are written so that NaN keeps it too.

use super::blocks::{BLOCK, PairBounds};
use super::surface::Layout;
use super::walk::Walk;
use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x8, i32x8};

/// All of eight places.
pub(crate) const ALL: u32 = 0xff;

/// A walk by grid line instead of by time: at line `k` its minor coordinate is `a + m k` and its height `p + q k`.
///
/// Heights are mirrored for a ray below the surface, so that the surface is always below the ray.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Strip {
    a: f64,
    m: f64,
    p: f64,
    q: f64,
    below: bool,
    backward: bool,
}

impl Strip {
    #[inline(always)]
    pub(crate) fn new(walk: &Walk, below: bool) -> Self {
        let (major, minor) = (&walk.major, &walk.minor);
        let m = minor.step * major.inverse;
        let q = walk.dy * major.inverse;
        let p = walk.y - q * major.origin;
        let mirror = if below { -1.0 } else { 1.0 };
        Self {
            a: minor.origin - m * major.origin,
            m,
            // Lower by what may be lost to rounding when the ray comes from far away.
            p: mirror * p - 4.0 * walk.rounding,
            q: mirror * q,
            below,
            backward: !walk.forward(),
        }
    }

    /// The line at which the walk enters a block column.
    #[inline(always)]
    fn entry(&self, block: u32) -> f64 {
        f64::from((block + u32::from(self.backward)) * BLOCK as u32)
    }

    /// Changes of the minor coordinate and the height from one line to the next in the order of travel.
    #[inline(always)]
    fn steps(&self) -> (f64, f64) {
        if self.backward {
            (-self.m, -self.q)
        } else {
            (self.m, self.q)
        }
    }

    /// Bit `k` is set unless the ray certainly misses the surface in the `k`-th block column from `block` on. Those beyond the
    /// grid may be set or not.
    #[inline(always)]
    pub(crate) fn block_columns<S: Simd>(&self, simd: S, bounds: &PairBounds, block: u32) -> u32 {
        let (lanes, ordinals) = lanes(simd);
        let line = self.entry(block);
        let z = (self.a + self.m * line) * (1.0 / BLOCK as f64);
        let row = z.floor();
        let (m, q) = self.steps();
        let (m, rise) = (m as f32, (q * BLOCK as f64) as f32);
        // Lowest minor coordinate and lowest height within the block column.
        let z = lanes * m + ((z - row) as f32 + m.min(0.0));
        let height = lanes * rise + ((self.p + self.q * line) as f32 + rise.min(0.0));
        let rows = (z.floor().to_int::<i32x8<S>>() + row as i32)
            .max(0)
            .min(bounds.rows as i32 - 1);
        let toward = if self.backward { -1 } else { 1 };
        let at = rows * (bounds.stride as i32) + (ordinals * toward + bounds.place(block) as i32);
        let ceiling = bounds.ceiling[usize::from(self.below)].as_slice();
        let Some(bound) = gather(simd, ceiling, at.into()) else {
            return ALL;
        };
        !(height.simd_gt(bound).to_bitmask() as u32) & ALL
    }

    /// Bit `k` is set unless the ray certainly misses the surface in the `k`-th column of `block`, provided that it does not
    /// meet it before the block. Columns beyond the grid may be set or not.
    #[inline(always)]
    pub(crate) fn columns<S: Simd>(
        &self,
        simd: S,
        bounds: &PairBounds,
        layout: &Layout<'_>,
        block: u32,
    ) -> u32 {
        let (lanes, _) = lanes(simd);
        let line = self.entry(block);
        let z = self.a + self.m * line;
        let row = z.floor();
        let (m, q) = self.steps();
        let (m, q) = (m as f32, q as f32);
        let start = (z - row) as f32;
        let row = row as i32;

        // The block rows that the ray passes: the lower one stands for the pair.
        let lowest = row
            .wrapping_add((start + m.min(0.0) * BLOCK as f32).floor() as i32)
            .max(0) as u32
            / BLOCK as u32;
        let bulge = bounds
            .bulge
            .get((lowest.min(bounds.rows - 1) * bounds.stride + bounds.place(block)) as usize);
        let bulge = bulge.copied().unwrap_or(f32::INFINITY);

        // The lines at which the walk leaves the columns, and the samples on either side of it.
        let along: i32x8<S> = layout.along.ahead[usize::from(self.backward)].simd_into(simd);
        let lines = along + layout.along.place(block * BLOCK as u32) as i32;
        let z = lanes * m + (start + m);
        let rows = (z.floor().to_int::<i32x8<S>>() + row)
            .max(0)
            .min(layout.minor_cells as i32 - 1);
        let share = z - (rows - row).to_float::<f32x8<S>>();
        let (fine, coarse) = (layout.across.fine as i32, layout.across.coarse as i32);
        let next = rows + 1;
        let near = (rows >> 2) * coarse + (rows & 3) * fine + lines;
        let far = (next >> 2) * coarse + (next & 3) * fine + lines;
        let (Some(near), Some(far)) = (
            gather(simd, layout.samples, near.into()),
            gather(simd, layout.samples, far.into()),
        ) else {
            return ALL;
        };
        let y = lanes * q + ((self.p + self.q * line) as f32 + q);
        let height = near + (far - near) * share;
        let f = if self.below { y + height } else { y - height };

        // Clear of the surface at both lines, by more than it can bulge between them. At the first line the ray is known to
        // be above the surface, by however little: there, four times the bulge at the second line is enough.
        let clear = f.simd_gt(bulge).to_bitmask() as u32;
        let clear_of_first = f.simd_gt(4.0 * bulge).to_bitmask() as u32 & 1;
        !(clear & (clear << 1 | clear_of_first)) & ALL
    }
}

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
pub(crate) fn gather<S: Simd>(simd: S, values: &[f32], at: [i32; 8]) -> Option<f32x8<S>> {
    let mut out = [0.0_f32; 8];
    for (out, at) in out.iter_mut().zip(at) {
        *out = *values.get(at as usize)?;
    }
    Some(out.simd_into(simd))
}
