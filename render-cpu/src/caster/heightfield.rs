//! The caster of choice: building it and asking it.

use super::batch::{BATCH, Batch};
use super::blocks::Blocks;
use super::column::{Columns, Crossing, Side};
use super::filter::Strip;
use super::route::Route;
use super::surface::{HeightfieldError, Patch, Surface};
use super::walk::{Walk, cell};
use super::{Caster, Hit, Ray};
use fearless_simd::{Level, Simd, dispatch};
use glam::DVec3;
use meniscus_sim::Grid;

/// A heightfield that rays can be cast at.
#[derive(Clone, Debug)]
pub struct Heightfield {
    surface: Surface,
    blocks: Blocks,
}

impl Heightfield {
    /// A heightfield of bilinear patches over `elevation` (metres).
    ///
    /// A grid of a single row or column spans no area; no ray hits it.
    ///
    /// # Errors
    /// [`HeightfieldError`] if a sample is not finite, or the grid impossible.
    pub fn build(elevation: &Grid<f32>) -> Result<Self, HeightfieldError> {
        Self::build_with(elevation, Patch::Bilinear)
    }

    /// As [`Self::build`], choosing what spans a cell.
    ///
    /// # Errors
    /// See [`Self::build`].
    pub fn build_with(elevation: &Grid<f32>, patch: Patch) -> Result<Self, HeightfieldError> {
        let mut field = Self {
            surface: Surface::empty(patch),
            blocks: Blocks::default(),
        };
        field.rebuild(elevation)?;
        Ok(field)
    }

    /// Takes the elevations of another frame; allocates nothing if the size is unchanged.
    ///
    /// # Errors
    /// See [`Self::build`]. After an error no ray hits this heightfield until it is rebuilt.
    pub fn rebuild(&mut self, elevation: &Grid<f32>) -> Result<(), HeightfieldError> {
        self.surface.copy_from(elevation)?;
        if self.blocks.rebuild(elevation, &mut self.surface) {
            Ok(())
        } else {
            Err(self.surface.refuse(elevation))
        }
    }

    /// The first point of the surface on the ray with `t` in `[t_min, t_max]`, from whichever side the ray comes.
    ///
    /// A ray that starts on the surface (to within rounding) does not hit it where it starts: reflected, refracted and
    /// shadow rays may start at a hit's position with `t_min = 0`. A ray that runs within the surface does not hit it
    /// until it has left it. A ray without direction, or with a value that is not finite, hits nothing.
    pub fn cast(&self, ray: &Ray, t_min: f64, t_max: f64) -> Option<Hit> {
        let walk = Walk::new(&self.surface, ray, t_min, t_max)?;
        let crossing = dispatch!(Level::new(), simd => self.crossing(simd, &walk))?;
        Some(crossing.hit(&self.surface, ray, &walk))
    }

    /// Casts many rays with a common interval, several times as fast as one by one and with the same answers to the last
    /// bit. `hits` receives one answer a ray, as many as the shorter slice has.
    pub fn cast_batch(&self, rays: &[Ray], t_min: f64, t_max: f64, hits: &mut [Option<Hit>]) {
        dispatch!(Level::new(), simd => self.cast_batch_with(simd, rays, t_min, t_max, hits));
    }

    #[inline(always)]
    fn cast_batch_with<S: Simd>(
        &self,
        simd: S,
        rays: &[Ray],
        t_min: f64,
        t_max: f64,
        hits: &mut [Option<Hit>],
    ) {
        let mut batch = Batch::new(&self.surface, &self.blocks);
        for (rays, hits) in rays.chunks(BATCH).zip(hits.chunks_mut(BATCH)) {
            batch.cast(simd, rays, t_min, t_max, hits);
        }
    }

    /// Whether the ray meets the surface with `t` in `[t_min, t_max]`, under the conventions of [`Self::cast`].
    pub fn occluded(&self, ray: &Ray, t_min: f64, t_max: f64) -> bool {
        Walk::new(&self.surface, ray, t_min, t_max)
            .is_some_and(|walk| dispatch!(Level::new(), simd => self.crossing(simd, &walk)).is_some())
    }

