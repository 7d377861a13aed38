//! The wave equation against theory: order of convergence, conservation, limits, edges, symmetry and scale.

#![allow(clippy::unwrap_used, missing_docs, reason = "test code")]

mod edges;

use glam::{UVec2, Vec2};
use meniscus_sim::events::{Action, EventError};
use meniscus_sim::scene::description::{Description, Initial};
use meniscus_sim::wave_equation::WaveEquation;
use meniscus_sim::{Channels, Frame, Grid, GridSpec, Scene, Solver, StepError};
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
        uplifts: Vec::new(),
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
                let errors =
                    [8, 16, 32, 64].map(|n| standing_wave_error(n, scheme, courant, periodic, mode, 1.1));
                let orders: Vec<f64> = errors.windows(2).map(|e| (e[0] / e[1]).log2()).collect();
                println!("{scheme} periodic {periodic} {mode:?}: {errors:.6?} {orders:.2?}");
                // The finest pair is closest to the limit; f32 takes at most a hundredth of its order.
                assert!(
                    (orders[2] - 2.0).abs() < 0.06,
                    "{scheme} {periodic} {mode:?}: {orders:?}"
                );
                assert!(errors[3] < 4e-3);
            }
        }
    }
}

/// A round hump off the middle, as high as the samples of `spec` are wide.
fn hump(spec: GridSpec) -> impl Fn(usize, usize) -> f32 {
    move |i, j| {
        let (x, z) = (
            i as f32 - 0.3 * spec.size.x as f32,
            j as f32 - 0.47 * spec.size.y as f32,
        );
        spec.spacing * (-(x * x + z * z) / 30.0).exp()
    }
}

/// ∫|η| in m³: the yardstick of volume drift. It is the volume that rounding acts on: a sum of η would vanish for
/// waves about rest, and the volume at rest would hide any error.
fn volume_in_motion(solver: &WaveEquation) -> f64 {
    solver
        .deviation()
        .iter()
        .map(|&e| f64::from(e.abs()))
        .sum::<f64>()
        * solver.spec().cell_area()
}

#[test]
fn ten_thousand_steps_keep_volume_and_energy() {
    let spec = grid(64, 48, 0.25);
    let limit = 0.25 / 2.0 / 2.0_f64.sqrt();
    for (scheme, courant, edges) in [
        ("explicit", 0.5, ""),
        ("explicit", 0.95, ""),
        ("explicit", 0.95, PERIODIC),
        ("implicit", 3.0, ""),
        ("implicit", 100.0, PERIODIC),
    ] {
        let step = courant * limit;
        let keys = format!("speed = 2.0\nscheme = \"{scheme}\"\nstep = {step}\n{edges}");
        let mut solver = solver(&scene(spec, &keys, hump(spec)));
        let (volume, size) = (solver.volume(), volume_in_motion(&solver));
        // What leap-frog conserves is defined from its first step on.
        solver.advance(step as f32).unwrap();
        let start = solver.energies();
        let (mut drift, mut conserved, mut physical) = (0.0_f64, 0.0_f64, 0.0_f64);
        for _ in 0..100 {
            solver.advance((100.0 * step) as f32).unwrap();
            drift = drift.max((solver.volume() - volume).abs() / size);
            let now = solver.energies();
            conserved = conserved.max((now.conserved / start.conserved - 1.0).abs());
            physical = physical.max((now.physical / start.conserved - 1.0).abs());
        }
        println!(
            "{scheme} at {courant} limits, 10⁴ steps: volume {drift:.1e}, conserved energy {conserved:.1e}, physical {physical:.1e}"
        );
        assert!(drift <= 1e-6, "{scheme} {courant}: volume drifts by {drift:e}");
        // Rounding of f32 adds up like a random walk: √10⁴ · 2⁻²⁴, with room.
        assert!(
            conserved <= 2e-5,
            "{scheme} {courant}: energy drifts by {conserved:e}"
        );
        // The physical energy of leap-frog swings about the conserved one by (ω step/2)²; the hump's waves are long.
        assert!(physical <= 0.02, "{scheme} {courant}: {physical:e}");
    }
}

