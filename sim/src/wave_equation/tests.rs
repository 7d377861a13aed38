//! Whole-solver tests and the scenes that they share.

use super::*;
use crate::grid::Grid;
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
        uplifts: Vec::new(),
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

/// Largest elevation after many raw leap-frog steps of a share of the limit.
fn growth(share: f64) -> f32 {
    let spec = grid(24, 18, 0.5);
    let mut solver = WaveEquation::from_scene(&scene(spec, "speed = 2.0")).unwrap();
    for (k, eta) in solver.state.eta.iter_mut().enumerate() {
        *eta = if k % 7 == 3 { 1e-3 } else { 0.0 };
    }
    let dt = share * solver.courant_limit();
    for _ in 0..200 {
        explicit::step(&solver.medium, &mut solver.state, &mut solver.explicit, dt);
    }
    solver.state.eta.iter().fold(0.0, |a, b| a.max(b.abs()))
}

#[test]
fn the_courant_limit_is_where_leap_frog_turns_unstable() {
    assert!(growth(0.999) < 0.1);
    // Walls cut off the very shortest wave, so the true limit lies a little above the bound.
    assert!(growth(1.01) > 1e3, "{}", growth(1.01));
}

#[test]
fn the_surface_continues_below_the_shore_as_frames_ask() {
    let spec = grid(30, 20, 1.0);
    let mut scene = scene(spec, "");
    let ground = Grid::from_fn(spec, |i, j| 0.4 * ((i * i) as f32 * 0.02 - j as f32 * 0.3) - 1.0);
    scene.terrain = Some(ground.clone());
    let mut solver = WaveEquation::from_scene(&scene).unwrap();
    for (eta, wet) in solver.state.eta.iter_mut().zip(&solver.medium.wet) {
        *eta = if *wet { 0.3 } else { 0.0 };
    }
    let mut frame = Frame::new(spec);
    solver.extract(Channels::DEPTH, &mut frame);
    let wet = Grid::from_vec(spec, solver.medium.depth.clone()).unwrap();
    let mut expected = frame.elevation.clone();
    for (value, depth) in expected.as_mut_slice().iter_mut().zip(wet.as_slice()) {
        *value = if *depth > 0.0 { 0.3 } else { 0.0 };
    }
    crate::frame::extend_into_dry(&mut expected, &wet, &ground, 2);
    assert_eq!(frame.elevation, expected);
    assert!(wet.as_slice().contains(&0.0) && wet.as_slice().iter().any(|&d| d > 0.0));
}
