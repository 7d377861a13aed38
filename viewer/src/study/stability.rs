//! Study `stability`: what every solver does with steps and situations that are too much for it.

use super::case::{Case, Outcome, Run, Study};
use super::measure::Probe;
use super::plot::{Cell, CellKind, Map};
use super::row::Row;
use super::scenes::{Edges, scene};
use meniscus_sim::glam::{UVec2, Vec2};
use meniscus_sim::rng::Rng;
use meniscus_sim::scene::description::{
    Procedural, ShallowWater, ShallowWaterScheme, Solver as Choice, Wave, WaveEquation, WaveScheme,
};
use meniscus_sim::{Channels, Frame, Grid, GridSpec, Scene, Solver, solver::StepError, solvers};
use std::sync::Arc;

/// The study.
pub(crate) struct StabilityStudy;

/// By how much the surface outgrows what it may, relative; 0 where it does not and where the step was refused.
pub(super) const GROWTH: &str = "growth beyond the bound";

/// Steps asked for, in largest stable steps of the explicit scheme (or, without one, in wave periods).
const STEPS: [f64; 8] = [0.01, 0.1, 0.5, 0.99, 2.0, 10.0, 100.0, 1000.0];

/// Growth of potential energy or height that rounding may cause. An instability doubles it in a few steps.
const TOLERATED_GROWTH: f64 = 0.01;

/// Change of volume that rounding may cause, relative to the volume in the crests at the start.
const TOLERATED_DRIFT: f64 = 1e-3;

impl Study for StabilityStudy {
    fn name(&self) -> &'static str {
        "stability"
    }

    fn title(&self) -> &'static str {
        "Stability: step against stiffness"
    }

    fn summary(&self) -> &'static str {
        "steps of 0.01 to 1000 stable steps in stiff and extreme situations: stable, sub-stepped or refused, never wrong"
    }

    fn about(&self) -> &'static str {
        "Every solver is asked for steps from a hundredth to a thousand times the largest stable step of its explicit \
         scheme, in situations from calm to extreme. All start from white noise at rest, which holds every wave of the grid \
         up to the shortest. A cell is stable if the step was taken as asked, sub-stepped if the solver divided it, and \
         refused if it returned an error that says why.\n\n\
         Every state that is returned as good is checked from its frame alone, not from the solver's own totals: all values \
         finite, no negative depth, potential energy never above what the state started with (nothing drives the water), \
         volume kept where no edge is open. For waves in closed form the bound is the sum of their amplitudes. A cell that \
         breaks any of these and was returned as good is wrong, and fails the study."
    }

    fn expectations(&self) -> &'static str {
        include_str!("../../../data/expectations/stability.toml")
    }

    fn timed(&self) -> bool {
        false
    }

    fn cases(&self, quick: bool) -> anyhow::Result<Vec<Case>> {
        let mut cases = Vec::new();
        for situation in situations()? {
            let situation = Arc::new(situation);
            let mut runs = Vec::new();
            for &method in situation.methods {
                for factor in STEPS {
                    let situation = Arc::clone(&situation);
                    let run = Run::new(method.name(), factor, move |probe| {
                        Ok(situation.try_step(method, factor, quick, probe))
                    });
                    runs.push(run);
                }
            }
            cases.push(Case {
                name: situation.name,
                truth: situation.describe(),
                resolution: "step over the largest stable one",
                curves: Vec::new(),
                runs,
            });
        }
        #[cfg(feature = "sph")]
        cases.extend(super::stability_sph::cases());
        Ok(cases)
    }

    fn maps(&self, rows: &[Row]) -> Vec<Map> {
        let maps = Method::ALL.iter().map(|method| map(*method, rows));
        #[cfg(feature = "sph")]
        let maps = maps.chain(super::stability_sph::maps(rows));
        maps.filter(|m| !m.rows.is_empty()).collect()
    }
}

/// A way of stepping.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Method {
    /// The explicit scheme left to choose its sub-steps.
    Explicit,
    /// The explicit scheme told to step as long as the step asked for.
    ExplicitFixed,
    /// The implicit scheme.
    Implicit,
    /// The implicit scheme that damps.
    ImplicitDamped,
    /// The shallow-water equations by finite volumes.
    FiniteVolume,
    /// The same by the lattice with finite volumes where water is not calm.
    Lattice,
    /// The same by nine populations.
    Bgk,
    /// Closed form.
    Procedural,
}

