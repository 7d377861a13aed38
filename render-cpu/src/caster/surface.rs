//! The surface between the samples of a grid: what every caster agrees on.

use super::samples::{Samples, Stride};
use glam::{DVec2, DVec3};
use meniscus_sim::Grid;
use meniscus_sim::grid::{GridError, GridSpec};

/// What spans the four samples of a cell.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Patch {
    /// One bilinear patch (a hyperbolic paraboloid through the four samples).
    #[default]
    Bilinear,
    /// Two triangles that share the diagonal from sample `(i, j)` to `(i + 1, j + 1)`.
    Triangles,
}

/// Why a heightfield cannot be built.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum HeightfieldError {
    /// A sample is NaN or infinite.
    #[error(
        "elevation {value} at sample ({i}, {j}) is not finite; a heightfield needs a number at every sample"
    )]
    NonFinite {
        /// Index along X.
        i: usize,
        /// Index along Z.
        j: usize,
        /// The value found.
        value: f32,
    },
    /// The grid specification is impossible.
    #[error("heightfield: {0}")]
    Grid(#[from] GridError),
}

/// Samples with their place and extremes, in units of samples horizontally and metres vertically.
#[derive(Clone, Debug)]
pub(crate) struct Surface {
    samples: Samples,
    width: u32,
    depth: u32,
    origin: DVec2,
    spacing: f64,
    pub(crate) patch: Patch,
    pub(crate) low: f64,
    pub(crate) high: f64,
    /// Largest difference in metres between samples that are neighbours along a grid line.
    pub(crate) steepest: f64,
}

/// Samples addressed by their place along the major and the minor axis of a walk.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Layout<'a> {
    pub(crate) samples: &'a [f32],
    pub(crate) patch: Patch,
    pub(crate) minor_cells: u32,
    pub(crate) along: &'a Stride,
    pub(crate) across: &'a Stride,
}

impl Layout<'_> {
    #[inline(always)]
    pub(crate) fn sample(&self, major: u32, minor: u32) -> f64 {
        self.at(self.along.place(major) + self.across.place(minor))
    }

    /// The sample at a place in storage.
    #[inline(always)]
    pub(crate) fn at(&self, place: u32) -> f64 {
        // Callers stay within the grid; the fallback only spares the panic.
        f64::from(self.samples.get(place as usize).copied().unwrap_or(0.0))
    }
}

impl Surface {
    /// A surface without cells, which no ray hits.
    pub(crate) fn empty(patch: Patch) -> Self {
        Self {
            samples: Samples::default(),
            width: 0,
            depth: 0,
            origin: DVec2::ZERO,
            spacing: 1.0,
            patch,
            low: 0.0,
            high: 0.0,
            steepest: 0.0,
        }
    }

    /// Takes other samples. The extremes are left to the caller, who reads the samples anyway.
    pub(crate) fn copy_from(&mut self, elevation: &Grid<f32>) -> Result<(), HeightfieldError> {
        let spec: &GridSpec = elevation.spec();
        self.width = 0;
        self.depth = 0;
        spec.validate()?;
        self.samples.copy_from(elevation);
        self.width = spec.size.x;
        self.depth = spec.size.y;
        self.origin = spec.origin.as_dvec2();
        self.spacing = f64::from(spec.spacing);
        Ok(())
    }

    /// Finds the extremes of the samples that were taken.
    pub(crate) fn measure(&mut self, elevation: &Grid<f32>) -> Result<(), HeightfieldError> {
        let (mut low, mut high, mut steepest) = (f32::INFINITY, f32::NEG_INFINITY, 0.0_f32);
        for j in 0..self.depth as usize {
            let row = elevation.row(j);
            let before = elevation.row(j.saturating_sub(1));
            for (i, (&h, &b)) in row.iter().zip(before).enumerate() {
                if !h.is_finite() {
                    return Err(self.refuse(elevation));
                }
                (low, high) = (low.min(h), high.max(h));
                let left = row[i.saturating_sub(1)];
                steepest = steepest.max((h - left).abs()).max((h - b).abs());
            }
        }
        self.set_extremes(f64::from(low), f64::from(high), f64::from(steepest));
        Ok(())
    }

    pub(crate) fn set_extremes(&mut self, low: f64, high: f64, steepest: f64) {
        (self.low, self.high, self.steepest) = (low, high, steepest);
    }

