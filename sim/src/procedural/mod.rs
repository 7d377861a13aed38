//! Sums of directional sines and Gerstner waves with exact linear dispersion, in closed form at any time.
//!
//! A wave of amplitude a, wave vector k and steepness Q lifts the sample at x by a cos θ and moves its surface point
//! by −Q a coth(kd) sin θ along k, with θ = k·x − ωt + φ and ω² = g k tanh(k d) (deep water: tanh = coth = 1). Q = 0 is
//! a sine, Q = 1 the full orbital motion (Gerstner 1802). Phases are kept in `f64`, so a wave is as exact after a day
//! as at the start.
//!
//! Nothing acts on these waves: no event, no shore, no edge. They are for open water, and for comparing renderers.

mod wave;

use crate::events::{Action, EventError};
use crate::frame::{Channels, Frame};
use crate::grid::{Grid, GridSpec};
use crate::optics::WATER_DENSITY;
use crate::scene::Scene;
use crate::scene::description::{self, Initial};
use crate::solver::{Solver, StepError, StepReport};
use crate::solvers::{BuildError, name_of};
use glam::{DVec2, Vec2};
use rayon::prelude::*;
use wave::Wave;

/// What to use where the water has to react.
const REACTING: &str = "use `wave-equation` or `shallow-water` for water that reacts";

/// Waves in closed form.
pub struct Procedural {
    spec: GridSpec,
    level: f32,
    waves: Vec<Wave>,
    /// Depth of the water where there is no ground, metres.
    depth: Option<f64>,
    ground: Option<Grid<f32>>,
    time: f64,
}

impl Procedural {
    /// The solver of a scene with `solver.kind = "procedural"`.
    ///
    /// # Errors
    /// [`BuildError`] for impossible waves, among them Gerstner waves so steep that the surface would fold, and for
    /// scenes that ask the water to react.
    pub fn from_scene(scene: &Scene) -> Result<Self, BuildError> {
        let description::Solver::Procedural(parameters) = &scene.description.solver else {
            return Err(BuildError::WrongSolver {
                expected: "procedural",
                found: name_of(&scene.description.solver),
            });
        };
        refuse_reaction(&scene.description)?;
        if let Some(depth) = parameters.depth.filter(|d| !(d.is_finite() && *d > 0.0)) {
            return Err(BuildError::impossible(
                "solver.depth",
                format!("{depth} m is not a positive depth"),
                "give a positive depth in metres, or leave it out for deep water",
            ));
        }
        let depth = parameters.depth.map(f64::from);
        let mut waves = Vec::with_capacity(parameters.waves.len());
        for (number, wave) in parameters.waves.iter().enumerate() {
            check_wave(number, wave, parameters.spacing)?;
            waves.push(Wave::new(&scene.grid, wave, depth, 0.0));
        }
        let fold: f64 = waves.iter().map(Wave::fold).sum();
        if fold > 1.0 + 1e-6 {
            return Err(BuildError::impossible(
                "solver.wave",
                format!("the horizontal motions add up to a steepness Σ steepness·k·amplitude of {fold:.3}"),
                format!(
                    "above 1 the surface folds over itself; scale every steepness by {:.3}",
                    1.0 / fold
                ),
            ));
        }
        Ok(Self {
            spec: scene.grid,
            level: scene.description.water.level,
            waves,
            depth,
            ground: scene.ground_on_grid(),
            time: 0.0,
        })
    }

    /// Elevation above datum in metres of the surface point that belongs to `position` (metres, X and Z) at `time`.
    /// Where waves lean, that point stands at `position` plus its [displacement](Self::displacement_at).
    pub fn elevation_at(&self, position: DVec2, time: f64) -> f64 {
        let sum: f64 = self
            .waves
            .iter()
            .map(|w| w.amplitude * w.phase_at(position, time).cos())
            .sum();
        f64::from(self.level) + sum
    }

    /// Horizontal displacement in metres of the surface point that belongs to `position` at `time`.
    pub fn displacement_at(&self, position: DVec2, time: f64) -> DVec2 {
        self.waves
            .iter()
            .map(|w| -w.lean * w.phase_at(position, time).sin() * w.direction())
            .sum()
    }

    /// Horizontal velocity in m/s of the surface point that belongs to `position` at `time`.
    pub fn velocity_at(&self, position: DVec2, time: f64) -> DVec2 {
        self.waves
            .iter()
            .map(|w| w.flow * w.phase_at(position, time).cos() * w.direction())
            .sum()
    }

