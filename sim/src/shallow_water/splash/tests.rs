//! Laws of grid and droplets together.

use super::*;
use crate::shallow_water::{Initial, Precision, Settings, ShallowWater};
use crate::solver::Solver;
use glam::{UVec2, Vec2};

fn spec(side: u32, spacing: f32) -> GridSpec {
    GridSpec::new(Vec2::new(-3.0, 7.0), spacing, UVec2::new(side, side - 8)).unwrap()
}

fn splashing(precision: Precision, edge: &Condition) -> Settings {
    Settings {
        precision,
        edges: Edges::all(edge),
        splash: Some(SplashSettings::default()),
        level: Some(0.0),
        ..Settings::default()
    }
}

/// A dam across a corner of a box over a rough bed at some height: its bore breaks.
fn dam(spec: &GridSpec, shallow: f64) -> Initial {
    let size = f64::from(spec.spacing) * f64::from(spec.size.x);
    Initial::still(spec, |x, z| {
        let corner = (x + 3.0) + 0.7 * (z - 7.0) < 0.4 * size;
        let bed = -1.0 + 0.05 * (x * 3.0).sin() * (z * 2.0).cos();
        (bed, if corner { 0.6 } else { -1.0 + shallow })
    })
}

fn total(solver: &ShallowWater) -> (f64, [f64; 2], f64) {
    let report = solver.report();
    (report.mass, report.momentum, report.energy)
}

#[test]
fn grid_and_droplets_keep_volume_together() {
    for (precision, bar) in [(Precision::Double, 1e-12), (Precision::Single, 1e-6)] {
        let spec = spec(96, 0.1);
        let mut solver =
            ShallowWater::new(spec, &dam(&spec, 0.3), splashing(precision, &Condition::Wall)).unwrap();
        let (mass, _, energy) = total(&solver);
        let mut most = 0;
        for _ in 0..60 {
            solver.advance(0.05).unwrap();
            let (now, _, held) = total(&solver);
            assert!(
                (now / mass - 1.0).abs() <= bar,
                "{precision:?}: {}",
                now / mass - 1.0
            );
            // What breaking gives to droplets is less than what the fronts dissipate.
            assert!(held <= energy * (1.0 + 1e-9), "{held} of {energy}");
            most = most.max(solver.splash.as_ref().unwrap().flock.len());
        }
        let ledger = solver.ledger();
        assert!(most > 50, "{most} droplets at once, {ledger:?}");
        assert!(ledger.landed > 100 && ledger.lost == 0);
        let (depths, spec) = (solver.depths(), solver.spec());
        assert!(depths.iter().all(|h| *h >= 0.0) && depths.len() == spec.len());
    }
}

/// Passes of droplets over water that itself stands still: every change of momentum and energy stands in the ledger.
#[test]
fn momentum_and_energy_are_in_the_grid_in_droplets_or_in_the_ledger() {
    for precision in [Precision::Double, Precision::Single] {
        for edge in [Condition::Wall, Condition::Periodic, Condition::Open] {
            let spec = spec(64, 0.25);
            let mut solver = ShallowWater::new(spec, &dam(&spec, 0.4), splashing(precision, &edge)).unwrap();
            for _ in 0..12 {
                solver.advance(0.05).unwrap();
            }
            let mut rng = crate::rng::Rng::new(5, 1);
            for _ in 0..400 {
                let mut u = |scale: f64| scale * rng.uniform();
                let at = [-3.0 + u(15.0), 2.0 + u(1.0), 7.0 + u(13.0)];
                let velocity = [u(30.0) - 15.0, u(4.0), u(30.0) - 15.0];
                let volume = u(2e-3);
                solver.splash.as_mut().unwrap().add(at, velocity, volume);
            }
            // Only the droplets' part of a step, so that no wall or bed acts on the water.
            let books = |s: &ShallowWater| (total(s), s.ledger());
            let ((m0, p0, e0), l0) = books(&solver);
            for _ in 0..40 {
                let level = solver.level;
                let splash = solver.splash.as_mut().unwrap();
                match &mut solver.core {
                    crate::shallow_water::solver::Core::Single(c) => {
                        splash.step(c.water_mut(), 1e-5, level, 0.02)
                    }
                    crate::shallow_water::solver::Core::Double(c) => {
                        splash.step(c.water_mut(), 1e-5, level, 0.02)
                    }
                };
            }
            let ((m1, p1, e1), l1) = books(&solver);
            assert!(l1.landed > l0.landed + 100, "{edge:?} {l1:?}");
            assert_eq!(l1.lost > 0, edge == Condition::Open);
            let lost = 1000.0 * (l1.lost_volume - l0.lost_volume);
            assert!(((m1 + lost) / m0 - 1.0).abs() < 1e-13, "{edge:?} mass");
            // Momentum is measured by what moves, not by its sum, in which most cancels.
            let scale = m0;
            for a in 0..2 {
                let drift = p1[a] - p0[a] + l1.momentum()[a] - l0.momentum()[a];
                assert!(
                    drift.abs() < 1e-13 * scale,
                    "{edge:?} momentum {a}: {drift} of {scale}"
                );
            }
            let drift = e1 - e0 + l1.energy() - l0.energy();
            assert!(
                drift.abs() < 1e-12 * (m0 * 10.0),
                "{edge:?} energy: {drift} of {e0}"
            );
            let rounded = l1.rounded_momentum[0].hypot(l1.rounded_momentum[1]);
            assert!(rounded < 1e-6 * scale, "{rounded}");
        }
    }
}