impl Method {
    const ALL: [Self; 8] = [
        Self::Explicit,
        Self::ExplicitFixed,
        Self::Implicit,
        Self::ImplicitDamped,
        Self::FiniteVolume,
        Self::Lattice,
        Self::Bgk,
        Self::Procedural,
    ];
    /// What can be tried with any basin of water. Nine populations are not among it: noise of a tenth of the depth makes
    /// them grow before they are refused (`docs/numerics-lattice.md`).
    const BASIN: &'static [Self] = &[
        Self::Explicit,
        Self::ExplicitFixed,
        Self::Implicit,
        Self::ImplicitDamped,
        Self::FiniteVolume,
        Self::Lattice,
    ];
    /// What knows a wave speed and damping of its own.
    const LINEAR: &'static [Self] = &[
        Self::Explicit,
        Self::ExplicitFixed,
        Self::Implicit,
        Self::ImplicitDamped,
    ];
    const CLOSED: &'static [Self] = &[Self::Procedural];

    fn name(self) -> &'static str {
        match self {
            Self::Explicit => "wave-equation, explicit",
            Self::ExplicitFixed => "wave-equation, explicit, step given",
            Self::Implicit => "wave-equation, implicit",
            Self::ImplicitDamped => "wave-equation, implicit-damped",
            Self::FiniteVolume => "shallow-water, finite volumes",
            Self::Lattice => "shallow-water, lattice",
            Self::Bgk => "shallow-water, bgk",
            Self::Procedural => "procedural",
        }
    }

    /// The scheme of the shallow-water solver, where it is one.
    fn shallow_water(self) -> Option<ShallowWaterScheme> {
        match self {
            Self::FiniteVolume => Some(ShallowWaterScheme::FiniteVolume),
            Self::Lattice => Some(ShallowWaterScheme::Lattice),
            Self::Bgk => Some(ShallowWaterScheme::Bgk),
            _ => None,
        }
    }
}

/// What the surface may never pass.
#[derive(Clone, Copy, Debug)]
enum Bound {
    /// The potential energy at the start: nothing drives the water.
    Energy,
    /// This height in metres.
    Height(f64),
}

/// A problem that is stiff or extreme in one way.
struct Situation {
    name: &'static str,
    scene: Scene,
    methods: &'static [Method],
    bound: Bound,
    keeps_volume: bool,
}

const SIDE: u32 = 24;

fn situations() -> anyhow::Result<Vec<Situation>> {
    let plain = |name| Basin {
        name,
        ..Basin::default()
    };
    let mut list = vec![
        plain("even depth").build()?,
        Basin {
            edges: Edges::Periodic,
            ..plain("periodic edges")
        }
        .build()?,
        Basin {
            edges: Edges::Open,
            ..plain("open edges")
        }
        .build()?,
        Basin {
            ground: |n| if n % 3 == 0 { -1000.0 } else { -0.001 },
            ..plain("depths of 1 mm beside 1 km")
        }
        .build()?,
        Basin {
            ground: |n| if n % 5 == 0 { 3.0 } else { -2.0 },
            ..plain("islands everywhere")
        }
        .build()?,
        Basin {
            speed: Some(1e4),
            ..plain("waves of 10 km/s")
        }
        .build()?,
        Basin {
            speed: Some(1e-4),
            ..plain("waves of 0.1 mm/s")
        }
        .build()?,
        Basin {
            damping: 1e5,
            ..plain("damping of 100 000 a second")
        }
        .build()?,
        Basin {
            spacing: 1e-3,
            ..plain("samples 1 mm apart")
        }
        .build()?,
        Basin {
            initial: |i, j, _| if (i + j) % 2 == 0 { 0.5 } else { -0.5 },
            ..plain("noise at the Nyquist wave number")
        }
        .build()?,
        Basin {
            initial: |_, _, noise| 9e3 * noise,
            ..plain("waves 9 km high on 1 m of water")
        }
        .build()?,
        Basin {
            initial: |_, _, noise| 1e30 * noise,
            ..plain("waves of 1e30 m")
        }
        .build()?,
        Basin {
            initial: |_, _, noise| 1e-30 * noise,
            ..plain("waves of 1e-30 m")
        }
        .build()?,
        Basin {
            size: UVec2::new(48, 2),
            edges: Edges::Periodic,
            ..plain("two rows of samples")
        }
        .build()?,
    ];
    list.push(procedural("gentle waves", 0.05, 0.0)?);
    list.push(procedural("the steepest waves that do not fold", 0.45, 1.0)?);
    list.push(procedural("waves 1000 km high", 1e6, 0.0)?);
    Ok(list)
}

