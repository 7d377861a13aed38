//! The solver against closed-form solutions: each case runs at any resolution and measures its error, for tests,
//! studies and benches alike.

use super::analytic::{Bump, BumpFlow, MacDonald, Ritter, Stoker, ThackerPlanar, ThackerRadial, Water};
use super::edges::{Condition, Edges, Series};
use super::settings::{Initial, Method, Precision, Settings, SetupError, position};
use super::solver::ShallowWater;
use crate::grid::{GridError, GridSpec};
use crate::solver::{Solver, StepError};
use glam::{UVec2, Vec2};
use std::f64::consts::SQRT_2;

/// A problem with a known solution.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Case {
    /// Dam break onto water, 5 mm over 1 mm, 10 m channel, 6 s (SWASHES §4.1.1).
    Stoker,
    /// Dam break onto dry ground, 5 mm, 10 m channel, 6 s (SWASHES §4.1.2).
    Ritter,
    /// Planar surface in a paraboloid, one period (SWASHES §4.2.2.2).
    ThackerPlanar,
    /// Radial oscillation in a paraboloid, one period (SWASHES §4.2.2.1).
    ThackerRadial,
    /// Steady flow over a bump (SWASHES §3.1.3–3.1.5), from the exact state until the scheme's own steady state.
    Bump(BumpFlow),
    /// Steady flow with friction in a long channel (SWASHES §3.2.1).
    MacDonald,
    /// Dam break of [`Case::Stoker`] across the diagonal of the grid.
    ObliqueStoker,
}

/// What a run of a case gave.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Outcome {
    /// Σ|h − h_exact| / Σ h_exact over the cells.
    pub depth_error: f64,
    /// Σ|q − q_exact| / Σ|q_exact| over the cells, both directions.
    pub discharge_error: f64,
    /// Smallest depth of the run's end, m.
    pub least_depth: f64,
    /// Largest distance of the shoreline along the middle row from the exact one, in spacings; 0 where there is none.
    pub shore_error: f64,
    /// Relative change of the water's volume; meaningful where the edges are closed.
    pub volume_drift: f64,
    /// Sub-steps taken.
    pub substeps: u64,
    /// Cells of the grid.
    pub cells: usize,
}

/// Why a case could not be run.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CaseError {
    /// The resolution is impossible.
    #[error(transparent)]
    Grid(#[from] GridError),
    /// The solver could not be made.
    #[error(transparent)]
    Setup(#[from] SetupError),
    /// The run failed.
    #[error(transparent)]
    Step(#[from] StepError),
}

/// How a case is computed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Options {
    /// Discretisation.
    pub method: Method,
    /// Number type.
    pub precision: Precision,
    /// Courant number; default: the solver's.
    pub courant: Option<f64>,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            method: Method::default(),
            precision: Precision::Double,
            courant: None,
        }
    }
}

/// A case made ready: the solver, the end and the exact solution there.
pub struct Setup {
    /// The solver in the initial state.
    pub solver: ShallowWater,
    /// End of the run, s.
    pub end: f64,
    exact: Box<dyn Fn(f64, f64) -> Water + Send + Sync>,
    /// Which positions count in the errors.
    counts: fn(f64, f64) -> bool,
}

/// Rows of a case that does not vary along Z.
const ROWS: u32 = 3;

impl Case {
    /// Every case.
    pub const ALL: [Self; 9] = [
        Self::Stoker,
        Self::Ritter,
        Self::ThackerPlanar,
        Self::ThackerRadial,
        Self::Bump(BumpFlow::Subcritical),
        Self::Bump(BumpFlow::Transcritical),
        Self::Bump(BumpFlow::Shock),
        Self::MacDonald,
        Self::ObliqueStoker,
    ];

