//! Study `shallow-water`: every scheme of the shallow-water solver against exact solutions and a laboratory.

use super::case::{Against, Case, Curves, Outcome, Run, Study};
use super::measure::Probe;
use anyhow::Context as _;
use meniscus_sim::events::Action;
use meniscus_sim::glam::{UVec2, Vec2};
use meniscus_sim::rng::Rng;
use meniscus_sim::shallow_water::analytic::BumpFlow;
use meniscus_sim::shallow_water::cases::{Case as Problem, CaseError, Options};
use meniscus_sim::shallow_water::monai::{Monai, MonaiError};
use meniscus_sim::shallow_water::{
    DEFAULT_RELAXATION, Initial, LatticeSettings, Method, Precision, Settings, ShallowWater,
};
use meniscus_sim::solver::StepError;
use meniscus_sim::solvers::GRAVITY;
use meniscus_sim::{GridSpec, Solver};
use std::sync::Arc;

/// The study.
pub(crate) struct ShallowWaterStudy;

/// Σ|h − exact| / Σ exact over the cells.
const DEPTH: &str = "relative L1 error of depth";
/// The same of depth times velocity.
const DISCHARGE: &str = "relative L1 error of discharge";
/// Distance of the computed shoreline from the exact one.
const SHORE: &str = "shoreline error (cells)";
/// Largest speed in water that should rest.
const SPEED: &str = "largest speed (m/s)";
/// What the steps alone have done to the volume, at its largest over the run.
const DRIFT: &str = "relative change of volume";
/// Mean over the gauges of the root mean square error in time.
const RMS: &str = "mean RMS error of the gauges (cm)";
/// Largest error of a gauge's highest elevation.
const PEAK: &str = "largest error of a peak (cm)";
/// 1 for a run that the scheme refused by name; the note says why.
const REFUSED: &str = "refused";

/// A scheme in a number type: one curve in every figure.
#[derive(Clone, Copy)]
struct Scheme {
    name: &'static str,
    method: fn() -> Method,
    precision: Precision,
}

impl Scheme {
    /// Every scheme that the solver offers; a new one joins all cases by a line here.
    const ALL: [Self; 6] = [
        Self::new("finite-volume", || Method::FiniteVolume, Precision::Single),
        Self::new("finite-volume", || Method::FiniteVolume, Precision::Double),
        Self::new("lattice", lattice, Precision::Single),
        Self::new("lattice", lattice, Precision::Double),
        Self::new("bgk", bgk, Precision::Single),
        Self::new("bgk", bgk, Precision::Double),
    ];

    const fn new(name: &'static str, method: fn() -> Method, precision: Precision) -> Self {
        Self {
            name,
            method,
            precision,
        }
    }

    fn options(self) -> Options {
        Options {
            method: (self.method)(),
            precision: self.precision,
            ..Options::default()
        }
    }

    fn settings(self) -> Settings {
        Settings {
            method: (self.method)(),
            precision: self.precision,
            ..Settings::default()
        }
    }

    fn digits(self) -> &'static str {
        match self.precision {
            Precision::Single => "f32",
            Precision::Double => "f64",
        }
    }

    /// A run of this scheme, on its curve.
    fn run(
        self,
        resolution: u32,
        body: impl Fn(&mut Probe) -> anyhow::Result<Outcome> + Send + Sync + 'static,
    ) -> Run {
        Run::new(self.name, f64::from(resolution), move |probe| {
            body(probe).or_else(refusal)
        })
        .with("precision", self.digits())
        .on_curve(format!("{}, {}", self.name, self.digits()))
    }
}

fn lattice() -> Method {
    Method::Lattice(LatticeSettings::default())
}

fn bgk() -> Method {
    Method::Bgk {
        relaxation: DEFAULT_RELAXATION,
    }
}

