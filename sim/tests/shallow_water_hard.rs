//! What is hard: broken beds, films on steep slopes, impossible setups and steps. Energy only falls, and what cannot be
//! done is refused by name.

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "helpers of tests")]

use glam::{UVec2, Vec2};
use meniscus_sim::events::Action;
use meniscus_sim::rng::Rng;
use meniscus_sim::shallow_water::stability::{self, Verdict, limits};
use meniscus_sim::shallow_water::{Condition, Edges, Initial, Precision, Settings, SetupError, ShallowWater};
use meniscus_sim::{GridSpec, Solver, StepError};

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

/// A stormy sea over islands, rough at the scale of a cell, in a closed basin.
fn storm(precision: Precision) -> ShallowWater {
    let spec = grid(70, 50, 0.5);
    let mut rng = Rng::new(5, 0);
    let initial = Initial::still(&spec, |x, z| {
        (
            0.8 * (0.31 * x).sin() * (0.27 * z).cos(),
            if x < 10.0 { 2.0 } else { 0.5 },
        )
    });
    let ground = initial.ground.iter().map(|z| z + 0.3 * rng.uniform()).collect();
    let settings = Settings {
        manning: 0.02,
        ..settings(precision, &Condition::Wall)
    };
    ShallowWater::new(spec, &Initial { ground, ..initial }, settings).unwrap()
}

#[test]
fn impossible_actions_are_refused_and_change_nothing() {
    let spec = grid(20, 20, 1.0);
    let initial = Initial::still(&spec, |_, _| (0.0, 1.0));
    let mut solver = ShallowWater::new(spec, &initial, Settings::default()).unwrap();
    let before = solver.checkpoint();
    let (position, radius) = (Vec2::new(5.0, 12.0), 2.0);
    for action in [
        Action::Drop {
            position,
            radius: f32::NAN,
            volume: 1.0,
        },
        Action::Drop {
            position,
            radius: -1.0,
            volume: 1.0,
        },
        Action::Drop {
            position,
            radius,
            volume: f32::INFINITY,
        },
        Action::Drop {
            position: Vec2::splat(1e6),
            radius,
            volume: 1.0,
        },
        Action::Press {
            position: Vec2::NAN,
            radius,
            depth: 1.0,
        },
        Action::Press {
            position,
            radius,
            depth: f32::NAN,
        },
        Action::Push {
            position,
            radius,
            velocity: Vec2::new(f32::NAN, 0.0),
        },
        Action::Push {
            position,
            radius,
            velocity: Vec2::new(1e9, 0.0),
        },
    ] {
        assert!(solver.apply(&action).is_err(), "{action:?}");
    }
    assert_eq!(solver.checkpoint().depth, before.depth);
    assert_eq!(solver.checkpoint().momentum_x, before.momentum_x);
}

#[test]
fn energy_only_falls() {
    let mut solver = storm(Precision::Double);
    let mut last = solver.report().energy;
    for _ in 0..40 {
        let energy = solver.advance(0.25).unwrap().energy;
        assert!(energy <= last * (1.0 + 1e-6), "{energy} after {last}");
        last = energy;
    }
}

#[test]
fn waves_over_a_broken_bed_gain_no_energy() {
    // Noise on water whose bed jumps by many depths from one cell to the next. A slope of the surface or velocity in such
    // a cell pushes other water than its faces let through; before the scheme fell back to first order there, potential
    // energy grew by up to 95 times.
    let spec = grid(24, 24, 0.5);
    let beds: [fn(usize) -> f64; 3] = [
        |k| if k % 3 == 0 { -1000.0 } else { -0.001 },
        |k| if k % 5 == 0 { 3.0 } else { -2.0 },
        |k| if (k / 24 + k) % 2 == 0 { -1.0 } else { -0.3 },
    ];
    for precision in BOTH {
        for (number, bed) in beds.into_iter().enumerate() {
            let mut rng = Rng::new(5, 0);
            let elevation = |_| 0.1 * (2.0 * rng.uniform() - 1.0);
            let initial = Initial {
                elevation: (0..spec.len()).map(elevation).collect(),
                ground: (0..spec.len()).map(bed).collect(),
                velocity: None,
            };
            let settings = Settings {
                level: Some(0.0),
                ..settings(precision, &Condition::Wall)
            };
            let mut solver = ShallowWater::new(spec, &initial, settings).unwrap();
            let start = solver.report();
            let step = 10.0 * start.largest_stable_step as f32;
            for _ in 0..200 {
                let energy = solver.advance(step).unwrap().energy;
                assert!(
                    energy <= 1.001 * start.energy,
                    "bed {number}, {precision:?}: {energy} J of {} J at {} s",
                    start.energy,
                    solver.time()
                );
            }
        }
    }
}

