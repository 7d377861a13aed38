//! Solvers on top of each other: waves of one over the water of another (`[[layer]]`).
//!
//! The base moves the water: shores, floods, bodies, events. A layer adds waves that the base is too coarse for or does
//! not know: its elevation relative to still water, its horizontal displacement and its velocity add up, and foam joins
//! as independent covers do, 1 − (1 − f)(1 − f′). Nothing of a layer acts back on the base.
//!
//! Where the base is shallow a layer fades, by a factor that rises smoothly from 0 at no depth to 1 at `fade_depth`:
//! dry samples stay exactly as the base has them, so shores stay dry. A trough never takes more than nine tenths of the
//! water that is there.

use crate::events::{Action, EventError};
use crate::frame::{Channels, Frame};
use crate::grid::{Grid, GridSpec};
use crate::scene::Scene;
use crate::scene::description::{Edge, Initial, Motion, Solver as Choice};
use crate::solver::{Extra, Solver, StepError, StepReport, Stirring};
use crate::solvers::{self, BuildError};
use crate::stages::Stages;
use glam::{BVec2, UVec2};
use std::cell::RefCell;
use std::ops::{Add, Mul};
use std::time::Instant;

/// Share of the water that a trough may take.
const DEEPEST: f32 = 0.9;

/// What a layer can add besides its elevation.
fn added() -> Channels {
    Channels::VELOCITY | Channels::DISPLACEMENT | Channels::FOAM
}

/// A base with layers over it.
pub struct Layered {
    base: Box<dyn Solver>,
    layers: Vec<Layer>,
    /// Frames of the base and of a layer, kept for their allocations.
    work: RefCell<(Frame, Frame)>,
    stages: Stages,
}

struct Layer {
    solver: Box<dyn Solver>,
    /// Elevation of its still water.
    level: f32,
    fade_depth: f32,
    /// Where its samples differ from the base's: how to take them.
    resample: Option<Resample>,
}

impl Layered {
    /// Puts the layers of `scene` over the solver of its base.
    ///
    /// # Errors
    /// [`BuildError`] if a layer cannot be built; its keys begin with `layer.N`.
    pub fn new(scene: &Scene, base: Box<dyn Solver>) -> Result<Self, BuildError> {
        let spec = base.spec();
        let mut layers = Vec::with_capacity(scene.description.layers.len());
        for (number, layer) in scene.description.layers.iter().enumerate() {
            let within = |e| in_layer(number, e);
            let own = scene_of(scene, &layer.solver, &spec, number)?;
            let solver = solvers::build(&own).map_err(within)?;
            layers.push(Layer {
                level: own.description.water.level,
                fade_depth: layer.fade_depth,
                resample: Resample::between(&solver.spec(), &spec, periodic(scene)),
                solver,
            });
        }
        let empty = || Frame::new(spec);
        Ok(Self {
            base,
            layers,
            work: RefCell::new((empty(), empty())),
            stages: Stages::default(),
        })
    }
}

fn periodic(scene: &Scene) -> BVec2 {
    let edges = &scene.description.boundary;
    BVec2::new(edges.x_min == Edge::Periodic, edges.z_min == Edge::Periodic)
}

/// The same error at the keys of a layer.
fn in_layer(number: usize, error: BuildError) -> BuildError {
    match error {
        BuildError::Impossible { key, message, remedy } => BuildError::Impossible {
            key: format!("layer.{number}.{key}"),
            message,
            remedy,
        },
        other => other,
    }
}

