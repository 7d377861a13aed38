//! What must hold exactly: rest, volume, symmetry, independence of threads, restarts.

#![allow(clippy::unwrap_used, reason = "helpers of tests")]

use glam::{UVec2, Vec2};
use meniscus_sim::events::Action;
use meniscus_sim::frame::{Channels, Frame};
use meniscus_sim::rng::Rng;
use meniscus_sim::shallow_water::{Condition, Edges, Initial, Precision, Series, Settings, ShallowWater};
use meniscus_sim::{GridSpec, Solver};

const BOTH: [Precision; 2] = [Precision::Single, Precision::Double];

fn grid(nx: u32, nz: u32, spacing: f32) -> GridSpec {
    GridSpec::new(Vec2::new(-3.0, 7.0), spacing, UVec2::new(nx, nz)).unwrap()
}

fn settings(precision: Precision, edge: &Condition) -> Settings {
    Settings {
        precision,
        edges: Edges::all(edge),
        ..Settings::default()
    }
}

/// Hills from noise: rough at the scale of a cell.
fn rough(spec: &GridSpec, seed: u64, height: f64) -> Vec<f64> {
    let mut rng = Rng::new(seed, 0);
    (0..spec.len()).map(|_| height * rng.uniform()).collect()
}

fn largest_speed(solver: &ShallowWater) -> f64 {
    let film = solver.film_depth();
    solver
        .depths()
        .iter()
        .zip(solver.discharges())
        .filter(|(h, _)| **h > film)
        .map(|(h, q)| q[0].hypot(q[1]) / h)
        .fold(0.0, f64::max)
}

#[test]
fn a_lake_over_a_rough_bed_stays_exactly_still() {
    let spec = grid(61, 47, 0.7);
    for precision in BOTH {
        for edge in [Condition::Wall, Condition::Open, Condition::Periodic] {
            // Submerged, with emerged islands, and both 1000 m up.
            for (relief, level) in [(1.0, 1.5), (3.0, 1.5), (1.0, 1001.5), (3.0, 1001.5)] {
                let altitude = if level > 100.0 { 1000.0 } else { 0.0 };
                let ground: Vec<f64> = rough(&spec, 3, relief).iter().map(|z| z + altitude).collect();
                let initial = Initial {
                    elevation: vec![level; spec.len()],
                    ground,
                    velocity: None,
                };
                let mut solver = ShallowWater::new(spec, &initial, settings(precision, &edge)).unwrap();
                let before = solver.depths();
                solver.advance(5.0).unwrap();
                assert_eq!(
                    largest_speed(&solver),
                    0.0,
                    "{precision:?} {edge:?} {relief} {level}"
                );
                assert_eq!(solver.depths(), before);
            }
        }
    }
}

#[test]
fn a_lake_held_by_a_prescribed_level_stays_still() {
    let spec = grid(40, 30, 1.0);
    let initial = Initial::still(&spec, |x, z| (0.05 * x + 0.3 * (0.7 * x + 0.4 * z).sin(), 2.0));
    for precision in BOTH {
        let settings = Settings {
            edges: Edges {
                x_min: Condition::Elevation(Series::constant(2.0)),
                z_max: Condition::Elevation(Series::constant(2.0)),
                x_max: Condition::Discharge(Series::constant(0.0)),
                ..Edges::default()
            },
            ..settings(precision, &Condition::Wall)
        };
        let mut solver = ShallowWater::new(spec, &initial, settings).unwrap();
        solver.advance(20.0).unwrap();
        assert!(
            largest_speed(&solver) <= 1e-12,
            "{precision:?}: {}",
            largest_speed(&solver)
        );
    }
}

/// A stormy sea over islands in a closed or periodic basin.
fn storm(spec: GridSpec, precision: Precision, edge: &Condition) -> ShallowWater {
    let mut initial = Initial::still(&spec, |x, z| {
        (
            0.8 * (0.31 * x).sin() * (0.27 * z).cos(),
            if x < 10.0 { 2.0 } else { 0.5 },
        )
    });
    for (z, bump) in initial.ground.iter_mut().zip(rough(&spec, 5, 0.3)) {
        *z += bump;
    }
    let settings = Settings {
        manning: 0.02,
        ..settings(precision, edge)
    };
    ShallowWater::new(spec, &initial, settings).unwrap()
}

