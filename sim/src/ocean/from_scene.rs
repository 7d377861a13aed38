//! An ocean from what a scene says: which patches hold it, and what cannot be.

use super::foam::Foam;
use super::lattice::{Draw, Lattice};
use super::patch::Patch;
use super::placement::{Placement, Planes};
use super::sea::WaveField;
use super::{Cascade, Ocean, TICK};
use crate::dispersion::{Dispersion, SURFACE_TENSION};
use crate::grid::GridSpec;
use crate::scene::Scene;
use crate::scene::description::{self, Edge, Initial};
use crate::solvers::{BuildError, name_of};
use glam::{DVec2, UVec2};
use std::cell::RefCell;
use std::f64::consts::TAU;

/// Waves of a finer patch that the coarser one leaves to it: the longest are this share of its period.
const WAVES_A_PERIOD: f64 = 8.0;
/// Samples of a coarser patch on its shortest wave.
const SAMPLES_A_WAVE: f64 = 8.0;
/// Lengths of the longest peak wave that the largest patch holds, where the choice is free.
const PEAKS_A_PERIOD: f64 = 12.0;
/// Most samples of all patches together: 1.5 GB.
const MOST_SAMPLES: f64 = (1_u64 << 25) as f64;
/// Samples of the coarser patches along a side, and factor between their periods and the next.
const COARSE: f64 = 8.0;

impl Ocean {
    /// The solver of a scene with `solver.kind = "ocean"`.
    ///
    /// A domain that is periodic along an axis is its own patch. Elsewhere one patch covers the domain and larger ones
    /// hold the waves that are too long for it, unless the scene names its patches.
    ///
    /// # Errors
    /// [`BuildError`] for impossible values, for scenes that ask the water to react, and for seas that the water is
    /// too shallow for.
    pub fn from_scene(scene: &Scene) -> Result<Self, BuildError> {
        let description::Solver::Ocean(how) = &scene.description.solver else {
            return Err(BuildError::WrongSolver {
                expected: "ocean",
                found: name_of(&scene.description.solver),
            });
        };
        refuse_reaction(&scene.description)?;
        check(how)?;
        let dispersion = Dispersion {
            depth: how.depth.unwrap_or(f64::INFINITY),
            surface_tension: if how.capillary { SURFACE_TENSION } else { 0.0 },
        };
        let sea = WaveField::new(&how.seas, dispersion);
        let sea_variance = sea.variance();
        let height = 4.0 * sea_variance.sqrt();
        if let Some(depth) = how.depth.filter(|d| height > *d) {
            return Err(BuildError::impossible(
                "solver.depth",
                format!(
                    "a sea of {height:.3} m significant height in {depth} m of water would have broken long ago"
                ),
                "give more depth or less wind; of the spectra only \"tma\" loses height to the bed",
            ));
        }
        let loop_ticks = how.loop_period.map(|t| (t / TICK).round() as i64);
        let loop_period = loop_ticks.map(|ticks| ticks as f64 * TICK);
        let plans = plan(how, scene, &sea)?;
        let samples: f64 = plans.iter().map(|p| p.size.as_dvec2().element_product()).sum();
        if samples > MOST_SAMPLES {
            return Err(BuildError::impossible(
                "solver.spacing",
                format!("the ocean's patches have {samples:.2e} samples, more than {MOST_SAMPLES:.2e}"),
                "use a coarser spacing, a smaller domain, or a cascade with a shorter period",
            ));
        }
        let cascades: Vec<Cascade> = plans
            .iter()
            .enumerate()
            .map(|(number, plan)| {
                let draw = Draw {
                    period: plan.period,
                    size: plan.size,
                    band: plan.band,
                    seed: scene.description.seed,
                    patch: number as u64,
                    loop_period,
                };
                Cascade {
                    patch: Patch::new(Lattice::new(&sea, &draw), dispersion.depth),
                    place: if plan.aligned {
                        Placement::same(plan.size)
                    } else {
                        Placement::between(plan.size, plan.period, &scene.grid)
                    },
                    band: plan.band,
                }
            })
            .collect();
        let fresh = |cascades: &[Cascade]| {
            let work = cascades.iter().map(|c| (c.patch.work(), Planes::default()));
            work.collect()
        };
        let work = fresh(&cascades);
        let ocean = Self {
            spec: scene.grid,
            level: scene.description.water.level,
            depth: how.depth,
            ground: scene.ground_on_grid(),
            choppiness: how.choppiness,
            loop_ticks,
            cascades,
            sea_variance,
            time: 0.0,
            work: RefCell::new(work),
            foam: how.foam.map(|foam| RefCell::new(Foam::new(foam, loop_period))),
        };
        ocean.warn();
        // What the check of folding needed is not kept.
        ocean.work.replace(fresh(&ocean.cascades));
        Ok(ocean)
    }