#[test]
fn the_implicit_scheme_holds_rough_water_at_a_hundred_limits() {
    let spec = grid(80, 60, 0.5);
    let limit = solver(&scene(spec, "depth = 2.0", |_, _| 0.0)).courant_limit();
    let keys = format!("depth = 2.0\nscheme = \"implicit\"\nstep = {}", 100.0 * limit);
    // One sample alone: every wave that the grid can hold, most of them far beyond what the step resolves.
    let mut solver = solver(&scene(
        spec,
        &keys,
        |i, j| if (i, j) == (33, 21) { 1.0 } else { 0.0 },
    ));
    let start = solver.energies().physical;
    for _ in 0..50 {
        let report = solver.advance((2000.0 * limit) as f32).unwrap();
        assert_eq!(report.substeps, 20);
        assert!((report.courant - 100.0).abs() < 1e-3);
        assert!(
            (report.energy / start - 1.0).abs() < 1e-5,
            "{}",
            report.energy / start
        );
        let most = solver.deviation().iter().fold(0.0_f32, |a, b| a.max(b.abs()));
        assert!(most <= 1.0 + 1e-5);
    }
}

#[test]
fn the_damped_scheme_takes_short_waves_first_and_never_adds_energy() {
    // A standing wave of 32 samples along Z: one step multiplies it by 1/√(1 + s²), s = (c step/dx) · 2 sin(k dx/2).
    let spec = grid(3, 32, 1.0);
    let (step, k) = (2.0_f64, TAU / 32.0);
    let keys = format!("speed = 1.0\nscheme = \"implicit-damped\"\nstep = {step}\n{PERIODIC}");
    let mut tank = solver(&scene(spec, &keys, |_, j| (k * j as f64).cos() as f32));
    let before = tank.energies().physical;
    tank.advance(20.0 * step as f32).unwrap();
    let s = step * 2.0 * (0.5 * k).sin();
    let theory = (1.0 + s * s).powi(-20);
    let measured = tank.energies().physical / before;
    assert!((measured / theory - 1.0).abs() < 1e-4, "{measured} {theory}");

    // One sample alone at a hundred limits: nearly all of it is gone in a step, but not the volume.
    let spec = grid(80, 60, 0.5);
    let limit = solver(&scene(spec, "depth = 2.0", |_, _| 0.0)).courant_limit();
    let keys = format!(
        "depth = 2.0\nscheme = \"implicit-damped\"\nstep = {}",
        100.0 * limit
    );
    let mut spike = solver(&scene(
        spec,
        &keys,
        |i, j| if (i, j) == (33, 21) { 1.0 } else { 0.0 },
    ));
    let mut last = spike.energies().physical;
    for n in 0..50 {
        let energy = spike.advance((100.0 * limit) as f32).unwrap().energy;
        assert!(energy <= last * (1.0 + 1e-6));
        if n == 0 {
            assert!(energy < 1e-3 * last, "{energy} {last}");
        }
        last = energy;
    }
    assert!((spike.volume() / 0.25 - 1.0).abs() < 1e-6);
}

/// Frequency in rad/s of a plane wave along Z, from its projection on the exact wave: `points` samples a wavelength.
fn measured_frequency(points: u32, scheme: &str, courant: f64) -> (f64, f64) {
    let spec = grid(3, points, 1.0);
    let c = 1.0;
    let k = TAU / f64::from(points);
    let step = courant / c / 2.0_f64.sqrt();
    let keys = format!("speed = {c}\nscheme = \"{scheme}\"\nstep = {step}\n{PERIODIC}");
    let mut solver = solver(&scene(spec, &keys, |_, j| (k * j as f64).cos() as f32));
    // η = cos(kz) cos(ωt): ω from the phase after a whole number of steps near three quarters of a turn.
    let count = (0.75 * TAU / (c * k) / step).round();
    solver.advance((count * step) as f32).unwrap();
    let turn: f64 = (0..points as usize)
        .map(|j| f64::from(solver.deviation()[3 * j]) * (k * j as f64).cos())
        .sum::<f64>()
        * 2.0
        / f64::from(points);
    ((TAU - turn.acos()) / (count * step), c * k)
}

