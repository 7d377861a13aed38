//! Scenes: what a scene file says ([`description`]) and the same with every file it names read and checked ([`Scene`]).

mod check;
pub mod description;
mod document;
mod fault;
mod layout;
mod load;
mod motion;
mod moving_ground;
#[cfg(test)]
mod page;
mod problem;
mod report;
mod schema;
mod series;
mod sky;
mod sky_layout;
mod suggest;
mod units;
mod validate;

pub use fault::ReadError;
pub(crate) use fault::{Fault, display_fault, read_file, read_text};
#[cfg(feature = "shallow-water")]
pub(crate) use moving_ground::{along, hump};
pub use problem::{Problem, SceneError};
pub use sky::SkyError;

use crate::grid::{Grid, GridSpec};
use crate::mesh::TriangleMesh;
use description::Description;
use glam::{UVec2, Vec3};

/// A scene ready to be simulated and drawn: needs no file any more.
#[derive(Clone, Debug, PartialEq)]
pub struct Scene {
    /// What the scene file says, overrides applied, defaults filled in.
    pub description: Description,
    /// Where the solver's samples stand.
    pub grid: GridSpec,
    /// Height of the ground above datum in metres at the resolution of its source, on square spacing. It may reach
    /// beyond `grid`. Absent: the water has no bed (deep water).
    pub terrain: Option<Grid<f32>>,
    /// Geometry of each object of the description, in its order.
    pub meshes: Vec<TriangleMesh>,
    /// The sky picture, where the description asks for one.
    pub sky: Option<Panorama>,
    /// Initial elevation above datum, where the description names an array; on `grid`.
    pub initial_elevation: Option<Grid<f32>>,
    /// Arrays of the description's `bed` of kind `array`, in its order, in their own units; on `grid`.
    pub uplifts: Vec<Grid<f32>>,
}

/// An equirectangular HDR picture: linear radiance, row-major from the zenith; column 0 looks along −Z, columns turn
/// towards +X.
#[derive(Clone, Debug, PartialEq)]
pub struct Panorama {
    /// Width and height in pixels.
    pub size: UVec2,
    /// Linear RGB radiance.
    pub pixels: Vec<Vec3>,
}

impl Scene {
    /// Ground height at the samples of the solver's grid, bilinear from [`Self::terrain`].
    pub fn ground_on_grid(&self) -> Option<Grid<f32>> {
        let terrain = self.terrain.as_ref()?;
        let spec = self.grid;
        Some(Grid::from_fn(spec, |i, j| terrain.sample(spec.position(i, j))))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    #[test]
    fn the_ripple_tank_loads() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../data/scenes/ripple-tank.toml");
        let scene = Scene::load(Path::new(path), &[]).unwrap();
        assert_eq!(scene.grid.size, UVec2::new(33, 33));
        assert_eq!(scene.ground_on_grid().unwrap().range(), (-0.25, -0.25));
        let text = scene.description.to_toml();
        assert_eq!(toml::from_str::<Description>(&text).unwrap(), scene.description);
    }
}