    /// Name for reports and command lines.
    pub fn name(self) -> &'static str {
        match self {
            Self::Stoker => "stoker",
            Self::Ritter => "ritter",
            Self::ThackerPlanar => "thacker-planar",
            Self::ThackerRadial => "thacker-radial",
            Self::Bump(BumpFlow::Subcritical) => "bump-subcritical",
            Self::Bump(BumpFlow::Transcritical) => "bump-transcritical",
            Self::Bump(BumpFlow::Shock) => "bump-shock",
            Self::MacDonald => "macdonald",
            Self::ObliqueStoker => "stoker-oblique",
        }
    }

    /// The case with `cells` cells along its length.
    ///
    /// # Errors
    /// [`CaseError`] if the resolution or an option is impossible.
    pub fn setup(self, cells: u32, options: Options) -> Result<Setup, CaseError> {
        match self {
            Self::Stoker => {
                let exact = Stoker::new(5.0, 0.005, 0.001);
                dam_break(cells, options, 0.001, move |x, t| exact.at(x, t))
            }
            Self::Ritter => {
                let exact = Ritter {
                    dam: 5.0,
                    left: 0.005,
                };
                dam_break(cells, options, 0.0, move |x, t| exact.at(x, t))
            }
            Self::ObliqueStoker => oblique(cells, options),
            Self::ThackerPlanar => {
                let basin = ThackerPlanar {
                    centre: [2.0, 2.0],
                    radius: 1.0,
                    depth: 0.1,
                    amplitude: 0.5,
                };
                let bed = move |x: f64, z: f64| basin.bed(x, z);
                bowl(cells, options, basin.period(), bed, move |x, z, t| {
                    basin.at(x, z, t)
                })
            }
            Self::ThackerRadial => {
                let basin = ThackerRadial {
                    centre: [2.0, 2.0],
                    radius: 1.0,
                    depth: 0.1,
                    shore: 0.8_f64.sqrt(),
                };
                let bed = move |x: f64, z: f64| basin.bed(x, z);
                bowl(cells, options, basin.period(), bed, move |x, z, t| {
                    basin.at(x, z, t)
                })
            }
            Self::Bump(flow) => bump(cells, options, flow),
            Self::MacDonald => macdonald(cells, options),
        }
    }

    /// Runs the case with `cells` cells along its length and measures the error.
    ///
    /// # Errors
    /// [`CaseError`] if the resolution is impossible or the run fails.
    pub fn run(self, cells: u32, options: Options) -> Result<Outcome, CaseError> {
        self.setup(cells, options)?.run()
    }
}

impl Setup {
    /// Runs to the end and measures.
    ///
    /// # Errors
    /// [`StepError`] if the run fails.
    pub fn run(mut self) -> Result<Outcome, CaseError> {
        let (substeps, volume_drift) = self.advance()?;
        Ok(Outcome {
            volume_drift,
            substeps,
            ..self.measure()
        })
    }

    /// Runs to the end: how many sub-steps that took, and the relative change of the water's volume.
    ///
    /// # Errors
    /// [`StepError`] if the run fails.
    pub fn advance(&mut self) -> Result<(u64, f64), StepError> {
        let before = self.solver.report().mass;
        let mut substeps = 0;
        while self.solver.time() < self.end * (1.0 - 1e-7) {
            let left = (self.end - self.solver.time()) as f32;
            substeps += u64::from(self.solver.advance(left)?.substeps);
        }
        let after = self.solver.report().mass;
        Ok((substeps, (after - before).abs() / before))
    }

    /// Errors of the present state against the solution at the end.
    pub fn measure(&self) -> Outcome {
        let spec = self.solver.spec();
        let (depths, discharges) = (self.solver.depths(), self.solver.discharges());
        let mut sums = [0.0; 4];
        let mut least = f64::INFINITY;
        for k in 0..spec.len() {
            let [x, z] = position(&spec, k % spec.width(), k / spec.width());
            least = least.min(depths[k]);
            if !(self.counts)(x, z) {
                continue;
            }
            let exact = (self.exact)(x, z);
            sums[0] += (depths[k] - exact.depth).abs();
            sums[1] += exact.depth;
            for (q, u) in discharges[k].iter().zip(exact.velocity) {
                sums[2] += (q - exact.depth * u).abs();
                sums[3] += (exact.depth * u).abs();
            }
        }
        Outcome {
            depth_error: sums[0] / sums[1],
            discharge_error: sums[2] / sums[3].max(f64::MIN_POSITIVE),
            least_depth: least,
            shore_error: self.shore_error(&depths),
            volume_drift: 0.0,
            substeps: 0,
            cells: spec.len(),
        }
    }

    /// The ends of the water along the middle row, in cells, against the exact ones; water counts above 1 % of the
    /// exact largest depth.
    fn shore_error(&self, depths: &[f64]) -> f64 {
        let spec = self.solver.spec();
        let j = spec.height() / 2;
        let exact: Vec<f64> = (0..spec.width())
            .map(|i| {
                let [x, z] = position(&spec, i, j);
                (self.exact)(x, z).depth
            })
            .collect();
        let threshold = 0.01 * exact.iter().fold(0.0_f64, |a, &b| a.max(b));
        let ends = |h: &[f64]| {
            let first = h.iter().position(|&h| h > threshold)?;
            let last = h.iter().rposition(|&h| h > threshold)?;
            Some([first as f64, last as f64])
        };
        match (
            ends(&depths[j * spec.width()..(j + 1) * spec.width()]),
            ends(&exact),
        ) {
            (Some(a), Some(b)) => (a[0] - b[0]).abs().max((a[1] - b[1]).abs()),
            _ => 0.0,
        }
    }
}

/// A grid of cells that fill `[0, length]` along X, whose samples are their centres.
fn channel(length: f64, cells: u32, rows: u32) -> Result<GridSpec, GridError> {
    let spacing = (length / f64::from(cells)) as f32;
    GridSpec::new(Vec2::splat(0.5 * spacing), spacing, UVec2::new(cells, rows))
}

fn settings(options: Options, edges: Edges) -> Settings {
    let default = Settings::default();
    Settings {
        method: options.method,
        precision: options.precision,
        courant: options.courant.unwrap_or(default.courant),
        edges,
        ..default
    }
}

