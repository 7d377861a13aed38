//! Whole-solver tests.

use super::*;
use crate::scene::description::Description;
use glam::UVec2;
use std::f64::consts::TAU;

fn scene(spec: GridSpec, keys: &str) -> Scene {
    let text = format!(
        "name = \"test\"\n[solver]\nkind = \"procedural\"\nspacing = {}\n{keys}",
        spec.spacing
    );
    let description: Description = toml::from_str(&text).unwrap();
    Scene {
        description,
        grid: spec,
        terrain: None,
        meshes: Vec::new(),
        sky: None,
        initial_elevation: None,
        uplifts: Vec::new(),
    }
}

fn spec() -> GridSpec {
    GridSpec::new(Vec2::new(-37.3, 112.9), 0.37, UVec2::new(130, 61)).unwrap()
}

const SEA: &str = r#"
depth = 3.7
wave = [
  { amplitude = 0.31, wavelength = 17.3, direction = 21.0, phase = 33.0, steepness = 0.8 },
  { amplitude = 0.12, wavelength = 6.1, direction = -74.0, steepness = 0.3 },
  { amplitude = 0.04, wavelength = 2.3, direction = 190.0, phase = 210.0 },
]
"#;

fn message(keys: &str) -> String {
    Procedural::from_scene(&scene(spec(), keys))
        .err()
        .unwrap()
        .to_string()
}

/// Brings a solver to about `time`.
fn run_to(solver: &mut Procedural, time: f64) {
    while time - solver.time() > 1e-6 {
        solver.advance((time - solver.time()) as f32).unwrap();
    }
}

#[test]
fn frames_are_exact_to_f32_rounding_after_a_hundred_thousand_seconds() {
    let scene = scene(spec(), SEA);
    let mut solver = Procedural::from_scene(&scene).unwrap();
    run_to(&mut solver, 1e5);
    let mut frame = Frame::new(spec());
    solver.extract(Channels::ALL, &mut frame);
    let velocity = frame.velocity.as_ref().unwrap();
    let displacement = frame.displacement.as_ref().unwrap();
    let description::Solver::Procedural(p) = &scene.description.solver else {
        panic!("{:?}", scene.description.solver);
    };
    let mut worst = [0.0_f64; 3];
    let mut scale = [0.0_f64; 3];
    for j in 0..61 {
        for i in 0..130 {
            // The oracle shares no code with the solver: dispersion and phase spelt out in f64.
            let x = f64::from(spec().origin.x) + f64::from(spec().spacing) * i as f64;
            let z = f64::from(spec().origin.y) + f64::from(spec().spacing) * j as f64;
            let mut truth = [0.0; 5];
            scale = [0.0; 3];
            for wave in &p.waves {
                let k = TAU / f64::from(wave.wavelength);
                let tanh = (k * f64::from(3.7_f32)).tanh();
                let omega = (9.81 * k * tanh).sqrt();
                let d = f64::from(wave.direction).to_radians();
                let theta =
                    k * (d.cos() * x + d.sin() * z) - omega * frame.time + f64::from(wave.phase).to_radians();
                let a = f64::from(wave.amplitude);
                let (speed, lean) = (a * omega / tanh, f64::from(wave.steepness) * a / tanh);
                truth[0] += a * theta.cos();
                truth[1] += speed * d.cos() * theta.cos();
                truth[2] += speed * d.sin() * theta.cos();
                truth[3] -= lean * d.cos() * theta.sin();
                truth[4] -= lean * d.sin() * theta.sin();
                for (s, v) in scale.iter_mut().zip([a, speed, lean]) {
                    *s += v;
                }
            }
            let (v, s) = (velocity[(i, j)], displacement[(i, j)]);
            let errors = [
                (f64::from(frame.elevation[(i, j)]) - truth[0]).abs(),
                (f64::from(v.x) - truth[1])
                    .abs()
                    .max((f64::from(v.y) - truth[2]).abs()),
                (f64::from(s.x) - truth[3])
                    .abs()
                    .max((f64::from(s.y) - truth[4]).abs()),
            ];
            for (w, e) in worst.iter_mut().zip(errors) {
                *w = w.max(e);
            }
        }
    }
    // Two factors rounded to f32 and their product, three sums: 3 half units of the last place, of the largest value.
    for (worst, scale) in worst.into_iter().zip(scale) {
        assert!(
            worst <= 3.0 * f64::from(f32::EPSILON) * scale,
            "{worst:e} of {scale}"
        );
    }
}

