//! Hard cases, each of which must end stable, sub-stepped or refused with a clear error: the table of
//! `docs/numerics-shallow-water.md`, which `cargo run --release -p meniscus-sim --example hard_cases` prints.

pub mod limits;

use super::edges::{Condition, Edges};
use super::settings::{
    DEFAULT_RELAXATION, Initial, LatticeSettings, Method, Precision, Settings, SetupError,
};
use super::solver::ShallowWater;
use crate::grid::GridSpec;
use crate::solver::{Solver, StepError};
use glam::{UVec2, Vec2};

/// How a case ended.
#[derive(Clone, Debug, PartialEq)]
pub enum Verdict {
    /// It ran, each step in one sub-step.
    Stable,
    /// It ran in several sub-steps a step; how many in all.
    SubStepped(u64),
    /// It was refused, with this message.
    Refused(String),
    /// It broke a law, which no case may: what went wrong.
    Broken(String),
}

impl Verdict {
    /// In one word, without the numbers.
    pub fn word(&self) -> &'static str {
        match self {
            Self::Stable => "stable",
            Self::SubStepped(_) => "sub-stepped",
            Self::Refused(_) => "refused",
            Self::Broken(_) => "**broken**",
        }
    }
}

/// One line of the table.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// What was tried.
    pub case: String,
    /// Name of the scheme.
    pub scheme: &'static str,
    /// Number type.
    pub precision: Precision,
    /// How it ended.
    pub verdict: Verdict,
    /// Largest speed met, m/s.
    pub fastest: f64,
    /// Largest speed that energy allows, m/s.
    pub bound: f64,
}

/// A state and how it is driven.
struct Trial {
    case: String,
    spec: GridSpec,
    initial: Initial,
    settings: Settings,
    /// Length and number of the calls of `advance`.
    steps: (f32, u32),
    /// Largest speed that energy allows, m/s.
    bound: f64,
    /// Whether the volume must stay.
    closed: bool,
}

/// The schemes that are tried. A new one joins the table by a line here.
fn schemes() -> Vec<(&'static str, Settings)> {
    let with = |method| Settings {
        method,
        ..Settings::default()
    };
    vec![
        ("finite-volume", Settings::default()),
        ("lattice", with(Method::Lattice(LatticeSettings::default()))),
        (
            "bgk",
            with(Method::Bgk {
                relaxation: DEFAULT_RELAXATION,
            }),
        ),
    ]
}

/// Runs every case with every scheme in both precisions.
pub fn table() -> Vec<Row> {
    let mut rows = Vec::new();
    for (scheme, settings) in schemes() {
        for precision in [Precision::Single, Precision::Double] {
            let settings = Settings {
                precision,
                ..settings.clone()
            };
            let run = |trial| run(trial, scheme, precision);
            rows.extend(trials(&settings).into_iter().map(run));
        }
    }
    rows
}

/// The table in Markdown: a line a case, a column a scheme and number type.
pub fn markdown(rows: &[Row]) -> String {
    let column = |row: &Row| match row.precision {
        Precision::Single => format!("{}, f32", row.scheme),
        Precision::Double => format!("{}, f64", row.scheme),
    };
    let (mut cases, mut columns) = (Vec::new(), Vec::new());
    for row in rows {
        if !cases.contains(&row.case) {
            cases.push(row.case.clone());
        }
        if !columns.contains(&column(row)) {
            columns.push(column(row));
        }
    }
    let mut text = format!(
        "| case | {} |\n|{}\n",
        columns.join(" | "),
        "---|".repeat(columns.len() + 1)
    );
    for case in cases {
        let cell = |name: &String| {
            let row = rows.iter().find(|row| row.case == case && column(row) == *name);
            row.map_or("", |row| row.verdict.word())
        };
        let cells: Vec<&str> = columns.iter().map(cell).collect();
        text.push_str(&format!("| {case} | {} |\n", cells.join(" | ")));
    }
    text
}

