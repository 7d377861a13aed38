//! Regular grids of samples on the horizontal plane.

use glam::{IVec2, UVec2, Vec2};
use serde::{Deserialize, Serialize};

/// Where the samples of a grid stand.
///
/// Sample `(i, j)` stands at `origin + spacing * (i, j)`; `i` counts along +X, `j` along +Z, and storage is row-major
/// with `i` fastest. There is no half-cell convention: a finite-volume or lattice cell is *centred* on its sample.
/// A periodic grid has period `spacing * size`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct GridSpec {
    /// Position of sample (0, 0) in metres: `x` is world X, `y` is world Z.
    pub origin: Vec2,
    /// Distance between neighbouring samples in metres, the same along both axes; finite and positive.
    pub spacing: f32,
    /// Number of samples along X and Z; each at least 1.
    pub size: UVec2,
}

/// Why a [`GridSpec`] cannot be used.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum GridError {
    /// A grid needs at least one sample along each axis.
    #[error("grid of {0} x {1} samples has none; both counts must be at least 1")]
    Empty(u32, u32),
    /// Spacing must be a finite positive length.
    #[error("grid spacing {0} m is not a positive finite length")]
    Spacing(f32),
    /// Origin must be finite.
    #[error("grid origin ({0}, {1}) m is not finite")]
    Origin(f32, f32),
    /// More samples than the limit of one grid.
    #[error(
        "grid of {0} x {1} samples exceeds the limit of {limit} samples a grid; use a coarser spacing",
        limit = GridSpec::MAX_SAMPLES
    )]
    TooLarge(u32, u32),
    /// The data does not have as many values as the grid has samples.
    #[error("{found} values given for a grid of {expected} samples")]
    Length {
        /// Samples of the grid.
        expected: usize,
        /// Values that were given.
        found: usize,
    },
}

impl GridSpec {
    /// Largest number of samples of one grid (16 384²: one `f32` channel of 1 GiB).
    pub const MAX_SAMPLES: u64 = 1 << 28;

    /// A checked specification.
    ///
    /// # Errors
    /// [`GridError`] if a count is zero, the total exceeds [`Self::MAX_SAMPLES`] or a length is not finite.
    pub fn new(origin: Vec2, spacing: f32, size: UVec2) -> Result<Self, GridError> {
        let spec = Self {
            origin,
            spacing,
            size,
        };
        spec.validate()?;
        Ok(spec)
    }

    /// Checks what [`Self::new`] checks, for specifications that were read from a file.
    ///
    /// # Errors
    /// See [`Self::new`].
    pub fn validate(&self) -> Result<(), GridError> {
        let Self {
            origin,
            spacing,
            size,
        } = *self;
        if size.x == 0 || size.y == 0 {
            return Err(GridError::Empty(size.x, size.y));
        }
        if u64::from(size.x) * u64::from(size.y) > Self::MAX_SAMPLES {
            return Err(GridError::TooLarge(size.x, size.y));
        }
        if !(spacing.is_finite() && spacing > 0.0) {
            return Err(GridError::Spacing(spacing));
        }
        if !origin.is_finite() {
            return Err(GridError::Origin(origin.x, origin.y));
        }
        Ok(())
    }

    /// Number of samples.
    pub fn len(&self) -> usize {
        self.size.x as usize * self.size.y as usize
    }

    /// Never true for a validated specification; present beside [`Self::len`] by convention.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Samples along X.
    pub fn width(&self) -> usize {
        self.size.x as usize
    }

    /// Samples along Z.
    pub fn height(&self) -> usize {
        self.size.y as usize
    }

    /// Index of sample `(i, j)` in row-major storage.
    pub fn index(&self, i: usize, j: usize) -> usize {
        debug_assert!(i < self.width() && j < self.height());
        j * self.width() + i
    }

    /// Position of sample `(i, j)` in metres.
    pub fn position(&self, i: usize, j: usize) -> Vec2 {
        self.origin + self.spacing * Vec2::new(i as f32, j as f32)
    }

    /// Distance from the first to the last sample along each axis, in metres.
    pub fn extent(&self) -> Vec2 {
        self.spacing * (self.size.as_vec2() - Vec2::ONE)
    }

    /// Grid coordinates (in samples) of a position.
    pub fn to_grid(&self, position: Vec2) -> Vec2 {
        (position - self.origin) / self.spacing
    }

    /// Area that one sample stands for, in m².
    pub fn cell_area(&self) -> f64 {
        f64::from(self.spacing) * f64::from(self.spacing)
    }

    /// The sample nearest to `position`, clamped to the grid.
    pub fn nearest(&self, position: Vec2) -> UVec2 {
        let p = self.to_grid(position).round().as_ivec2();
        p.clamp(IVec2::ZERO, self.size.as_ivec2() - IVec2::ONE).as_uvec2()
    }
}

/// One value at every sample of a [`GridSpec`].
#[derive(Clone, Debug, PartialEq)]
pub struct Grid<T> {
    spec: GridSpec,
    data: Vec<T>,
}

impl<T: Clone> Grid<T> {
    /// A grid with `value` at every sample.
    pub fn filled(spec: GridSpec, value: T) -> Self {
        Self {
            spec,
            data: vec![value; spec.len()],
        }
    }

    /// Makes this a grid of `spec`, keeping the allocation; values are unspecified afterwards unless the size grew.
    pub fn reshape(&mut self, spec: GridSpec, value: T) {
        self.spec = spec;
        self.data.resize(spec.len(), value);
    }
}