/// A run that left the range in which its scheme can be trusted and said so is a result; any other error is a failure.
fn refusal(error: anyhow::Error) -> anyhow::Result<Outcome> {
    let step = match (error.downcast_ref(), error.downcast_ref()) {
        (Some(CaseError::Step(step)), _) | (_, Some(MonaiError::Step(step))) => Some(step),
        _ => error.downcast_ref::<StepError>(),
    };
    match step {
        Some(step @ StepError::OutOfRange { .. }) => {
            Ok(Outcome::of(REFUSED, 1.0).remark(format!("refused: {step}")))
        }
        _ => Err(error),
    }
}

impl Study for ShallowWaterStudy {
    fn name(&self) -> &'static str {
        "shallow-water"
    }

    fn title(&self) -> &'static str {
        "Shallow water against exact solutions and a laboratory"
    }

    fn summary(&self) -> &'static str {
        "dam breaks, basins with moving shores, steady flows, lakes at rest, a stormy box and the Monai valley"
    }

    fn about(&self) -> &'static str {
        "The shallow-water solver runs problems with closed solutions (collected by Delestre et al. 2013 as SWASHES) from \
         their exact initial state and is compared with them in double precision: dam breaks onto water and onto dry ground, \
         one of them across the diagonal of the grid; one period of two oscillations in a paraboloid, whose shoreline moves; \
         steady flows over a bump, started from the exact state and run to the scheme's own steady state; a channel with \
         friction. The error is that of the depth, summed over all cells and relative to the water there is.\n\n\
         Lakes over a bed rough at the scale of a cell must stay still, with and without islands, and 1000 m up. A closed box \
         under a storm of drops must keep its water; what the drops themselves add or take is not counted.\n\n\
         The scheme `bgk` refuses dry ground, films and fast flow; such a run is a row that says so.\n\n\
         The Monai valley is a laboratory model of a tsunami's runup. Its data is not part of the repository; without it the \
         case is left out."
    }

    fn expectations(&self) -> &'static str {
        include_str!("../../../data/expectations/shallow-water.toml")
    }

    fn cases(&self, quick: bool) -> anyhow::Result<Vec<Case>> {
        let mut cases: Vec<Case> = Problem::ALL.iter().map(|p| exact(*p, quick)).collect();
        cases.extend(LAKES.iter().map(|lake| lake_at_rest(*lake)));
        cases.push(deep_waves(quick));
        cases.push(stormy_box(quick));
        cases.extend(super::shallow_water_coupling::cases(quick));
        match Monai::find() {
            Some(folder) => {
                let data = Monai::load(&folder).context("the Monai benchmark cannot be read")?;
                cases.push(monai(&Arc::new(data), quick));
            }
            None => tracing::warn!(
                "the case `monai` is left out: its data is absent; name the folder that holds monai_valley in \
                 MENISCUS_SHARED_DATA"
            ),
        }
        Ok(cases)
    }
}

/// Cells along the length of a problem.
fn resolutions(problem: Problem, quick: bool) -> &'static [u32] {
    match (problem, quick) {
        (Problem::Stoker | Problem::Ritter, true) => &[100, 200, 400],
        (Problem::Stoker | Problem::Ritter, false) => &[50, 100, 200, 400, 800, 1600],
        (Problem::Bump(_), true) => &[100, 200],
        (Problem::Bump(_), false) => &[50, 100, 200, 400],
        (_, true) => &[50, 100, 200],
        (_, false) => &[50, 100, 200, 400],
    }
}