/// A basin of the wave equation; each situation differs in one thing.
struct Basin {
    name: &'static str,
    edges: Edges,
    size: UVec2,
    spacing: f32,
    speed: Option<f32>,
    damping: f32,
    /// Height of the ground at a sample of that number.
    ground: fn(usize) -> f32,
    /// Elevation at the start from the sample and a random number between −1 and 1.
    initial: fn(usize, usize, f32) -> f32,
}

impl Default for Basin {
    fn default() -> Self {
        Self {
            name: "",
            edges: Edges::Walls,
            size: UVec2::splat(SIDE),
            spacing: 0.5,
            speed: None,
            damping: 0.0,
            ground: |_| -1.0,
            initial: |_, _, noise| 0.1 * noise,
        }
    }
}

impl Basin {
    fn build(self) -> anyhow::Result<Situation> {
        let grid = GridSpec::new(Vec2::ZERO, self.spacing, self.size)?;
        let mut rng = Rng::new(5, 0);
        let start = Grid::from_fn(grid, |i, j| (self.initial)(i, j, 2.0 * rng.uniform_f32() - 1.0));
        let ground = Grid::from_fn(grid, |i, j| (self.ground)(grid.index(i, j)));
        let choice = Choice::WaveEquation(WaveEquation {
            spacing: self.spacing,
            scheme: WaveScheme::Explicit,
            speed: self.speed,
            depth: 1.0,
            damping: self.damping,
            step: None,
        });
        Ok(Situation {
            name: self.name,
            scene: scene(grid, choice, self.edges, Some(ground), Some(start))?,
            methods: if self.speed.is_some() || self.damping > 0.0 {
                Method::LINEAR
            } else {
                Method::BASIN
            },
            bound: Bound::Energy,
            keeps_volume: self.edges != Edges::Open,
        })
    }
}

/// Two crossing waves of `amplitude` metres and 6 m length.
fn procedural(name: &'static str, amplitude: f32, steepness: f32) -> anyhow::Result<Situation> {
    let grid = GridSpec::new(Vec2::ZERO, 0.5, UVec2::splat(SIDE))?;
    let waves = [(0.0, 0.0), (70.0, 100.0)].map(|(direction, phase)| Wave {
        amplitude,
        wavelength: 6.0,
        direction,
        phase,
        steepness,
    });
    let choice = Choice::Procedural(Procedural {
        spacing: grid.spacing,
        depth: None,
        waves: waves.to_vec(),
    });
    Ok(Situation {
        name,
        scene: scene(grid, choice, Edges::Open, None, None)?,
        methods: Method::CLOSED,
        bound: Bound::Height(2.0 * f64::from(amplitude)),
        keeps_volume: false,
    })
}

/// What a trial of one cell came to.
enum Verdict {
    /// Right; how many sub-steps the worst call took.
    Good { substeps: u32 },
    /// An error, in words.
    Refused(String),
    /// Wrong and returned as good: by how much, and what.
    Wrong { growth: f64, what: String },
}

impl Situation {
    fn describe(&self) -> String {
        let methods: Vec<&str> = self.methods.iter().map(|m| m.name()).collect();
        let bound = match self.bound {
            Bound::Energy => "its potential energy at the start".to_owned(),
            Bound::Height(height) => format!("a height of {height} m"),
        };
        format!(
            "Tried with {}. The surface must stay within {bound}.",
            methods.join("; ")
        )
    }