fn dam_break(
    cells: u32,
    options: Options,
    right: f64,
    exact: impl Fn(f64, f64) -> Water + Send + Sync + 'static,
) -> Result<Setup, CaseError> {
    let spec = channel(10.0, cells, ROWS)?;
    let initial = Initial::still(&spec, |x, _| (0.0, if x < 5.0 { 0.005 } else { right }));
    let end = 6.0;
    Ok(Setup {
        counts: |_, _| true,
        solver: ShallowWater::new(spec, &initial, settings(options, Edges::default()))?,
        end,
        exact: Box::new(move |x, _| exact(x, end)),
    })
}

/// The dam stands at 45° to the grid, in a periodic strip along it: the flow is that of the straight dam.
fn oblique(cells: u32, options: Options) -> Result<Setup, CaseError> {
    // Along the diagonal the cells are 1/√2 as far apart: as many of them as in the straight channel.
    let diagonal = SQRT_2;
    let n = (f64::from(cells) / diagonal).round() as u32;
    let spec = channel(10.0, n.max(4), n.max(4))?;
    let dam = 5.0 * diagonal;
    let exact = Stoker::new(dam, 0.005, 0.001);
    // The dam runs through the middles of the cells on the diagonal: their means are half and half.
    let quarter = 0.25 * f64::from(spec.spacing);
    let initial = Initial::still(&spec, |x, z| {
        let beyond = x + z - dam * diagonal;
        let depth = if beyond.abs() < quarter {
            0.003
        } else if beyond < 0.0 {
            0.005
        } else {
            0.001
        };
        (0.0, depth)
    });
    let end = 6.0;
    Ok(Setup {
        // A strip across the middle of the dam as long as the straight channel: no edge condition knows a wave that comes
        // in at an angle, and what the ends of the dam disturb travels less than 2 m of the 4.5 m up to the strip.
        counts: |x, z| (x - z).abs() <= 2.5 * SQRT_2 && (x + z - 10.0).abs() <= 5.0 * SQRT_2,
        solver: ShallowWater::new(spec, &initial, settings(options, Edges::all(&Condition::Open)))?,
        end,
        exact: Box::new(move |x, z| {
            let along = exact.at((x + z) / diagonal, end);
            let u = along.velocity[0] / diagonal;
            Water {
                depth: along.depth,
                velocity: [u, u],
            }
        }),
    })
}

fn bowl(
    cells: u32,
    options: Options,
    period: f64,
    bed: impl Fn(f64, f64) -> f64,
    exact: impl Fn(f64, f64, f64) -> Water + Send + Sync + 'static,
) -> Result<Setup, CaseError> {
    let spec = channel(4.0, cells, cells)?;
    let initial = Initial::moving(&spec, |x, z| {
        let water = exact(x, z, 0.0);
        (bed(x, z), bed(x, z) + water.depth, water.velocity)
    });
    Ok(Setup {
        counts: |_, _| true,
        solver: ShallowWater::new(spec, &initial, settings(options, Edges::default()))?,
        end: period,
        exact: Box::new(move |x, z| exact(x, z, period)),
    })
}

fn bump(cells: u32, options: Options, flow: BumpFlow) -> Result<Setup, CaseError> {
    let exact = Bump::new(flow);
    let spec = channel(Bump::LENGTH, cells, ROWS)?;
    let initial = Initial::moving(&spec, |x, _| {
        let water = exact.at(x);
        (Bump::bed(x), Bump::bed(x) + water.depth, water.velocity)
    });
    let edges = Edges {
        x_min: Condition::Discharge(Series::constant(exact.discharge())),
        x_max: match flow {
            BumpFlow::Transcritical => Condition::Open,
            _ => Condition::Elevation(Series::constant(exact.at(Bump::LENGTH).depth)),
        },
        ..Edges::default()
    };
    Ok(Setup {
        counts: |_, _| true,
        solver: ShallowWater::new(spec, &initial, settings(options, edges))?,
        end: 200.0,
        exact: Box::new(move |x, _| exact.at(x)),
    })
}

fn macdonald(cells: u32, options: Options) -> Result<Setup, CaseError> {
    let exact = MacDonald::new();
    let spec = channel(MacDonald::LENGTH, cells, ROWS)?;
    let initial = Initial::moving(&spec, |x, _| {
        let water = exact.at(x);
        (exact.bed(x), exact.bed(x) + water.depth, water.velocity)
    });
    let edges = Edges {
        x_min: Condition::Discharge(Series::constant(MacDonald::DISCHARGE)),
        x_max: Condition::Elevation(Series::constant(exact.at(MacDonald::LENGTH).depth)),
        ..Edges::default()
    };
    let settings = Settings {
        manning: MacDonald::MANNING,
        ..settings(options, edges)
    };
    Ok(Setup {
        counts: |_, _| true,
        solver: ShallowWater::new(spec, &initial, settings)?,
        end: 1500.0,
        exact: Box::new(move |x, _| exact.at(x)),
    })
}