#[test]
fn a_run_continued_from_a_checkpoint_is_the_unbroken_one_and_threads_do_not_matter() {
    let spec = spec(72, 0.1);
    let make = || {
        ShallowWater::new(
            spec,
            &dam(&spec, 0.3),
            splashing(Precision::Single, &Condition::Wall),
        )
        .unwrap()
    };
    let frame = |solver: &ShallowWater| {
        let mut frame = crate::frame::Frame::new(spec);
        solver.extract(crate::frame::Channels::ALL, &mut frame);
        frame
    };
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        pool.install(|| {
            let mut solver = make();
            for _ in 0..20 {
                solver.advance(0.05).unwrap();
            }
            let kept = solver.checkpoint();
            for _ in 0..10 {
                solver.advance(0.05).unwrap();
            }
            (kept, frame(&solver), solver.ledger())
        })
    };
    let (kept, unbroken, ledger) = run(1);
    assert_eq!((kept.clone(), unbroken.clone(), ledger), run(3));
    assert!(!unbroken.droplets.as_ref().unwrap().is_empty());
    assert!(unbroken.foam.as_ref().unwrap().range().1 > 0.1);
    let mut solver = make();
    solver.restore(&kept).unwrap();
    for _ in 0..10 {
        solver.advance(0.05).unwrap();
    }
    assert_eq!((frame(&solver), solver.ledger()), (unbroken, ledger));
    // Damage is refused.
    let mut bad = kept.clone();
    bad.splash.as_mut().unwrap().foam[3] = f32::NAN;
    assert!(solver.restore(&bad).is_err());
    bad.splash = None;
    assert!(solver.restore(&bad).is_err());
}

#[test]
fn still_water_and_gentle_waves_do_not_break() {
    let spec = spec(48, 0.5);
    for height in [0.0, 0.05] {
        let initial = Initial::still(&spec, |x, z| {
            let square = (x - 9.0).powi(2) + (z - 17.0).powi(2);
            (-1.0, height * (-0.5 * square / 4.0).exp())
        });
        let settings = splashing(Precision::Single, &Condition::Wall);
        let mut solver = ShallowWater::new(spec, &initial, settings).unwrap();
        for _ in 0..40 {
            solver.advance(0.1).unwrap();
        }
        assert_eq!(solver.ledger().emitted, 0, "{height}");
    }
}

#[test]
fn extremes_stay_sound() {
    let spec = spec(40, 0.1);
    let dry = Initial::still(&spec, |x, _| (-1.0, if x < -2.0 { 20.0 } else { -2.0 }));
    for settings in [
        SplashSettings {
            droplet_radius: Some(1e-6),
            ..SplashSettings::default()
        },
        SplashSettings {
            droplet_radius: Some(50.0),
            amount: 1.0,
            slope: 1e-6,
            ..SplashSettings::default()
        },
        SplashSettings {
            max_droplets: 20,
            amount: 1.0,
            slope: 0.01,
            ..SplashSettings::default()
        },
    ] {
        let cap = settings.max_droplets;
        let all = Settings {
            splash: Some(settings),
            ..splashing(Precision::Single, &Condition::Wall)
        };
        let mut solver = ShallowWater::new(spec, &dry, all).unwrap();
        let mass = solver.report().mass;
        // Thousands of droplets into one cell, and steps a hundred times too long.
        for _ in 0..5000 {
            solver
                .splash
                .as_mut()
                .unwrap()
                .add([-1.0, 30.0, 9.0], [0.0, -1.0, 0.0], 1e-5);
        }
        let thrown = 5000.0 * 1e-5 * 1000.0;
        for _ in 0..4 {
            let report = solver.advance(1.0).unwrap();
            assert!((report.mass / (mass + thrown) - 1.0).abs() < 1e-6, "{report:?}");
            let mut frame = crate::frame::Frame::new(spec);
            solver.extract(crate::frame::Channels::ALL, &mut frame);
            frame.check_finite().unwrap();
            assert!(solver.depths().iter().all(|h| *h >= 0.0));
        }
        let splash = solver.splash.as_ref().unwrap();
        assert!(splash.flock.len() <= cap.max(5000));
        assert_eq!(splash.books.suppressed > 0, cap == 20);
    }
}
