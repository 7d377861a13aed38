//! Study `wave-equation`: explicit and implicit schemes, and procedural waves, against exact solutions.

use super::case::{Against, Case, Curves, Outcome, Run, Study};
use super::measure::Probe;
use super::scenes::{Edges, scene};
use super::truth::{RidgePulse, radial_pulse, standing_wave};
use anyhow::Context as _;
use meniscus_sim::glam::{DVec2, UVec2, Vec2};
use meniscus_sim::scene::description::{Solver as Choice, WaveEquation, WaveScheme};
use meniscus_sim::{Channels, Frame, Grid, GridSpec, Scene, Solver, StepReport, reduce, solvers};
use std::f64::consts::{PI, TAU};
use std::sync::Arc;

/// The study.
pub(crate) struct WaveEquationStudy;

/// Error over the root mean square of the initial elevation.
const L2: &str = "relative L2 error";
/// Advance of the phase beyond the exact one, radians a period.
const PHASE: &str = "phase error (rad a period)";
/// Change of energy over the run, relative to the initial one.
const ENERGY: &str = "relative energy change";
/// Largest error of procedural waves, relative to the sum of their amplitudes.
const DISPERSION: &str = "largest error over the sum of amplitudes";

/// Wave speed in m/s; one, so that times are lengths.
const SPEED: f64 = 1.0;

impl Study for WaveEquationStudy {
    fn name(&self) -> &'static str {
        "wave-equation"
    }

    fn title(&self) -> &'static str {
        "Linear waves against exact solutions"
    }

    fn summary(&self) -> &'static str {
        "explicit and implicit schemes against standing, travelling and radial waves; dispersion of procedural waves"
    }

    fn about(&self) -> &'static str {
        "The solver `wave-equation` steps the linear wave equation on a grid, by an explicit leap-frog scheme with a \
         Courant limit or by implicit ones that are stable at any step, of second order or of first order and damping. All \
         are run from rest to a fixed time and \
         compared with exact solutions in double precision: a standing wave, two pulses that part and travel, and a \
         round hump whose solution is its Hankel integral. A curve refines the grid at a fixed Courant number, given as \
         a multiple of the explicit limit, so space and time are refined together.\n\n\
         The solver `procedural` evaluates sums of sine waves in closed form. Its case sweeps time instead of resolution: \
         the phase ωt must keep its digits for a day of simulated time. The curve beside it keeps the same phase in \
         single precision, as shaders often do."
    }

    fn expectations(&self) -> &'static str {
        include_str!("../../../data/expectations/wave-equation.toml")
    }

    fn cases(&self, quick: bool) -> anyhow::Result<Vec<Case>> {
        Ok(vec![
            standing(quick)?,
            travelling(quick)?,
            radial(quick)?,
            dispersion()?,
        ])
    }
}

/// A scheme with the multiple of the explicit limit that it steps with.
#[derive(Clone, Copy)]
struct Scheme {
    scheme: WaveScheme,
    courant: f64,
}

impl Scheme {
    /// The explicit scheme well below and near its limit, the implicit ones at and beyond it.
    const ALL: [Self; 7] = [
        Self::new(WaveScheme::Explicit, 0.25),
        Self::new(WaveScheme::Explicit, 0.95),
        Self::new(WaveScheme::Implicit, 1.0),
        Self::new(WaveScheme::Implicit, 4.0),
        Self::new(WaveScheme::Implicit, 16.0),
        Self::new(WaveScheme::ImplicitDamped, 1.0),
        Self::new(WaveScheme::ImplicitDamped, 4.0),
    ];

    const fn new(scheme: WaveScheme, courant: f64) -> Self {
        Self { scheme, courant }
    }

    fn name(self) -> &'static str {
        match self.scheme {
            WaveScheme::Explicit => "explicit",
            WaveScheme::Implicit => "implicit",
            WaveScheme::ImplicitDamped => "implicit-damped",
        }
    }

    fn label(self) -> String {
        format!("{}, C = {}", self.name(), self.courant)
    }

    /// Samples across, doubling; steps that span several wavelengths are left out, since a phase that is wrong by whole
    /// turns looks right.
    fn sizes(self, smallest: u32, largest: u32) -> Vec<u32> {
        let doubled = std::iter::successors(Some(smallest), |n| Some(2 * n));
        let sizes = doubled.take_while(|n| *n <= largest);
        sizes.filter(|n| f64::from(*n) >= 4.0 * self.courant).collect()
    }

    fn choice(self, spacing: f32) -> Choice {
        // Spacing / (c √2) is the explicit limit of a uniform medium.
        let limit = f64::from(spacing) / (SPEED * std::f64::consts::SQRT_2);
        Choice::WaveEquation(WaveEquation {
            spacing,
            scheme: self.scheme,
            speed: Some(SPEED as f32),
            depth: 1.0,
            damping: 0.0,
            step: Some((self.courant * limit) as f32),
        })
    }
}