#[test]
fn closed_forms_at_a_point_agree_with_frames() {
    let mut solver = Procedural::from_scene(&scene(spec(), SEA)).unwrap();
    run_to(&mut solver, 12.7);
    let mut frame = Frame::new(spec());
    solver.extract(Channels::ALL, &mut frame);
    for (i, j) in [(0, 0), (129, 60), (77, 13)] {
        let p = spec().position(i, j).as_dvec2();
        assert!((solver.elevation_at(p, frame.time) - f64::from(frame.elevation[(i, j)])).abs() < 1e-5);
        let velocity = frame.velocity.as_ref().unwrap()[(i, j)];
        assert!((solver.velocity_at(p, frame.time).as_vec2() - velocity).length() < 1e-5);
        let displacement = frame.displacement.as_ref().unwrap()[(i, j)];
        assert!((solver.displacement_at(p, frame.time).as_vec2() - displacement).length() < 1e-5);
    }
}

#[test]
fn surface_points_move_with_their_velocity() {
    // Full orbital motion: the velocity is the time derivative of the displacement.
    let keys =
        "depth = 2.0\nwave = [{ amplitude = 0.2, wavelength = 9.0, direction = 30.0, steepness = 1.0 }]";
    let solver = Procedural::from_scene(&scene(spec(), keys)).unwrap();
    let (p, t, e) = (DVec2::new(3.0, 4.0), 5.0, 1e-4);
    let numeric = (solver.displacement_at(p, t + e) - solver.displacement_at(p, t - e)) / (2.0 * e);
    assert!((solver.velocity_at(p, t) - numeric).length() < 1e-7);
}

#[test]
fn totals_are_those_of_the_frame() {
    let mut solver = Procedural::from_scene(&scene(spec(), SEA)).unwrap();
    run_to(&mut solver, 3.3);
    let mut frame = Frame::new(spec());
    solver.extract(Channels::DEPTH, &mut frame);
    let sum: f64 = frame.elevation.as_slice().iter().map(|&e| f64::from(e)).sum();
    let size: f64 = frame
        .elevation
        .as_slice()
        .iter()
        .map(|&e| f64::from(e.abs()))
        .sum();
    let area = spec().cell_area();
    assert!((solver.report().mass / 1000.0 - sum * area).abs() < 1e-6 * size * area);
    let depth = frame.depth.as_ref().unwrap();
    assert!((depth[(5, 5)] - 3.7 - frame.elevation[(5, 5)]).abs() < 1e-6);
}

#[test]
fn impossible_waves_are_refused_with_a_remedy() {
    let wave = |keys: &str| format!("wave = [{{ amplitude = 0.5, {keys} }}]");
    let folded = message(&wave("wavelength = 3.0, steepness = 1.0"));
    assert!(folded.contains("1.047") && folded.contains("0.955"), "{folded}");
    let steep = message(&wave("wavelength = 3.0, steepness = 1.2"));
    assert!(steep.contains("wave.0.steepness"), "{steep}");
    let short = message(&wave("wavelength = 0.5"));
    assert!(short.contains("spacing"), "{short}");
    assert!(message(&wave("wavelength = -3.0")).contains("wavelength"));
    assert!(message("wave = [{ amplitude = nan, wavelength = 3.0 }]").contains("amplitude"));
    assert!(message("depth = 0.0").contains("depth"));
    let event = "[[event]]\nkind = \"drop\"\ntime = 1.0\nposition = [0, 0]\nradius = 1.0\nvolume = 1.0";
    assert!(message(event).contains("wave-equation"));
    assert!(
        message("[water.initial]\nkind = \"dam\"\nmin = [0, 0]\nmax = [1, 1]\nlevel = 1.0").contains("still")
    );
}

#[test]
fn nothing_can_act_on_procedural_waves() {
    let mut solver = Procedural::from_scene(&scene(spec(), SEA)).unwrap();
    let drop = Action::Drop {
        position: Vec2::ZERO,
        radius: 1.0,
        volume: 1.0,
    };
    let error = solver.apply(&drop).unwrap_err();
    assert!(error.to_string().contains("wave-equation"), "{error}");
    assert!(solver.advance(f32::NAN).is_err());
    assert!(solver.advance(-1.0).is_err());
}
