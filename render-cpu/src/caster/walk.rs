//! A ray in the frame of the grid, clipped to where the surface can be.
//!
//! The walk goes from grid line to grid line along the horizontal axis in which the ray moves faster (the *major* axis);
//! between two lines lies a *column*, in which the ray moves at most one cell along the other (*minor*) axis.

use super::Ray;
use super::column::Side;
use super::surface::Surface;

/// One horizontal axis of a walk: position `origin + step · t` in samples.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Axis {
    pub(crate) origin: f64,
    pub(crate) step: f64,
    /// `1 / step`; 0 if the ray does not move along this axis, whose lines it then never crosses.
    pub(crate) inverse: f64,
}

impl Axis {
    #[inline(always)]
    pub(crate) fn at(&self, t: f64) -> f64 {
        self.origin + self.step * t
    }

    /// When the ray crosses grid line `line`.
    #[inline(always)]
    pub(crate) fn time(&self, line: usize) -> f64 {
        (line as f64 - self.origin) * self.inverse
    }
}

/// The cell among `cells` that holds a position; positions outside (by rounding) go to the cell at the edge.
#[inline(always)]
pub(crate) fn cell(position: f64, cells: usize) -> usize {
    // Casting saturates, so a position below zero becomes cell 0.
    (position as u32 as usize).min(cells - 1)
}

/// A clipped ray.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Walk {
    pub(crate) major: Axis,
    pub(crate) minor: Axis,
    /// Height in metres: `y + dy · t`.
    pub(crate) y: f64,
    pub(crate) dy: f64,
    /// The interval of `t` that is left.
    pub(crate) start: f64,
    pub(crate) end: f64,
    /// Distance from the surface in metres that is rounding at this ray's coordinates.
    pub(crate) rounding: f64,
    /// First and last column of the walk, in the order of travel.
    pub(crate) first: u32,
    pub(crate) last: u32,
    /// Whether the major axis is X.
    pub(crate) major_is_x: bool,
    /// The side from which the walk enters the slab that holds the surface; `On` where it starts within.
    pub(crate) enters: Side,
}

impl Walk {
    /// Clips a ray to the rectangle and to the slab in which the surface lies; `None` if nothing is left, or if the
    /// ray is not a ray (no direction, or a value that is not finite).
    pub(crate) fn new(surface: &Surface, ray: &Ray, t_min: f64, t_max: f64) -> Option<Self> {
        let mut walk = [Self::default()];
        let valid = Self::clip(surface, &[*ray], t_min, t_max, &mut walk);
        let [walk] = walk;
        (valid != 0).then_some(walk)
    }

