//! Floats against the waves that carry them.

use super::*;
use crate::solvers;
use std::f64::consts::TAU;
use std::path::Path;

fn scene(text: &str) -> Scene {
    let whole = format!("name = 'afloat'\n{text}");
    Scene::from_toml(&whole, Path::new("test"), Path::new("."), &[]).unwrap_or_else(|e| panic!("{e}"))
}

fn build(text: &str) -> Box<dyn Solver> {
    solvers::build(&scene(text)).unwrap_or_else(|e| panic!("{e}"))
}

fn pose(solver: &dyn Solver) -> BodyPose {
    let mut frame = Frame::new(solver.spec());
    solver.extract(Channels::BODIES, &mut frame);
    frame.bodies.unwrap()[0]
}

/// A crate of half the density of water, with its middle at `position`.
fn crate_at(x: f64, y: f64, z: f64) -> String {
    format!(
        "[[object]]\nname = 'crate'\nshape = {{ kind = 'box', size = [1.0, 0.6, 1.0] }}\n\
         position = [{x}, {y}, {z}]\ndensity = 500.0\nmotion = {{ kind = 'free' }}\n"
    )
}

/// Amplitude and phase of the part of `values` (taken every `dt` seconds) that turns at `omega`.
fn at_frequency(values: &[f64], dt: f64, omega: f64) -> (f64, f64) {
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    let (mut c, mut s) = (0.0, 0.0);
    for (k, v) in values.iter().enumerate() {
        let (sin, cos) = (omega * dt * k as f64).sin_cos();
        c += (v - mean) * cos;
        s += (v - mean) * sin;
    }
    let n = 0.5 * values.len() as f64;
    ((c / n).hypot(s / n), (s / n).atan2(c / n))
}

#[test]
fn a_small_float_goes_with_a_long_wave() {
    // A deep wave of 60 m; a crate a sixtieth as long rides it like a drop of its water.
    let (length, height) = (60.0, 0.3);
    let omega = (9.81 * TAU / length).sqrt();
    let period = TAU / omega;
    let text = format!(
        // It starts in a trough, with its water.
        "domain.size = [60, 30]\nboundary = {{ x_min = 'periodic', x_max = 'periodic', z_min = 'periodic', z_max = 'periodic' }}\n\
         [solver]\nkind = 'procedural'\nspacing = 0.5\n[[solver.wave]]\namplitude = {height}\nwavelength = {length}\n\
         direction = 0.0\n{}velocity = [{}, 0, 0]\n",
        crate_at(30.0, -height, 15.0),
        -height * omega
    );
    let mut solver = build(&text);
    let steps = 64;
    let dt = period / f64::from(steps);
    let (mut x, mut y) = (Vec::new(), Vec::new());
    for k in 0..8 * steps {
        solver.advance(dt as f32).unwrap();
        if k >= 4 * steps {
            let here = pose(&*solver).position;
            x.push(f64::from(here.x));
            y.push(f64::from(here.y));
        }
    }
    // Surge drifts slowly (Stokes); over whole periods its trend is a straight line.
    let n = x.len() as f64;
    let drift = (x[x.len() - 1] - x[0]) / (n - 1.0);
    let surge: Vec<f64> = x.iter().enumerate().map(|(k, x)| x - drift * k as f64).collect();
    let (heave, heave_phase) = at_frequency(&y, dt, omega);
    let (surge, surge_phase) = at_frequency(&surge, dt, omega);
    // Heave: the surface's, raised by M ω²/(ρ g A − (M + A₃) ω²), here 3 to 4 %.
    assert!((heave / height - 1.03).abs() < 0.03, "heave {heave}");
    // Surge: the water's own, πH/λ-small corrections aside. Without the force of the accelerating flow on the added mass
    // it would be a third less.
    assert!((surge / height - 1.0).abs() < 0.06, "surge {surge}");
    let apart = (heave_phase - surge_phase).rem_euclid(TAU);
    assert!(
        (apart.min(TAU - apart) - 0.25 * TAU).abs() < 0.1,
        "a quarter turn: {apart}"
    );
    // Stokes' drift at the surface is a² k ω.
    let stokes = height * height * TAU / length * omega * dt;
    assert!(drift > 0.0 && drift < 4.0 * stokes, "{drift} {stokes}");
}