/// What a layer's solver is built from: the scene without what belongs to the base alone.
fn scene_of(scene: &Scene, solver: &Choice, base: &GridSpec, number: usize) -> Result<Scene, BuildError> {
    let spacing = solver.spacing();
    let mut size = UVec2::ZERO;
    for (axis, periodic) in [periodic(scene).x, periodic(scene).y].into_iter().enumerate() {
        let ratio = f64::from(base.spacing) / f64::from(spacing);
        let intervals = f64::from(base.size[axis] - u32::from(!periodic)) * ratio;
        // A layer may reach a little beyond an open domain, but has to end where a periodic one does.
        let whole = if periodic {
            intervals.round()
        } else {
            (intervals - 1e-3).ceil()
        };
        if !(2.0..1e9).contains(&whole) || (periodic && (whole - intervals).abs() > 1e-3) {
            return Err(BuildError::impossible(
                format!("layer.{number}.solver.spacing"),
                format!("samples {spacing} m apart do not divide the periodic domain of the base"),
                format!(
                    "use {} m, as the base does, or a whole share of the domain",
                    base.spacing
                ),
            ));
        }
        size[axis] = whole as u32 + u32::from(!periodic);
    }
    let grid = GridSpec::new(base.origin, spacing, size).map_err(|e| {
        let remedy = format!("use {} m, as the base does", base.spacing);
        BuildError::impossible(format!("layer.{number}.solver.spacing"), e.to_string(), remedy)
    })?;
    let mut description = scene.description.clone();
    description.solver = solver.clone();
    description.layers.clear();
    description.detail = None;
    description.events.clear();
    description.water.initial = Initial::Still;
    let floating = |k: usize| scene.description.objects[k].motion == Motion::Free;
    let kept = |k: &usize| !floating(*k);
    let objects = 0..scene.description.objects.len();
    description.objects = objects
        .clone()
        .filter(kept)
        .map(|k| scene.description.objects[k].clone())
        .collect();
    Ok(Scene {
        description,
        grid,
        terrain: scene.terrain.clone(),
        meshes: objects
            .filter(kept)
            .filter_map(|k| scene.meshes.get(k).cloned())
            .collect(),
        sky: None,
        initial_elevation: None,
        uplifts: Vec::new(),
    })
}

/// How much of a layer there is over water of a depth: 0 on dry ground, 1 from `fade_depth` on.
pub fn share(depth: f32, fade_depth: f32) -> f32 {
    if depth <= 0.0 {
        0.0
    } else if depth >= fade_depth {
        1.0
    } else {
        let s = depth / fade_depth;
        s * s * (3.0 - 2.0 * s)
    }
}

impl Layer {
    /// Adds the layer's frame to `out`, over water of the base's depth.
    fn add(&self, own: &Frame, depth: Option<&Grid<f32>>, out: &mut Frame) {
        let spec = *out.spec();
        let w = spec.width();
        for j in 0..spec.height() {
            for i in 0..w {
                let k = j * w + i;
                let water = depth.map_or(f32::INFINITY, |d| d.as_slice()[k]);
                let share = share(water, self.fade_depth);
                if share == 0.0 {
                    continue;
                }
                let rise = share * (self.at(&own.elevation, i, j) - self.level);
                let rise = rise.max(-DEEPEST * water);
                out.elevation.as_mut_slice()[k] += rise;
                if let Some(depth) = &mut out.depth {
                    depth.as_mut_slice()[k] += rise;
                }
                for (sum, own) in [
                    (&mut out.velocity, &own.velocity),
                    (&mut out.displacement, &own.displacement),
                ] {
                    if let (Some(sum), Some(own)) = (sum, own) {
                        sum.as_mut_slice()[k] += share * self.at(own, i, j);
                    }
                }
                if let (Some(sum), Some(own)) = (&mut out.foam, &own.foam) {
                    let foam = &mut sum.as_mut_slice()[k];
                    *foam = 1.0 - (1.0 - *foam) * (1.0 - share * self.at(own, i, j).clamp(0.0, 1.0));
                }
            }
        }
    }

    fn at<T>(&self, grid: &Grid<T>, i: usize, j: usize) -> T
    where
        T: Copy + Default + Add<Output = T> + Mul<f32, Output = T>,
    {
        match &self.resample {
            None => grid[(i, j)],
            Some(resample) => resample.at(grid, i, j),
        }
    }
}