    /// As [`Self::new`] for several rays, in loops that become vector code; bit `k` says whether `walks[k]` is one.
    #[inline(always)]
    pub(crate) fn clip<const N: usize>(
        surface: &Surface,
        rays: &[Ray; N],
        t_min: f64,
        t_max: f64,
        walks: &mut [Self; N],
    ) -> u32 {
        let (cells_x, cells_z) = (surface.cells_x(), surface.cells_z());
        // The comparison also refuses NaN.
        if cells_x == 0 || cells_z == 0 || !(t_min <= t_max) {
            return 0;
        }
        let scale = 1.0 / surface.spacing();
        let corner = surface.corner();
        let mut x = Still::<N>::default();
        let mut z = Still::<N>::default();
        let mut y = Still::<N>::default();
        for k in 0..N {
            let (o, d) = (rays[k].origin, rays[k].direction);
            (x.origin[k], x.step[k]) = ((o.x - corner.x) * scale, d.x * scale);
            (z.origin[k], z.step[k]) = ((o.z - corner.y) * scale, d.z * scale);
            (y.origin[k], y.step[k]) = (o.y, d.y);
        }
        x.invert();
        z.invert();
        y.invert();

        let size = surface.high.abs() + surface.low.abs();
        let reach = (cells_x + cells_z) as f64;
        let mut rounding = [0.0; N];
        let (mut low, mut high) = ([0.0; N], [0.0; N]);
        for k in 0..N {
            let far = x.origin[k].abs() + z.origin[k].abs() + reach;
            rounding[k] = 4e-15 * (y.origin[k].abs() + size + surface.steepest * far);
            // A slab of zero thickness (flat water) would be missed by rounding alone; the walk must start and end
            // clear of the surface.
            let pad = 1e-6 * (surface.high - surface.low) + 64.0 * rounding[k];
            (low[k], high[k]) = (surface.low - pad, surface.high + pad);
        }
        let (start_x, end_x) = x.within(&[0.0; N], &[cells_x as f64; N]);
        let (start_z, end_z) = z.within(&[0.0; N], &[cells_z as f64; N]);
        let (start_y, end_y) = y.within(&low, &high);

        let (mut start, mut end) = ([0.0; N], [0.0; N]);
        let mut valid = [false; N];
        for k in 0..N {
            start[k] = larger(larger(t_min, start_x[k]), start_z[k]);
            end[k] = smaller(smaller(smaller(t_max, end_x[k]), end_z[k]), end_y[k]);
            let first = larger(start[k], start_y[k]);
            // Zero times a sum is NaN if a term is not finite. A ray that moves along no axis is no ray.
            let sum = (x.origin[k] + z.origin[k] + y.origin[k]) + (x.step[k] + z.step[k] + y.step[k]);
            let moves = x.inverse[k] != 0.0 || z.inverse[k] != 0.0 || y.inverse[k] != 0.0;
            valid[k] = sum * 0.0 == 0.0
                && moves
                && first <= end[k]
                && first.abs() < f64::MAX
                && end[k].abs() < f64::MAX;
        }
        let mut mask = 0;
        for k in 0..N {
            if !valid[k] {
                continue;
            }
            mask |= 1 << k;
            let axis = |a: &Still<N>| Axis {
                origin: a.origin[k],
                step: a.step[k],
                inverse: a.inverse[k],
            };
            let major_is_x = x.step[k].abs() >= z.step[k].abs();
            let (major, minor) = if major_is_x {
                (axis(&x), axis(&z))
            } else {
                (axis(&z), axis(&x))
            };
            let cells = if major_is_x { cells_x } else { cells_z };
            let enters = if start_y[k] <= start[k] {
                Side::On
            } else if y.step[k] < 0.0 {
                Side::Above
            } else {
                Side::Below
            };
            let start = larger(start[k], start_y[k]);
            walks[k] = Self {
                major,
                minor,
                y: y.origin[k],
                dy: y.step[k],
                start,
                end: end[k],
                rounding: rounding[k],
                first: cell(major.at(start), cells) as u32,
                last: cell(major.at(end[k]), cells) as u32,
                major_is_x,
                enters,
            };
        }
        mask
    }

    /// Whether columns are walked in increasing order.
    #[inline(always)]
    pub(crate) fn forward(&self) -> bool {
        self.major.step >= 0.0
    }

    #[inline(always)]
    pub(crate) fn height(&self, t: f64) -> f64 {
        self.y + self.dy * t
    }
}

/// One axis of several rays.
struct Still<const N: usize> {
    origin: [f64; N],
    step: [f64; N],
    inverse: [f64; N],
}

impl<const N: usize> Default for Still<N> {
    fn default() -> Self {
        Self {
            origin: [0.0; N],
            step: [0.0; N],
            inverse: [0.0; N],
        }
    }
}

impl<const N: usize> Still<N> {
    /// Finds the inverse steps. Steps too small to be inverted become 0: such a ray crosses no line.
    #[inline(always)]
    fn invert(&mut self) {
        const LEAST: f64 = 1e-290;
        for k in 0..N {
            let step = self.step[k];
            let still = step.abs() < LEAST;
            self.inverse[k] = if still { 0.0 } else { 1.0 / step };
            self.step[k] = if still { 0.0 } else { step };
        }
    }

    /// From when to when the rays are between `low` and `high`.
    #[inline(always)]
    fn within(&self, low: &[f64; N], high: &[f64; N]) -> ([f64; N], [f64; N]) {
        let (mut start, mut end) = ([0.0; N], [0.0; N]);
        for k in 0..N {
            let (a, b) = (
                (low[k] - self.origin[k]) * self.inverse[k],
                (high[k] - self.origin[k]) * self.inverse[k],
            );
            let outside = self.origin[k] < low[k] || self.origin[k] > high[k];
            let still = self.inverse[k] == 0.0;
            // A ray that does not move is between for ever or never.
            let never = if outside { f64::INFINITY } else { f64::NEG_INFINITY };
            start[k] = if still { never } else { smaller(a, b) };
            end[k] = if still { f64::INFINITY } else { larger(a, b) };
        }
        (start, end)
    }
}

/// One instruction, where `f64::max` takes four to treat NaN.
#[inline(always)]
fn larger(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}

#[inline(always)]
fn smaller(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}
