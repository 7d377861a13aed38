//! The `f32` filter: which block columns, and then which columns, a ray can meet the surface in.
//!
//! Both tests look at eight places at once, in loops over arrays that become vector code. They may only err on the side of
//! keeping a column; comparisons are written so that NaN keeps it too.

use super::blocks::{BLOCK, PairBounds, WINDOW};
use super::walk::Walk;

/// A walk by grid line instead of by time: at line `k` its minor coordinate is `a + m k` and its height `p + q k`.
///
/// Heights are mirrored for a ray below the surface, so that the surface is always below the ray.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Strip {
    a: f64,
    m: f64,
    p: f64,
    q: f64,
    /// 1 above the surface, −1 below.
    mirror: f32,
}

/// Floors `x` of small magnitude, by rounding; a tie may go one too low, which callers allow for. Adding 1.5 · 2²³ leaves the
/// integer in the low bits; unlike a cast it is one vector instruction.
fn floor_bits(x: f32) -> i32 {
    const MAGIC: f32 = 12_582_912.0;
    ((x - 0.5 + MAGIC).to_bits() as i32).wrapping_sub(MAGIC.to_bits() as i32)
}

impl Strip {
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
    pub(crate) fn block_columns(&self, bounds: &PairBounds, window: usize) -> u32 {
        let line = (window * BLOCK) as f64;
        let z = (self.a + self.m * line) * (1.0 / BLOCK as f64);
        let row = z.floor();
        let (m, rise) = (self.m as f32, (self.q * BLOCK as f64) as f32);
        // Lowest minor coordinate and lowest height within the block column.
        let z = (z - row) as f32 + m.min(0.0);
        let y = (self.p + self.q * line) as f32 + rise.min(0.0);
        let row = row as i32;
        let last = bounds.rows as i32 - 1;
        let columns = bounds.columns as i32;
        let mut at = [0_i32; WINDOW];
        let mut height = [0.0_f32; WINDOW];
        for k in 0..WINDOW {
            let k32 = k as f32;
            let r = row.wrapping_add(floor_bits(z + m * k32)).max(0).min(last);
            at[k] = r.wrapping_mul(columns).wrapping_add((window + k) as i32);
            height[k] = y + rise * k32;
        }
        let ceiling = &bounds.ceiling[usize::from(self.mirror < 0.0)];
        let mut mask = 0;
        for k in 0..WINDOW {
            let bound = ceiling.get(at[k] as usize).copied().unwrap_or(f32::INFINITY);
            let passes_over = height[k] > bound;
            mask |= u32::from(!passes_over) << k;
        }
        mask
    }

    /// Bit `k` is set unless the ray certainly misses the surface in the column `8 block + k`.
    #[inline(always)]
    pub(crate) fn columns(&self, bounds: &PairBounds, heights: &[f32], walk: &Walk, block: usize) -> u32 {
        let line = block * BLOCK;
        let z = self.a + self.m * line as f64;
        let row = z.floor();
        let (m, q) = (self.m as f32, self.q as f32);
        let start = (z - row) as f32;
        let y = (self.p + self.q * line as f64) as f32;
        let row = row as i32;
        let last_row = walk.minor.cells as i32 - 1;
        let last_line = walk.major.cells;
        let (along, across) = (walk.major.stride as i32, walk.minor.stride as i32);

        // The block rows that the ray passes: the lower one stands for the pair.
        let lowest =
            (row.wrapping_add(floor_bits(start + (m * BLOCK as f32).min(0.0)))).max(0) as usize / BLOCK;
        let bulge = bounds
            .bulge
            .get(lowest.min(bounds.rows - 1) * bounds.columns + block)
            .copied();
        let bulge = bulge.unwrap_or(f32::INFINITY);

        let mut f = [0.0_f32; BLOCK + 1];
        let mut at = [0_i32; BLOCK + 1];
        let mut share = [0.0_f32; BLOCK + 1];
        for k in 0..=BLOCK {
            let z = start + m * k as f32;
            let r = row.wrapping_add(floor_bits(z)).max(0).min(last_row);
            share[k] = z - r.wrapping_sub(row) as f32;
            let l = (line + k).min(last_line) as i32;
            at[k] = r.wrapping_mul(across).wrapping_add(l.wrapping_mul(along));
        }
        for k in 0..=BLOCK {
            let near = heights.get(at[k] as usize).copied().unwrap_or(f32::NAN);
            let far = heights
                .get(at[k].wrapping_add(across) as usize)
                .copied()
                .unwrap_or(f32::NAN);
            f[k] = (y + q * k as f32) - self.mirror * (near + (far - near) * share[k]);
        }
        let mut mask = 0;
        for k in 0..BLOCK {
            let passes_over = f[k] > bulge && f[k + 1] > bulge;
            mask |= u32::from(!passes_over) << k;
        }
        mask
    }
}