    /// Sums the waves along row `j`.
    fn row(&self, j: usize, row: &mut Row) {
        let start = self.spec.origin.as_dvec2() + DVec2::new(0.0, f64::from(self.spec.spacing) * j as f64);
        row.clear(self.spec.width());
        for wave in &self.waves {
            let (sin, cos) = wave.phase_at(start, self.time).sin_cos();
            row.add(wave, cos, sin);
        }
    }
}

/// Refuses what needs water that reacts.
fn refuse_reaction(scene: &description::Description) -> Result<(), BuildError> {
    if !scene.events.is_empty() {
        return Err(BuildError::impossible(
            "event",
            format!(
                "{} given, but procedural waves cannot be acted on",
                scene.events.len()
            ),
            format!("remove the events, or {REACTING}"),
        ));
    }
    if scene.water.initial != Initial::Still {
        return Err(BuildError::impossible(
            "water.initial",
            "procedural waves have no initial state but themselves",
            format!("use kind = \"still\", or {REACTING}"),
        ));
    }
    Ok(())
}

/// Refuses impossible values of one wave.
fn check_wave(number: usize, wave: &description::Wave, spacing: f32) -> Result<(), BuildError> {
    let key = |name: &str| format!("solver.wave.{number}.{name}");
    for (name, value) in [
        ("amplitude", wave.amplitude),
        ("wavelength", wave.wavelength),
        ("direction", wave.direction),
        ("phase", wave.phase),
        ("steepness", wave.steepness),
    ] {
        if !value.is_finite() {
            return Err(BuildError::impossible(
                key(name),
                format!("{value} is not finite"),
                "give a finite number",
            ));
        }
    }
    if wave.wavelength < 2.0 * spacing {
        return Err(BuildError::impossible(
            key("wavelength"),
            format!(
                "{} m is shorter than two samples of {spacing} m, which would show a false wave",
                wave.wavelength
            ),
            "give a longer wave or a finer solver.spacing",
        ));
    }
    if wave.amplitude.abs() > 1e6 {
        return Err(BuildError::impossible(
            key("amplitude"),
            format!("{} m is no wave of water", wave.amplitude),
            "give at most 1e6 m",
        ));
    }
    if !(0.0..=1.0).contains(&wave.steepness) {
        return Err(BuildError::impossible(
            key("steepness"),
            format!("{} is not a share", wave.steepness),
            "give 0 (sine) to 1 (full orbital motion)",
        ));
    }
    Ok(())
}

/// Sums along one row, each array as long as the row or empty where it is not wanted.
#[derive(Default)]
struct Row {
    with_velocity: bool,
    with_displacement: bool,
    elevation: Vec<f32>,
    velocity: [Vec<f32>; 2],
    displacement: [Vec<f32>; 2],
}

impl Row {
    fn clear(&mut self, width: usize) {
        let zero = |list: &mut Vec<f32>, wanted: bool| {
            list.clear();
            list.resize(if wanted { width } else { 0 }, 0.0);
        };
        zero(&mut self.elevation, true);
        for list in &mut self.velocity {
            zero(list, self.with_velocity);
        }
        for list in &mut self.displacement {
            zero(list, self.with_displacement);
        }
    }

    /// Adds a wave whose phase at the row's first sample has this cosine and sine.
    fn add(&mut self, wave: &Wave, cos: f64, sin: f64) {
        let [column_cos, column_sin] = &wave.column;
        // Re(e^{iθ}) over the row, times a factor.
        let add_cos = |out: &mut [f32], factor: f64| {
            let (c, s) = ((factor * cos) as f32, (factor * sin) as f32);
            for ((out, a), b) in out.iter_mut().zip(column_cos).zip(column_sin) {
                *out += c * a - s * b;
            }
        };
        // Im(e^{iθ}) over the row, times a factor.
        let add_sin = |out: &mut [f32], factor: f64| {
            let (c, s) = ((factor * cos) as f32, (factor * sin) as f32);
            for ((out, a), b) in out.iter_mut().zip(column_cos).zip(column_sin) {
                *out += s * a + c * b;
            }
        };
        add_cos(&mut self.elevation, wave.amplitude);
        let direction = wave.direction().to_array();
        if self.with_velocity {
            for (out, along) in self.velocity.iter_mut().zip(direction) {
                add_cos(out, wave.flow * along);
            }
        }
        if self.with_displacement && wave.lean != 0.0 {
            for (out, along) in self.displacement.iter_mut().zip(direction) {
                add_sin(out, -wave.lean * along);
            }
        }
    }
}