/// What a run of the wave equation is compared with.
trait Truth: Send + Sync + 'static {
    /// Elevation at a point and time.
    fn at(&self, p: DVec2, t: f64) -> f64;
}

impl<F: Fn(DVec2, f64) -> f64 + Send + Sync + 'static> Truth for F {
    fn at(&self, p: DVec2, t: f64) -> f64 {
        self(p, t)
    }
}

/// Samples of a basin with walls at 0 and `length` along X: walls stand half a spacing beyond the outermost samples.
fn basin(length: f64, across: u32, rows: u32) -> anyhow::Result<GridSpec> {
    let spacing = (length / f64::from(across)) as f32;
    Ok(GridSpec::new(
        Vec2::splat(0.5 * spacing),
        spacing,
        UVec2::new(across, rows),
    )?)
}

/// Position of a sample in double precision.
fn position(spec: &GridSpec, k: usize) -> DVec2 {
    let at = UVec2::new((k % spec.width()) as u32, (k / spec.width()) as u32).as_dvec2();
    spec.origin.as_dvec2() + f64::from(spec.spacing) * at
}

fn initial(spec: GridSpec, truth: &impl Truth) -> anyhow::Result<Grid<f32>> {
    let values = (0..spec.len())
        .map(|k| truth.at(position(&spec, k), 0.0) as f32)
        .collect();
    Ok(Grid::from_vec(spec, values)?)
}

/// Sum of squared differences from the truth.
fn squared_error(frame: &Frame, time: f64, truth: &impl Truth) -> f64 {
    let spec = *frame.spec();
    let values = frame.elevation.as_slice();
    reduce::sum(values.len(), |k| {
        (f64::from(values[k]) - truth.at(position(&spec, k), time)).powi(2)
    })
}

fn squares(grid: &Grid<f32>) -> f64 {
    let values = grid.as_slice();
    reduce::sum(values.len(), |k| f64::from(values[k]).powi(2))
}

/// A solver run to `times` seconds one after another; only the stepping is timed.
struct Advanced {
    solver: Box<dyn Solver>,
    frame: Frame,
    start: StepReport,
    end: StepReport,
    /// Frames at the times before the last.
    earlier: Vec<Frame>,
}

fn advance(scene: &Scene, times: &[f64], probe: &mut Probe) -> anyhow::Result<Advanced> {
    let mut solver = solvers::build(scene)?;
    let start = solver.report();
    let mut earlier = Vec::new();
    let mut end = start;
    let mut frame = Frame::new(scene.grid);
    for (n, time) in times.iter().enumerate() {
        let dt = (time - solver.time()) as f32;
        end = probe.time(|| solver.advance(dt))?;
        if n + 1 < times.len() {
            let mut copy = Frame::new(scene.grid);
            solver.extract(Channels::NONE, &mut copy);
            earlier.push(copy);
        }
    }
    solver.extract(Channels::NONE, &mut frame);
    frame.check_finite()?;
    Ok(Advanced {
        solver,
        frame,
        start,
        end,
        earlier,
    })
}

impl Advanced {
    /// The outcome with errors that every case has. The mass drift is relative to the mass in the crests at the start.
    fn outcome(&self, scene: &Scene, truth: &impl Truth) -> anyhow::Result<Outcome> {
        let start = scene
            .initial_elevation
            .as_ref()
            .context("the case has no initial elevation")?;
        let error = (squared_error(&self.frame, self.solver.time(), truth) / squares(start)).sqrt();
        let values = start.as_slice();
        let crests =
            reduce::sum(values.len(), |k| f64::from(values[k]).max(0.0)) * scene.grid.cell_area() * 1000.0;
        Ok(Outcome::of(L2, error)
            .and(ENERGY, (self.end.energy / self.start.energy - 1.0).abs())
            .drift((self.end.mass - self.start.mass) / crests))
    }
}

