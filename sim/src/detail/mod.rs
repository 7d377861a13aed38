//! Small waves and wrinkles over any solver, carried by its water (`[detail]`).
//!
//! A periodic tile of heights, made of gradient noise or of a patch of short wind waves, is laid over the surface. Where
//! the water flows the tile goes with it: every sample remembers how far its water has come (semi-Lagrangian, so any step
//! is stable). Shear would stretch the tile without end; so there are two coverings that begin anew in turns, each from
//! another place of the tile, and the one that is about to begin anew has no weight (Max & Becker 1995; Neyret 2003). A
//! covering is thus stretched by no more than the flow does in one lifetime. Weights keep the variance of the sum, so
//! the detail does not pulse.
//!
//! Detail has no volume and no velocity of its own; it fades on water shallower than ten times its height. Without
//! `[detail]` none of this exists.

mod noise;

use crate::events::{Action, EventError};
use crate::frame::{Channels, Frame};
use crate::grid::{Grid, GridSpec};
use crate::layers::share;
use crate::rng::Rng;
use crate::scene::Scene;
use crate::scene::description::{Detail as Parameters, Edge};
use crate::solver::{Extra, Solver, StepError, StepReport};
use crate::solvers::BuildError;
use crate::stages::Stages;
use glam::{BVec2, Vec2};
use noise::GradientNoise;
use rayon::prelude::*;
use std::cell::RefCell;
use std::time::Instant;

/// Samples of the tile along a side.
const TILE: usize = 256;
/// Depth of water, in standard deviations of the detail, from which it is there in full.
const SHALLOW: f32 = 10.0;
/// Steps that one advance is cut into at most: what is older than two lifetimes is forgotten anyway.
const MOST_STEPS: u32 = 16;

/// What the tile is made of.
#[allow(clippy::large_enum_variant, reason = "there is one of it a solver")]
enum Pattern {
    Noise {
        noise: GradientNoise,
        rate: f32,
    },
    #[cfg(feature = "ocean")]
    Waves {
        patch: crate::ocean::patch::Patch,
        work: RefCell<crate::ocean::patch::Work>,
    },
}

/// A solver with detail over it.
pub struct Detailed {
    base: Box<dyn Solver>,
    pattern: Pattern,
    /// Period of the tile in metres.
    period: f32,
    /// Seconds after which a covering begins anew.
    lifetime: f64,
    /// Standard deviation of the detail in metres.
    height: f32,
    seed: u64,
    periodic: BVec2,
    coverings: [Covering; 2],
    /// Frame of the base, kept for its allocations.
    work: RefCell<Frame>,
    tile: RefCell<Tile>,
    stages: Stages,
}

/// One covering of the surface by the tile.
struct Covering {
    /// How many times it has begun.
    count: i64,
    /// How far the water at each sample has come since it began, metres; empty while nothing has moved.
    carried: Vec<Vec2>,
}

/// The tile at one time.
struct Tile {
    time: f64,
    heights: Vec<f32>,
}

/// Detail at a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DetailPoint {
    /// Height in metres.
    pub height: f32,
    /// Slope along X and Z.
    pub slope: Vec2,
}

impl Detailed {
    /// Lays the detail of `scene` over `base`.
    ///
    /// # Errors
    /// [`BuildError`] if waves are asked for in a build without oceans, or the samples are too coarse for the tile.
    pub fn new(scene: &Scene, how: &Parameters, base: Box<dyn Solver>) -> Result<Self, BuildError> {
        let spec = base.spec();
        let seed = scene.description.seed ^ 0x00de_7a11;
        let (period, lifetime) = (how.period(), how.lifetime());
        if period < 16.0 * f64::from(spec.spacing) {
            return Err(BuildError::impossible(
                "detail.period",
                format!(
                    "a tile of {period} m has fewer than 16 samples of {} m",
                    spec.spacing
                ),
                "give a longer period or a finer solver.spacing",
            ));
        }
        let finest = spec.spacing / period as f32;
        let (pattern, height) = match *how {
            Parameters::Noise { height, rate, .. } => {
                let noise = GradientNoise::new(seed, height as f32, TILE, finest);
                let rate = rate as f32;
                (Pattern::Noise { noise, rate }, height as f32)
            }
            Parameters::Waves { .. } => waves(how, seed, &spec)?,
        };
        let edges = &scene.description.boundary;
        Ok(Self {
            pattern,
            period: period as f32,
            lifetime,
            height,
            seed,
            periodic: BVec2::new(edges.x_min == Edge::Periodic, edges.z_min == Edge::Periodic),
            coverings: [0, 1].map(|c| Covering {
                count: begun(base.time(), lifetime, c).0,
                carried: Vec::new(),
            }),
            work: RefCell::new(Frame::new(spec)),
            stages: Stages::default(),
            tile: RefCell::new(Tile {
                time: f64::NAN,
                heights: vec![0.0; TILE * TILE],
            }),
            base,
        })
    }