    /// Says what a person would not expect: heights that the samples cannot hold, and a surface that folds.
    fn warn(&self) {
        let (held, whole) = (self.significant_height(), self.sea_height());
        if held < 0.97 * whole {
            tracing::warn!(
                "the ocean's samples hold {held:.3} m of a significant height of {whole:.3} m: other waves are longer \
                 than the patch or shorter than two samples"
            );
        }
        if self.choppiness > 0.0 && whole > 0.0 {
            let fold = self.fold(0.0);
            if fold.share > 1e-3 {
                tracing::warn!(
                    "the ocean folds over itself on {:.2} % of its surface (J down to {:.2}); lower solver.choppiness \
                     below {:.2} or use a coarser spacing",
                    100.0 * fold.share,
                    fold.smallest,
                    self.choppiness
                );
            }
        }
    }
}

/// Refuses what needs water that reacts.
fn refuse_reaction(scene: &description::Description) -> Result<(), BuildError> {
    if !scene.events.is_empty() {
        return Err(BuildError::impossible(
            "event",
            format!("{} given, but nothing acts on an ocean", scene.events.len()),
            format!("remove the events, or {}", super::REACTING),
        ));
    }
    if scene.water.initial != Initial::Still {
        return Err(BuildError::impossible(
            "water.initial",
            "an ocean has no initial state but its own waves",
            format!("use kind = \"still\", or {}", super::REACTING),
        ));
    }
    Ok(())
}

/// Refuses values that scene files cannot hold but descriptions made by programs can.
fn check(how: &description::Ocean) -> Result<(), BuildError> {
    let refuse = |key: &str, value: f64, remedy: &str| {
        Err(BuildError::impossible(
            format!("solver.{key}"),
            format!("{value} is impossible"),
            remedy,
        ))
    };
    if let Some(depth) = how.depth.filter(|d| !(d.is_finite() && *d > 0.0)) {
        return refuse(
            "depth",
            depth,
            "give a positive depth in metres, or leave it out for deep water",
        );
    }
    if !(0.0..=10.0).contains(&how.choppiness) {
        return refuse("choppiness", how.choppiness, "give 0 to 10");
    }
    if let Some(period) = how.loop_period.filter(|t| !(0.1..=1e6).contains(t)) {
        return refuse("loop_period", period, "give 0.1 s to 1e6 s");
    }
    if let Some(foam) = how.foam
        && !(foam.threshold.is_finite() && foam.growth >= 0.0 && foam.growth.is_finite() && foam.fade >= 1e-3)
    {
        return refuse(
            "foam.fade",
            foam.fade,
            "give at least 0.001 1/s, and finite numbers",
        );
    }
    for (number, sea) in how.seas.iter().enumerate() {
        use description::Spectrum as S;
        let values = match sea.spectrum {
            S::Phillips { wind, height } => [wind, height, 1.0],
            S::PiersonMoskowitz { wind } => [wind, 0.0, 1.0],
            S::Jonswap { wind, fetch, gamma } | S::Tma { wind, fetch, gamma } => [wind, fetch, gamma],
            S::Swell {
                height,
                period,
                gamma,
            } => [height, period, gamma],
        };
        let spread = match sea.spreading {
            description::Spreading::CosinePower { exponent } => exponent,
            description::Spreading::Swell { elongation } => elongation,
            _ => 0.0,
        };
        let all = [values[0], values[1], values[2] - 1.0, spread, sea.direction.abs()];
        if let Some(bad) = all.into_iter().find(|v| !(v.is_finite() && *v >= 0.0)) {
            return refuse(
                &format!("sea.{number}"),
                bad,
                "give finite numbers that are not negative",
            );
        }
    }
    Ok(())
}

/// A patch to be made.
struct Plan {
    period: DVec2,
    size: UVec2,
    band: (f64, f64),
    /// Whether its samples stand on those of the frame.
    aligned: bool,
}