const SIDE: u32 = 48;

fn grid(spacing: f32) -> Option<GridSpec> {
    GridSpec::new(Vec2::ZERO, spacing, UVec2::splat(SIDE)).ok()
}

/// Speed of water that has fallen `height` m, with the dry-bed front's surplus.
fn fall(height: f64) -> f64 {
    // A front on dry ground runs at 2 √(g h) from water at rest: more than free fall by √2.
    2.0 * (crate::solvers::GRAVITY * height).sqrt()
}

fn trials(settings: &Settings) -> Vec<Trial> {
    let Some(spec) = grid(1.0) else { return Vec::new() };
    let trial = |case: String, initial: Initial, bound: f64| Trial {
        case,
        spec,
        initial,
        settings: settings.clone(),
        steps: (0.05, 60),
        bound,
        closed: true,
    };
    let middle = 0.5 * f64::from(SIDE - 1);
    let radius = move |x: f64, z: f64| (x - middle).hypot(z - middle);
    let mut trials = Vec::new();

    for power in 1..=6 {
        let shallow = 10.0_f64.powi(-power);
        let initial = Initial::still(&spec, |x, z| {
            (0.0, if radius(x, z) < 10.0 { 1.0 } else { shallow })
        });
        trials.push(trial(
            format!("round dam, depth ratio 1e{power}:1"),
            initial,
            fall(1.0),
        ));
    }
    let initial = Initial::still(&spec, |x, z| (0.0, if radius(x, z) < 10.0 { 1.0 } else { 0.0 }));
    trials.push(trial("round dam on dry ground".into(), initial, fall(1.0)));
    let initial = Initial::still(&spec, |x, z| {
        (0.0, if radius(x, z) < 10.0 { 1000.0 } else { 1e-3 })
    });
    trials.push(trial("round dam, 1000 m over 1 mm".into(), initial, fall(1000.0)));

    for (depth, step) in [(1.0, 10.0), (1e-3, 10.0), (10.0, 1.0)] {
        let initial = Initial::still(&spec, |x, _| {
            let ground = if x < middle { 0.0 } else { step };
            (ground, ground + depth)
        });
        let case = format!("{depth} m of water on a bed step of {step} m");
        trials.push(trial(case, initial, fall(step + depth)));
    }
    let initial = Initial::still(&spec, |x, z| {
        let ground = 3.0 * (0.9 * x).sin() * (1.1 * z).cos();
        (ground, ground + 1e-6)
    });
    trials.push(trial("film of 1e-6 m on rough hills".into(), initial, fall(6.0)));
    let initial = Initial::still(&spec, |x, z| {
        let ground = 3.0 * (0.9 * x).sin() * (1.1 * z).cos();
        (ground, if x < 10.0 { 5.0 } else { ground + 1e-6 })
    });
    trials.push(trial(
        "dam onto a film of 1e-6 m on rough hills".into(),
        initial,
        fall(8.0),
    ));

    for slope in [1.0, 3.0] {
        let initial = Initial::still(&spec, |x, _| {
            (slope * (x - middle), if x < 8.0 { 10.0 } else { 0.0 })
        });
        let degrees = f64::atan(slope).to_degrees().round();
        let case = format!("wave against a shore of {degrees}°");
        trials.push(trial(case, initial, fall(10.0 + slope * middle)));
    }

    for froude in 0..=5 {
        let u = f64::from(froude) * crate::solvers::GRAVITY.sqrt();
        let initial = Initial::moving(&spec, |x, z| {
            let bump = 0.2 * (-0.05 * radius(x, z).powi(2)).exp();
            (bump, 1.0, [u, 0.3 * u])
        });
        trials.push(Trial {
            settings: Settings {
                edges: Edges::all(&Condition::Periodic),
                ..settings.clone()
            },
            ..trial(
                format!("periodic flow over a bump at Froude {froude}"),
                initial,
                1.1 * u + fall(1.0),
            )
        });
    }
    let u = 5.0 * crate::solvers::GRAVITY.sqrt();
    let initial = Initial::moving(&spec, |_, _| (0.0, 1.0, [u, 0.0]));
    trials.push(trial(
        "flow at Froude 5 thrown against a wall".into(),
        initial,
        u + fall(1.0),
    ));

    let initial = Initial::still(&spec, |x, z| (0.0, if radius(x, z) < 10.0 { 1.0 } else { 0.1 }));
    trials.push(Trial {
        // Largest stable step: 0.45 m over √(g h) = 3.1 m/s.
        steps: (14.0, 1),
        ..trial("step 100 times too large".into(), initial.clone(), fall(1.0))
    });
    trials.push(Trial {
        steps: (1e30, 1),
        ..trial("step of 1e30 s".into(), initial.clone(), fall(1.0))
    });
    trials.push(Trial {
        steps: (f32::NAN, 1),
        ..trial("step of NaN".into(), initial.clone(), fall(1.0))
    });
    for (what, value) in [
        ("NaN", f64::NAN),
        ("infinite", f64::INFINITY),
        ("1e9 m high", 1e9),
    ] {
        let mut broken = initial.clone();
        broken.ground[100] = value;
        trials.push(trial(
            format!("terrain with a sample that is {what}"),
            broken,
            fall(1.0),
        ));
    }
    trials
}

