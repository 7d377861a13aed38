//! A ray in the frame of the grid, clipped to where the surface can be.
//!
//! The walk goes from grid line to grid line along the horizontal axis in which the ray moves faster (the *major* axis);
//! between two lines lies a *column*, in which the ray moves at most one cell along the other (*minor*) axis.

use super::Ray;
use super::surface::Surface;

/// One horizontal axis of a walk: position `origin + step · t` in samples.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Axis {
    pub(crate) origin: f64,
    pub(crate) step: f64,
    /// `1 / step`; 0 if the ray does not move along this axis, whose lines it then never crosses.
    pub(crate) inverse: f64,
    /// Cells along the axis, at least 1.
    pub(crate) cells: usize,
    /// Distance in storage between neighbouring samples.
    pub(crate) stride: usize,
}

impl Axis {
    pub(crate) fn at(&self, t: f64) -> f64 {
        self.origin + self.step * t
    }

    /// The cell that holds a position; positions outside (by rounding) go to the cell at the edge.
    pub(crate) fn cell(&self, position: f64) -> usize {
        // Casting saturates, so a position below zero becomes cell 0.
        (position as usize).min(self.cells - 1)
    }

    /// When the ray crosses grid line `line`.
    pub(crate) fn time(&self, line: usize) -> f64 {
        (line as f64 - self.origin) * self.inverse
    }
}

/// A clipped ray.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Walk {
    pub(crate) major: Axis,
    pub(crate) minor: Axis,
    /// Whether the major axis is X.
    pub(crate) major_is_x: bool,
    /// Height in metres: `y + dy · t`.
    pub(crate) y: f64,
    pub(crate) dy: f64,
    /// The interval of `t` that is left.
    pub(crate) start: f64,
    pub(crate) end: f64,
    /// First and last column of the walk, in the order of travel.
    pub(crate) first: usize,
    pub(crate) last: usize,
    /// Distance from the surface in metres that is rounding at this ray's coordinates.
    pub(crate) rounding: f64,
}

/// Steps below this cannot be inverted; a ray that moves so little crosses no line.
const STILL: f64 = 1e-290;

impl Walk {
    /// Clips a ray to the rectangle and to the slab in which the surface lies; `None` if nothing is left, or if the
    /// ray is not a ray (no direction, or a value that is not finite).
    pub(crate) fn new(surface: &Surface, ray: &Ray, t_min: f64, t_max: f64) -> Option<Self> {
        let (cells_x, cells_z) = (surface.cells_x(), surface.cells_z());
        if cells_x == 0 || cells_z == 0 || !ray.origin.is_finite() || !ray.direction.is_finite() {
            return None;
        }
        let origin = surface.to_grid(ray.origin.x, ray.origin.z);
        let step = glam::DVec2::new(ray.direction.x, ray.direction.z) / surface.spacing();
        let (y, dy) = (ray.origin.y, ray.direction.y);
        let axis = |origin: f64, step: f64, cells: usize, stride: usize| {
            let still = step.abs() < STILL;
            Axis {
                origin,
                step: if still { 0.0 } else { step },
                inverse: if still { 0.0 } else { 1.0 / step },
                cells,
                stride,
            }
        };
        let x = axis(origin.x, step.x, cells_x, 1);
        let z = axis(origin.y, step.y, cells_z, surface.width());
        if x.step == 0.0 && z.step == 0.0 && dy.abs() < STILL {
            return None;
        }

        let reach = (x.origin.abs() + cells_x as f64) + (z.origin.abs() + cells_z as f64);
        let rounding = 4e-15 * (y.abs() + surface.high.abs() + surface.low.abs() + surface.steepest * reach);
        // A slab of zero thickness (flat water) would be missed by rounding alone; the walk must start and end clear
        // of the surface.
        let pad = 1e-6 * (surface.high - surface.low) + 64.0 * rounding;
        let (mut start, mut end) = (t_min, t_max);
        clip(x.origin, x.step, 0.0, cells_x as f64, &mut start, &mut end);
        clip(z.origin, z.step, 0.0, cells_z as f64, &mut start, &mut end);
        clip(y, dy, surface.low - pad, surface.high + pad, &mut start, &mut end);
        // Also refuses NaN, from limits or from an overflow of coordinates far beyond any scene.
        if !(start <= end && start.is_finite() && end.is_finite()) {
            return None;
        }
        let major_is_x = x.step.abs() >= z.step.abs();
        let (major, minor) = if major_is_x { (x, z) } else { (z, x) };
        Some(Self {
            major,
            minor,
            major_is_x,
            y,
            dy,
            start,
            end,
            first: major.cell(major.at(start)),
            last: major.cell(major.at(end)),
            rounding,
        })
    }

    pub(crate) fn height(&self, t: f64) -> f64 {
        self.y + self.dy * t
    }
}

/// Shortens `[start, end]` to where `origin + step · t` lies in `[low, high]`.
fn clip(origin: f64, step: f64, low: f64, high: f64, start: &mut f64, end: &mut f64) {
    if step.abs() < STILL {
        if !(origin >= low && origin <= high) {
            *end = f64::NEG_INFINITY;
        }
        return;
    }
    let (a, b) = ((low - origin) / step, (high - origin) / step);
    *start = start.max(a.min(b));
    *end = end.min(a.max(b));
}
