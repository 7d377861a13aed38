//! Scenes that studies make up, without files.

use anyhow::Context as _;
use meniscus_sim::glam::Vec2;
use meniscus_sim::scene::description::{Boundary, Description, Edge, Initial, Solver, Water};
use meniscus_sim::{Grid, GridSpec, Scene};
use std::path::PathBuf;

/// What happens at the edges.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Edges {
    Walls,
    Open,
    Periodic,
}

impl Edges {
    fn boundary(self) -> Boundary {
        let edge = match self {
            Self::Walls => Edge::Wall,
            Self::Open => Edge::Open,
            Self::Periodic => Edge::Periodic,
        };
        Boundary {
            drives: Vec::new(),
            x_min: edge,
            x_max: edge,
            z_min: edge,
            z_max: edge,
        }
    }
}

/// A scene over `grid` with the given solver, ground and elevation at the start; still water without the latter.
pub(crate) fn scene(
    grid: GridSpec,
    solver: Solver,
    edges: Edges,
    terrain: Option<Grid<f32>>,
    initial: Option<Grid<f32>>,
) -> anyhow::Result<Scene> {
    let text = "name = \"study\"\n[solver]\nkind = \"procedural\"\nspacing = 1.0\n";
    let mut description: Description = toml::from_str(text).context("the smallest scene cannot be read")?;
    description.solver = solver;
    description.boundary = edges.boundary();
    description.domain.origin = Some(grid.origin);
    // Periodic domains end one spacing after their last sample.
    let intervals = if edges == Edges::Periodic {
        grid.size
    } else {
        grid.size - 1
    };
    description.domain.size = Some(grid.spacing * Vec2::new(intervals.x as f32, intervals.y as f32));
    if initial.is_some() {
        description.water = Water {
            initial: Initial::Array {
                file: PathBuf::from("study.npy"),
            },
            ..Water::default()
        };
    }
    let scene = Scene::from_parts(description, terrain, Vec::new(), None, initial)
        .context("the scene of a study is impossible")?;
    anyhow::ensure!(
        scene.grid.size == grid.size,
        "the scene of a study has {} samples instead of {}",
        scene.grid.size,
        grid.size
    );
    Ok(Scene { grid, ..scene })
}
