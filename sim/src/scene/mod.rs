//! Scenes: what a scene file says ([`description`]) and the same with every file it names read and checked ([`Scene`]).

pub mod description;
mod motion;
mod problem;

pub use problem::{Problem, SceneError};

use crate::grid::{Grid, GridSpec};
use crate::mesh::TriangleMesh;
use description::{Description, Edge, Shape, Terrain};
use glam::{UVec2, Vec2, Vec3};
use std::path::Path;

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
    /// Reads a scene file and every file that it names. `overrides` are `key=value` texts that replace or add keys
    /// before anything is checked.
    ///
    /// # Errors
    /// [`SceneError`] with everything that is wrong.
    pub fn load(path: &Path, overrides: &[String]) -> Result<Self, SceneError> {
        let text = std::fs::read_to_string(path)
            .map_err(|e| single(path, None, String::new(), e.to_string(), ""))?;
        let base = path.parent().unwrap_or(Path::new("."));
        Self::from_toml(&text, path, base, overrides)
    }

    /// As [`Self::load`], from the text of a scene file; `file_name` is for messages, files are sought in `base_dir`.
    ///
    /// # Errors
    /// [`SceneError`] with everything that is wrong.
    pub fn from_toml(
        text: &str,
        file_name: &Path,
        base_dir: &Path,
        overrides: &[String],
    ) -> Result<Self, SceneError> {
        let _ = (base_dir, overrides);
        let fail = |message: String| single(file_name, None, String::new(), message, "");
        let description: Description = toml::from_str(text).map_err(|e| fail(e.to_string()))?;
        let grid = layout(&description, None).map_err(fail)?;
        let terrain = match description.terrain {
            Some(Terrain::Flat { height }) => Some(Grid::filled(grid, height)),
            None => None,
            Some(_) => return Err(fail("terrain from files is not read yet".into())),
        };
        let mut meshes = Vec::new();
        for object in &description.objects {
            meshes.push(match object.shape {
                Shape::Sphere { radius } => TriangleMesh::sphere(radius),
                Shape::Box { size } => TriangleMesh::cuboid(size),
                Shape::Cylinder { radius, height } => TriangleMesh::cylinder(radius, height),
                Shape::Model { .. } => return Err(fail("models are not read yet".into())),
            });
        }
        Self::from_parts(description, terrain, meshes, None, None)
    }

    /// A scene from a description and what its files held, as stored in a recording.
    ///
    /// # Errors
    /// [`SceneError`] if the parts do not make a scene.
    pub fn from_parts(
        description: Description,
        terrain: Option<Grid<f32>>,
        meshes: Vec<TriangleMesh>,
        sky: Option<Panorama>,
        initial_elevation: Option<Grid<f32>>,
    ) -> Result<Self, SceneError> {
        let grid = layout(&description, terrain.as_ref())
            .map_err(|m| single(Path::new("scene"), None, String::new(), m, ""))?;
        Ok(Self {
            description,
            grid,
            terrain,
            meshes,
            sky,
            initial_elevation,
        })
    }

    /// Ground height at the samples of the solver's grid, bilinear from [`Self::terrain`].
    pub fn ground_on_grid(&self) -> Option<Grid<f32>> {
        let terrain = self.terrain.as_ref()?;
        let spec = self.grid;
        Some(Grid::from_fn(spec, |i, j| terrain.sample(spec.position(i, j))))
    }
}

impl Description {
    /// The canonical text of the description: reading it gives the same description again.
    pub fn to_toml(&self) -> String {
        toml::to_string(self).unwrap_or_default()
    }
}

fn single(file: &Path, line: Option<u32>, key: String, message: String, remedy: &str) -> SceneError {
    SceneError {
        problems: vec![Problem {
            file: file.to_path_buf(),
            line,
            key,
            message,
            remedy: remedy.into(),
        }],
    }
}

/// Gravity-free geometry of a scene: how many samples the solver has and where.
fn layout(description: &Description, terrain: Option<&Grid<f32>>) -> Result<GridSpec, String> {
    let spacing = description.solver.spacing();
    let origin = description
        .domain
        .origin
        .or(terrain.map(|t| t.spec().origin))
        .unwrap_or(Vec2::ZERO);
    let size = description
        .domain
        .size
        .or(terrain.map(|t| t.spec().extent()))
        .ok_or_else(|| "domain.size is missing".to_string())?;
    let b = &description.boundary;
    let count = |length: f32, periodic: bool| (length / spacing).round() as u32 + u32::from(!periodic);
    GridSpec::new(
        origin,
        spacing,
        UVec2::new(
            count(size.x, b.x_min == Edge::Periodic),
            count(size.y, b.z_min == Edge::Periodic),
        ),
    )
    .map_err(|e| e.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

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
