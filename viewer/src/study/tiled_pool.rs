//! A tiled pool with things in it, for studies and timings of renderers.

use meniscus_sim::glam::Vec2;
use meniscus_sim::{Frame, Grid, Scene};
use std::path::Path;

const POOL: &str = r#"
name = "study pool"
domain = { size = [6.0, 4.0] }
terrain = { kind = "flat", height = -1.5 }
ground = { albedo = [0.78, 0.80, 0.80], shore_albedo = [0.16, 0.40, 0.52], steep_albedo = [0.55, 0.53, 0.49], checker = 0.5 }
solver = { kind = "wave-equation", spacing = 0.04 }
light = { sun = { elevation = 55.0, azimuth = 150.0 } }
[[camera]]
name = "above"
position = [0.5, 1.7, 5.2]
target = [3.1, -0.9, 2.0]
fov = 52.0
[[camera]]
name = "below"
position = [0.6, -0.9, 3.4]
target = [3.2, 0.1, 1.9]
fov = 70.0
"#;

const THINGS: &str = r#"
[[object]]
name = "ball"
shape = { kind = "sphere", radius = 0.35 }
position = [2.2, -1.15, 2.4]
color = [0.80, 0.16, 0.10]
[[object]]
name = "box"
shape = { kind = "box", size = [0.6, 1.9, 0.4] }
position = [3.9, -0.55, 1.7]
rotation = { axis = [0.0, 1.0, 0.0], angle = 25.0 }
color = [0.12, 0.30, 0.70]
[[object]]
name = "bunny"
shape = { kind = "model", file = "bunny.glb", scale = 1.2 }
position = [3.0, -1.5, 1.2]
color = [0.75, 0.62, 0.30]
"#;

const ONE_MODEL: &str = r#"
[[object]]
name = "model"
shape = { kind = "model", file = "bunny.glb" }
position = [3.0, -0.9, 2.0]
color = [0.80, 0.16, 0.10]
"#;

/// What stands in the pool.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Things {
    /// Nothing.
    None,
    /// A ball on the floor, a box that reaches out of the water, and a bunny on the floor.
    Three,
    /// One model in mid-water, whose mesh the caller replaces.
    OneModel,
}

/// The pool with samples `spacing` metres apart.
///
/// # Errors
/// If no temporary file can be written.
pub fn scene(things: Things, spacing: f32) -> anyhow::Result<Scene> {
    let folder = tempfile::tempdir()?;
    std::fs::write(
        folder.path().join("bunny.glb"),
        include_bytes!("../../../data/models/bunny.glb"),
    )?;
    let text = match things {
        Things::None => POOL.to_owned(),
        Things::Three => format!("{POOL}{THINGS}"),
        Things::OneModel => format!("{POOL}{ONE_MODEL}"),
    };
    let spacing = format!("solver.spacing={spacing:?}");
    Ok(Scene::from_toml(
        &text,
        Path::new("pool.toml"),
        folder.path(),
        &[spacing],
    )?)
}

/// The pool without things over ground that rays graze: ridges of 0.4 m, 0.7 m apart, along the view and across it.
///
/// # Errors
/// As [`scene`].
pub fn ridged(spacing: f32) -> anyhow::Result<Scene> {
    let mut scene = scene(Things::None, spacing)?;
    let tau = std::f32::consts::TAU;
    if let Some(terrain) = &mut scene.terrain {
        let spec = scene.grid;
        *terrain = Grid::from_fn(spec, |i, j| {
            let p = spec.position(i, j);
            let along = (tau * (p.x + 0.3 * p.y) / 0.7).sin().powi(3);
            -1.1 + 0.2 * along + 0.2 * (tau * p.y / 1.1).sin()
        });
    }
    Ok(scene)
}

/// Waves of a few lengths and directions; their steepness goes with the amplitude (metres).
pub fn waves(scene: &Scene, amplitude: f32) -> Frame {
    let mut frame = Frame::new(scene.grid);
    let spec = scene.grid;
    frame.elevation = Grid::from_fn(spec, |i, j| {
        let p = spec.position(i, j);
        [(1.6_f32, 0.3_f32, 0.5_f32), (0.9, 1.4, 0.3), (0.55, -0.8, 0.2)]
            .into_iter()
            .map(|(length, angle, share)| {
                let along = p.dot(Vec2::from_angle(angle));
                amplitude * share * (std::f32::consts::TAU * along / length + angle).sin()
            })
            .sum()
    });
    frame
}