fn exact(problem: Problem, quick: bool) -> Case {
    let mut runs = Vec::new();
    for scheme in Scheme::ALL {
        for &cells in resolutions(problem, quick) {
            runs.push(scheme.run(cells, move |probe| {
                let mut setup = problem.setup(cells, scheme.options())?;
                let (substeps, drift) = probe.time(|| setup.advance())?;
                let found = setup.measure();
                let outcome = Outcome::of(DEPTH, found.depth_error)
                    .and(SHORE, found.shore_error)
                    .remark(format!("{substeps} sub-steps"));
                let outcome = match problem {
                    // After whole periods the truth is at rest: nothing to be relative to.
                    Problem::ThackerRadial => outcome,
                    _ => outcome.and(DISCHARGE, found.discharge_error),
                };
                let outcome = match problem {
                    Problem::ThackerPlanar | Problem::ThackerRadial | Problem::Ritter | Problem::Stoker => {
                        outcome.drift(drift)
                    }
                    _ => outcome,
                };
                Ok(if found.least_depth >= 0.0 {
                    outcome
                } else {
                    outcome.wrong(format!("a depth of {} m", found.least_depth))
                })
            }));
        }
    }
    Case {
        name: problem.name(),
        truth: truth(problem).to_owned(),
        resolution: "cells along the length",
        curves: Curves::standard(DEPTH),
        runs,
    }
}

fn truth(problem: Problem) -> &'static str {
    match problem {
        Problem::Stoker => {
            "Dam break of 5 mm onto 1 mm of water in a 10 m channel, at 6 s: Stoker 1957, SWASHES §4.1.1."
        }
        Problem::Ritter => {
            "Dam break of 5 mm onto dry ground in a 10 m channel, at 6 s: Ritter 1892, SWASHES §4.1.2."
        }
        Problem::ThackerPlanar => {
            "A plane surface that rotates in a paraboloid of 1 m radius and 0.1 m depth, after one period: Thacker 1981, \
             SWASHES §4.2.2.2. The shoreline is taken along the middle row."
        }
        Problem::ThackerRadial => {
            "A bulge that rises and spreads in the same paraboloid, after one period: Thacker 1981, SWASHES §4.2.2.1."
        }
        Problem::Bump(BumpFlow::Subcritical) => "Subcritical flow over a bump, at 200 s: SWASHES §3.1.3.",
        Problem::Bump(BumpFlow::Transcritical) => {
            "Flow over a bump that becomes critical on it, at 200 s: SWASHES §3.1.4."
        }
        Problem::Bump(BumpFlow::Shock) => "The same with a standing jump behind, at 200 s: SWASHES §3.1.5.",
        Problem::MacDonald => {
            "Subcritical flow with Manning friction over a bed made for it, 1 km, at 1500 s: MacDonald et al. 1997, SWASHES \
             §3.2.1."
        }
        Problem::ObliqueStoker => {
            "The dam break onto water with the dam across the diagonal of the grid; the truth is the straight one's, the \
             resolution counts cells along the normal of the dam."
        }
    }
}

/// Relative L2 error of the elevation.
const WAVE: &str = "relative L2 error of elevation";

