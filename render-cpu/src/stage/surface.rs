//! A heightfield that continues beyond its grid: the water surface and the ground.
//!
//! A grid ends, the world does not. Along a periodic axis the surface repeats. Elsewhere it is continued by an apron
//! in which its mirror image fades into a level plane, and by that plane to the horizon. The apron is mirrored rather
//! than clamped so that waves and hills go on as waves and hills; it meets the plane at exactly the same height, so
//! that no ray can pass between them.

use crate::caster::{Heightfield, HeightfieldError, Ray};
use glam::{DVec2, DVec3, UVec2, Vec2, dvec2, dvec3};
use meniscus_sim::stage::continuation::{Continuation, catmull_rom, continued, neighbour, slopes_of};
use meniscus_sim::{Grid, GridSpec};

/// Tiles of a periodic surface that one ray is followed through; beyond them the surface is its mean plane with the
/// slopes of the tile on it.
const MAX_TILES: u32 = 96;

/// Where a ray meets a [`Surface`].
#[derive(Clone, Copy, Debug)]
pub(crate) struct SurfaceHit {
    /// Ray parameter: metres for unit directions.
    pub(crate) t: f64,
    pub(crate) position: DVec3,
    /// Upward unit normal of what was hit.
    pub(crate) normal: DVec3,
}

/// A heightfield with its continuation and smooth slopes.
#[derive(Clone, Debug)]
pub(crate) struct Surface {
    field: Heightfield,
    heights: Grid<f32>,
    slopes: Grid<Vec2>,
    low: DVec2,
    high: DVec2,
    period: DVec2,
    range: (f64, f64),
    how: Continuation,
}

impl Surface {
    pub(crate) fn build(source: &Grid<f32>, how: Continuation) -> Result<Self, HeightfieldError> {
        let heights = continued(source, &how, None);
        let slopes = slopes_of(&heights, how.periodic, None);
        let mut surface = Self {
            field: Heightfield::build(&heights)?,
            heights,
            slopes,
            low: DVec2::ZERO,
            high: DVec2::ZERO,
            period: DVec2::ZERO,
            range: (0.0, 0.0),
            how,
        };
        surface.measure(source.spec());
        Ok(surface)
    }

    /// The same for new heights, reusing what is allocated.
    pub(crate) fn rebuild(&mut self, source: &Grid<f32>, how: Continuation) -> Result<(), HeightfieldError> {
        let old = std::mem::replace(&mut self.heights, Grid::filled(UNIT, 0.0));
        self.heights = continued(source, &how, Some(old));
        let old = std::mem::replace(&mut self.slopes, Grid::filled(UNIT, Vec2::ZERO));
        self.slopes = slopes_of(&self.heights, how.periodic, Some(old));
        self.field.rebuild(&self.heights)?;
        self.how = how;
        self.measure(source.spec());
        Ok(())
    }

    fn measure(&mut self, source: &GridSpec) {
        let spec = self.heights.spec();
        self.low = spec.origin.as_dvec2();
        self.high = self.low + f64::from(spec.spacing) * (spec.size.as_dvec2() - 1.0);
        self.period = f64::from(source.spacing) * source.size.as_dvec2();
        let (low, high) = self.heights.range();
        self.range = (f64::from(low), f64::from(high));
    }

    pub(crate) fn spacing(&self) -> f64 {
        f64::from(self.heights.spec().spacing)
    }

    /// Whether the point lies on the grid or its apron (always, along a periodic axis).
    fn covers(&self, p: DVec2) -> bool {
        (self.how.periodic.x || (p.x >= self.low.x && p.x <= self.high.x))
            && (self.how.periodic.y || (p.y >= self.low.y && p.y <= self.high.y))
    }

    /// The same point in the tile that is stored.
    fn wrapped(&self, mut p: DVec2) -> DVec2 {
        if self.how.periodic.x {
            p.x = self.low.x + (p.x - self.low.x).rem_euclid(self.period.x);
        }
        if self.how.periodic.y {
            p.y = self.low.y + (p.y - self.low.y).rem_euclid(self.period.y);
        }
        p
    }