impl Solver for Layered {
    /// That of the base.
    fn name(&self) -> &'static str {
        self.base.name()
    }

    fn spec(&self) -> GridSpec {
        self.base.spec()
    }

    fn time(&self) -> f64 {
        self.base.time()
    }

    fn offers(&self) -> Channels {
        let layers = self
            .layers
            .iter()
            .fold(Channels::NONE, |sum, l| sum | l.solver.offers());
        self.base.offers() | (layers & added())
    }

    fn advance(&mut self, dt: f32) -> Result<StepReport, StepError> {
        self.stages.clear();
        let mut clock = Instant::now();
        let mut total = self.base.advance(dt)?;
        self.stages.of(&*self.base, &mut clock);
        for layer in &mut self.layers {
            total = both(total, layer.solver.advance(dt)?);
            self.stages.of(&*layer.solver, &mut clock);
        }
        Ok(total)
    }

    fn stages(&self) -> &[(&'static str, f64)] {
        self.stages.as_slice()
    }

    fn extract(&self, want: Channels, out: &mut Frame) {
        let want = want & self.offers();
        let (base, own) = &mut *self.work.borrow_mut();
        let offered = self.base.offers();
        self.base.extract((want | Channels::DEPTH) & offered, base);
        let spec = self.base.spec();
        out.prepare(spec, want);
        out.time = base.time;
        fn copy<T: Copy + Default>(to: &mut Grid<T>, from: Option<&Grid<T>>) {
            match from {
                Some(from) => to.as_mut_slice().copy_from_slice(from.as_slice()),
                None => to.as_mut_slice().fill(T::default()),
            }
        }
        copy(&mut out.elevation, Some(&base.elevation));
        for (to, from) in [(&mut out.depth, &base.depth), (&mut out.foam, &base.foam)] {
            if let Some(to) = to {
                copy(to, from.as_ref());
            }
        }
        for (to, from) in [
            (&mut out.velocity, &base.velocity),
            (&mut out.displacement, &base.displacement),
        ] {
            if let Some(to) = to {
                copy(to, from.as_ref());
            }
        }
        if out.droplets.is_some() {
            std::mem::swap(&mut out.droplets, &mut base.droplets);
        }
        if out.bodies.is_some() {
            std::mem::swap(&mut out.bodies, &mut base.bodies);
        }
        if out.particles.is_some() {
            std::mem::swap(&mut out.particles, &mut base.particles);
        }
        for layer in &self.layers {
            layer.solver.extract(want & layer.solver.offers() & added(), own);
            layer.add(own, base.depth.as_ref(), out);
        }
    }

    /// The base takes the action, or else the first layer that can.
    fn apply(&mut self, action: &Action) -> Result<(), EventError> {
        let mut refused = match self.base.apply(action) {
            Err(e @ EventError::Unsupported { .. }) => e,
            other => return other,
        };
        for layer in &mut self.layers {
            match layer.solver.apply(action) {
                Err(e @ EventError::Unsupported { .. }) => refused = e,
                other => return other,
            }
        }
        Err(refused)
    }

    /// Sums over base and layers.
    fn report(&self) -> StepReport {
        let layers = self.layers.iter().map(|l| l.solver.report());
        layers.fold(self.base.report(), both)
    }

    fn stirred_every(&self) -> Option<f64> {
        self.base.stirred_every()
    }

    fn stir(&mut self, by: &Stirring<'_>) -> Result<bool, StepError> {
        self.base.stir(by)
    }

    fn extras(&self) -> Vec<Extra> {
        let layers = self.layers.iter().flat_map(|l| l.solver.extras());
        self.base.extras().into_iter().chain(layers).collect()
    }

    fn bytes(&self) -> u64 {
        let layers: u64 = self.layers.iter().map(|l| l.solver.bytes()).sum();
        // Two frames of elevation and what comes with it.
        self.base.bytes() + layers + 2 * 28 * self.spec().len() as u64
    }
}

/// Two methods at once: totals add up, limits are the tighter ones.
fn both(a: StepReport, b: StepReport) -> StepReport {
    StepReport {
        substeps: a.substeps.max(b.substeps),
        largest_stable_step: a.largest_stable_step.min(b.largest_stable_step),
        mass: a.mass + b.mass,
        momentum: [a.momentum[0] + b.momentum[0], a.momentum[1] + b.momentum[1]],
        energy: a.energy + b.energy,
        courant: a.courant.max(b.courant),
        froude: a.froude.max(b.froude),
        clamps: a.clamps.saturating_add(b.clamps),
    }
}

/// Four neighbours along one axis and their weights.
#[derive(Clone, Copy, Debug)]
struct Taps([usize; 4], [f32; 4]);

/// Samples of a coarser or finer grid over the same rectangle, by Catmull–Rom splines.
#[derive(Clone, Debug)]
struct Resample {
    columns: Vec<Taps>,
    rows: Vec<Taps>,
}