    /// Detail at `position` (metres, X and Z) at the present time: for renderers that are finer than the frame.
    pub fn at(&self, position: Vec2) -> DetailPoint {
        self.refresh();
        let tile = self.tile.borrow();
        let weights = self.weights(self.base.time());
        let mut sum = DetailPoint {
            height: 0.0,
            slope: Vec2::ZERO,
        };
        for (c, covering) in self.coverings.iter().enumerate() {
            let carried = carried_at(&covering.carried, &self.base.spec(), self.periodic, position);
            let (height, slope) = sample(&tile.heights, self.period, position - carried + self.start(c));
            sum.height += weights[c] * height;
            sum.slope += weights[c] * slope;
        }
        sum
    }

    /// Where in the tile a covering begins.
    fn start(&self, c: usize) -> Vec2 {
        let mut rng = Rng::new(
            self.seed,
            ((c as u64) << 48) | (self.coverings[c].count as u64 & 0xffff_ffff),
        );
        self.period * Vec2::new(rng.uniform_f32(), rng.uniform_f32())
    }

    /// Weights of the two coverings: 0 where one begins, squares adding up to 1.
    fn weights(&self, time: f64) -> [f32; 2] {
        let w = [0, 1].map(|c| {
            let (_, age) = begun(time, self.lifetime, c);
            (1.0 - (2.0 * age - 1.0).abs()) as f32
        });
        let length = w[0].hypot(w[1]).max(1e-6);
        w.map(|w| w / length)
    }

    /// Makes the tile that of the present time.
    fn refresh(&self) {
        let time = self.base.time();
        let mut tile = self.tile.borrow_mut();
        if tile.time == time {
            return;
        }
        tile.time = time;
        match &self.pattern {
            Pattern::Noise { noise, rate } => {
                noise.fill((time * f64::from(*rate)) as f32, TILE, &mut tile.heights)
            }
            #[cfg(feature = "ocean")]
            Pattern::Waves { patch, work } => {
                use crate::ocean::patch::Field::Elevation;
                let (mut work, heights) = (work.borrow_mut(), &mut tile.heights);
                patch.turn(time, &[Elevation], &mut work);
                let rows = patch.lattice().size.y as usize;
                patch.one(Elevation, &mut work, rows, heights, |row, out| {
                    out.copy_from_slice(row)
                });
            }
        }
    }

    /// Carries the coverings with the water for `dt` seconds that end at `time`.
    fn carry(&mut self, velocity: Option<&Grid<Vec2>>, time: f64, dt: f64) {
        let lifetime = self.lifetime;
        let span = dt.min(2.0 * lifetime);
        let steps = ((8.0 * span / lifetime).ceil() as u32).clamp(1, MOST_STEPS);
        let step = span / f64::from(steps);
        for k in 1..=steps {
            let now = time - span + step * f64::from(k);
            for c in 0..2 {
                let (count, age) = begun(now, lifetime, c);
                let fresh = count != self.coverings[c].count;
                if fresh {
                    self.coverings[c].count = count;
                    self.coverings[c].carried.clear();
                }
                let Some(velocity) = velocity else { continue };
                let step = if fresh { (age * lifetime).min(step) } else { step } as f32;
                let old = std::mem::take(&mut self.coverings[c].carried);
                let (spec, periodic) = (self.base.spec(), self.periodic);
                let w = spec.width();
                let mut new = vec![Vec2::ZERO; spec.len()];
                new.par_chunks_mut(w).enumerate().for_each(|(j, row)| {
                    for (i, out) in row.iter_mut().enumerate() {
                        let way = step * velocity[(i, j)];
                        *out = way + carried_at(&old, &spec, periodic, spec.position(i, j) - way);
                    }
                });
                self.coverings[c].carried = new;
            }
        }
    }
}

