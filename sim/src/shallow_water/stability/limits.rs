//! How far each scheme can be pushed: the tables of `docs/numerics-lattice.md`.
//!
//! A run survives if no step is refused, no depth is negative, every value is finite, no water is lost and the energy
//! never passes that of the start by more than a hundredth: the first steps of an edge sharper than a cell may gain some
//! thousandths, and a run that dies gains without bound.

use crate::grid::GridSpec;
use crate::rng::Rng;
use crate::shallow_water::edges::{Condition, Edges};
use crate::shallow_water::settings::{
    DEFAULT_COURANT, DEFAULT_RELAXATION, Initial, LARGEST_COURANT, LatticeSettings, Method, Precision,
    Settings,
};
use crate::shallow_water::solver::ShallowWater;
use crate::solver::Solver;
use crate::solvers::GRAVITY;
use glam::{UVec2, Vec2};
use std::f64::consts::TAU;

/// What a scheme bears at one relaxation time.
#[derive(Clone, Debug, PartialEq)]
pub struct AtRelaxation {
    /// Name of the scheme.
    pub scheme: &'static str,
    /// Relaxation time of the shear stress in steps.
    pub relaxation: f64,
    /// Whether it survives 1500 steps of two thin shear layers at Froude 0.2.
    pub shear: bool,
    /// Largest ratio of depths of a round dam that it and all smaller ones survive; 1 if none.
    pub ratio: f64,
}

/// What step a scheme bears.
#[derive(Clone, Debug, PartialEq)]
pub struct LargestStep {
    /// Name of the scheme.
    pub scheme: &'static str,
    /// (|u| + √(g h)) Δt/Δx of the longest step tried that it and all shorter ones survive.
    pub survives: f64,
    /// That of its own steps.
    pub default: f64,
    /// The longest that its settings allow.
    pub allowed: f64,
}

const RELAXATIONS: [f64; 6] = [0.5001, 0.501, 0.505, 0.51, 0.6, 1.0];
const RATIOS: [f64; 10] = [1.4, 1.7, 2.0, 2.5, 3.0, 4.0, 5.0, 30.0, 1e3, 1e6];
/// (|u| + √(g h)) Δt/Δx of [`Method::Bgk`] at the solver's default Courant number.
const BGK_REACH: f64 = 0.8;

fn periodic(method: Method) -> Settings {
    Settings {
        method,
        precision: Precision::Double,
        edges: Edges::all(&Condition::Periodic),
        ..Settings::default()
    }
}