fn standing(quick: bool) -> anyhow::Result<Case> {
    const PERIODS: f64 = 2.125;
    // A wavelength is as long as the basin along X and twice as long along Z.
    let wave = standing_wave(1.0, (2.0, 1.0), SPEED);
    let period = TAU / wave.omega;
    let mut runs = Vec::new();
    for scheme in Scheme::ALL {
        for n in scheme.sizes(16, if quick { 128 } else { 512 }) {
            let truth = move |p: DVec2, t: f64| wave.at(p.x, p.y, t);
            let grid = basin(1.0, n, n)?;
            let start = initial(grid, &truth)?;
            let scene = Arc::new(scene(
                grid,
                scheme.choice(grid.spacing),
                Edges::Walls,
                None,
                Some(start),
            )?);
            let run = Run::new(scheme.name(), f64::from(n), move |probe| {
                // A quarter of a period before the end the amplitude is the sine of the phase instead of its cosine; to
                // first order the two give the phase error half-way between them.
                let times = [(PERIODS - 0.25) * period, PERIODS * period];
                let done = advance(&scene, &times, probe)?;
                let outcome = done.outcome(&scene, &truth)?;
                let amplitude = |frame: &Frame| {
                    let (spec, values) = (*frame.spec(), frame.elevation.as_slice());
                    let shape = |k: usize| {
                        let p = position(&spec, k);
                        wave.shape(p.x, p.y)
                    };
                    reduce::sum(values.len(), |k| f64::from(values[k]) * shape(k))
                };
                let (sine, cosine) = (amplitude(&done.earlier[0]), amplitude(&done.frame));
                let ahead = sine.atan2(cosine) - PERIODS * TAU;
                let ahead = (ahead + PI).rem_euclid(TAU) - PI;
                // Beyond half a turn nobody can tell how many turns are missing.
                let lost = outcome.errors.iter().any(|e| e.0 == L2 && e.1 > 0.6);
                Ok(if lost {
                    outcome.remark("too far out of phase to tell by how much")
                } else {
                    outcome.and(PHASE, ahead.abs() / (PERIODS - 0.125))
                })
            });
            runs.push(run.with("courant", scheme.courant).on_curve(scheme.label()));
        }
    }
    let mut curves = Curves::standard(L2);
    curves.extend(
        Curves::standard(PHASE)
            .into_iter()
            .filter(|c| c.against == Against::Resolution),
    );
    Ok(Case {
        name: "standing wave",
        truth: "The mode cos(2πx/L) cos(πz/L) of a square basin with walls, from rest, for 2⅛ periods; the truth is \
                cos(ωt) times the mode. Phase error is taken from the projection onto the mode at the end and a quarter \
                of a period before. Mass drift is relative to the mass of the crests."
            .to_owned(),
        resolution: "samples a wavelength",
        curves,
        runs,
    })
}

fn travelling(quick: bool) -> anyhow::Result<Case> {
    let pulse = RidgePulse {
        width: 0.05,
        centre: 0.5,
        period: 1.0,
        speed: SPEED,
    };
    let mut runs = Vec::new();
    for scheme in Scheme::ALL {
        for n in scheme.sizes(32, if quick { 256 } else { 1024 }) {
            let truth = move |p: DVec2, t: f64| pulse.at(p.x, t);
            let spacing = (1.0 / f64::from(n)) as f32;
            let grid = GridSpec::new(Vec2::ZERO, spacing, UVec2::new(n, 8))?;
            let start = initial(grid, &truth)?;
            let scene = Arc::new(scene(
                grid,
                scheme.choice(spacing),
                Edges::Periodic,
                None,
                Some(start),
            )?);
            let run = Run::new(scheme.name(), f64::from(n) * pulse.width, move |probe| {
                advance(&scene, &[2.25], probe)?.outcome(&scene, &truth)
            });
            runs.push(run.with("courant", scheme.courant).on_curve(scheme.label()));
        }
    }
    Ok(Case {
        name: "travelling pulses",
        truth: "A Gaussian ridge on a periodic line parts into two pulses that travel 2¼ times around the basin, through \
                each other; the truth is d'Alembert's. Eight rows of samples, since nothing varies along them. Mass drift \
                is relative to the mass of the ridge."
            .to_owned(),
        resolution: "samples a standard deviation of the pulse",
        curves: Curves::standard(L2),
        runs,
    })
}

fn radial(quick: bool) -> anyhow::Result<Case> {
    const WIDTH: f64 = 0.05;
    const TIME: f64 = 0.3;
    let reach = std::f64::consts::SQRT_2 * 0.5 + 0.01;
    let start = radial_pulse(WIDTH, SPEED, 0.0, reach);
    let end = radial_pulse(WIDTH, SPEED, TIME, reach);
    let mut runs = Vec::new();
    for scheme in Scheme::ALL {
        for n in scheme.sizes(32, if quick { 256 } else { 512 }) {
            let (start, end) = (start.clone(), end.clone());
            let truth = move |p: DVec2, t: f64| {
                let r = (p - DVec2::splat(0.5)).length();
                if t == 0.0 { start.at(r) } else { end.at(r) }
            };
            let grid = basin(1.0, n, n)?;
            let first = initial(grid, &truth)?;
            let scene = Arc::new(scene(
                grid,
                scheme.choice(grid.spacing),
                Edges::Walls,
                None,
                Some(first),
            )?);
            let run = Run::new(scheme.name(), f64::from(n) * WIDTH, move |probe| {
                advance(&scene, &[TIME], probe)?.outcome(&scene, &truth)
            });
            runs.push(run.with("courant", scheme.courant).on_curve(scheme.label()));
        }
    }
    Ok(Case {
        name: "radial pulse",
        truth: "A round Gaussian hump spreads in a basin whose walls it has not reached; the truth is its Hankel integral, \
                evaluated in double precision as a mean of plane ridges over all directions. Shows errors that depend on \
                the direction of travel. Mass drift is relative to the mass of the hump."
            .to_owned(),
        resolution: "samples a standard deviation of the hump",
        curves: Curves::standard(L2),
        runs,
    })
}