#[test]
fn films_run_down_a_steep_slope_at_their_speed() {
    // Uniform flow at 45° (bed slope 1): Manning's u = h^(2/3) / n, reached within u/g, for depths far below the fall of
    // the bed from cell to cell.
    let manning = 0.03;
    for (along_x, depth) in [(true, 0.1), (false, 0.1), (true, 0.01)] {
        let size = if along_x { (60, 3) } else { (3, 60) };
        let spec = GridSpec::new(Vec2::ZERO, 1.0, UVec2::new(size.0, size.1)).unwrap();
        let initial = Initial::still(&spec, |x, z| {
            let s = if along_x { x } else { z };
            (-s, -s + if s < 40.0 { depth } else { 0.0 })
        });
        let settings = Settings {
            manning,
            ..settings(Precision::Double, &Condition::Wall)
        };
        let mut solver = ShallowWater::new(spec, &initial, settings).unwrap();
        solver.advance(3.0).unwrap();
        let (depths, discharges) = (solver.depths(), solver.discharges());
        // Below what the upper wall disturbs.
        for s in 28..36 {
            let k = if along_x { 60 + s } else { 3 * s + 1 };
            let [q, across] = if along_x {
                discharges[k]
            } else {
                [discharges[k][1], discharges[k][0]]
            };
            let expected = depths[k].powf(2.0 / 3.0) / manning;
            let speed = q / depths[k];
            assert!(
                (speed / expected - 1.0).abs() < 0.01,
                "{speed} m/s instead of {expected} at {s} m"
            );
            assert!(across.abs() < 1e-12);
        }
    }
}

#[test]
fn impossible_setups_name_what_is_wrong() {
    let spec = grid(10, 10, 1.0);
    let initial = Initial::still(&spec, |_, _| (0.0, 1.0));
    let refuse = |settings: Settings| {
        ShallowWater::new(spec, &initial, settings)
            .err()
            .unwrap()
            .to_string()
    };
    let base = Settings::default();
    assert!(
        refuse(Settings {
            courant: 0.9,
            ..base.clone()
        })
        .contains("courant is 0.9")
    );
    assert!(
        refuse(Settings {
            courant: f64::NAN,
            ..base.clone()
        })
        .contains("courant is NaN")
    );
    assert!(
        refuse(Settings {
            manning: -1.0,
            ..base.clone()
        })
        .contains("manning is -1")
    );
    assert!(
        refuse(Settings {
            film_depth: Some(0.0),
            ..base.clone()
        })
        .contains("film_depth is 0")
    );
    let edges = Edges {
        x_min: Condition::Periodic,
        ..Edges::default()
    };
    assert!(
        refuse(Settings {
            edges,
            ..base.clone()
        })
        .contains("periodic")
    );
    let narrow = GridSpec::new(Vec2::ZERO, 1.0, UVec2::new(2, 50)).unwrap();
    assert_eq!(
        ShallowWater::new(narrow, &Initial::still(&narrow, |_, _| (0.0, 1.0)), base.clone()).err(),
        Some(SetupError::Narrow(2, 50))
    );
    let mut wrong = initial.clone();
    wrong.elevation[37] = f64::NAN;
    let error = ShallowWater::new(spec, &wrong, base).err().unwrap().to_string();
    assert!(
        error.contains("water elevation in m is NaN at sample (7, 3)"),
        "{error}"
    );
}

#[test]
fn steps_that_would_take_too_long_are_refused_and_change_nothing() {
    let spec = grid(20, 20, 0.1);
    let initial = Initial::still(&spec, |x, _| (0.0, if x < -2.0 { 2.0 } else { 1.0 }));
    let settings = Settings {
        max_substeps: 50,
        ..Settings::default()
    };
    let mut solver = ShallowWater::new(spec, &initial, settings).unwrap();
    let before = solver.depths();
    assert!(matches!(
        solver.advance(10.0),
        Err(StepError::TooManySubsteps { allowed: 50, .. })
    ));
    assert_eq!(solver.depths(), before);
    for dt in [0.0, -1.0, f32::NAN, f32::INFINITY] {
        assert!(matches!(solver.advance(dt), Err(StepError::InvalidStep { .. })));
    }
}

#[test]
fn the_limits_of_the_schemes_are_those_of_the_page() {
    let (relaxations, steps) = (limits::relaxations(), limits::steps());
    let table = limits::markdown(&relaxations, &steps);
    assert!(
        include_str!("../../docs/numerics-lattice.md").contains(&table),
        "the table in docs/numerics-lattice.md is not this:\n{table}"
    );
    for row in &relaxations {
        // Finite volumes take over wherever water is not calm.
        assert!(
            row.scheme != "lattice" || (row.shear && row.ratio >= 1e6),
            "{row:?}"
        );
    }
    for row in &steps {
        assert!(row.survives >= row.default, "{row:?}");
    }
}

#[test]
fn every_hard_case_is_stable_sub_stepped_or_refused() {
    let rows = stability::table();
    assert!(rows.len() > 40);
    for row in &rows {
        println!("{} ({:?}): {:?}", row.case, row.precision, row.verdict);
        assert!(!matches!(row.verdict, Verdict::Broken(_)), "{row:?}");
    }
    let table = stability::markdown(&rows);
    assert!(
        include_str!("../../docs/numerics-shallow-water.md").contains(&table),
        "the table in docs/numerics-shallow-water.md is not this:\n{table}"
    );
    for scheme in ["finite-volume", "lattice"] {
        let refused = rows
            .iter()
            .filter(|r| r.scheme == scheme && matches!(r.verdict, Verdict::Refused(_)))
            .count();
        assert_eq!(
            refused,
            2 * 5,
            "{scheme}: impossible steps and terrain, in both precisions, and nothing else"
        );
    }
    // The paper's scheme also refuses what is outside its range, by name.
    for row in rows.iter().filter(|r| r.scheme == "bgk") {
        if let Verdict::Refused(why) = &row.verdict {
            assert!(
                why.contains("; ") || why.contains("positive finite time"),
                "{row:?}"
            );
        }
    }
}