    /// Height anywhere.
    pub(crate) fn height(&self, p: DVec2) -> f64 {
        if !self.covers(p) {
            return f64::from(self.how.level);
        }
        let spec = self.heights.spec();
        let g = (self.wrapped(p) - self.low) / f64::from(spec.spacing);
        let max = spec.size.as_dvec2() - 1.0;
        let g = g.clamp(DVec2::ZERO, max);
        let i = (g.x as usize).min(spec.width().saturating_sub(2));
        let j = (g.y as usize).min(spec.height().saturating_sub(2));
        let f = g - dvec2(i as f64, j as f64);
        let at = |i: usize, j: usize| f64::from(self.heights[(i, j)]);
        let low = at(i, j) * (1.0 - f.x) + at(i + 1, j) * f.x;
        let high = at(i, j + 1) * (1.0 - f.x) + at(i + 1, j + 1) * f.x;
        low * (1.0 - f.y) + high * f.y
    }

    /// Slope (∂y/∂x, ∂y/∂z) of the smooth surface: fourth-order differences at the samples, interpolated by
    /// Catmull–Rom splines, hence continuous with its first derivative. Also the largest change of slope a metre.
    pub(crate) fn slope(&self, p: DVec2) -> (Vec2, f32) {
        if !self.covers(p) {
            return (Vec2::ZERO, 0.0);
        }
        let spec = self.heights.spec();
        let g = (self.wrapped(p) - self.low) / f64::from(spec.spacing);
        let (i, j) = (g.x.floor(), g.y.floor());
        let f = (g - dvec2(i, j)).as_vec2();
        let (i, j) = (i as isize, j as isize);
        let (wx, wz) = (catmull_rom(f.x), catmull_rom(f.y));
        let (w, h) = (spec.width(), spec.height());
        let (px, pz) = (self.how.periodic.x, self.how.periodic.y);
        let data = self.slopes.as_slice();
        let mut slope = Vec2::ZERO;
        let (mut low, mut high) = (Vec2::INFINITY, Vec2::NEG_INFINITY);
        for (b, wz) in wz.into_iter().enumerate() {
            let row = neighbour(j + b as isize - 1, h, pz) * w;
            for (a, wx) in wx.into_iter().enumerate() {
                let s = data[row + neighbour(i + a as isize - 1, w, px)];
                slope += s * (wx * wz);
                if (a == 1 || a == 2) && (b == 1 || b == 2) {
                    low = low.min(s);
                    high = high.max(s);
                }
            }
        }
        (slope, (high - low).max_element() / spec.spacing)
    }

    /// Lowest and highest sample, metres.
    pub(crate) fn range(&self) -> (f64, f64) {
        self.range
    }

    /// Bound of |slope| over the whole surface: splines overshoot their samples by less than a quarter.
    pub(crate) fn steepest(&self) -> f32 {
        let steepest = self.slopes.as_slice().iter().map(|s| s.length_squared());
        1.25 * steepest.fold(0.0, f32::max).sqrt()
    }

    /// Slope (∂y/∂x, ∂y/∂z) of the very surface that rays meet: of its bilinear patch, 0 beyond the grid.
    pub(crate) fn facet_slope(&self, p: DVec2) -> DVec2 {
        if !self.covers(p) {
            return DVec2::ZERO;
        }
        let spec = self.heights.spec();
        let spacing = f64::from(spec.spacing);
        let g = ((self.wrapped(p) - self.low) / spacing).clamp(DVec2::ZERO, spec.size.as_dvec2() - 1.0);
        let i = (g.x as usize).min(spec.width().saturating_sub(2));
        let j = (g.y as usize).min(spec.height().saturating_sub(2));
        let f = g - dvec2(i as f64, j as f64);
        let at = |i: usize, j: usize| f64::from(self.heights[(i, j)]);
        let (a, b, c, d) = (at(i, j), at(i + 1, j), at(i, j + 1), at(i + 1, j + 1));
        dvec2(
            (b - a) * (1.0 - f.y) + (d - c) * f.y,
            (c - a) * (1.0 - f.x) + (d - b) * f.x,
        ) / spacing
    }

    /// First meeting of the ray with the surface, from either side, with `t` in `[0, t_max]`.
    pub(crate) fn cast(&self, ray: &Ray, t_max: f64) -> Option<SurfaceHit> {
        let near = if self.how.periodic.any() {
            self.cast_tiles(ray, t_max)
        } else {
            self.cast_grid(ray, DVec3::ZERO, 0.0, t_max)
        };
        if near.is_some() || self.how.periodic.all() {
            return near;
        }
        self.cast_plane(ray, t_max)
    }

    fn cast_grid(&self, ray: &Ray, shift: DVec3, t_min: f64, t_max: f64) -> Option<SurfaceHit> {
        let shifted = Ray {
            origin: ray.origin - shift,
            direction: ray.direction,
        };
        let hit = self.field.cast(&shifted, t_min, t_max)?;
        Some(SurfaceHit {
            t: hit.t,
            position: hit.position + shift,
            normal: hit.normal,
        })
    }