/// Amplitude (m), wavelength (m) and direction (degrees) of the waves of the dispersion case: a short-crested sea over
/// four octaves.
const SEA: [(f32, f32, f32); 8] = [
    (0.30, 16.0, 0.0),
    (0.22, 11.3, 25.0),
    (0.16, 8.1, -30.0),
    (0.11, 5.7, 10.0),
    (0.08, 4.05, 55.0),
    (0.05, 2.9, -15.0),
    (0.04, 2.05, 40.0),
    (0.02, 1.02, -60.0),
];

fn dispersion() -> anyhow::Result<Case> {
    let grid = GridSpec::new(Vec2::ZERO, 0.25, UVec2::new(64, 64))?;
    let waves = SEA
        .iter()
        .map(
            |&(amplitude, wavelength, direction)| meniscus_sim::scene::description::Wave {
                amplitude,
                wavelength,
                direction,
                phase: 20.0,
                steepness: 0.0,
            },
        )
        .collect();
    let choice = Choice::Procedural(meniscus_sim::scene::description::Procedural {
        spacing: grid.spacing,
        depth: None,
        waves,
    });
    let scene = Arc::new(scene(grid, choice, Edges::Open, None, None)?);
    let mut runs = Vec::new();
    for power in 0..=5 {
        let time = 10_f64.powi(power);
        let of_solver = Arc::clone(&scene);
        runs.push(Run::new("procedural", time, move |probe| {
            let mut solver = solvers::build(&of_solver)?;
            let mut frame = Frame::new(grid);
            probe.time(|| -> anyhow::Result<()> {
                solver.advance(time as f32)?;
                solver.extract(Channels::NONE, &mut frame);
                Ok(())
            })?;
            Ok(Outcome::of(
                DISPERSION,
                largest_error(&frame.elevation, solver.time()),
            ))
        }));
        runs.push(Run::new("phase in single precision", time, move |probe| {
            let surface = probe.time(|| {
                Grid::from_fn(grid, |i, j| {
                    single_precision_sea(grid.position(i, j), time as f32)
                })
            });
            Ok(Outcome::of(
                DISPERSION,
                largest_error(&surface, f64::from(time as f32)),
            ))
        }));
    }
    Ok(Case {
        name: "dispersion over time",
        truth: "A sum of eight deep-water sine waves of 1 to 16 m on 64 × 64 samples; the truth is the same sum in double \
                precision with ω² = gk, at times up to 10⁵ s. Single precision resolves 6·10⁻⁸ of a value."
            .to_owned(),
        resolution: "simulated time (s)",
        curves: vec![Curves {
            metric: DISPERSION,
            against: Against::Resolution,
            slopes: &[],
        }],
        runs,
    })
}

/// Largest difference from the sea at `time`, relative to the sum of the amplitudes.
fn largest_error(surface: &Grid<f32>, time: f64) -> f64 {
    let (spec, values) = (*surface.spec(), surface.as_slice());
    let exact = |k: usize| -> f64 {
        let p = position(&spec, k);
        SEA.iter()
            .map(|&(amplitude, wavelength, direction)| {
                let number = TAU / f64::from(wavelength);
                let along = DVec2::from_angle(f64::from(direction).to_radians());
                let omega = (solvers::GRAVITY * number).sqrt();
                let phase = number * along.dot(p) - omega * time + 20_f64.to_radians();
                f64::from(amplitude) * phase.cos()
            })
            .sum()
    };
    let whole: f64 = SEA.iter().map(|w| f64::from(w.0)).sum();
    let worst = reduce::arg_max(values.len(), |k| (f64::from(values[k]) - exact(k)).abs());
    worst.map_or(f64::NAN, |(_, error)| error / whole)
}

/// The same sea with everything in single precision, as it is often written.
fn single_precision_sea(p: Vec2, time: f32) -> f32 {
    SEA.iter()
        .map(|&(amplitude, wavelength, direction)| {
            let number = std::f32::consts::TAU / wavelength;
            let omega = (solvers::GRAVITY as f32 * number).sqrt();
            let along = Vec2::from_angle(direction.to_radians());
            amplitude * (number * along.dot(p) - omega * time + 20_f32.to_radians()).cos()
        })
        .sum()
}