#[test]
fn a_closed_box_keeps_its_water() {
    let spec = grid(70, 50, 0.5);
    for edge in [Condition::Wall, Condition::Periodic] {
        for precision in BOTH {
            let mut solver = storm(spec, precision, &edge);
            let start = solver.report().mass;
            let mut rng = Rng::new(11, 2);
            let mut steps = 0;
            let mut moved = 0.0;
            for _ in 0..60 {
                let at =
                    spec.position(0, 0) + Vec2::new(rng.uniform_f32(), rng.uniform_f32()) * spec.extent();
                solver
                    .apply(&Action::Press {
                        position: at,
                        radius: 2.0,
                        depth: 0.5,
                    })
                    .unwrap();
                steps += solver.advance(0.5).unwrap().substeps;
                moved = f64::max(moved, largest_speed(&solver));
            }
            assert!(steps > 600 && moved > 1.0, "{steps} steps, {moved} m/s");
            let drift = (solver.report().mass - start) / start;
            match precision {
                Precision::Single => assert_eq!(drift, 0.0),
                Precision::Double => assert!(drift.abs() <= 1e-14, "{drift:e}"),
            }
            assert!(solver.depths().iter().all(|h| *h >= 0.0));
        }
    }
}

#[test]
fn drops_add_exactly_their_volume_and_take_it_away_again() {
    let spec = grid(40, 40, 0.25);
    let initial = Initial::still(&spec, |x, _| (0.1 * x, 0.5));
    for precision in BOTH {
        let mut solver = ShallowWater::new(spec, &initial, settings(precision, &Condition::Wall)).unwrap();
        let start = solver.report().mass;
        // Half a quantum a drop, and the rounding of sums over 1600 cells in double precision.
        let quantum = (solver.quantum() * spec.cell_area() * 1000.0).max(1e-15 * start);
        let drop = |volume| Action::Drop {
            position: Vec2::new(0.0, 11.0),
            radius: 1.0,
            volume,
        };
        for k in 1..=20 {
            solver.apply(&drop(0.013)).unwrap();
            let added = solver.report().mass - start;
            let expected = 1000.0 * f64::from(0.013_f32) * f64::from(k);
            assert!(
                (added - expected).abs() <= f64::from(k) * quantum,
                "{added} {expected}"
            );
        }
        for _ in 0..20 {
            solver.apply(&drop(-0.013)).unwrap();
        }
        assert!((solver.report().mass - start).abs() <= quantum);
        let before = solver.report().mass;
        let error = solver.apply(&drop(-1000.0)).unwrap_err().to_string();
        assert!(error.contains("no more water than"), "{error}");
        assert_eq!(solver.report().mass, before);
    }
}

#[test]
fn water_poured_onto_dry_ground_is_all_there() {
    let spec = grid(40, 40, 0.5);
    let initial = Initial::still(&spec, |x, z| (0.02 * (x * x + z * z), -1.0));
    for precision in BOTH {
        let mut solver = ShallowWater::new(spec, &initial, settings(precision, &Condition::Wall)).unwrap();
        assert_eq!(solver.report().mass, 0.0);
        assert!(solver.report().largest_stable_step.is_infinite());
        solver.advance(1.0).unwrap();
        let pour = Action::Drop {
            position: Vec2::new(3.0, 12.0),
            radius: 3.0,
            volume: 7.5,
        };
        solver.apply(&pour).unwrap();
        let quantum = solver.quantum() * spec.cell_area() * 1000.0;
        let start = solver.report().mass;
        // Half a quantum, and the rounding of the sum in double precision.
        assert!((start - 7500.0).abs() <= quantum.max(1e-11), "{start}");
        solver.advance(5.0).unwrap();
        assert!(largest_speed(&solver) > 0.1);
        // Its deepest water is elsewhere now, but not a quantum is lost.
        assert!((solver.report().mass - start).abs() <= quantum.max(1e-11 * start));
    }
}

#[test]
fn pushes_give_momentum_and_presses_keep_it() {
    let spec = grid(60, 60, 0.5);
    let initial = Initial::still(&spec, |_, _| (0.0, 1.0));
    let mut solver =
        ShallowWater::new(spec, &initial, settings(Precision::Double, &Condition::Periodic)).unwrap();
    let centre = Vec2::new(10.0, 20.0);
    solver
        .apply(&Action::Push {
            position: centre,
            radius: 4.0,
            velocity: Vec2::new(0.5, -0.2),
        })
        .unwrap();
    // The bump (1 − r²)² has volume π R²/3.
    let expected = 1000.0 * std::f64::consts::PI * 16.0 / 3.0 * 0.5;
    let momentum = solver.report().momentum;
    assert!(
        (momentum[0] / expected - 1.0).abs() < 2e-3,
        "{momentum:?} {expected}"
    );
    solver
        .apply(&Action::Press {
            position: centre,
            radius: 3.0,
            depth: 0.3,
        })
        .unwrap();
    let after = solver.report().momentum;
    assert!((after[0] - momentum[0]).abs() < 1e-9 * momentum[0].abs());
    // A level periodic basin keeps momentum.
    solver.advance(3.0).unwrap();
    let later = solver.report().momentum;
    for axis in 0..2 {
        assert!(
            (later[axis] - momentum[axis]).abs() < 1e-9 * momentum[0].abs(),
            "{later:?} {momentum:?}"
        );
    }
}