impl<T> Grid<T> {
    /// A grid over existing row-major values.
    ///
    /// # Errors
    /// [`GridError::Length`] if there are not `spec.len()` values, and what [`GridSpec::validate`] says.
    pub fn from_vec(spec: GridSpec, data: Vec<T>) -> Result<Self, GridError> {
        spec.validate()?;
        if data.len() != spec.len() {
            return Err(GridError::Length {
                expected: spec.len(),
                found: data.len(),
            });
        }
        Ok(Self { spec, data })
    }

    /// A grid whose values are computed from the sample indices.
    pub fn from_fn(spec: GridSpec, mut f: impl FnMut(usize, usize) -> T) -> Self {
        let mut data = Vec::with_capacity(spec.len());
        for j in 0..spec.height() {
            for i in 0..spec.width() {
                data.push(f(i, j));
            }
        }
        Self { spec, data }
    }

    /// Where the samples stand.
    pub fn spec(&self) -> &GridSpec {
        &self.spec
    }

    /// All values, row-major.
    pub fn as_slice(&self) -> &[T] {
        &self.data
    }

    /// All values, row-major.
    pub fn as_mut_slice(&mut self) -> &mut [T] {
        &mut self.data
    }

    /// Values along X at column index `j`.
    pub fn row(&self, j: usize) -> &[T] {
        let w = self.spec.width();
        &self.data[j * w..(j + 1) * w]
    }

    /// The values, without the specification.
    pub fn into_vec(self) -> Vec<T> {
        self.data
    }
}

impl<T> std::ops::Index<(usize, usize)> for Grid<T> {
    type Output = T;
    fn index(&self, (i, j): (usize, usize)) -> &T {
        &self.data[self.spec.index(i, j)]
    }
}

impl<T> std::ops::IndexMut<(usize, usize)> for Grid<T> {
    fn index_mut(&mut self, (i, j): (usize, usize)) -> &mut T {
        let k = self.spec.index(i, j);
        &mut self.data[k]
    }
}

impl Grid<f32> {
    /// Bilinear interpolation at `position`; outside the grid the nearest edge value continues.
    pub fn sample(&self, position: Vec2) -> f32 {
        let spec = &self.spec;
        let g = spec.to_grid(position);
        let max = (spec.size.as_vec2() - Vec2::ONE).max(Vec2::ZERO);
        let g = g.clamp(Vec2::ZERO, max);
        let i0 = (g.x.floor() as usize).min(spec.width().saturating_sub(2));
        let j0 = (g.y.floor() as usize).min(spec.height().saturating_sub(2));
        let i1 = (i0 + 1).min(spec.width() - 1);
        let j1 = (j0 + 1).min(spec.height() - 1);
        let (fx, fz) = (g.x - i0 as f32, g.y - j0 as f32);
        let low = self[(i0, j0)] * (1.0 - fx) + self[(i1, j0)] * fx;
        let high = self[(i0, j1)] * (1.0 - fx) + self[(i1, j1)] * fx;
        low * (1.0 - fz) + high * fz
    }

    /// The first value that is not finite, with its indices.
    pub fn find_non_finite(&self) -> Option<(usize, usize, f32)> {
        let k = self.data.iter().position(|v| !v.is_finite())?;
        Some((k % self.spec.width(), k / self.spec.width(), self.data[k]))
    }

    /// Smallest and largest value; NaN is ignored.
    pub fn range(&self) -> (f32, f32) {
        self.data
            .iter()
            .fold((f32::INFINITY, f32::NEG_INFINITY), |(lo, hi), &v| {
                (lo.min(v), hi.max(v))
            })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_stand_on_the_lattice_and_interpolate_linearly() {
        let spec = GridSpec::new(Vec2::new(-1.0, 2.0), 0.5, UVec2::new(5, 3)).unwrap();
        let grid = Grid::from_fn(spec, |i, j| {
            let p = spec.position(i, j);
            2.0 * p.x - 3.0 * p.y
        });
        for p in [Vec2::new(-0.3, 2.2), Vec2::new(1.0, 3.0), Vec2::new(-1.0, 2.0)] {
            assert!((grid.sample(p) - (2.0 * p.x - 3.0 * p.y)).abs() < 1e-5);
        }
        // Beyond the edge the edge value continues.
        assert_eq!(grid.sample(Vec2::new(9.0, 9.0)), grid[(4, 2)]);
    }

    #[test]
    fn impossible_grids_are_refused() {
        let bad = |spacing, x, y| GridSpec::new(Vec2::ZERO, spacing, UVec2::new(x, y)).unwrap_err();
        assert_eq!(bad(1.0, 0, 3), GridError::Empty(0, 3));
        assert_eq!(bad(0.0, 3, 3), GridError::Spacing(0.0));
        assert!(matches!(bad(f32::NAN, 3, 3), GridError::Spacing(_)));
        assert_eq!(
            bad(1.0, u32::MAX, u32::MAX),
            GridError::TooLarge(u32::MAX, u32::MAX)
        );
    }

    #[test]
    fn a_single_sample_can_be_interpolated() {
        let spec = GridSpec::new(Vec2::ZERO, 1.0, UVec2::ONE).unwrap();
        assert_eq!(Grid::filled(spec, 3.5_f32).sample(Vec2::new(0.4, -2.0)), 3.5);
    }
}