    /// The level plane outside grid and apron. It overlaps the apron's last row by a hair, where both are level.
    fn cast_plane(&self, ray: &Ray, t_max: f64) -> Option<SurfaceHit> {
        let t = (f64::from(self.how.level) - ray.origin.y) / ray.direction.y;
        if !(t >= 0.0 && t <= t_max) {
            return None;
        }
        let position = ray.origin + t * ray.direction;
        let hair = 1e-9 * (self.high - self.low);
        let inside = |p: f64, lo: f64, hi: f64, hair: f64, periodic: bool| {
            periodic || (p > lo + hair && p < hi - hair)
        };
        let (lo, hi, per) = (self.low, self.high, self.how.periodic);
        if inside(position.x, lo.x, hi.x, hair.x, per.x) && inside(position.z, lo.y, hi.y, hair.y, per.y) {
            return None;
        }
        let level = f64::from(self.how.level);
        Some(SurfaceHit {
            t,
            position: dvec3(position.x, level, position.z),
            normal: DVec3::Y,
        })
    }

    /// Follows the ray through the repetitions of the grid while it is between the lowest and the highest point.
    fn cast_tiles(&self, ray: &Ray, t_max: f64) -> Option<SurfaceHit> {
        let (mut t, mut end) = (0.0_f64, t_max);
        let d = ray.direction;
        if d.y == 0.0 {
            if ray.origin.y < self.range.0 || ray.origin.y > self.range.1 {
                return None;
            }
        } else {
            let (a, b) = (
                (self.range.0 - ray.origin.y) / d.y,
                (self.range.1 - ray.origin.y) / d.y,
            );
            t = t.max(a.min(b));
            end = end.min(a.max(b));
        }
        for axis in [0, 2] {
            let k = axis / 2;
            if !self.how.periodic.test(k) && d[axis] != 0.0 {
                let (a, b) = (
                    (self.low[k] - ray.origin[axis]) / d[axis],
                    (self.high[k] - ray.origin[axis]) / d[axis],
                );
                t = t.max(a.min(b));
                end = end.min(a.max(b));
            }
        }
        if !(t <= end) {
            return None;
        }
        // A hair of the slab is given away on both sides, so that a ray along its border is not lost to rounding.
        let hair = 1e-9 * (self.period.max_element() + t.abs());
        (t, end) = ((t - hair).max(0.0), (end + hair).min(t_max));
        let tile = |t: f64, axis: usize, k: usize| -> f64 {
            if !self.how.periodic.test(k) {
                return 0.0;
            }
            ((ray.origin[axis] + t * d[axis] - self.low[k]) / self.period[k]).floor()
        };
        let (mut tx, mut tz) = (tile(t, 0, 0), tile(t, 2, 1));
        let leave = |n: f64, axis: usize, k: usize| -> f64 {
            if !self.how.periodic.test(k) || d[axis] == 0.0 {
                return f64::INFINITY;
            }
            let border = if d[axis] > 0.0 { n + 1.0 } else { n };
            (self.low[k] + border * self.period[k] - ray.origin[axis]) / d[axis]
        };
        for _ in 0..MAX_TILES {
            let (lx, lz) = (leave(tx, 0, 0), leave(tz, 2, 1));
            let next = lx.min(lz).min(end);
            let shift = dvec3(tx * self.period.x, 0.0, tz * self.period.y);
            if let Some(hit) = self.cast_grid(ray, shift, t, next + hair) {
                return Some(hit);
            }
            if next >= end {
                return None;
            }
            if lx <= lz {
                tx += d.x.signum();
            } else {
                tz += d.z.signum();
            }
            t = next.max(t);
        }
        // So far away and so flat: the mean plane.
        let s = (f64::from(self.how.level) - ray.origin.y) / d.y;
        let s = if s.is_finite() { s.clamp(t, end) } else { end };
        s.is_finite().then(|| SurfaceHit {
            t: s,
            position: ray.origin + s * d,
            normal: DVec3::Y,
        })
    }
}

const UNIT: GridSpec = GridSpec {
    origin: Vec2::ZERO,
    spacing: 1.0,
    size: UVec2::ONE,
};

/// Bytes of a surface of that many samples: heights twice (once in the caster), slopes, block bounds.
pub(crate) fn bytes_for(samples: u64) -> u64 {
    samples * (4 + 4 + 8) + samples / 64 * 12
}