impl Resample {
    /// From samples on `from` to those on `to`; `None` if they are the same.
    fn between(from: &GridSpec, to: &GridSpec, periodic: BVec2) -> Option<Self> {
        if from == to {
            return None;
        }
        let taps = |k: usize, n: usize, periodic: bool| {
            let at = k as f64 * f64::from(to.spacing) / f64::from(from.spacing);
            let cell = at.floor();
            let t = (at - cell) as f32;
            let (t2, t3) = (t * t, t * t * t);
            let index = |d: i64| {
                let k = cell as i64 + d;
                (if periodic {
                    k.rem_euclid(n as i64)
                } else {
                    k.clamp(0, n as i64 - 1)
                }) as usize
            };
            Taps(
                [index(-1), index(0), index(1), index(2)],
                [
                    -0.5 * t + t2 - 0.5 * t3,
                    1.0 - 2.5 * t2 + 1.5 * t3,
                    0.5 * t + 2.0 * t2 - 1.5 * t3,
                    -0.5 * t2 + 0.5 * t3,
                ],
            )
        };
        Some(Self {
            columns: (0..to.width())
                .map(|i| taps(i, from.width(), periodic.x))
                .collect(),
            rows: (0..to.height())
                .map(|j| taps(j, from.height(), periodic.y))
                .collect(),
        })
    }

