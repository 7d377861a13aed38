//! Cases of the study `shallow-water` for what acts on the water: splashes, and ground that moves.

use super::case::{Against, Case, Curves, Outcome, Run};
use super::measure::Probe;
use meniscus_sim::events::Action;
use meniscus_sim::glam::{UVec2, Vec2};
use meniscus_sim::rng::Rng;
use meniscus_sim::shallow_water::{
    BedMotion, Condition, Edges, Initial, LatticeSettings, Method, Precision, Series, Settings, ShallowWater,
    SplashSettings,
};
use meniscus_sim::{GridSpec, Solver};

/// Largest change of the volume of grid and droplets over the run.
const DRIFT: &str = "relative change of volume";
/// Σ|η − exact| / Σ|exact| over the cells.
const WAVE: &str = "relative L1 error of the wave";

/// The cases.
pub(super) fn cases(quick: bool) -> Vec<Case> {
    vec![splashing_box(quick), uplift(quick)]
}

fn splashing_box(quick: bool) -> Case {
    let steps: &[u32] = if quick { &[1000] } else { &[1000, 10_000, 100_000] };
    let mut runs = Vec::new();
    for (precision, digits) in [(Precision::Single, "f32"), (Precision::Double, "f64")] {
        for &steps in steps {
            let run = Run::new("finite-volume", f64::from(steps), move |probe: &mut Probe| {
                probe.time(|| splash(precision, u64::from(steps)))
            });
            runs.push(
                run.with("precision", digits)
                    .on_curve(format!("finite-volume, {digits}")),
            );
        }
    }
    Case {
        name: "splashing box",
        truth: "A closed box of 48 × 40 cells that presses and pushes keep stormy, so that it throws some 40 droplets a step: \
                grid and droplets together keep their volume."
            .into(),
        resolution: "steps",
        curves: vec![Curves {
            metric: DRIFT,
            against: Against::Resolution,
            slopes: &[],
        }],
        runs,
    }
}

fn splash(precision: Precision, steps: u64) -> anyhow::Result<Outcome> {
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
    let (mut worst, mut taken, mut round) = (0.0_f64, 0, 0_u32);
    while taken < steps {
        let position = Vec2::new(rng.uniform_f32(), rng.uniform_f32()) * spec.extent();
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
    let outcome = Outcome::of(DRIFT, worst).drift(worst);
    Ok(if ledger.landed > 10 * steps {
        outcome.remark(format!("{} droplets landed", ledger.landed))
    } else {
        outcome.wrong(format!("only {} droplets landed", ledger.landed))
    })
}

/// Height of the uplift, m.
const HEIGHT: f64 = 1e-3;

fn uplift(quick: bool) -> Case {
    let cells: &[u32] = if quick {
        &[100, 200, 400]
    } else {
        &[100, 200, 400, 800]
    };
    let mut runs = Vec::new();
    for (name, method) in [
        ("finite-volume", Method::FiniteVolume),
        ("lattice", Method::Lattice(LatticeSettings::default())),
        ("bgk", Method::Bgk { relaxation: 0.6 }),
    ] {
        for &n in cells {
            let run = Run::new(name, f64::from(n), move |probe: &mut Probe| {
                rise(method, n, probe)
            });
            runs.push(run.with("precision", "f64").on_curve(format!("{name}, f64")));
        }
    }
    Case {
        name: "uplift",
        truth: "The bed of a channel 1 m deep rises by cos² × 1 mm over 12 m within 3 s. Linear theory (Hammack 1973, without \
                dispersion): every moment's rise parts into two halves that run away at √(gh); compared 6 s after the start."
            .into(),
        resolution: "cells along 100 m",
        curves: [Against::Cpu, Against::Resolution]
            .into_iter()
            .map(|against| Curves {
                metric: WAVE,
                against,
                slopes: &[],
            })
            .collect(),
        runs,
    }
}

fn rise(method: Method, cells: u32, probe: &mut Probe) -> anyhow::Result<Outcome> {
    let spacing = 100.0 / cells as f32;
    let spec = GridSpec::new(
        Vec2::new(-50.0 + 0.5 * spacing, 0.0),
        spacing,
        UVec2::new(cells, 4),
    )?;
    let bell = |x: f64| {
        if x.abs() < 6.0 {
            (std::f64::consts::PI * x / 12.0).cos().powi(2)
        } else {
            0.0
        }
    };
    let x = |i: usize| f64::from(spec.position(i, 0).x);
    let settings = Settings {
        method,
        precision: Precision::Double,
        edges: Edges {
            x_min: Condition::Open,
            x_max: Condition::Open,
            ..Edges::all(&Condition::Periodic)
        },
        bed: vec![BedMotion::Uplift {
            shape: (0..spec.len())
                .map(|k| HEIGHT * bell(x(k % spec.width())))
                .collect(),
            share: Series::new(&[[0.0, 0.0], [3.0, 1.0]])?,
        }],
        level: Some(0.0),
        ..Settings::default()
    };
    let mut solver = ShallowWater::new(spec, &Initial::still(&spec, |_, _| (-1.0, 0.0)), settings)?;
    let start = solver.report().mass;
    for _ in 0..12 {
        probe.time(|| solver.advance(0.5))?;
    }
    let (c, parts) = (9.81_f64.sqrt(), 1000);
    let truth = |x: f64| {
        let half = |k: u32| {
            let ago = 6.0 - 3.0 * (f64::from(k) + 0.5) / f64::from(parts);
            0.5 * (bell(x - c * ago) + bell(x + c * ago))
        };
        HEIGHT * (0..parts).map(half).sum::<f64>() / f64::from(parts)
    };
    let (mut sum, mut scale) = (0.0, 0.0);
    for i in 0..spec.width() {
        let exact = truth(x(i));
        sum += (solver.elevation_at(i, 1) - exact).abs();
        scale += exact.abs();
    }
    Ok(Outcome::of(WAVE, sum / scale).drift(solver.report().mass / start - 1.0))
}
