//! The wave equation against theory: order of convergence, conservation, limits, edges, symmetry and scale.

use glam::{UVec2, Vec2};
use meniscus_sim::scene::description::{Description, Initial};
use meniscus_sim::wave_equation::WaveEquation;
use meniscus_sim::{Grid, GridSpec, Scene, Solver};
use std::f64::consts::{PI, TAU};

/// A scene of the wave equation with the given elevation above rest at the start; `keys` go into the solver's table.
fn scene(spec: GridSpec, keys: &str, above: impl FnMut(usize, usize) -> f32) -> Scene {
    let text = format!(
        "name = \"test\"\n[solver]\nkind = \"wave-equation\"\nspacing = {}\n{keys}",
        spec.spacing
    );
    let mut description: Description = toml::from_str(&text).unwrap();
    description.water.initial = Initial::Array {
        file: "start.npy".into(),
    };
    Scene {
        description,
        grid: spec,
        terrain: None,
        meshes: Vec::new(),
        sky: None,
        initial_elevation: Some(Grid::from_fn(spec, above)),
    }
}

fn grid(w: u32, h: u32, spacing: f32) -> GridSpec {
    GridSpec::new(Vec2::ZERO, spacing, UVec2::new(w, h)).unwrap()
}

fn solver(scene: &Scene) -> WaveEquation {
    WaveEquation::from_scene(scene).unwrap()
}

const PERIODIC: &str =
    "[boundary]\nx_min = \"periodic\"\nx_max = \"periodic\"\nz_min = \"periodic\"\nz_max = \"periodic\"";

/// Largest error, over the amplitude, of a standing wave in a tank of 3 m by 2 m after `periods` periods, with `n` samples a
/// metre, and with the scheme's step proportional to the spacing.
fn standing_wave_error(
    n: u32,
    scheme: &str,
    courant: f64,
    periodic: bool,
    mode: [f64; 2],
    periods: f64,
) -> f64 {
    let (w, h) = (3 * n, 2 * n);
    let spec = grid(w, h, 1.0 / n as f32);
    let c = 1.7;
    let k = if periodic {
        [TAU * mode[0] / 3.0, TAU * mode[1] / 2.0]
    } else {
        [PI * mode[0] / 3.0, PI * mode[1] / 2.0]
    };
    let omega = c * k[0].hypot(k[1]);
    let shape = |i: usize, j: usize| {
        let half = if periodic { 0.0 } else { 0.5 };
        let (x, z) = ((i as f64 + half) / f64::from(n), (j as f64 + half) / f64::from(n));
        (k[0] * x).cos() * (k[1] * z).cos()
    };
    let amplitude = 0.01;
    let edges = if periodic { PERIODIC } else { "" };
    let limit = 1.0 / f64::from(n) / c / 2.0_f64.sqrt();
    let keys = format!(
        "speed = {c}\nscheme = \"{scheme}\"\nstep = {}\n{edges}",
        courant * limit
    );
    let mut solver = solver(&scene(spec, &keys, |i, j| (amplitude * shape(i, j)) as f32));
    solver.advance((periods * TAU / omega) as f32).unwrap();
    let turn = (omega * solver.time()).cos();
    let mut worst = 0.0_f64;
    for j in 0..h as usize {
        for i in 0..w as usize {
            let value = f64::from(solver.deviation()[spec.index(i, j)]);
            worst = worst.max((value / amplitude - turn * shape(i, j)).abs());
        }
    }
    worst
}

#[test]
fn both_schemes_converge_to_standing_waves_at_second_order() {
    for scheme in ["explicit", "implicit"] {
        for periodic in [false, true] {
            for mode in [[1.0, 0.0], [0.0, 1.0], [2.0, 1.0]] {
                let courant = if scheme == "explicit" { 0.7 } else { 2.0 };
                let errors: Vec<f64> = [8, 16, 32, 64]
                    .map(|n| standing_wave_error(n, scheme, courant, periodic, mode, 1.1))
                    .to_vec();
                let orders: Vec<f64> = errors.windows(2).map(|e| (e[0] / e[1]).log2()).collect();
                println!("{scheme} periodic {periodic} {mode:?}: {errors:.6?} {orders:.2?}");
            }
        }
    }
}

#[test]
fn probe_drift() {
    for (scheme, courant) in [("explicit", 0.5), ("implicit", 3.0)] {
        for kind in [2, 3] {
            let n = 64;
            let spec = grid(n, n, 0.25);
            let c = 2.0;
            let limit = 0.25 / c / 2.0_f64.sqrt();
            let keys = format!(
                "speed = {c}\nscheme = \"{scheme}\"\nstep = {}\n{}",
                courant * limit,
                if kind == 3 { PERIODIC } else { "" }
            );
            let s = scene(spec, &keys, |i, j| match kind {
                0 => (PI * (i as f64 + 0.5) / f64::from(n)).cos() as f32 * 0.01,
                1 => 0.3 + (PI * (i as f64 + 0.5) / f64::from(n)).cos() as f32 * 0.01,
                _ => {
                    let d2 = (i as f32 - 20.3).powi(2) + (j as f32 - 30.1).powi(2);
                    (-d2 / 30.0).exp()
                }
            });
            let mut solver = solver(&s);
            let v0 = solver.volume();
            let size: f64 = solver
                .deviation()
                .iter()
                .map(|&e| f64::from(e.abs()))
                .sum::<f64>()
                * spec.cell_area();
            print!("{scheme} {kind}");
            for k in 0..1000 {
                solver.advance((100.0 * courant * limit) as f32).unwrap();
                if [0, 2, 9, 30, 99, 299, 999].contains(&k) {
                    let now: f64 = solver
                        .deviation()
                        .iter()
                        .map(|&e| f64::from(e.abs()))
                        .sum::<f64>()
                        * spec.cell_area();
                    print!(
                        "  {}: {:.1e} ({:.2})",
                        (k + 1) * 100,
                        (solver.volume() - v0) / size,
                        now / size
                    );
                }
            }
            println!();
        }
    }
}
