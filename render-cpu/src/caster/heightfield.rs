//! The caster of choice: building it and asking it.

use super::column::{Columns, Crossing};
use super::surface::{HeightfieldError, Patch, Surface};
use super::walk::Walk;
use super::{Caster, Hit, Ray};
use glam::DVec3;
use meniscus_sim::Grid;

/// A heightfield that rays can be cast at.
#[derive(Clone, Debug)]
pub struct Heightfield {
    surface: Surface,
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
        self.surface.measure()
    }

    /// The first point of the surface on the ray with `t` in `[t_min, t_max]`, from whichever side the ray comes.
    ///
    /// A ray that starts on the surface (to within rounding) does not hit it where it starts: reflected, refracted and
    /// shadow rays may start at a hit's position with `t_min = 0`. A ray that runs within the surface does not hit it
    /// until it has left it. A ray without direction, or with a value that is not finite, hits nothing.
    pub fn cast(&self, ray: &Ray, t_min: f64, t_max: f64) -> Option<Hit> {
        let walk = Walk::new(&self.surface, ray, t_min, t_max)?;
        let crossing = self.crossing(&walk)?;
        Some(self.hit(ray, &walk, crossing))
    }

    /// Whether the ray meets the surface with `t` in `[t_min, t_max]`, under the conventions of [`Self::cast`].
    pub fn occluded(&self, ray: &Ray, t_min: f64, t_max: f64) -> bool {
        Walk::new(&self.surface, ray, t_min, t_max).is_some_and(|walk| self.crossing(&walk).is_some())
    }

    /// Height of the surface in metres at world `x`, `z`; `None` outside the grid.
    pub fn height(&self, x: f64, z: f64) -> Option<f64> {
        let ((i, j), (u, v)) = self.locate(x, z)?;
        Some(self.surface.height(i, j, u, v))
    }

    /// Upward unit normal of the patch at world `x`, `z`: exact, and discontinuous from cell to cell. `None` outside.
    pub fn normal(&self, x: f64, z: f64) -> Option<DVec3> {
        let ((i, j), (u, v)) = self.locate(x, z)?;
        Some(self.surface.normal(i, j, u, v))
    }

    /// Upward unit normal for shading at world `x`, `z`: continuous across cells, from slopes by central differences at
    /// the samples (one-sided at the rim) and interpolated bilinearly; exact for surfaces of second degree, else of
    /// second order in the spacing. `None` outside the grid.
    pub fn shading_normal(&self, x: f64, z: f64) -> Option<DVec3> {
        let ((i, j), (u, v)) = self.locate(x, z)?;
        Some(self.surface.smooth_normal(i, j, u, v))
    }

    fn locate(&self, x: f64, z: f64) -> Option<((usize, usize), (f64, f64))> {
        let p = self.surface.to_grid(x, z);
        let (cells_x, cells_z) = (self.surface.cells_x(), self.surface.cells_z());
        let inside = |p: f64, cells: usize| cells > 0 && p >= 0.0 && p <= cells as f64;
        if !inside(p.x, cells_x) || !inside(p.y, cells_z) {
            return None;
        }
        let (i, j) = ((p.x as usize).min(cells_x - 1), (p.y as usize).min(cells_z - 1));
        Some(((i, j), (p.x - i as f64, p.y - j as f64)))
    }

    fn crossing(&self, walk: &Walk) -> Option<Crossing> {
        let mut columns = Columns::new(&self.surface, walk);
        if walk.forward() {
            (walk.first..=walk.last).find_map(|major| columns.crossing(major))
        } else {
            (walk.last..=walk.first)
                .rev()
                .find_map(|major| columns.crossing(major))
        }
    }

    fn hit(&self, ray: &Ray, walk: &Walk, crossing: Crossing) -> Hit {
        let u = walk.major.at(crossing.t) - crossing.major as f64;
        let v = walk.minor.at(crossing.t) - crossing.minor as f64;
        let (i, j, u, v) = if walk.major_is_x {
            (crossing.major, crossing.minor, u, v)
        } else {
            (crossing.minor, crossing.major, v, u)
        };
        let point = ray.at(crossing.t);
        Hit {
            t: crossing.t,
            position: DVec3::new(point.x, self.surface.height(i, j, u, v), point.z),
            normal: self.surface.normal(i, j, u, v),
            cell: (i as u32, j as u32),
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

    fn bytes(&self) -> usize {
        self.surface.bytes()
    }
}