#[test]
fn results_do_not_depend_on_threads() {
    let spec = grid(300, 130, 0.5);
    let run = |threads| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        pool.install(|| {
            let mut solver = storm(spec, Precision::Single, &Condition::Open);
            let report = solver.advance(3.0).unwrap();
            (solver.checkpoint(), report)
        })
    };
    let one = run(1);
    for threads in [2, 5] {
        assert_eq!(one, run(threads));
    }
}

#[test]
fn a_restored_run_goes_on_bit_for_bit() {
    let spec = grid(90, 70, 0.5);
    for precision in BOTH {
        let mut whole = storm(spec, precision, &Condition::Open);
        let mut frame = Frame::new(spec);
        whole.advance(1.3).unwrap();
        let saved = whole.checkpoint();
        let report = whole.advance(2.1).unwrap();
        whole.extract(Channels::ALL, &mut frame);

        let mut other = storm(spec, precision, &Condition::Open);
        other.advance(0.4).unwrap();
        other.restore(&saved).unwrap();
        assert_eq!(other.checkpoint(), saved);
        assert_eq!(other.advance(2.1).unwrap(), report);
        assert_eq!(other.checkpoint(), whole.checkpoint());
        let mut again = Frame::new(spec);
        other.extract(Channels::ALL, &mut again);
        assert_eq!(again, frame);

        let mut damaged = saved.clone();
        damaged.depth[77] = -1.0;
        assert!(
            other
                .restore(&damaged)
                .unwrap_err()
                .to_string()
                .contains("depth is -1 at entry 77")
        );
        let mut short = saved.clone();
        short.bed.pop();
        assert!(other.restore(&short).is_err());
        assert_eq!(
            other.checkpoint(),
            whole.checkpoint(),
            "a refused checkpoint changes nothing"
        );
    }
}

#[test]
fn sleeping_tiles_wake_when_water_arrives() {
    // A flood that must cross tiles which have slept, against the same run woken before every step.
    let spec = grid(600, 70, 0.5);
    let initial = Initial::still(&spec, |x, z| {
        (
            0.02 * (0.5 * x).sin() * (0.4 * z).cos(),
            if x < 20.0 { 2.0 } else { -1.0 },
        )
    });
    let mut slept = ShallowWater::new(spec, &initial, Settings::default()).unwrap();
    let mut woken = ShallowWater::new(spec, &initial, Settings::default()).unwrap();
    let wake = woken.checkpoint().tiles;
    let mut asleep = 0;
    for _ in 0..40 {
        slept.advance(0.5).unwrap();
        let mut all = woken.checkpoint();
        all.tiles
            .iter_mut()
            .zip(&wake)
            .for_each(|(t, w)| t.awake = w.awake);
        woken.restore(&all).unwrap();
        woken.advance(0.5).unwrap();
        asleep += slept.checkpoint().tiles.iter().filter(|t| !t.awake).count();
    }
    // The dam's front needs 8.6 s for the 77 m to the tiles in the middle, at no more than 2 √(g h) of 2 m. In each of
    // the 17 calls until then nothing moves in the middle, and the tiles on the right, a third of all, sleep. (Of 40
    // calls: from then on the right has a neighbour that moves.)
    assert!(
        wake.len() >= 6 && asleep >= 17 * wake.len() / 3,
        "only {asleep} tiles slept through a step"
    );
    assert_eq!(slept.depths(), woken.depths());
    assert_eq!(slept.discharges(), woken.discharges());
}

#[test]
fn a_round_dam_stays_round() {
    let spec = grid(81, 81, 1.0);
    let centre = spec.position(40, 40).as_dvec2();
    // To the bit, on a level bed and over a cone whose water starts with a shore: heights at a face are relative to the
    // higher of the two cells' beds, from whichever side one looks.
    for (precision, slope) in BOTH.into_iter().flat_map(|p| [(p, 0.0), (p, 0.01), (p, 0.1)]) {
        let initial = Initial::still(&spec, |x, z| {
            let r = (x - centre.x).hypot(z - centre.y);
            (slope * r, if r < 15.0 { 3.0 } else { 0.6 })
        });
        let mut solver = ShallowWater::new(spec, &initial, settings(precision, &Condition::Wall)).unwrap();
        solver.advance(4.0).unwrap();
        let (h, q) = (solver.depths(), solver.discharges());
        for j in 0..81 {
            for i in 0..81 {
                let (k, mirror, turned) = (j * 81 + i, j * 81 + 80 - i, i * 81 + j);
                for difference in [
                    h[k] - h[mirror],
                    h[k] - h[turned],
                    q[k][0] + q[mirror][0],
                    q[k][1] - q[mirror][1],
                    q[k][0] - q[turned][1],
                ] {
                    assert_eq!(difference, 0.0, "at ({i}, {j}), {precision:?}, {slope}");
                }
            }
        }
    }
}