/// Runs a trial and looks for anything that no state may be.
fn run(trial: Trial, scheme: &'static str, precision: Precision) -> Row {
    let bound = trial.bound;
    let mut fastest = 0.0;
    let case = trial.case.clone();
    let verdict = match follow(trial, &mut fastest) {
        Ok(verdict) => verdict,
        Err(message) => Verdict::Refused(message),
    };
    let verdict = match verdict {
        Verdict::Stable | Verdict::SubStepped(_) if !(fastest <= bound) => Verdict::Broken(format!(
            "speed {fastest} m/s exceeds what energy allows, {bound} m/s"
        )),
        other => other,
    };
    Row {
        case,
        scheme,
        precision,
        verdict,
        fastest,
        bound,
    }
}

/// The verdict of a run that was not refused; `Err` holds the message of one that was.
fn follow(trial: Trial, fastest: &mut f64) -> Result<Verdict, String> {
    let refused = |e: SetupError| e.to_string();
    let mut solver = ShallowWater::new(trial.spec, &trial.initial, trial.settings).map_err(refused)?;
    let start = solver.report();
    let mut substeps = 0;
    for _ in 0..trial.steps.1 {
        let report = match solver.advance(trial.steps.0) {
            Ok(report) => report,
            Err(error @ StepError::Unstable { .. }) => return Ok(Verdict::Broken(error.to_string())),
            Err(error) => return Err(error.to_string()),
        };
        substeps += u64::from(report.substeps);
        let film = solver.film_depth();
        for (depth, q) in solver.depths().into_iter().zip(solver.discharges()) {
            if !(depth >= 0.0 && q[0].is_finite() && q[1].is_finite()) {
                return Ok(Verdict::Broken(format!(
                    "depth {depth} m with discharge {q:?} m²/s"
                )));
            }
            if depth > film {
                *fastest = fastest.max(q[0].hypot(q[1]) / depth);
            }
        }
        if trial.closed && (report.mass - start.mass).abs() > 1e-12 * start.mass {
            return Ok(Verdict::Broken(format!(
                "mass went from {} to {} kg",
                start.mass, report.mass
            )));
        }
        if report.energy > start.energy + 1e-3 * start.energy.abs() {
            return Ok(Verdict::Broken(format!(
                "energy grew from {} to {} J",
                start.energy, report.energy
            )));
        }
    }
    Ok(if substeps == u64::from(trial.steps.1) {
        Verdict::Stable
    } else {
        Verdict::SubStepped(substeps)
    })
}