/// The smallest number from `n` on whose factors are 2, 3 and 5: transforms of other lengths are slow.
fn fast(n: f64) -> u32 {
    let smooth = |mut n: u32| {
        for p in [2, 3, 5] {
            while n.is_multiple_of(p) {
                n /= p;
            }
        }
        n == 1
    };
    let mut n = n.ceil().clamp(2.0, 1e9) as u32;
    while !(smooth(n) && n.is_multiple_of(2)) {
        n += 1;
    }
    n
}

/// The patches, longest first.
fn plan(how: &description::Ocean, scene: &Scene, sea: &WaveField) -> Result<Vec<Plan>, BuildError> {
    let spec: GridSpec = scene.grid;
    let spacing = f64::from(spec.spacing);
    let edges = &scene.description.boundary;
    let periodic = [edges.x_min == Edge::Periodic, edges.z_min == Edge::Periodic];
    if periodic != [false; 2] {
        if !how.cascades.is_empty() {
            return Err(BuildError::impossible(
                "solver.cascade",
                "a periodic domain is its own patch: waves of another period would not fit",
                "leave the cascades out, or make the edges open",
            ));
        }
        let side = |n: u32, periodic: bool| if periodic { n } else { fast(f64::from(n)) };
        let size = UVec2::new(side(spec.size.x, periodic[0]), side(spec.size.y, periodic[1]));
        return Ok(vec![Plan {
            period: spacing * size.as_dvec2(),
            size,
            band: (0.0, f64::INFINITY),
            aligned: true,
        }]);
    }
    let (finest, mut longer) = if how.cascades.is_empty() {
        let size = UVec2::new(fast(f64::from(spec.size.x)), fast(f64::from(spec.size.y)));
        (size, automatic(spacing * f64::from(size.min_element()), sea))
    } else {
        named(how, spacing)?
    };
    // Longest first.
    longer.sort_by(|a, b| b.total_cmp(a));
    let mut plans = Vec::new();
    let mut from = 0.0;
    let next = |k: usize| {
        longer
            .get(k + 1)
            .copied()
            .unwrap_or(spacing * f64::from(finest.min_element()))
    };
    for (k, period) in longer.iter().enumerate() {
        let to = WAVES_A_PERIOD * TAU / next(k);
        let samples = fast(WAVES_A_PERIOD * SAMPLES_A_WAVE * period / next(k));
        plans.push(Plan {
            period: DVec2::splat(*period),
            size: UVec2::splat(samples),
            band: (from, to),
            aligned: false,
        });
        from = to;
    }
    plans.push(Plan {
        period: spacing * finest.as_dvec2(),
        size: finest,
        band: (from, f64::INFINITY),
        aligned: true,
    });
    Ok(plans)
}

/// Periods of the larger patches that a patch of `finest` metres needs for the longest waves of a sea.
fn automatic(finest: f64, sea: &WaveField) -> Vec<f64> {
    let Some(peak) = sea.lowest_peak() else {
        return Vec::new();
    };
    let needed = PEAKS_A_PERIOD * TAU / sea.dispersion.wave_number(peak);
    let mut periods = Vec::new();
    let mut period = finest;
    while period < needed && periods.len() < 8 {
        period = (COARSE * period).min(needed.max(2.0 * period));
        periods.push(period);
    }
    periods
}

/// The finest patch and the periods of the others that a scene names.
fn named(how: &description::Ocean, spacing: f64) -> Result<(UVec2, Vec<f64>), BuildError> {
    let mut periods: Vec<f64> = how.cascades.iter().map(|c| c.period).collect();
    if let Some(bad) = periods.iter().find(|p| !(p.is_finite() && **p > 0.0)) {
        return Err(BuildError::impossible(
            "solver.cascade",
            format!("a period of {bad} m is impossible"),
            "give positive lengths",
        ));
    }
    periods.sort_by(f64::total_cmp);
    let finest = periods.remove(0);
    if finest < 16.0 * spacing {
        return Err(BuildError::impossible(
            "solver.cascade",
            format!("a patch of {finest} m has fewer than 16 samples of {spacing} m"),
            "give a longer period or a finer solver.spacing",
        ));
    }
    let mut last = finest;
    for &period in &periods {
        if period < 1.2 * last {
            return Err(BuildError::impossible(
                "solver.cascade",
                format!("the periods {last} m and {period} m are too near to share the waves"),
                "make each period at least 1.2 times the next; 5 to 12 times is best",
            ));
        }
        last = period;
    }
    Ok((UVec2::splat(fast((finest / spacing).round())), periods))
}