    /// Height of the surface in metres at world `x`, `z`; `None` outside the grid.
    pub fn height(&self, x: f64, z: f64) -> Option<f64> {
        let ((i, j), (u, v)) = self.locate(x, z)?;
        Some(self.surface.height_and_normal(i, j, u, v).0)
    }

    /// Upward unit normal of the patch at world `x`, `z`: exact, and discontinuous from cell to cell. `None` outside.
    pub fn normal(&self, x: f64, z: f64) -> Option<DVec3> {
        let ((i, j), (u, v)) = self.locate(x, z)?;
        Some(self.surface.height_and_normal(i, j, u, v).1)
    }

    /// Upward unit normal for shading at world `x`, `z`: continuous across cells, from slopes by central differences at
    /// the samples (one-sided at the rim) and interpolated bilinearly; exact for surfaces of second degree, else of
    /// second order in the spacing. `None` outside the grid.
    pub fn shading_normal(&self, x: f64, z: f64) -> Option<DVec3> {
        let ((i, j), (u, v)) = self.locate(x, z)?;
        Some(self.surface.smooth_normal(i, j, u, v))
    }

    fn locate(&self, x: f64, z: f64) -> Option<((u32, u32), (f64, f64))> {
        let p = self.surface.to_grid(x, z);
        let (cells_x, cells_z) = (self.surface.cells_x(), self.surface.cells_z());
        let inside = |p: f64, cells: u32| cells > 0 && p >= 0.0 && p <= f64::from(cells);
        if !inside(p.x, cells_x) || !inside(p.y, cells_z) {
            return None;
        }
        let (i, j) = (cell(p.x, cells_x), cell(p.y, cells_z));
        Some(((i, j), (p.x - f64::from(i), p.y - f64::from(j))))
    }

    #[inline(always)]
    fn crossing<S: Simd>(&self, simd: S, walk: &Walk) -> Option<Crossing> {
        let layout = self.surface.layout(walk.major_is_x);
        let mut columns = Columns::new(layout, walk);
        let mut column = walk.first;
        // What starts on the surface must find its side first.
        while columns.side == Side::On {
            let found = columns.crossing(column);
            if found.is_some() || column == walk.last {
                return found;
            }
            column = if walk.forward() { column + 1 } else { column - 1 };
        }
        let mut route = Route::new(walk, column);
        if route.is_short() {
            while route.has_columns() {
                let found = columns.crossing(route.next_column());
                if found.is_some() {
                    return found;
                }
            }
            return None;
        }
        let strip = Strip::new(walk, columns.side == Side::Below);
        let bounds = self.blocks.along(walk.major_is_x);
        loop {
            route.set_blocks(strip.block_columns(simd, bounds, route.window()));
            while route.has_blocks() {
                let (block, in_walk) = route.next_block();
                route.set_columns(strip.columns(simd, bounds, &layout, block) & in_walk);
                while route.has_columns() {
                    let found = columns.crossing(route.next_column());
                    if found.is_some() {
                        return found;
                    }
                }
            }
            if !route.next_window() {
                return None;
            }
        }
    }
}

impl Caster for Heightfield {
    fn name(&self) -> &'static str {
        "blocks"
    }

    fn rebuild(&mut self, elevation: &Grid<f32>) -> Result<(), HeightfieldError> {
        Heightfield::rebuild(self, elevation)
    }

    fn cast(&self, ray: &Ray, t_min: f64, t_max: f64) -> Option<Hit> {
        Heightfield::cast(self, ray, t_min, t_max)
    }

    fn cast_batch(&self, rays: &[Ray], t_min: f64, t_max: f64, hits: &mut [Option<Hit>]) {
        Heightfield::cast_batch(self, rays, t_min, t_max, hits);
    }

    fn bytes(&self) -> usize {
        self.surface.bytes() + self.blocks.bytes()
    }
}
