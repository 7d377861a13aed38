//! Ray casting against heightfields whose samples change every frame.
//!
//! [`Heightfield`] is built from a `Grid<f32>` of elevations and rebuilt in place for the next frame. Between the
//! samples the surface is a bilinear patch a cell, or two triangles ([`Patch`]). It has no walls and no volume: a ray
//! may come from above, from below, from outside the grid or start anywhere, and finds the first point where it meets
//! the surface.
//!
//! What decides whether and where a ray hits is always the same `f64` arithmetic ([`column`], and [`packet`] for eight rays at
//! once), so all ways of asking agree to the last bit; what differs is how the columns that cannot hold a hit are passed over.
//!
//! ```
//! use glam::{DVec3, UVec2, Vec2};
//! use meniscus_render_cpu::caster::{Heightfield, Ray};
//! use meniscus_sim::{Grid, GridSpec};
//!
//! let spec = GridSpec::new(Vec2::ZERO, 0.5, UVec2::new(65, 33))?;
//! let waves = Grid::from_fn(spec, |i, j| 0.1 * (0.3 * i as f32).sin() * (0.2 * j as f32).cos());
//! let water = Heightfield::build(&waves)?;
//! let ray = Ray { origin: DVec3::new(3.0, 5.0, 4.0), direction: DVec3::new(0.6, -0.8, 0.0) };
//! let hit = water.cast(&ray, 0.0, f64::INFINITY).expect("the ray points down at the middle of the grid");
//! assert!(hit.normal.y > 0.0 && hit.position.y.abs() <= 0.1);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod batch;
mod blocks;
mod brute;
#[cfg(feature = "bvh")]
mod bvh;
mod column;
mod filter;
mod heightfield;
mod lanes;
mod max_mip;
mod packet;
mod route;
mod samples;
mod surface;
mod walk;

pub use brute::BruteForce;
#[cfg(feature = "bvh")]
pub use bvh::TriangleBvh;
pub use heightfield::Heightfield;
pub use max_mip::MaxMip;
pub use meniscus_sim::stage::Ray;
pub use surface::{HeightfieldError, Patch};

use glam::DVec3;
use meniscus_sim::Grid;

/// Where a ray first meets a heightfield.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Distance along the ray in multiples of its direction, within the interval that was asked for.
    pub t: f64,
    /// The point of the surface, metres: `x` and `z` are the ray's, `y` is the surface's height there.
    pub position: DVec3,
    /// Unit normal of the patch at the point. It points up whichever side the ray comes from.
    pub normal: DVec3,
    /// The cell, between samples `(i, j)` and `(i + 1, j + 1)`.
    pub cell: (u32, u32),
}

/// A method of casting rays at a heightfield, so that a study can sweep all of them.
///
/// All methods take the same surface and the same conventions (those of [`Heightfield::cast`]); they differ in time,
/// memory and, where they say so, in error.
pub trait Caster: Send + Sync {
    /// Short name as in tables and options.
    fn name(&self) -> &'static str;

    /// Takes the elevations of another frame. Allocates nothing if the size is unchanged, unless the method says so.
    ///
    /// # Errors
    /// [`HeightfieldError`]; the caster then keeps a surface that no ray hits.
    fn rebuild(&mut self, elevation: &Grid<f32>) -> Result<(), HeightfieldError>;

    /// The first point of the surface on the ray with `t` in `[t_min, t_max]`.
    fn cast(&self, ray: &Ray, t_min: f64, t_max: f64) -> Option<Hit>;

    /// Casts many rays with a common interval; `hits` receives one answer a ray, as many as the shorter slice has.
    fn cast_batch(&self, rays: &[Ray], t_min: f64, t_max: f64, hits: &mut [Option<Hit>]) {
        for (ray, hit) in rays.iter().zip(hits) {
            *hit = self.cast(ray, t_min, t_max);
        }
    }

    /// Bytes that the method keeps, samples included.
    fn bytes(&self) -> usize;
}