    fn at<T>(&self, grid: &Grid<T>, i: usize, j: usize) -> T
    where
        T: Copy + Default + Add<Output = T> + Mul<f32, Output = T>,
    {
        let (Taps(columns, across), Taps(rows, down)) = (&self.columns[i], &self.rows[j]);
        let mut sum = T::default();
        for (row, weight) in rows.iter().zip(down) {
            for (column, share) in columns.iter().zip(across) {
                sum = sum + grid[(*column, *row)] * (weight * share);
            }
        }
        sum
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec2;
    use std::path::Path;

    fn scene(text: &str) -> Scene {
        Scene::from_toml(text, Path::new("test"), Path::new("."), &[]).unwrap_or_else(|e| panic!("{e}"))
    }

    fn frame(solver: &dyn Solver, want: Channels) -> Frame {
        let mut frame = Frame::new(solver.spec());
        solver.extract(want, &mut frame);
        frame.check_finite().unwrap();
        frame
    }

    const BASIN: &str = "name = 'x'\ndomain.size = [40, 20]\nterrain = { kind = 'flat', height = -5.0 }\n\
        water.initial = { kind = 'disturbance', position = [10, 10], radius = 3, height = 0.3 }\n\
        solver = { kind = 'wave-equation', spacing = 0.5 }\n";
    const WAVES: &str = "wave = [{ amplitude = 0.1, wavelength = 8, steepness = 1.0 }]";

    #[test]
    fn elevations_displacements_and_velocities_add() {
        let over = format!("{BASIN}\n[[layer]]\nsolver = {{ kind = 'procedural', spacing = 0.5, {WAVES} }}");
        let mut both = solvers::build(&scene(&over)).unwrap();
        let mut base = solvers::build(&scene(BASIN)).unwrap();
        let alone = format!(
            "name = 'x'\ndomain.size = [40, 20]\nsolver = {{ kind = 'procedural', spacing = 0.5, {WAVES} }}"
        );
        let mut waves = solvers::build(&scene(&alone)).unwrap();
        for solver in [&mut both, &mut base, &mut waves] {
            solver.advance(0.7).unwrap();
        }
        let want = Channels::ALL;
        let (sum, a, b) = (frame(&*both, want), frame(&*base, want), frame(&*waves, want));
        assert_eq!(sum.channels(), (a.channels() | b.channels()) - Channels::BODIES);
        for k in 0..sum.spec().len() {
            let expected = a.elevation.as_slice()[k] + b.elevation.as_slice()[k];
            assert!((sum.elevation.as_slice()[k] - expected).abs() < 1e-6);
            let depth = a.depth.as_ref().unwrap().as_slice()[k] + b.elevation.as_slice()[k];
            assert!((sum.depth.as_ref().unwrap().as_slice()[k] - depth).abs() < 1e-5);
            assert_eq!(
                sum.displacement.as_ref().unwrap().as_slice()[k],
                b.displacement.as_ref().unwrap().as_slice()[k]
            );
        }
        let total = both.report().energy;
        assert!((total - base.report().energy - waves.report().energy).abs() < 1e-9 * total);
    }

    #[test]
    fn shores_stay_dry_and_troughs_keep_water() {
        // Ground from 2 m below to 2 m above the water, waves of 1.5 m over it.
        let dir = tempfile::tempdir().unwrap();
        let rows = (0..3).map(|_| {
            (0..41)
                .map(|i| format!("{}", f64::from(i) * 0.1 - 2.0))
                .collect::<Vec<_>>()
                .join(" ")
        });
        let grid = format!(
            "ncols 41\nnrows 3\nxllcorner 0\nyllcorner 0\ncellsize 1\n{}\n",
            rows.collect::<Vec<_>>().join("\n")
        );
        std::fs::write(dir.path().join("beach.asc"), grid).unwrap();
        let text = "name = 'x'\nterrain = { kind = 'ascii-grid', file = 'beach.asc' }\n\
            solver = { kind = 'shallow-water', spacing = 1 }\n[[layer]]\nfade_depth = 1.0\n\
            solver = { kind = 'procedural', spacing = 1, wave = [{ amplitude = 1.5, wavelength = 9 }] }";
        let scene =
            Scene::from_toml(text, Path::new("test"), dir.path(), &[]).unwrap_or_else(|e| panic!("{e}"));
        let solver = solvers::build(&scene).unwrap();
        let mut bare = scene.clone();
        bare.description.layers.clear();
        let base = frame(&*solvers::build(&bare).unwrap(), Channels::DEPTH);
        let now = frame(&*solver, Channels::DEPTH);
        let (mut dry, mut moved) = (0, 0);
        for k in 0..now.spec().len() {
            let before = base.depth.as_ref().unwrap().as_slice()[k];
            let after = now.depth.as_ref().unwrap().as_slice()[k];
            if before <= 0.0 {
                assert_eq!(now.elevation.as_slice()[k], base.elevation.as_slice()[k]);
                dry += 1;
            } else {
                assert!(after >= 0.099 * before, "{before} m became {after} m");
                moved += i32::from((after - before).abs() > 0.1);
            }
        }
        assert!(dry > 20 && moved > 20, "{dry} {moved}");
    }

    #[test]
    fn a_layer_may_be_finer_or_coarser_than_its_base() {
        let at = |spacing: f32| {
            let text = format!(
                "{BASIN}\n[[layer]]\nsolver = {{ kind = 'procedural', spacing = {spacing}, {WAVES} }}"
            );
            frame(&*solvers::build(&scene(&text)).unwrap(), Channels::DISPLACEMENT)
        };
        let same = at(0.5);
        for spacing in [0.4, 0.8] {
            let other = at(spacing);
            for k in 0..same.spec().len() {
                let apart = (same.elevation.as_slice()[k] - other.elevation.as_slice()[k]).abs();
                assert!(apart < 4e-3, "{spacing}: {apart}");
            }
        }
        let text = "name = 'x'\ndomain.size = [8, 8]\nboundary = { x_min = 'periodic', x_max = 'periodic' }\n\
            solver = { kind = 'procedural', spacing = 0.5 }\n[[layer]]\nsolver = { kind = 'procedural', spacing = 0.3 }";
        let message = solvers::build(&scene(text)).err().unwrap().to_string();
        assert!(
            message.contains("layer.0.solver.spacing") && message.contains("0.5 m"),
            "{message}"
        );
    }

    #[test]
    fn actions_go_to_whoever_can_take_them() {
        let action = Action::Press {
            position: Vec2::new(4.0, 4.0),
            radius: 1.0,
            depth: 0.1,
        };
        let text = "name = 'x'\ndomain.size = [8, 8]\nsolver = { kind = 'procedural', spacing = 0.5 }\n\
            [[layer]]\nsolver = { kind = 'wave-equation', spacing = 0.5 }";
        let mut solver = solvers::build(&scene(text)).unwrap();
        solver.apply(&action).unwrap();
        assert!(frame(&*solver, Channels::NONE).elevation.range().0 < -0.05);
        let text = "name = 'x'\ndomain.size = [8, 8]\nsolver = { kind = 'procedural', spacing = 0.5 }";
        let mut alone = solvers::build(&scene(text)).unwrap();
        assert!(alone.apply(&action).is_err());
    }
}