    /// The step that `factor` stands for, in seconds.
    fn step(&self, method: Method, factor: f64) -> f64 {
        if method == Method::Procedural {
            // Deep-water period of a wave of 6 m.
            return factor * 1.96;
        }
        let explicit = if method.shallow_water().is_some() {
            self.scene_for(method, 0.0)
        } else {
            self.scene.clone()
        };
        // Where the scheme refuses the situation itself, any step will do to see that the others do too.
        solvers::build(&explicit).map_or(factor, |solver| factor * solver.report().largest_stable_step)
    }

    /// The scene with the method's own parameters.
    fn scene_for(&self, method: Method, step: f64) -> Scene {
        let mut scene = self.scene.clone();
        if let Some(scheme) = method.shallow_water() {
            scene.description.solver = Choice::ShallowWater(ShallowWater {
                spacing: scene.grid.spacing,
                scheme,
                manning: 0.0,
                smagorinsky: 0.0,
                courant: None,
                film_depth: None,
                relaxation: None,
                splash: None,
            });
        }
        if let Choice::WaveEquation(parameters) = &mut scene.description.solver {
            match method {
                Method::ExplicitFixed => parameters.step = Some(step as f32),
                Method::Implicit => parameters.scheme = WaveScheme::Implicit,
                Method::ImplicitDamped => parameters.scheme = WaveScheme::ImplicitDamped,
                _ => {}
            }
        }
        scene
    }

    fn try_step(&self, method: Method, factor: f64, quick: bool, probe: &mut Probe) -> Outcome {
        let step = self.step(method, factor);
        // Enough steps for an instability of one part in a thousand a step to show, fewer where each costs many.
        let calls = (if quick { 600.0 } else { 3000.0 } / factor)
            .clamp(20.0, if quick { 300.0 } else { 1500.0 }) as usize;
        let scene = self.scene_for(method, step);
        match probe.time(|| self.run(&scene, step as f32, calls)) {
            Verdict::Good { substeps: 1 } => Outcome::of(GROWTH, 0.0).remark("stable"),
            Verdict::Good { substeps } => {
                Outcome::of(GROWTH, 0.0).remark(format!("sub-stepped: {substeps} a step"))
            }
            Verdict::Refused(why) => Outcome::of(GROWTH, 0.0).remark(format!("refused: {why}")),
            Verdict::Wrong { growth, what } => Outcome::of(GROWTH, growth).wrong(format!("wrong: {what}")),
        }
    }

    fn run(&self, scene: &Scene, step: f32, calls: usize) -> Verdict {
        let mut solver = match solvers::build(scene) {
            Ok(solver) => solver,
            Err(error) => return Verdict::Refused(error.to_string()),
        };
        let mut frame = Frame::new(scene.grid);
        let want = solver.offers();
        solver.extract(want, &mut frame);
        let start = Totals::of(scene, &frame);
        let mut most = 1;
        for _ in 0..calls {
            match solver.advance(step) {
                Ok(report) => most = most.max(report.substeps),
                Err(error) => return Verdict::Refused(brief(&error)),
            }
            if let Some(wrong) = self.check(&*solver, scene, want, &mut frame, &start) {
                return wrong;
            }
        }
        Verdict::Good { substeps: most }
    }

    /// Looks for anything wrong in a state that was returned as good.
    fn check(
        &self,
        solver: &dyn Solver,
        scene: &Scene,
        want: Channels,
        frame: &mut Frame,
        start: &Totals,
    ) -> Option<Verdict> {
        let wrong = |growth: f64, what: String| Some(Verdict::Wrong { growth, what });
        solver.extract(want, frame);
        if let Err(error) = frame.check_finite() {
            return wrong(f64::MAX, error.to_string());
        }
        let lowest = frame.depth.as_ref().map_or(0.0, |depth| depth.range().0);
        if lowest < 0.0 {
            return wrong(
                f64::from(-lowest),
                format!("a depth of {lowest} m at t = {} s", solver.time()),
            );
        }
        let now = Totals::of(scene, frame);
        let growth = match self.bound {
            Bound::Energy if start.potential > 0.0 => now.potential / start.potential - 1.0,
            Bound::Energy => now.potential,
            Bound::Height(height) => now.highest / height - 1.0,
        };
        if !(growth <= TOLERATED_GROWTH) {
            return wrong(
                growth,
                format!(
                    "the surface outgrew its bound by {growth:.3e} at t = {} s",
                    solver.time()
                ),
            );
        }
        let drift = (now.volume - start.volume).abs() / start.crests.max(f64::MIN_POSITIVE);
        if self.keeps_volume && !(drift <= TOLERATED_DRIFT) {
            return wrong(
                drift,
                format!(
                    "the volume changed by {drift:.3e} of the crests at t = {} s",
                    solver.time()
                ),
            );
        }
        None
    }
}