#[test]
fn a_crate_on_still_water_of_any_solver_floats_at_its_draft() {
    for solver in [
        "kind = 'wave-equation'\nspacing = 0.5",
        "kind = 'wave-particles'\nspacing = 0.5\ndepth = 4.0",
    ] {
        // Let fall from 0.2 m above its balance.
        let text = format!(
            "domain.size = [12, 12]\nboundary = {{ x_min = 'open', x_max = 'open', z_min = 'open', z_max = 'open' }}\n\
             terrain = {{ kind = 'flat', height = -4 }}\n[solver]\n{solver}\n{}",
            crate_at(6.0, 0.2, 6.0)
        );
        let mut solver = build(&text);
        let mut highest = f64::NEG_INFINITY;
        for k in 0..600 {
            solver.advance(0.04).unwrap();
            if k > 500 {
                highest = highest.max(f64::from(pose(&*solver).position.y).abs());
            }
        }
        assert!(highest < 6e-3, "{}: {highest}", solver.name());
        let here = pose(&*solver).position;
        assert!(
            (here.x - 6.0).abs() < 1e-2 && (here.z - 6.0).abs() < 1e-2,
            "{here}"
        );
    }
}

#[test]
fn what_a_falling_crate_displaces_is_what_its_waves_hold() {
    // Before the waves reach an edge, with the law that keeps volume.
    let text = format!(
        "domain.size = [40, 40]\nboundary = {{ x_min = 'open', x_max = 'open', z_min = 'open', z_max = 'open' }}\n\
         [solver]\nkind = 'wave-particles'\nspacing = 0.25\nspeed = 3.0\nlaw = 'volume'\nsmallest = 1e-7\n{}",
        crate_at(20.0, 0.4, 20.0)
    );
    let mut solver = build(&text);
    let mass = solver.report().mass;
    for _ in 0..100 {
        solver.advance(0.04).unwrap();
    }
    let displaced = 0.5 * 1.0 * 0.6 - f64::from(pose(&*solver).position.y);
    let waves = (solver.report().mass - mass) / 1000.0;
    // The last interval's share is still to be sent off.
    assert!(
        (waves - displaced).abs() < 0.02 * displaced,
        "{waves} {displaced}"
    );

    // Rings are the same in the four directions, and half a turn around.
    let mut frame = Frame::new(solver.spec());
    solver.extract(Channels::NONE, &mut frame);
    let middle = 80;
    let (mut largest, mut worst) = (0.0_f32, 0.0_f32);
    for r in 10..50 {
        let at = |i: usize, j: usize| frame.elevation[(i, j)];
        let four = [
            at(middle + r, middle),
            at(middle - r, middle),
            at(middle, middle + r),
            at(middle, middle - r),
        ];
        for v in four {
            largest = largest.max(v.abs());
            worst = worst.max((v - four[0]).abs());
        }
    }
    assert!(worst < 0.02 * largest, "{worst} of {largest}");
}

#[test]
fn a_float_feels_layers_and_depends_on_no_thread() {
    let run = |threads: usize, layer: &str| {
        let text = format!(
            "domain.size = [32, 32]\nboundary = {{ x_min = 'periodic', x_max = 'periodic', z_min = 'periodic', z_max = 'periodic' }}\n\
             terrain = {{ kind = 'flat', height = -8 }}\nsolver = {{ kind = 'wave-equation', spacing = 1.0 }}\n{layer}{}",
            crate_at(16.0, 0.0, 16.0)
        );
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        pool.install(|| {
            let mut solver = build(&text);
            for _ in 0..50 {
                solver.advance(0.1).unwrap();
            }
            pose(&*solver)
        })
    };
    let layer = "[[layer]]\nsolver = { kind = 'ocean', spacing = 1.0, sea = [{ kind = 'swell', height = 0.5, period = 3.0 }] }\n";
    let (one, three) = (run(1, layer), run(3, layer));
    assert_eq!(one, three);
    let still = run(1, "");
    assert!((still.position.y).abs() < 1e-4 && (one.position - still.position).length() > 0.01);
}

#[test]
fn a_gale_throws_no_float_out_of_the_world() {
    // Winds of 40 m/s, waves that fold, long steps: finite, inside and near the surface, or refused.
    let text = format!(
        "domain.size = [128, 128]\n[solver]\nkind = 'ocean'\nspacing = 2.0\nchoppiness = 1.5\n\
         sea = [{{ kind = 'pierson-moskowitz', wind = 40.0 }}]\n{}",
        crate_at(64.0, 0.0, 64.0)
    );
    let mut solver = build(&text);
    for dt in [0.04_f32, 0.5, 2.0, 10.0] {
        for _ in 0..4 {
            match solver.advance(dt) {
                Ok(report) => assert!(report.energy.is_finite()),
                Err(StepError::TooManySubsteps { .. }) => continue,
                Err(e) => panic!("{e}"),
            }
            let here = pose(&*solver).position;
            assert!(here.is_finite() && here.y.abs() < 60.0, "{here}");
            assert!(
                (0.0..=128.0).contains(&here.x) && (0.0..=128.0).contains(&here.z),
                "{here}"
            );
        }
    }
}