#[test]
fn dispersion_is_what_the_discrete_relations_say_at_every_courant_number() {
    for points in [8, 16, 32] {
        let k = TAU / f64::from(points);
        for (scheme, courant) in [
            ("explicit", 0.1),
            ("explicit", 0.5),
            ("explicit", 0.95),
            ("implicit", 0.5),
            ("implicit", 2.0),
        ] {
            let step = courant / 2.0_f64.sqrt();
            // Along an axis: sin(ω dt/2) = (c dt/dx) sin(k dx/2); the implicit scheme has the tangent on the left.
            let s = step * (0.5 * k).sin();
            let theory = match scheme {
                "explicit" => 2.0 / step * s.asin(),
                _ => 2.0 / step * s.atan(),
            };
            let (measured, exact) = measured_frequency(points, scheme, courant);
            println!(
                "{points:2} samples a wave, {scheme} at {courant:4} limits: frequency off by {:+.3} % (theory {:+.3} %)",
                100.0 * (measured / exact - 1.0),
                100.0 * (theory / exact - 1.0)
            );
            assert!((measured / theory - 1.0).abs() < 1e-4);
        }
    }
}

/// A basin with an island, a slope and an uneven start; `at` gives the ground of a sample.
fn basin(w: u32, h: u32, keys: &str, at: impl Fn(usize, usize) -> (f32, f32)) -> Scene {
    let spec = grid(w, h, 0.5);
    let mut scene = scene(spec, keys, |i, j| at(i, j).1);
    scene.terrain = Some(Grid::from_fn(spec, |i, j| at(i, j).0));
    scene
}

/// Ground and start of a basin without any symmetry.
fn uneven(i: usize, j: usize) -> (f32, f32) {
    let (x, z) = (i as f32, j as f32);
    let island = 4.0 * (-((x - 40.0).powi(2) + (z - 31.0).powi(2)) / 40.0).exp();
    let ground = -2.5 + 0.013 * x - 0.007 * z + 0.4 * (0.3 * x).sin() * (0.17 * z).cos() + island;
    (ground, 0.1 * (0.21 * x + 0.4).sin() * (0.33 * z).cos())
}

fn run(scene: &Scene, duration: f32) -> Vec<f32> {
    let mut solver = solver(scene);
    for _ in 0..10 {
        solver.advance(0.1 * duration).unwrap();
    }
    solver.deviation().to_vec()
}

#[test]
fn the_explicit_scheme_has_no_preferred_direction_bit_for_bit() {
    let (w, h) = (70_usize, 52_usize);
    let edges = |a: &str, b: &str, c: &str, d: &str| {
        format!(
            "damping = 0.05\n[boundary]\nx_min = \"{a}\"\nx_max = \"{b}\"\nz_min = \"{c}\"\nz_max = \"{d}\""
        )
    };
    let plain = run(
        &basin(70, 52, &edges("open", "wall", "wall", "open"), uneven),
        4.0,
    );
    assert!(plain.iter().any(|&e| e != 0.0));
    let transposed = run(
        &basin(52, 70, &edges("wall", "open", "open", "wall"), |i, j| {
            uneven(j, i)
        }),
        4.0,
    );
    let mirrored = run(
        &basin(70, 52, &edges("wall", "open", "wall", "open"), |i, j| {
            uneven(w - 1 - i, j)
        }),
        4.0,
    );
    for j in 0..h {
        for i in 0..w {
            let value = plain[j * w + i];
            assert_eq!(
                value.to_bits(),
                transposed[i * h + j].to_bits(),
                "transposed {i} {j}"
            );
            assert_eq!(value, mirrored[j * w + w - 1 - i], "mirrored {i} {j}");
        }
    }
}

#[test]
fn results_do_not_depend_on_the_number_of_threads() {
    for keys in [
        "",
        "scheme = \"implicit\"\nstep = 0.2",
        "scheme = \"implicit\"\n[boundary]\nx_min = \"periodic\"\nx_max = \"periodic\"",
    ] {
        let scene = basin(300, 150, keys, uneven);
        let in_pool = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new()
                .num_threads(threads)
                .build()
                .unwrap();
            pool.install(|| {
                let mut solver = solver(&scene);
                let report = solver.advance(1.7).unwrap();
                (solver.deviation().to_vec(), report)
            })
        };
        let (one, report) = in_pool(1);
        for threads in [2, 5] {
            let (many, other) = in_pool(threads);
            assert!(one.iter().zip(&many).all(|(a, b)| a.to_bits() == b.to_bits()));
            assert_eq!(report, other);
        }
    }
}