/// Waves low and slow enough for the linear theory, over deep water: where schemes differ by how they damp and delay
/// short waves.
fn deep_waves(quick: bool) -> Case {
    const DEPTH: f64 = 1.0;
    const LENGTH: f64 = 20.0;
    const HEIGHT: f64 = 1e-4;
    const PERIODS: f64 = 5.0;
    let resolutions: &[u32] = if quick {
        &[8, 12, 16, 24, 32]
    } else {
        &[8, 12, 16, 24, 32, 48, 64]
    };
    let mut runs = Vec::new();
    for scheme in Scheme::ALL {
        for &cells in resolutions {
            runs.push(scheme.run(cells, move |probe| {
                let spec = GridSpec::new(Vec2::ZERO, LENGTH as f32 / cells as f32, UVec2::splat(2 * cells))?;
                let spacing = f64::from(spec.spacing);
                // Crests in the middle of a cell, so that walls half a cell beyond the outermost samples lie on crests.
                let k = std::f64::consts::TAU / (spacing * f64::from(cells));
                let phase = 0.5 * spacing;
                let shape = move |x: f64, z: f64| (k * (x + phase)).cos() * (k * (z + phase)).cos();
                let initial = Initial::still(&spec, |x, z| (-DEPTH, HEIGHT * shape(x, z)));
                let mut solver = ShallowWater::new(spec, &initial, scheme.settings())?;
                let frequency = (GRAVITY * DEPTH).sqrt() * k * std::f64::consts::SQRT_2;
                let end = PERIODS * std::f64::consts::TAU / frequency;
                probe.time(|| solver.advance(end as f32))?;
                let swing = (frequency * solver.time()).cos();
                let (mut error, mut size) = (0.0, 0.0);
                for (n, found) in solver.elevations().into_iter().enumerate() {
                    let at = |n: usize| spacing * n as f64;
                    let exact = HEIGHT * shape(at(n % spec.width()), at(n / spec.width()));
                    error += (found - swing * exact).powi(2);
                    size += exact * exact;
                }
                Ok(Outcome::of(WAVE, (error / size).sqrt()))
            }));
        }
    }
    Case {
        name: "deep waves",
        truth: "Standing waves 0.1 mm high and 20 m long along both axes between walls in 1 m of water, after 5 periods: linear \
                theory, whose own error is of the order of the height over the depth a period."
            .to_owned(),
        resolution: "cells a wavelength",
        curves: Curves::standard(WAVE),
        runs,
    }
}

/// A lake that must rest.
#[derive(Clone, Copy)]
struct Lake {
    name: &'static str,
    /// Largest height of the ground above its lowest point, m; the surface stands 1.5 m above that.
    relief: f64,
    altitude: f64,
}

const LAKES: [Lake; 4] = [
    Lake {
        name: "lake, submerged bed",
        relief: 1.0,
        altitude: 0.0,
    },
    Lake {
        name: "lake with islands",
        relief: 3.0,
        altitude: 0.0,
    },
    Lake {
        name: "lake, submerged bed, 1000 m up",
        relief: 1.0,
        altitude: 1000.0,
    },
    Lake {
        name: "lake with islands, 1000 m up",
        relief: 3.0,
        altitude: 1000.0,
    },
];

/// Largest speed of water deeper than a film.
fn largest_speed(solver: &ShallowWater) -> f64 {
    let film = solver.film_depth();
    let speeds = solver.depths().into_iter().zip(solver.discharges());
    speeds
        .filter(|(h, _)| *h > film)
        .map(|(h, q)| q[0].hypot(q[1]) / h)
        .fold(0.0, f64::max)
}

fn lake_at_rest(lake: Lake) -> Case {
    let mut runs = Vec::new();
    for scheme in Scheme::ALL {
        for side in [32, 128] {
            runs.push(scheme.run(side, move |probe| {
                let spec = GridSpec::new(Vec2::ZERO, 0.7, UVec2::splat(side))?;
                let mut rng = Rng::new(3, 0);
                let ground: Vec<f64> = (0..spec.len())
                    .map(|_| lake.altitude + lake.relief * rng.uniform())
                    .collect();
                let initial = Initial {
                    elevation: vec![lake.altitude + 1.5; spec.len()],
                    ground,
                    velocity: None,
                };
                let mut solver = ShallowWater::new(spec, &initial, scheme.settings())?;
                probe.time(|| solver.advance(10.0))?;
                Ok(Outcome::of(SPEED, largest_speed(&solver)))
            }));
        }
    }
    Case {
        name: lake.name,
        truth: "Still water over noise, 10 s. The truth is rest.".to_owned(),
        resolution: "cells along each side",
        curves: Vec::new(),
        runs,
    }
}

/// Steps between two drops.
const STEPS_A_DROP: u32 = 10;