/// Every scheme with a relaxation time at every one.
pub fn relaxations() -> Vec<AtRelaxation> {
    let bgk = |relaxation| Method::Bgk { relaxation };
    let lattice = |relaxation: f64| {
        Method::Lattice(LatticeSettings {
            shear_rate: 1.0 / relaxation,
            ..LatticeSettings::default()
        })
    };
    let schemes: [(&'static str, &dyn Fn(f64) -> Method); 2] = [("bgk", &bgk), ("lattice", &lattice)];
    let mut rows = Vec::new();
    for (scheme, method) in schemes {
        for relaxation in RELAXATIONS {
            let method = method(relaxation);
            let ratios = RATIOS.iter().take_while(|ratio| round_dam(method, **ratio));
            rows.push(AtRelaxation {
                scheme,
                relaxation,
                shear: shear_layers(method),
                ratio: ratios.last().copied().unwrap_or(1.0),
            });
        }
    }
    rows
}

/// Every scheme at ever longer steps.
pub fn steps() -> Vec<LargestStep> {
    let volumes = |courant| Settings {
        courant,
        ..periodic(Method::FiniteVolume)
    };
    let lattice = |courant| {
        periodic(Method::Lattice(LatticeSettings {
            courant,
            ..LatticeSettings::default()
        }))
    };
    let bgk = |courant: f64| Settings {
        courant: (courant * DEFAULT_COURANT / BGK_REACH).min(LARGEST_COURANT),
        ..periodic(Method::Bgk {
            relaxation: DEFAULT_RELAXATION,
        })
    };
    let row = |scheme, tried: &[f64], default, settings: &dyn Fn(f64) -> Settings| {
        let survived = tried.iter().take_while(|courant| noise(settings(**courant)));
        LargestStep {
            scheme,
            survives: survived.last().copied().unwrap_or(0.0),
            default,
            allowed: tried.last().copied().unwrap_or(0.0),
        }
    };
    vec![
        row(
            "finite-volume",
            &[0.3, 0.4, 0.45, LARGEST_COURANT],
            DEFAULT_COURANT,
            &volumes,
        ),
        row(
            "lattice",
            &[0.5, 0.6, 0.65, 0.7, 0.75, 0.8, 0.85, 0.9],
            LatticeSettings::default().courant,
            &lattice,
        ),
        row("bgk", &[0.5, 0.6, 0.7, 0.8, 0.85, 0.88], BGK_REACH, &bgk),
    ]
}

/// Both tables in Markdown.
pub fn markdown(relaxations: &[AtRelaxation], steps: &[LargestStep]) -> String {
    let mut text =
        "| τ | bgk, shear layers | lattice, shear layers | bgk, depth ratio | lattice, depth ratio |\n\
                    |---|---|---|---|---|\n"
            .to_owned();
    for relaxation in RELAXATIONS {
        let of = |scheme: &str| {
            relaxations
                .iter()
                .find(|row| row.scheme == scheme && row.relaxation == relaxation)
        };
        let shear = |scheme| match of(scheme) {
            Some(row) if row.shear => "survives",
            _ => "dies",
        };
        let ratio = |scheme| match of(scheme) {
            Some(row) if row.ratio > 1e3 => format!("{:e}:1", row.ratio),
            Some(row) => format!("{}:1", row.ratio),
            None => String::new(),
        };
        text.push_str(&format!(
            "| {relaxation} | {} | {} | {} | {} |\n",
            shear("bgk"),
            shear("lattice"),
            ratio("bgk"),
            ratio("lattice")
        ));
    }
    text.push_str("\n| scheme | longest step that survives | its own steps | longest that is allowed |\n|---|---|---|---|\n");
    for row in steps {
        text.push_str(&format!(
            "| {} | {} | {} | {} |\n",
            row.scheme, row.survives, row.default, row.allowed
        ));
    }
    text
}

/// Two thin shear layers in a periodic box, bent by a wave across (after Minion & Brown 1997,
/// doi:10.1006/jcph.1997.5843).
fn shear_layers(method: Method) -> bool {
    let Ok(spec) = GridSpec::new(Vec2::ZERO, 1.0, UVec2::splat(64)) else {
        return false;
    };
    let speed = 0.2 * GRAVITY.sqrt();
    let initial = Initial::moving(&spec, |x, z| {
        let (x, z) = (x / 64.0, z / 64.0);
        let layer = if z <= 0.5 { z - 0.25 } else { 0.75 - z };
        let across = 0.05 * speed * (TAU * (x + 0.25)).sin();
        (0.0, 1.0, [speed * (80.0 * layer).tanh(), across])
    });
    survives(&spec, &initial, periodic(method), 1500)
}

/// A round dam of 1 m depth in water `ratio` times shallower, between walls.
fn round_dam(method: Method, ratio: f64) -> bool {
    let Ok(spec) = GridSpec::new(Vec2::ZERO, 1.0, UVec2::splat(48)) else {
        return false;
    };
    let initial = Initial::still(&spec, |x, z| {
        let inside = (x - 23.5).hypot(z - 23.5) < 10.0;
        (0.0, if inside { 1.0 } else { 1.0 / ratio })
    });
    let settings = Settings {
        edges: Edges::default(),
        ..periodic(method)
    };
    survives(&spec, &initial, settings, 300)
}

fn survives(spec: &GridSpec, initial: &Initial, settings: Settings, steps: u32) -> bool {
    let Ok(mut solver) = ShallowWater::new(*spec, initial, settings) else {
        return false;
    };
    let start = solver.report();
    let mut step = 0.99 * start.largest_stable_step;
    for _ in 0..steps {
        let Ok(report) = solver.advance(step as f32) else {
            return false;
        };
        step = 0.99 * report.largest_stable_step;
        let sound = report.energy <= start.energy + 1e-2 * start.energy.abs()
            && (report.mass - start.mass).abs() <= 1e-12 * start.mass;
        if !sound {
            return false;
        }
    }
    let sound = |(h, q): (f64, [f64; 2])| h >= 0.0 && q[0].is_finite() && q[1].is_finite();
    solver.depths().into_iter().zip(solver.discharges()).all(sound)
}

/// Whether white noise of a thousandth of the depth on a flow of Froude 0.2 falls to a tenth of its height and less in
/// 1500 steps.
fn noise(settings: Settings) -> bool {
    let Ok(spec) = GridSpec::new(Vec2::ZERO, 1.0, UVec2::splat(48)) else {
        return false;
    };
    let speed = 0.2 * GRAVITY.sqrt();
    let mut rng = Rng::new(11, 0);
    let mut initial = Initial::moving(&spec, |_, _| (0.0, 1.0, [speed, 0.3 * speed]));
    for surface in &mut initial.elevation {
        *surface += 1e-3 * (2.0 * rng.uniform() - 1.0);
    }
    let Ok(mut solver) = ShallowWater::new(spec, &initial, settings) else {
        return false;
    };
    let size = |solver: &ShallowWater| -> f64 { solver.depths().iter().map(|h| (h - 1.0).powi(2)).sum() };
    let start = size(&solver);
    let mut step = 0.999 * solver.report().largest_stable_step;
    for _ in 0..1500 {
        let Ok(report) = solver.advance(step as f32) else {
            return false;
        };
        step = 0.999 * report.largest_stable_step;
    }
    size(&solver) <= 0.01 * start
}