/// How far the water at a place has come, bilinear between samples.
fn carried_at(carried: &[Vec2], spec: &GridSpec, periodic: BVec2, position: Vec2) -> Vec2 {
    if carried.is_empty() {
        return Vec2::ZERO;
    }
    let g = spec.to_grid(position);
    let cell = g.floor();
    let f = g - cell;
    let index = |k: f32, d: i64, n: usize, periodic: bool| {
        let k = (k as i64).saturating_add(d);
        (if periodic {
            k.rem_euclid(n as i64)
        } else {
            k.clamp(0, n as i64 - 1)
        }) as usize
    };
    let at = |a: i64, b: i64| {
        let i = index(cell.x, a, spec.width(), periodic.x);
        let j = index(cell.y, b, spec.height(), periodic.y);
        carried[spec.index(i, j)]
    };
    at(0, 0)
        .lerp(at(1, 0), f.x)
        .lerp(at(0, 1).lerp(at(1, 1), f.x), f.y)
}

/// How many times a covering has begun by `time`, and its age as a share of its lifetime.
fn begun(time: f64, lifetime: f64, covering: usize) -> (i64, f64) {
    let turns = time / lifetime + 0.5 * covering as f64;
    (turns.floor() as i64, turns - turns.floor())
}

#[cfg(feature = "ocean")]
fn waves(how: &Parameters, seed: u64, spec: &GridSpec) -> Result<(Pattern, f32), BuildError> {
    use crate::dispersion::Dispersion;
    use crate::ocean::{lattice, patch::Patch, sea::WaveField};
    use crate::scene::description::{Sea, Spectrum, Spreading};
    let Parameters::Waves {
        period,
        wind,
        fetch,
        direction,
        ..
    } = *how
    else {
        return Err(BuildError::impossible(
            "detail.kind",
            "no waves are asked for",
            "use kind = \"waves\"",
        ));
    };
    let sea = Sea {
        spectrum: Spectrum::Jonswap {
            wind,
            fetch,
            gamma: 3.3,
        },
        direction,
        spreading: Spreading::Hasselmann,
    };
    let sea = WaveField::new(&[sea], Dispersion::new(None));
    let draw = lattice::Draw {
        period: glam::DVec2::splat(period),
        size: glam::UVec2::splat(TILE as u32),
        // Waves of at least two of the frame's samples.
        band: (0.0, std::f64::consts::PI / f64::from(spec.spacing)),
        seed,
        patch: 0,
        loop_period: None,
    };
    let lattice = lattice::Lattice::new(&sea, &draw);
    let height = lattice.variance.sqrt() as f32;
    let patch = Patch::new(lattice, f64::INFINITY);
    let work = RefCell::new(patch.work());
    Ok((Pattern::Waves { patch, work }, height))
}

#[cfg(not(feature = "ocean"))]
fn waves(_: &Parameters, _: u64, _: &GridSpec) -> Result<(Pattern, f32), BuildError> {
    Err(BuildError::NotCompiled {
        solver: "ocean",
        compiled: "detail of kind \"noise\"".to_owned(),
    })
}

