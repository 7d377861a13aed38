//! The long storm: drops, pushes and droplets in a closed box, and what became of the volume.
//!
//! `cargo run --release -p meniscus-sim --example splash_storm -- [STEPS]` (default 100 000; a minute or two).

#![allow(clippy::print_stdout, reason = "its output is what it is for")]

use glam::{UVec2, Vec2};
use meniscus_sim::Solver;
use meniscus_sim::events::Action;
use meniscus_sim::grid::GridSpec;
use meniscus_sim::rng::Rng;
use meniscus_sim::shallow_water::{Initial, Precision, Settings, ShallowWater, SplashSettings};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let steps: u64 = match std::env::args().nth(1) {
        Some(text) => text.parse()?,
        None => 100_000,
    };
    for (precision, bar) in [(Precision::Double, 1e-12), (Precision::Single, 1e-6)] {
        storm(steps, precision, bar)?;
    }
    Ok(())
}

fn storm(steps: u64, precision: Precision, bar: f64) -> Result<(), Box<dyn std::error::Error>> {
    let spec = GridSpec::new(Vec2::ZERO, 0.1, UVec2::new(48, 40))?;
    let initial = Initial::still(&spec, |x, z| {
        (-0.4 + 0.1 * (3.0 * x).sin() * (2.0 * z).cos(), 0.0)
    });
    let settings = Settings {
        precision,
        splash: Some(SplashSettings::default()),
        level: Some(0.0),
        ..Settings::default()
    };
    let mut solver = ShallowWater::new(spec, &initial, settings)?;
    let start = solver.report().mass;
    let mut rng = Rng::new(7, 3);
    let (mut worst, mut taken) = (0.0_f64, 0_u64);
    let mut round = 0_u64;
    while taken < steps {
        // A press and a push keep the volume; together they keep the box stormy.
        let position = Vec2::new(4.7 * rng.uniform_f32(), 3.9 * rng.uniform_f32());
        let radius = 0.6;
        if round.is_multiple_of(4) {
            let velocity = 4.0 * Vec2::new(rng.uniform_f32() - 0.5, rng.uniform_f32() - 0.5);
            solver.apply(&Action::Push {
                position,
                radius,
                velocity,
            })?;
        } else if round.is_multiple_of(2) {
            let depth = 0.3;
            solver.apply(&Action::Press {
                position,
                radius,
                depth,
            })?;
        }
        let report = solver.advance(0.05)?;
        taken += u64::from(report.substeps);
        worst = worst.max((report.mass / start - 1.0).abs());
        round += 1;
    }
    let ledger = solver.ledger();
    let verdict = if worst <= bar { "kept" } else { "BROKEN" };
    println!(
        "{precision:?}: {taken} sub-steps, {} droplets thrown, {} landed; largest drift of the volume {worst:.2e} (bar {bar:e}): {verdict}",
        ledger.emitted, ledger.landed
    );
    Ok(())
}