#[test]
fn lengths_a_thousand_times_larger_give_the_same_flow() {
    // Lengths by 1024 and times by 32 leave the equations as they are.
    let run = |scale: f64| {
        let spec = GridSpec::new(Vec2::ZERO, scale as f32, UVec2::new(60, 20)).unwrap();
        let initial = Initial::still(&spec, |x, z| {
            let (x, z) = (x / scale, z / scale);
            (
                scale * 0.3 * (0.4 * x + 0.2 * z).sin(),
                scale * if x < 20.0 { 2.0 } else { 0.1 },
            )
        });
        let mut solver =
            ShallowWater::new(spec, &initial, settings(Precision::Double, &Condition::Wall)).unwrap();
        solver.advance((4.0 * scale.sqrt()) as f32).unwrap();
        solver.depths().into_iter().map(|h| h / scale).collect::<Vec<_>>()
    };
    let (one, large) = (run(1.0), run(1024.0));
    let worst = one
        .iter()
        .zip(&large)
        .map(|(a, b)| (a - b).abs())
        .fold(0.0, f64::max);
    assert!(worst <= 1e-10, "{worst:e}");
}

#[test]
fn waves_leave_through_open_edges() {
    let spec = grid(200, 5, 1.0);
    let initial = Initial::still(&spec, |x, _| {
        (0.0, 1.0 + 0.05 * (-0.01 * (x - 97.0).powi(2)).exp())
    });
    let edges = Edges {
        x_min: Condition::Open,
        x_max: Condition::Open,
        ..Edges::default()
    };
    let mut solver = ShallowWater::new(
        spec,
        &initial,
        Settings {
            edges,
            ..settings(Precision::Double, &Condition::Wall)
        },
    )
    .unwrap();
    let largest = |s: &ShallowWater| s.depths().iter().map(|h| (h - 1.0).abs()).fold(0.0, f64::max);
    solver.advance(20.0).unwrap();
    assert!(largest(&solver) > 0.02);
    // After another crossing nothing is left but what the edges sent back: below 1 % of the wave.
    solver.advance(50.0).unwrap();
    assert!(largest(&solver) < 2.5e-4, "{:e}", largest(&solver));
}

#[test]
fn a_flood_leaves_over_a_dry_open_edge() {
    let spec = grid(60, 6, 1.0);
    let initial = Initial::still(&spec, |x, _| (-0.05 * x, if x < 10.0 { 1.0 } else { -10.0 }));
    let edges = Edges {
        x_max: Condition::Open,
        ..Edges::default()
    };
    let mut solver = ShallowWater::new(
        spec,
        &initial,
        Settings {
            edges,
            ..Settings::default()
        },
    )
    .unwrap();
    let start = solver.report().mass;
    solver.advance(200.0).unwrap();
    assert!(solver.report().mass < 0.01 * start);
}

#[test]
fn an_inflow_brings_its_discharge() {
    let spec = grid(80, 10, 1.0);
    let initial = Initial::still(&spec, |x, _| (-0.002 * x, -10.0));
    for precision in BOTH {
        let edges = Edges {
            x_min: Condition::Discharge(Series::constant(0.5)),
            ..Edges::default()
        };
        let settings = Settings {
            edges,
            manning: 0.03,
            ..settings(precision, &Condition::Wall)
        };
        let mut solver = ShallowWater::new(spec, &initial, settings).unwrap();
        solver.advance(60.0).unwrap();
        let expected = 1000.0 * 0.5 * 10.0 * 60.0;
        let mass = solver.report().mass;
        assert!(
            (mass / expected - 1.0).abs() < 0.02,
            "{precision:?}: {mass} of {expected} kg"
        );
    }
}

#[test]
fn frames_are_finite_and_continue_below_the_shore() {
    let spec = grid(50, 40, 0.5);
    let mut solver = storm(spec, Precision::Single, &Condition::Wall);
    let mut frame = Frame::new(spec);
    solver.advance(2.0).unwrap();
    solver.extract(Channels::ALL, &mut frame);
    frame.check_finite().unwrap();
    assert_eq!(frame.channels(), Channels::DEPTH | Channels::VELOCITY);
    assert_eq!(frame.time, solver.time());
    let (depth, film) = (frame.depth.as_ref().unwrap(), solver.film_depth());
    for (k, elevation) in solver.elevations().into_iter().enumerate() {
        let shown = f64::from(frame.elevation.as_slice()[k]);
        if f64::from(depth.as_slice()[k]) > 2.0 * film {
            assert!((shown - elevation).abs() < 1e-6);
        } else if f64::from(depth.as_slice()[k]) < 0.5 * film {
            assert!(shown <= elevation + 1e-6, "dry ground under water at {k}");
        }
    }
}