#[test]
fn larger_water_moves_as_smaller_water_does() {
    // Lengths times 4⁵, times times 2⁵: every operation scales by a power of two, so the bits are the same. Times a
    // thousand they are the same to rounding.
    for scheme in ["explicit", "implicit"] {
        let keys = format!("scheme = \"{scheme}\"");
        let scaled = |factor: f32| -> Vec<f32> {
            let spec = GridSpec::new(Vec2::ZERO, 0.5 * factor, UVec2::new(70, 52)).unwrap();
            let mut scene = scene(spec, &keys, |i, j| factor * uneven(i, j).1);
            scene.terrain = Some(Grid::from_fn(spec, |i, j| factor * uneven(i, j).0));
            let mut solver = solver(&scene);
            for _ in 0..20 {
                solver.advance(0.2 * factor.sqrt()).unwrap();
            }
            solver.deviation().iter().map(|e| e / factor).collect()
        };
        let plain = scaled(1.0);
        assert_eq!(plain, scaled(1024.0), "{scheme}");
        let thousand = scaled(1000.0);
        let worst = plain
            .iter()
            .zip(&thousand)
            .fold(0.0_f32, |a, (p, q)| a.max((p - q).abs()));
        assert!(worst < 1e-5, "{scheme}: {worst}");
    }
}

#[test]
fn damping_takes_half_its_rate_from_the_amplitude_and_any_rate_is_stable() {
    for (scheme, step) in [("explicit", 0.02), ("implicit", 0.05)] {
        let spec = grid(64, 4, 0.25);
        let (c, k, gamma) = (2.0, PI / 16.0, 0.3);
        let shape = |i: usize| (k * 0.25 * (i as f64 + 0.5)).cos();
        let keys = format!("speed = {c}\nscheme = \"{scheme}\"\nstep = {step}\ndamping = {gamma}");
        let mut tank = solver(&scene(spec, &keys, |i, _| (0.1 * shape(i)) as f32));
        let omega = ((c * k).powi(2) - 0.25 * gamma * gamma).sqrt();
        let t = TAU / omega;
        tank.advance(t as f32).unwrap();
        // After one turn η = e^{−γt/2}: the sine part of the damped oscillation is zero there.
        let theory = (-0.5 * gamma * t).exp();
        let measured = f64::from(tank.deviation()[0]) / (0.1 * shape(0));
        assert!(
            (measured / theory - 1.0).abs() < 3e-3,
            "{scheme}: {measured} {theory}"
        );

        let keys = format!("speed = {c}\nscheme = \"{scheme}\"\nstep = {step}\ndamping = 1e6");
        let mut stiff = solver(&scene(spec, &keys, |i, _| (0.1 * shape(i)) as f32));
        let before = stiff.energies().physical;
        let report = stiff.advance(10.0).unwrap();
        // Overdamped: the hump sinks at c²k²/γ, which is nothing in ten seconds.
        assert!(
            report.energy <= before * (1.0 + 1e-6) && report.energy > 0.99 * before,
            "{scheme}"
        );
    }
}

#[test]
fn actions_change_volume_and_momentum_by_what_they_say() {
    let spec = grid(80, 60, 0.5);
    for scheme in ["explicit", "implicit"] {
        let mut solver = solver(&scene(
            spec,
            &format!("depth = 2.0\nscheme = \"{scheme}\""),
            |_, _| 0.0,
        ));
        solver.advance(0.1).unwrap();
        let at = Vec2::new(17.3, 12.9);
        let drop = Action::Drop {
            position: at,
            radius: 1.5,
            volume: 0.7,
        };
        solver.apply(&drop).unwrap();
        assert!((solver.volume() / f64::from(0.7_f32) - 1.0).abs() < 1e-6);
        solver
            .apply(&Action::Press {
                position: at,
                radius: 2.0,
                depth: 0.2,
            })
            .unwrap();
        assert!((solver.volume() / f64::from(0.7_f32) - 1.0).abs() < 1e-6);
        let before = solver.report().momentum;
        solver
            .apply(&Action::Push {
                position: at,
                radius: 3.0,
                velocity: Vec2::new(0.5, -0.2),
            })
            .unwrap();
        let after = solver.report().momentum;
        // ρ · depth · velocity · volume of the bump over its height; twelve samples a diameter leave a percent.
        let bump = 1000.0 * 2.0 * meniscus_sim::events::BUMP_VOLUME * 9.0;
        assert!(
            ((after[0] - before[0]) / (0.5 * bump) - 1.0).abs() < 0.02,
            "{after:?}"
        );
        assert!(
            ((after[1] - before[1]) / (-0.2 * bump) - 1.0).abs() < 0.02,
            "{after:?}"
        );
        solver.advance(0.5).unwrap();
        assert!((solver.volume() / f64::from(0.7_f32) - 1.0).abs() < 1e-6);
    }
}