/// What a frame holds, in units of the sample's area: heights over the samples that are water at rest; volume from
/// the depth of all samples where the method moves the shore, else from the heights, since a trough of the linear
/// equation may reach below the bed.
struct Totals {
    potential: f64,
    volume: f64,
    crests: f64,
    highest: f64,
}

impl Totals {
    fn of(scene: &Scene, frame: &Frame) -> Self {
        let level = f64::from(scene.description.water.level);
        let mut totals = Self {
            potential: 0.0,
            volume: 0.0,
            crests: 0.0,
            highest: 0.0,
        };
        let moving_shore = match (&scene.description.solver, &frame.depth) {
            (Choice::ShallowWater(_), Some(depth)) => Some(depth.as_slice()),
            _ => None,
        };
        for (k, elevation) in frame.elevation.as_slice().iter().enumerate() {
            let ground = scene.terrain.as_ref().map(|g| f64::from(g.as_slice()[k]) - level);
            let mut height = f64::from(*elevation) - level;
            if let (Some(depth), Some(ground)) = (moving_shore, ground) {
                // Frames continue the surface below the shore, where there is no water: a dry sample's height is its
                // ground's. On land, what counts is the water above the ground.
                if height <= ground {
                    height = ground + f64::from(depth[k]);
                }
                if ground >= 0.0 {
                    totals.potential += height * height - ground * ground;
                    continue;
                }
            } else if ground.is_some_and(|g| g >= 0.0) {
                continue;
            }
            totals.potential += height * height;
            totals.volume += height;
            totals.crests += height.max(0.0);
            totals.highest = totals.highest.max(height.abs());
        }
        if let Some(depth) = moving_shore {
            totals.volume = depth.iter().map(|d| f64::from(*d)).sum();
        }
        totals
    }
}

/// The first clause of an error.
pub(super) fn brief(error: &StepError) -> String {
    let text = error.to_string();
    text.split(';').next().unwrap_or(&text).to_owned()
}

fn map(method: Method, rows: &[Row]) -> Map {
    let mine: Vec<&Row> = rows.iter().filter(|row| row.method == method.name()).collect();
    let mut situations: Vec<&str> = mine.iter().map(|row| row.case.as_str()).collect();
    situations.dedup();
    let lines = situations.into_iter().map(|situation| {
        let cells = mine
            .iter()
            .filter(|row| row.case == situation)
            .map(|row| cell(row));
        (situation.to_owned(), cells.collect())
    });
    Map {
        name: method.name().to_owned(),
        title: format!("What becomes of a step: {}", method.name()),
        columns_label: if method == Method::Procedural {
            "step asked for, in wave periods".to_owned()
        } else {
            "step asked for, in largest stable explicit steps".to_owned()
        },
        columns: STEPS.iter().map(ToString::to_string).collect(),
        rows: lines.collect(),
    }
}

pub(super) fn cell(row: &Row) -> Cell {
    let note = row.note.as_str();
    let (kind, text) = if !row.ok {
        (CellKind::Wrong, "wrong".to_owned())
    } else if let Some(rest) = note.strip_prefix("sub-stepped: ") {
        let count = rest.split(' ').next().unwrap_or_default();
        (CellKind::SubStepped, format!("× {count}"))
    } else if note.starts_with("refused") {
        (CellKind::Refused, "refused".to_owned())
    } else {
        (CellKind::Stable, "stable".to_owned())
    };
    Cell { kind, text }
}