fn stormy_box(quick: bool) -> Case {
    let mut runs = Vec::new();
    for scheme in Scheme::ALL {
        // The dearest run of all is left to the whole study.
        let dear = scheme.name == "lattice" && scheme.precision == Precision::Double;
        let steps: &[u32] = if quick && dear {
            &[10_000]
        } else {
            &[10_000, 100_000]
        };
        for &steps in steps {
            runs.push(scheme.run(steps, move |probe| probe.time(|| storm(scheme, steps))));
        }
    }
    Case {
        name: "stormy box",
        truth: "A closed box of 24² cells with an island, into which drops fall and from which as many are taken, one of \
                them every 10 steps. What the steps do to the volume is summed; the largest sum over the run counts."
            .to_owned(),
        resolution: "steps",
        curves: vec![Curves {
            metric: DRIFT,
            against: Against::Resolution,
            slopes: &[],
        }],
        runs,
    }
}

fn storm(scheme: Scheme, steps: u32) -> anyhow::Result<Outcome> {
    let spec = GridSpec::new(Vec2::ZERO, 0.5, UVec2::splat(24))?;
    let initial = Initial::still(&spec, |x, z| {
        (1.4 * (-0.1 * ((x - 8.0).powi(2) + (z - 5.0).powi(2))).exp(), 1.0)
    });
    let mut solver = ShallowWater::new(spec, &initial, scheme.settings())?;
    let start = solver.report().mass;
    let mut rng = Rng::new(29, 0);
    let (mut taken, mut volume) = (0, 0.02);
    let (mut change, mut drift, mut fastest) = (0.0, 0.0_f64, 0.0_f64);
    while taken < steps {
        let drop = Action::Drop {
            position: Vec2::new(rng.uniform_f32(), rng.uniform_f32()) * spec.extent(),
            radius: 1.5,
            volume,
        };
        // A drop that would take more water than there is is refused; the next one falls elsewhere.
        if solver.apply(&drop).is_ok() {
            volume = -volume;
        }
        let before = solver.report();
        let step = 0.9 * before.largest_stable_step * f64::from(STEPS_A_DROP);
        let after = solver.advance(step as f32)?;
        taken += after.substeps;
        change += after.mass - before.mass;
        drift = drift.max(change.abs() / start);
        fastest = fastest.max(after.froude);
    }
    let outcome = Outcome::of(DRIFT, drift).drift(drift);
    let least = solver.depths().into_iter().fold(f64::INFINITY, f64::min);
    Ok(if fastest > 0.1 && least >= 0.0 {
        outcome.remark(format!("Froude numbers up to {fastest:.2}"))
    } else {
        outcome.wrong(format!(
            "no storm: Froude number {fastest}, least depth {least} m"
        ))
    })
}

fn monai(data: &Arc<Monai>, quick: bool) -> Case {
    let resolutions: &[u32] = if quick {
        &[49, 98, 196]
    } else {
        &[49, 98, 196, 392]
    };
    let mut runs = Vec::new();
    for scheme in Scheme::ALL {
        for &cells in resolutions {
            let data = Arc::clone(data);
            runs.push(scheme.run(cells, move |probe| {
                let found = probe.time(|| data.run(cells, scheme.settings()))?;
                let peak = found.peak_error.iter().fold(0.0_f64, |a, e| a.max(e.abs()));
                let cm = |gauges: [f64; 3]| gauges.map(|e| format!("{:.3}", 100.0 * e)).join(" ");
                Ok(Outcome::of(RMS, 100.0 * found.mean_rms())
                    .and(PEAK, 100.0 * peak)
                    .remark(format!(
                        "RMS {} cm; peaks {} cm; {} sub-steps",
                        cm(found.rms),
                        cm(found.peak_error),
                        found.substeps
                    )))
            }));
        }
    }
    Case {
        name: "monai",
        truth: "Runup in the Monai valley, 1:400, 22.5 s: three gauges of the laboratory (Liu, Yeh & Synolakis 2008), no \
                exact solution. Channels 5, 7 and 9."
            .to_owned(),
        resolution: "cells along the tank",
        curves: Curves::standard(RMS),
        runs,
    }
}