#[test]
fn impossible_steps_and_actions_are_refused_and_change_nothing() {
    let spec = grid(40, 30, 0.5);
    let mut solver = solver(&scene(spec, "depth = 2.0", hump(spec)));
    solver.advance(0.3).unwrap();
    let before = solver.deviation().to_vec();
    for dt in [0.0, -1.0, f32::NAN, f32::INFINITY] {
        assert!(
            matches!(solver.advance(dt), Err(StepError::InvalidStep { .. })),
            "{dt}"
        );
    }
    let message = solver.advance(1e9).unwrap_err().to_string();
    assert!(
        message.contains("sub-steps") && message.contains("implicit"),
        "{message}"
    );
    let at = Vec2::new(5.0, 5.0);
    for action in [
        Action::Drop {
            position: at,
            radius: 1.0,
            volume: f32::NAN,
        },
        Action::Drop {
            position: at,
            radius: 0.0,
            volume: 1.0,
        },
        Action::Drop {
            position: at,
            radius: 1.0,
            volume: 3e38,
        },
        Action::Press {
            position: at,
            radius: 1.0,
            depth: -3e38,
        },
        Action::Press {
            position: Vec2::new(f32::INFINITY, 0.0),
            radius: 1.0,
            depth: 1.0,
        },
        Action::Push {
            position: at,
            radius: 1.0,
            velocity: Vec2::new(0.0, 3e38),
        },
    ] {
        let error = solver.apply(&action).unwrap_err();
        assert!(matches!(error, EventError::Impossible { .. }), "{error}");
    }
    assert_eq!(before, solver.deviation());
}

#[test]
fn water_that_runs_away_is_an_error_with_its_place() {
    let spec = grid(40, 30, 0.5);
    let mut solver = solver(&scene(spec, "depth = 0.01", |_, _| 0.0));
    let drop = Action::Drop {
        position: Vec2::new(5.0, 5.0),
        radius: 1.5,
        volume: 100.0,
    };
    for _ in 0..10 {
        solver.apply(&drop).unwrap();
    }
    let error = solver.advance(0.001).unwrap_err();
    let StepError::Unstable {
        value, limit, i, j, ..
    } = error
    else {
        panic!("{error}");
    };
    assert!(
        (limit - 100.0).abs() < 0.01 && value > limit && (i, j) == (10, 10),
        "{error}"
    );
}

#[test]
fn a_travelling_wave_carries_the_velocity_of_theory() {
    // Only η starts, so half of it travels each way; once apart, u = ±√(g/h) η.
    let spec = grid(400, 4, 0.25);
    for scheme in ["explicit", "implicit"] {
        let keys = format!("depth = 2.0\nscheme = \"{scheme}\"\nstep = 0.03");
        let mut solver = solver(&scene(spec, &keys, |i, _| {
            0.1 * (-((i as f32 - 200.0) / 20.0).powi(2)).exp()
        }));
        solver.advance(5.0).unwrap();
        let mut frame = Frame::new(spec);
        solver.extract(Channels::VELOCITY, &mut frame);
        let crest = (9.81_f32 * 2.0).sqrt() * 5.0 / 0.25;
        for side in [-1.0, 1.0] {
            let i = (200.0 + side * crest).round() as usize;
            let (eta, u) = (frame.elevation[(i, 2)], frame.velocity.as_ref().unwrap()[(i, 2)]);
            assert!((eta - 0.05).abs() < 1e-3, "{scheme}: {eta}");
            assert!(
                (u.x / (side * (9.81_f32 / 2.0).sqrt() * eta) - 1.0).abs() < 0.01,
                "{scheme}: {u} {eta}"
            );
        }
    }
}