/// Height and slope of the tile at `x` metres, by Catmull–Rom splines: continuous with the slope, across seams too.
fn sample(tile: &[f32], period: f32, x: Vec2) -> (f32, Vec2) {
    let n = TILE as f32;
    let g = (x / period).rem_euclid(Vec2::ONE) * n;
    let cell = g.floor();
    let f = g - cell;
    let weights = |t: f32| {
        let (t2, t3) = (t * t, t * t * t);
        (
            [
                -0.5 * t + t2 - 0.5 * t3,
                1.0 - 2.5 * t2 + 1.5 * t3,
                0.5 * t + 2.0 * t2 - 1.5 * t3,
                -0.5 * t2 + 0.5 * t3,
            ],
            [
                -0.5 + 2.0 * t - 1.5 * t2,
                -5.0 * t + 4.5 * t2,
                0.5 + 4.0 * t - 4.5 * t2,
                -t + 1.5 * t2,
            ],
        )
    };
    let ((wx, dx), (wz, dz)) = (weights(f.x), weights(f.y));
    let (i, j) = (cell.x as usize + TILE, cell.y as usize + TILE);
    let (mut height, mut slope) = (0.0, Vec2::ZERO);
    for b in 0..4 {
        let row = &tile[(j + b - 1) % TILE * TILE..][..TILE];
        for a in 0..4 {
            let v = row[(i + a - 1) % TILE];
            height += wx[a] * wz[b] * v;
            slope += Vec2::new(dx[a] * wz[b], wx[a] * dz[b]) * v;
        }
    }
    (height, slope * (n / period))
}

impl Solver for Detailed {
    /// That of the solver below.
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
        self.base.offers()
    }

    fn advance(&mut self, dt: f32) -> Result<StepReport, StepError> {
        let before = self.base.time();
        let mut clock = Instant::now();
        let report = self.base.advance(dt)?;
        self.stages.clear();
        self.stages.of(&*self.base, &mut clock);
        let time = self.base.time();
        let velocity = if self.base.offers().contains(Channels::VELOCITY) {
            let mut frame = self.work.borrow_mut();
            self.base.extract(Channels::VELOCITY, &mut frame);
            frame.velocity.take()
        } else {
            None
        };
        self.carry(velocity.as_ref(), time, time - before);
        self.work.borrow_mut().velocity = velocity;
        self.stages.lap("detail", &mut clock);
        Ok(report)
    }

    fn stages(&self) -> &[(&'static str, f64)] {
        self.stages.as_slice()
    }

    fn extract(&self, want: Channels, out: &mut Frame) {
        let offered = self.base.offers();
        let want = want & offered;
        self.base.extract(want | (Channels::DEPTH & offered), out);
        self.refresh();
        let spec = self.base.spec();
        let w = spec.width();
        let tile = self.tile.borrow();
        let weights = self.weights(self.base.time());
        let starts = [0, 1].map(|c| self.start(c));
        let coverings = [0, 1].map(|c| self.coverings[c].carried.as_slice());
        let (period, full, heights) = (self.period, SHALLOW * self.height, tile.heights.as_slice());
        let depths = out.depth.as_ref().map(Grid::as_slice);
        let mut rises = vec![0.0_f32; spec.len()];
        rises.par_chunks_mut(w).enumerate().for_each(|(j, row)| {
            for (i, out) in row.iter_mut().enumerate() {
                let k = j * w + i;
                let share = depths.map_or(1.0, |d| share(d[k], full));
                if share == 0.0 {
                    continue;
                }
                let x = spec.position(i, j);
                for c in 0..2 {
                    let carried = coverings[c].get(k).copied().unwrap_or_default();
                    *out += share * weights[c] * sample(heights, period, x - carried + starts[c]).0;
                }
                if let Some(depths) = depths {
                    *out = out.max(-0.9 * depths[k]);
                }
            }
        });
        for (elevation, rise) in out.elevation.as_mut_slice().iter_mut().zip(&rises) {
            *elevation += rise;
        }
        if let Some(depth) = &mut out.depth {
            for (depth, rise) in depth.as_mut_slice().iter_mut().zip(&rises) {
                *depth += rise;
            }
        }
        if !want.contains(Channels::DEPTH) {
            out.depth = None;
        }
    }

    fn apply(&mut self, action: &Action) -> Result<(), EventError> {
        self.base.apply(action)
    }

    fn report(&self) -> StepReport {
        self.base.report()
    }

    fn bytes(&self) -> u64 {
        let carried: usize = self.coverings.iter().map(|c| 8 * c.carried.len()).sum();
        self.base.bytes() + (carried + 4 * TILE * TILE) as u64
    }

    fn extras(&self) -> Vec<Extra> {
        self.base.extras()
    }
}

#[cfg(test)]
mod tests;
