//! Whole-solver tests and the scenes that they share.

use super::*;
use crate::scene::description::Description;
use glam::UVec2;

/// A grid of `w` by `h` samples from the origin.
pub(super) fn grid(w: u32, h: u32, spacing: f32) -> GridSpec {
    GridSpec::new(Vec2::ZERO, spacing, UVec2::new(w, h)).unwrap()
}

/// A scene without terrain; `keys` go into the solver's table, further tables may follow.
pub(super) fn scene(grid: GridSpec, keys: &str) -> Scene {
    let text = format!(
        "name = \"test\"\n[solver]\nkind = \"wave-equation\"\nspacing = {}\n{keys}",
        grid.spacing
    );
    let description: Description = toml::from_str(&text).unwrap();
    Scene {
        description,
        grid,
        terrain: None,
        meshes: Vec::new(),
        sky: None,
        initial_elevation: None,
    }
}

#[test]
fn the_explicit_scheme_refuses_a_step_above_its_limit_and_names_it() {
    let spec = grid(40, 30, 0.5);
    let limit = 0.5 / (3.0 * 2.0_f64.sqrt());
    let solver = WaveEquation::from_scene(&scene(spec, "speed = 3.0")).unwrap();
    assert!((solver.courant_limit() / limit - 1.0).abs() < 1e-6);
    let error = WaveEquation::from_scene(&scene(spec, "speed = 3.0\nstep = 0.12"))
        .err()
        .unwrap();
    let message = error.to_string();
    assert!(
        message.contains(&format!("{:.4e}", solver.courant_limit())[..6]),
        "{message}"
    );
    assert!(message.contains("implicit"), "{message}");
    assert!(WaveEquation::from_scene(&scene(spec, "speed = 3.0\nstep = 0.117")).is_ok());
}