impl Solver for Procedural {
    fn name(&self) -> &'static str {
        "procedural"
    }

    fn spec(&self) -> GridSpec {
        self.spec
    }

    fn time(&self) -> f64 {
        self.time
    }

    /// Velocity is that of the surface points, not the mean over the depth.
    fn offers(&self) -> Channels {
        let moving = Channels::VELOCITY | Channels::DISPLACEMENT;
        if self.ground.is_some() || self.depth.is_some() {
            moving | Channels::DEPTH
        } else {
            moving
        }
    }

    fn advance(&mut self, dt: f32) -> Result<StepReport, StepError> {
        StepError::check_step(dt)?;
        self.time += f64::from(dt);
        Ok(StepReport {
            substeps: 1,
            ..self.report()
        })
    }

    fn extract(&self, want: Channels, out: &mut Frame) {
        let want = want & self.offers();
        out.prepare(self.spec, want);
        out.time = self.time;
        let w = self.spec.width();
        let level = self.level;
        // Rows of an unwanted channel are empty.
        fn rows<T: Copy + Send>(grid: Option<&mut Grid<T>>, w: usize, h: usize) -> Vec<&mut [T]> {
            match grid {
                Some(grid) => grid.as_mut_slice().chunks_mut(w).collect(),
                None => (0..h).map(|_| <&mut [T]>::default()).collect(),
            }
        }
        let h = self.spec.height();
        let velocity = rows(out.velocity.as_mut(), w, h);
        let displacement = rows(out.displacement.as_mut(), w, h);
        out.elevation
            .as_mut_slice()
            .par_chunks_mut(w)
            .zip(velocity)
            .zip(displacement)
            .enumerate()
            .for_each_init(
                || Row {
                    with_velocity: want.contains(Channels::VELOCITY),
                    with_displacement: want.contains(Channels::DISPLACEMENT),
                    ..Row::default()
                },
                |row, (j, ((elevation, velocity), displacement))| {
                    self.row(j, row);
                    for (out, value) in elevation.iter_mut().zip(&row.elevation) {
                        *out = level + value;
                    }
                    interleave(&row.velocity, velocity);
                    interleave(&row.displacement, displacement);
                },
            );
        if let Some(depth) = &mut out.depth {
            let (elevation, rest) = (out.elevation.as_slice(), self.depth.unwrap_or(0.0) as f32 - level);
            let ground = self.ground.as_ref().map(Grid::as_slice);
            for (k, depth) in depth.as_mut_slice().iter_mut().enumerate() {
                *depth = ground
                    .map_or(elevation[k] + rest, |g| elevation[k] - g[k])
                    .max(0.0);
            }
        }
    }

    fn apply(&mut self, action: &Action) -> Result<(), EventError> {
        Err(EventError::Unsupported {
            solver: self.name(),
            action: action.name(),
            remedy: REACTING,
        })
    }

    /// Mass and momentum are those of the present surface (first order in the amplitude, relative to rest); energy is
    /// the sum of the waves' mean energies.
    fn report(&self) -> StepReport {
        let area = self.spec.cell_area();
        let mut report = StepReport {
            largest_stable_step: f64::INFINITY,
            ..StepReport::default()
        };
        for wave in &self.waves {
            let mass = WATER_DENSITY * area * wave.amplitude * wave.sum_at(&self.spec, self.time);
            report.mass += mass;
            // ∂η/∂t = −∇·q gives the flux of a plane wave: q = (ω/k) η along its direction.
            let flux = wave.frequency / wave.vector.length() * wave.direction();
            report.momentum[0] += mass * flux.x;
            report.momentum[1] += mass * flux.y;
            report.energy += wave.energy * area * self.spec.len() as f64;
        }
        report
    }

    fn bytes(&self) -> u64 {
        let columns: usize = self.waves.iter().map(|w| 8 * w.column[0].len()).sum();
        let ground = self.ground.as_ref().map_or(0, |g| 4 * g.spec().len());
        (columns + ground) as u64
    }
}

/// Pairs two rows of components into vectors.
fn interleave(components: &[Vec<f32>; 2], out: &mut [Vec2]) {
    let [x, z] = components;
    for ((out, &x), &z) in out.iter_mut().zip(x).zip(z) {
        *out = Vec2::new(x, z);
    }
}

#[cfg(test)]
mod tests;
