//! Rays in the frame of the grid, clipped to where the surface can be.
//!
//! A walk goes from grid line to grid line along the horizontal axis in which the ray moves faster (the *major* axis);
//! between two lines lies a *column*, in which the ray moves at most one cell along the other (*minor*) axis.

use super::Ray;
use super::column::Side;
use super::surface::Surface;

/// One horizontal axis of a walk: position `origin + step · t` in samples.
#[derive(Clone, Copy, Debug)]
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
    pub(crate) fn time(&self, line: u32) -> f64 {
        (f64::from(line) - self.origin) * self.inverse
    }
}

/// The cell among `cells` that holds a position; positions outside (by rounding) go to the cell at the edge.
#[inline(always)]
pub(crate) fn cell(position: f64, cells: u32) -> u32 {
    // Casting saturates, so a position below zero becomes cell 0.
    (position as u32).min(cells - 1)
}

/// A clipped ray.
#[derive(Clone, Copy, Debug)]
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
    #[inline(always)]
    pub(crate) fn new(surface: &Surface, ray: &Ray, t_min: f64, t_max: f64) -> Option<Self> {
        let mut walks = Walks::<1>::new();
        walks.clip(surface, &[*ray], t_min, t_max);
        walks.get(0)
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

/// Several walks, one array a quantity, so that loops over them become vector code.
#[derive(Clone, Debug)]
pub(crate) struct Walks<const N: usize> {
    pub(crate) major: Axes<N>,
    pub(crate) minor: Axes<N>,
    pub(crate) y: [f64; N],
    pub(crate) dy: [f64; N],
    pub(crate) start: [f64; N],
    pub(crate) end: [f64; N],
    rounding: [f64; N],
    pub(crate) first: [f64; N],
    pub(crate) last: [f64; N],
    valid: [bool; N],
    pub(crate) major_is_x: [bool; N],
    in_slab: [bool; N],
}

#[derive(Clone, Debug)]
pub(crate) struct Axes<const N: usize> {
    pub(crate) origin: [f64; N],
    pub(crate) step: [f64; N],
    pub(crate) inverse: [f64; N],
}

impl<const N: usize> Axes<N> {
    fn new() -> Self {
        Self {
            origin: [0.0; N],
            step: [0.0; N],
            inverse: [0.0; N],
        }
    }

    #[inline(always)]
    fn get(&self, k: usize) -> Axis {
        Axis {
            origin: self.origin[k],
            step: self.step[k],
            inverse: self.inverse[k],
        }
    }
}

/// Steps below this cannot be inverted: such a ray crosses no line.
const STILL: f64 = 1e-290;

impl<const N: usize> Walks<N> {
    pub(crate) fn new() -> Self {
        Self {
            major: Axes::new(),
            minor: Axes::new(),
            y: [0.0; N],
            dy: [0.0; N],
            start: [0.0; N],
            end: [0.0; N],
            rounding: [0.0; N],
            first: [0.0; N],
            last: [0.0; N],
            valid: [false; N],
            major_is_x: [false; N],
            in_slab: [false; N],
        }
    }

    #[inline(always)]
    pub(crate) fn get(&self, k: usize) -> Option<Walk> {
        self.valid[k].then(|| Walk {
            major: self.major.get(k),
            minor: self.minor.get(k),
            y: self.y[k],
            dy: self.dy[k],
            start: self.start[k],
            end: self.end[k],
            rounding: self.rounding[k],
            first: self.first[k] as u32,
            last: self.last[k] as u32,
            major_is_x: self.major_is_x[k],
            enters: match (self.in_slab[k], self.dy[k] < 0.0) {
                (true, _) => Side::On,
                (false, true) => Side::Above,
                (false, false) => Side::Below,
            },
        })
    }

    #[inline(always)]
    pub(crate) fn major_is_x(&self, k: usize) -> bool {
        self.major_is_x[k]
    }

    /// Clips rays as [`Walk::new`] does; there are as many walks as rays.
    #[inline(always)]
    pub(crate) fn clip(&mut self, surface: &Surface, rays: &[Ray], t_min: f64, t_max: f64) {
        let (cells_x, cells_z) = (f64::from(surface.cells_x()), f64::from(surface.cells_z()));
        // Also refuses NaN.
        let possible = cells_x > 0.0 && cells_z > 0.0 && t_min <= t_max;
        let scale = 1.0 / surface.spacing();
        let corner = surface.corner();
        // Until it is known which is the major axis, X is in its place.
        for (k, ray) in rays.iter().enumerate().take(N) {
            let (o, d) = (ray.origin, ray.direction);
            (self.major.origin[k], self.major.step[k]) = (o.x, d.x);
            (self.minor.origin[k], self.minor.step[k]) = (o.z, d.z);
            (self.y[k], self.dy[k]) = (o.y, d.y);
        }
        let size = surface.high.abs() + surface.low.abs();
        let slab_pad = 1e-6 * (surface.high - surface.low);
        let reach = cells_x + cells_z;
        for k in 0..N {
            let (ox, oz) = (
                (self.major.origin[k] - corner.x) * scale,
                (self.minor.origin[k] - corner.y) * scale,
            );
            let (x, xi) = step(self.major.step[k] * scale);
            let (z, zi) = step(self.minor.step[k] * scale);
            let (y, yi) = step(self.dy[k]);
            let oy = self.y[k];

            let rounding = 4e-15 * (oy.abs() + size + surface.steepest * (ox.abs() + oz.abs() + reach));
            // A slab of zero thickness (flat water) would be missed by rounding alone; the walk must start and end
            // clear of the surface.
            let pad = slab_pad + 64.0 * rounding;
            let (start_x, end_x) = within(ox, xi, 0.0, cells_x);
            let (start_z, end_z) = within(oz, zi, 0.0, cells_z);
            let (start_y, end_y) = within(oy, yi, surface.low - pad, surface.high + pad);
            let inside = larger(larger(t_min, start_x), start_z);
            let start = larger(inside, start_y);
            let end = smaller(smaller(smaller(t_max, end_x), end_z), end_y);

            // Zero times a sum is NaN if a term is not finite. A ray that moves along no axis is no ray.
            let sum = (ox + oz + oy) + (x + z + y);
            let moves = xi.abs() + zi.abs() + yi.abs() > 0.0;
            let bounded = start.abs() < f64::MAX && end.abs() < f64::MAX;
            self.valid[k] = possible & (sum * 0.0 == 0.0) & moves & (start <= end) & bounded;
            self.in_slab[k] = start_y <= inside;
            let major_is_x = x.abs() >= z.abs();
            self.major_is_x[k] = major_is_x;
            let pick = |a: f64, b: f64| if major_is_x { (a, b) } else { (b, a) };
            (self.major.origin[k], self.minor.origin[k]) = pick(ox, oz);
            (self.major.step[k], self.minor.step[k]) = pick(x, z);
            (self.major.inverse[k], self.minor.inverse[k]) = pick(xi, zi);
            (self.dy[k], self.start[k], self.end[k], self.rounding[k]) = (y, start, end, rounding);
            let (last, _) = pick(cells_x - 1.0, cells_z - 1.0);
            let column = |t: f64| {
                let p = self.major.origin[k] + self.major.step[k] * t;
                smaller(larger(p, 0.0), last)
            };
            (self.first[k], self.last[k]) = (column(start), column(end));
        }
    }
}

/// A step and its inverse; both are 0 where the step is too small.
#[inline(always)]
fn step(step: f64) -> (f64, f64) {
    let still = step.abs() < STILL;
    (
        if still { 0.0 } else { step },
        if still { 0.0 } else { 1.0 / step },
    )
}

/// From when to when a ray is between `low` and `high`.
#[inline(always)]
fn within(origin: f64, inverse: f64, low: f64, high: f64) -> (f64, f64) {
    let (a, b) = ((low - origin) * inverse, (high - origin) * inverse);
    let outside = (origin < low) | (origin > high);
    // A ray that does not move is between for ever or never.
    let never = if outside { f64::INFINITY } else { f64::NEG_INFINITY };
    let still = inverse == 0.0;
    (
        if still { never } else { smaller(a, b) },
        if still { f64::INFINITY } else { larger(a, b) },
    )
}

/// One instruction, where `f64::max` takes four to treat NaN.
#[inline(always)]
pub(crate) fn larger(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}

/// As [`larger`].
#[inline(always)]
pub(crate) fn smaller(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}
