//! The surface between the samples of a grid: what every caster agrees on.

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
    heights: Vec<f32>,
    width: usize,
    depth: usize,
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
    pub(crate) heights: &'a [f32],
    pub(crate) patch: Patch,
    pub(crate) major_cells: usize,
    pub(crate) minor_cells: usize,
    /// Distance in storage between neighbours along the major axis.
    pub(crate) along: usize,
    /// Distance in storage between neighbours along the minor axis.
    pub(crate) across: usize,
}

impl Layout<'_> {
    #[inline(always)]
    pub(crate) fn sample(&self, major: usize, minor: usize) -> f64 {
        // Callers stay within the grid; the fallback only spares the panic.
        f64::from(
            self.heights
                .get(major * self.along + minor * self.across)
                .copied()
                .unwrap_or(0.0),
        )
    }
}

impl Surface {
    /// A surface without cells, which no ray hits.
    pub(crate) fn empty(patch: Patch) -> Self {
        Self {
            heights: Vec::new(),
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
        self.heights.clear();
        self.heights.extend_from_slice(elevation.as_slice());
        self.width = spec.width();
        self.depth = spec.height();
        self.origin = spec.origin.as_dvec2();
        self.spacing = f64::from(spec.spacing);
        Ok(())
    }

    /// Finds the extremes, and the first sample that is not finite.
    pub(crate) fn measure(&mut self) -> Result<(), HeightfieldError> {
        let (mut low, mut high) = (f32::INFINITY, f32::NEG_INFINITY);
        let mut steepest = 0.0_f64;
        for row in self.heights.chunks_exact(self.width) {
            if row.iter().any(|h| !h.is_finite()) {
                return Err(self.refuse());
            }
            for &h in row {
                low = low.min(h);
                high = high.max(h);
            }
            for pair in row.windows(2) {
                steepest = steepest.max((f64::from(pair[1]) - f64::from(pair[0])).abs());
            }
        }
        for j in 1..self.depth {
            let (before, row) = self.heights[(j - 1) * self.width..].split_at(self.width);
            for (a, b) in before.iter().zip(row) {
                steepest = steepest.max((f64::from(*b) - f64::from(*a)).abs());
            }
        }
        self.set_extremes(f64::from(low), f64::from(high), steepest);
        Ok(())
    }

    pub(crate) fn set_extremes(&mut self, low: f64, high: f64, steepest: f64) {
        (self.low, self.high, self.steepest) = (low, high, steepest);
    }

    /// Leaves no cells, after samples that cannot be used; says which.
    pub(crate) fn refuse(&mut self) -> HeightfieldError {
        let k = self.heights.iter().position(|h| !h.is_finite()).unwrap_or(0);
        let (i, j) = (k % self.width.max(1), k / self.width.max(1));
        let value = self.heights.get(k).copied().unwrap_or(f32::NAN);
        (self.width, self.depth) = (0, 0);
        HeightfieldError::NonFinite { i, j, value }
    }

    /// Cells along X; 0 where a grid has a single sample.
    pub(crate) fn cells_x(&self) -> usize {
        self.width.saturating_sub(1)
    }

    /// Cells along Z.
    pub(crate) fn cells_z(&self) -> usize {
        self.depth.saturating_sub(1)
    }

    /// Samples along X, which is the distance in storage from a sample to its neighbour along Z.
    pub(crate) fn width(&self) -> usize {
        self.width
    }

    pub(crate) fn heights(&self) -> &[f32] {
        &self.heights
    }

    /// World X and Z of the first sample.
    pub(crate) fn corner(&self) -> DVec2 {
        self.origin
    }

    /// The grid as walks along one axis see it.
    #[inline(always)]
    pub(crate) fn layout(&self, major_is_x: bool) -> Layout<'_> {
        let (x, z) = ((self.cells_x(), 1), (self.cells_z(), self.width));
        let ((major_cells, along), (minor_cells, across)) = if major_is_x { (x, z) } else { (z, x) };
        Layout {
            heights: &self.heights,
            patch: self.patch,
            major_cells,
            minor_cells,
            along,
            across,
        }
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
    pub(crate) fn position(&self, i: usize, j: usize) -> DVec3 {
        let p = self.origin + self.spacing * DVec2::new(i as f64, j as f64);
        DVec3::new(p.x, 0.0, p.y)
    }

    /// The four samples of a cell: `[h00, h10, h01, h11]`, the first index along X.
    #[inline(always)]
    pub(crate) fn corners(&self, i: usize, j: usize) -> [f64; 4] {
        let k = j * self.width + i;
        let at = |k: usize| f64::from(self.heights.get(k).copied().unwrap_or(0.0));
        [at(k), at(k + 1), at(k + self.width), at(k + self.width + 1)]
    }

    /// Height in metres within cell `(i, j)` at `(u, v)` in `[0, 1]`.
    #[inline(always)]
    pub(crate) fn height(&self, i: usize, j: usize, u: f64, v: f64) -> f64 {
        let [a, b, c, d] = self.corners(i, j);
        match self.patch {
            Patch::Bilinear => lerp(lerp(a, b, u), lerp(c, d, u), v),
            Patch::Triangles if u >= v => a + (b - a) * u + (d - b) * v,
            Patch::Triangles => a + (d - c) * u + (c - a) * v,
        }
    }

    /// Upward unit normal within cell `(i, j)` at `(u, v)`.
    #[inline(always)]
    pub(crate) fn normal(&self, i: usize, j: usize, u: f64, v: f64) -> DVec3 {
        let [a, b, c, d] = self.corners(i, j);
        let (du, dv) = match self.patch {
            Patch::Bilinear => (lerp(b - a, d - c, v), lerp(c - a, d - b, u)),
            Patch::Triangles if u >= v => (b - a, d - b),
            Patch::Triangles => (d - c, c - a),
        };
        DVec3::new(-du, self.spacing, -dv).normalize()
    }

    /// Upward unit normal at `(u, v)` of cell `(i, j)` from the slopes at its samples (central differences, one-sided at
    /// the rim), interpolated bilinearly.
    pub(crate) fn smooth_normal(&self, i: usize, j: usize, u: f64, v: f64) -> DVec3 {
        let at = |i: usize, j: usize| f64::from(self.heights.get(j * self.width + i).copied().unwrap_or(0.0));
        let slope = |i: usize, j: usize| {
            let (left, right) = (i.saturating_sub(1), (i + 1).min(self.cells_x()));
            let (before, after) = (j.saturating_sub(1), (j + 1).min(self.cells_z()));
            DVec2::new(
                (at(right, j) - at(left, j)) / (right - left) as f64,
                (at(i, after) - at(i, before)) / (after - before) as f64,
            )
        };
        let low = slope(i, j).lerp(slope(i + 1, j), u);
        let high = slope(i, j + 1).lerp(slope(i + 1, j + 1), u);
        let slope = low.lerp(high, v);
        DVec3::new(-slope.x, self.spacing, -slope.y).normalize()
    }

    pub(crate) fn bytes(&self) -> usize {
        self.heights.capacity() * size_of::<f32>()
    }
}

#[inline(always)]
pub(crate) fn lerp(a: f64, b: f64, s: f64) -> f64 {
    a + (b - a) * s
}