    /// Leaves no cells, after samples that cannot be used; says which.
    pub(crate) fn refuse(&mut self, elevation: &Grid<f32>) -> HeightfieldError {
        (self.width, self.depth) = (0, 0);
        let (i, j, value) = elevation.find_non_finite().unwrap_or((0, 0, f32::NAN));
        HeightfieldError::NonFinite { i, j, value }
    }

    /// Cells along X; 0 where a grid has a single sample.
    pub(crate) fn cells_x(&self) -> u32 {
        self.width.saturating_sub(1)
    }

    /// Cells along Z.
    pub(crate) fn cells_z(&self) -> u32 {
        self.depth.saturating_sub(1)
    }

    /// World X and Z of the first sample.
    pub(crate) fn corner(&self) -> DVec2 {
        self.origin
    }

    /// The grid as walks along one axis see it.
    #[inline(always)]
    pub(crate) fn layout(&self, major_is_x: bool) -> Layout<'_> {
        let (x, z) = (&self.samples.x, &self.samples.z);
        let (along, across, minor_cells) = if major_is_x {
            (x, z, self.cells_z())
        } else {
            (z, x, self.cells_x())
        };
        Layout {
            samples: self.samples.as_slice(),
            patch: self.patch,
            minor_cells,
            along,
            across,
        }
    }

    #[inline(always)]
    pub(crate) fn sample(&self, i: u32, j: u32) -> f64 {
        self.layout(true).sample(i, j)
    }

    pub(crate) fn spacing(&self) -> f64 {
        self.spacing
    }

    /// World X and Z to units of samples.
    pub(crate) fn to_grid(&self, x: f64, z: f64) -> DVec2 {
        (DVec2::new(x, z) - self.origin) * (1.0 / self.spacing)
    }

    /// World position of sample `(i, j)` at height 0.
    #[cfg(feature = "bvh")]
    pub(crate) fn position(&self, i: u32, j: u32) -> DVec3 {
        let p = self.origin + self.spacing * DVec2::new(f64::from(i), f64::from(j));
        DVec3::new(p.x, 0.0, p.y)
    }

    /// The four samples of a cell: `[h00, h10, h01, h11]`, the first index along X.
    #[inline(always)]
    pub(crate) fn corners(&self, i: u32, j: u32) -> [f64; 4] {
        [
            self.sample(i, j),
            self.sample(i + 1, j),
            self.sample(i, j + 1),
            self.sample(i + 1, j + 1),
        ]
    }

    /// Height in metres and upward unit normal within cell `(i, j)` at `(u, v)` in `[0, 1]`.
    #[inline(always)]
    pub(crate) fn height_and_normal(&self, i: u32, j: u32, u: f64, v: f64) -> (f64, DVec3) {
        let [a, b, c, d] = self.corners(i, j);
        let (height, du, dv) = match self.patch {
            Patch::Bilinear => (
                lerp(lerp(a, b, u), lerp(c, d, u), v),
                lerp(b - a, d - c, v),
                lerp(c - a, d - b, u),
            ),
            Patch::Triangles if u >= v => (a + (b - a) * u + (d - b) * v, b - a, d - b),
            Patch::Triangles => (a + (d - c) * u + (c - a) * v, d - c, c - a),
        };
        (height, DVec3::new(-du, self.spacing, -dv).normalize())
    }

    /// Upward unit normal at `(u, v)` of cell `(i, j)` from the slopes at its samples (central differences, one-sided at
    /// the rim), interpolated bilinearly.
    pub(crate) fn smooth_normal(&self, i: u32, j: u32, u: f64, v: f64) -> DVec3 {
        let slope = |i: u32, j: u32| {
            let (left, right) = (i.saturating_sub(1), (i + 1).min(self.cells_x()));
            let (before, after) = (j.saturating_sub(1), (j + 1).min(self.cells_z()));
            DVec2::new(
                (self.sample(right, j) - self.sample(left, j)) / f64::from(right - left),
                (self.sample(i, after) - self.sample(i, before)) / f64::from(after - before),
            )
        };
        let low = slope(i, j).lerp(slope(i + 1, j), u);
        let high = slope(i, j + 1).lerp(slope(i + 1, j + 1), u);
        let slope = low.lerp(high, v);
        DVec3::new(-slope.x, self.spacing, -slope.y).normalize()
    }

    pub(crate) fn bytes(&self) -> usize {
        self.samples.bytes()
    }
}

#[inline(always)]
pub(crate) fn lerp(a: f64, b: f64, s: f64) -> f64 {
    a + (b - a) * s
}
