//! Study `bodies`: floats against Archimedes, the theory of added mass and a laboratory.

use super::case::{Against, Case, Curves, Outcome, Run, Study};
use super::measure::Probe;
use meniscus_sim::Scene;
use meniscus_sim::Solver as _;
use meniscus_sim::bodies::{Bodies, StillWater};
use meniscus_sim::shallow_water::ShallowWater;
use std::path::Path;
use std::sync::Arc;

/// The study.
pub(crate) struct BodiesStudy;

/// Draft below the mean level of the tank at the end, against density over that of water.
const DRAFT: &str = "relative draft error";
/// Mean of the first two periods.
const PERIOD: &str = "relative period error";
/// What is left after the first full period of the height above its rest.
const DECAY: &str = "amplitude left after a period";

/// The one-way coupled method, beside which the coupled one is drawn.
const ONE_WAY: &str = "one-way, still water";
/// Shallow water, coupled both ways.
const COUPLED: &str = "shallow water, coupled";

impl Study for BodiesStudy {
    fn name(&self) -> &'static str {
        "bodies"
    }

    fn title(&self) -> &'static str {
        "Floating bodies against Archimedes, added mass and a laboratory"
    }

    fn summary(&self) -> &'static str {
        "draft, bobbing period and decay of a box and a sphere, coupled to shallow water and on still water"
    }

    fn about(&self) -> &'static str {
        "A body floats in shallow water that it displaces and pushes (coupled), or on still water that takes no notice \
         (one-way). A curve refines the grid and with it the panels of the hull; resolution counts cells a body's length, so \
         1 and less are bodies smaller than a cell.\n\n\
         Draft has one truth, Archimedes. The period has that of added-mass theory: the water that goes along is that of the \
         half ellipsoid with the body's waterplane and volume (Lamb), in deep water; the laboratory's sphere tests that \
         theory itself. Shallow-water equations alone know no such flow: see docs/numerics-bodies.md for what the coupled \
         model adds to it and what it cannot know."
    }

    fn expectations(&self) -> &'static str {
        include_str!("../../../data/expectations/bodies.toml")
    }

    fn cases(&self, quick: bool) -> anyhow::Result<Vec<Case>> {
        Ok(vec![drafts(quick)?, bobbing_box(quick)?, sphere(quick)?])
    }
}

/// A square tank with open edges or walls, level 0, and one free body in its middle.
struct Tank {
    side: f64,
    depth: f64,
    open: bool,
    shape: String,
    height: f64,
    density: f64,
}

impl Tank {
    fn scene(&self, spacing: f64) -> anyhow::Result<Arc<Scene>> {
        let edge = if self.open { "open" } else { "wall" };
        let text = format!(
            "name = \"tank\"\ndomain = {{ origin = [{0:?}, {0:?}], size = [{1:?}, {1:?}] }}\n\
             terrain = {{ kind = \"flat\", height = {2:?} }}\n\
             solver = {{ kind = \"shallow-water\", spacing = {spacing:?} }}\n\
             boundary = {{ x_min = \"{edge}\", x_max = \"{edge}\", z_min = \"{edge}\", z_max = \"{edge}\" }}\n\
             [[object]]\nname = \"float\"\nshape = {3}\nposition = [0.0, {4:?}, 0.0]\ndensity = {5:?}\n\
             motion = {{ kind = \"free\" }}\n",
            -0.5 * self.side,
            self.side,
            -self.depth,
            self.shape,
            self.height,
            self.density,
        );
        Ok(Arc::new(Scene::from_toml(
            &text,
            Path::new("tank.toml"),
            Path::new("."),
            &[],
        )?))
    }
}

/// Heights of the body's origin after each `dt`, and the level of the water at the end.
struct Followed {
    heights: Vec<f64>,
    level: f64,
    drift: f64,
}

fn coupled(scene: &Scene, duration: f64, dt: f64, probe: &mut Probe) -> anyhow::Result<Followed> {
    let mut solver = ShallowWater::from_scene(scene)?;
    let start = solver.report().mass;
    let mut heights = Vec::new();
    for _ in 0..(duration / dt).round() as u32 {
        probe.time(|| solver.advance(dt as f32))?;
        heights.push(
            solver
                .bodies()
                .map_or(0.0, |b| f64::from(b.poses()[0].position.y)),
        );
    }
    let elevations = solver.elevations();
    Ok(Followed {
        heights,
        level: elevations.iter().sum::<f64>() / elevations.len() as f64,
        drift: solver.report().mass / start - 1.0,
    })
}

fn one_way(scene: &Scene, depth: f64, duration: f64, dt: f64, probe: &mut Probe) -> anyhow::Result<Followed> {
    let water = StillWater {
        level: 0.0,
        bed: -depth,
    };
    let mut heights = Vec::new();
    if let Some(mut bodies) = Bodies::from_scene(scene, &water)? {
        for k in 0..(duration / dt).round() as u32 {
            probe.time(|| bodies.advance(&water, f64::from(k) * dt, dt))?;
            heights.push(f64::from(bodies.poses()[0].position.y));
        }
    }
    Ok(Followed {
        heights,
        level: 0.0,
        drift: 0.0,
    })
}

/// Mean of the first two periods, by upward passages of the height at rest, and the share of the first crest that the
/// second has.
fn bobbing(heights: &[f64], dt: f64, rest: f64) -> Option<(f64, f64)> {
    let mut times = Vec::new();
    for (k, pair) in heights.windows(2).enumerate() {
        let (a, b) = (pair[0] - rest, pair[1] - rest);
        if a < 0.0 && b >= 0.0 {
            times.push((k, dt * (k as f64 + a / (a - b))));
        }
    }
    let [(first, t0), (second, _), (third, t2)] = *times.first_chunk::<3>()?;
    let crest = |from: usize, to: usize| heights[from..to].iter().fold(0.0_f64, |c, y| c.max(y - rest));
    Some((0.5 * (t2 - t0), crest(second, third) / crest(first, second)))
}

/// Runs of both methods over `cells` cells a body's `length`.
fn runs(
    tank: &Arc<Tank>,
    length: f64,
    cells: &[f64],
    duration: f64,
    dt: f64,
    judge: impl Fn(&Followed) -> Outcome + Send + Sync + Copy + 'static,
) -> anyhow::Result<Vec<Run>> {
    let mut out = Vec::new();
    for &n in cells {
        let scene = tank.scene(length / n)?;
        out.push(Run::new(COUPLED, n, move |probe| {
            let followed = coupled(&scene, duration, dt, probe)?;
            Ok(judge(&followed).drift(followed.drift))
        }));
    }
    let (scene, depth) = (tank.scene(length)?, tank.depth);
    out.push(Run::new(ONE_WAY, 1.0, move |probe| {
        Ok(judge(&one_way(&scene, depth, duration, dt, probe)?))
    }));
    Ok(out)
}

/// Flat enough to float upright; a cube of these densities would lie on an edge.
const BOX: &str = r#"{ kind = "box", size = [1.0, 0.6, 1.0] }"#;

fn drafts(quick: bool) -> anyhow::Result<Case> {
    const DENSITY: f64 = 600.0;
    let tank = Arc::new(Tank {
        side: 8.0,
        depth: 3.0,
        open: true,
        shape: BOX.into(),
        height: 0.2,
        density: DENSITY,
    });
    let cells: &[f64] = if quick {
        &[1.0, 2.0, 4.0]
    } else {
        &[0.5, 1.0, 2.0, 4.0, 8.0]
    };
    let judge = |f: &Followed| {
        let draft = f.level - f.heights.last().copied().unwrap_or(f64::NAN) + 0.3;
        Outcome::of(DRAFT, (draft / (0.6 * DENSITY / 1000.0) - 1.0).abs())
    };
    Ok(Case {
        name: "draft",
        truth: "A box of 1 m × 0.6 m × 1 m and 600 kg/m³, let go 0.26 m above its rest in open water 3 m deep; after 30 s its draft \
                below the mean level is 0.36 m by Archimedes' law."
            .into(),
        resolution: "cells a side of the box",
        curves: standard(DRAFT),
        runs: runs(&tank, 1.0, cells, 30.0, 0.1, judge)?,
    })
}

fn standard(metric: &'static str) -> Vec<Curves> {
    [Against::Cpu, Against::Resolution]
        .into_iter()
        .map(|against| Curves {
            metric,
            against,
            slopes: &[],
        })
        .collect()
}

fn bobbing_box(quick: bool) -> anyhow::Result<Case> {
    let tank = Arc::new(Tank {
        side: 16.0,
        depth: 4.0,
        open: true,
        shape: BOX.into(),
        height: 0.05,
        density: 500.0,
    });
    let cells: &[f64] = if quick {
        &[1.0, 2.0, 4.0]
    } else {
        &[0.5, 1.0, 2.0, 4.0, 8.0]
    };
    Ok(Case {
        name: "bobbing box",
        truth: "A box of 1 m × 0.6 m × 1 m and 500 kg/m³, let go 0.05 m above its rest in open water 4 m deep. Its period is \
                2π √((m + a)/(ρ g A)) with a the added mass of the half spheroid with the box's waterplane moments and \
                submerged volume."
            .into(),
        resolution: "cells a side of the box",
        curves: standard(PERIOD),
        runs: runs(&tank, 1.0, cells, 8.0, 0.02, |f| periods(f, 0.02, box_period()))?,
    })
}

/// The period of the theory for the bobbing box.
fn box_period() -> f64 {
    // Half-axes of the half spheroid, which is oblate: 2/√12 m along the surface, 3 V/(2π a²) down (Lamb § 114).
    let (a, volume) = (2.0 / 12.0_f64.sqrt(), 0.3);
    let c = 3.0 * volume / (2.0 * std::f64::consts::PI * a * a);
    let e = (1.0 - c * c / (a * a)).sqrt();
    let share = 2.0 / (e * e) * (1.0 - (1.0 - e * e).sqrt() * e.asin() / e);
    let mass = 300.0 + 1000.0 * volume * share / (2.0 - share);
    std::f64::consts::TAU * (mass / 9810.0).sqrt()
}

fn periods(f: &Followed, dt: f64, truth: f64) -> Outcome {
    match bobbing(&f.heights, dt, 0.0) {
        Some((period, left)) => Outcome::of(PERIOD, (period / truth - 1.0).abs())
            .and(DECAY, left)
            .remark(format!("{period:.4} s for {truth:.4} s")),
        None => Outcome::of(PERIOD, f64::NAN).wrong("it does not bob three times"),
    }
}

fn sphere(quick: bool) -> anyhow::Result<Case> {
    let tank = Arc::new(Tank {
        side: 6.0,
        depth: 0.9,
        open: true,
        shape: r#"{ kind = "sphere", radius = 0.15 }"#.into(),
        height: 0.03,
        density: 500.0,
    });
    let cells: &[f64] = if quick {
        &[1.0, 2.0, 3.0]
    } else {
        &[0.5, 1.0, 2.0, 3.0, 6.0]
    };
    Ok(Case {
        name: "bobbing sphere",
        truth: "A sphere of 0.3 m that floats half submerged in 0.9 m of water, let go 0.03 m above its rest: the benchmark of \
                M. B. Kramer et al., Highly accurate experimental heave decay tests with a floating sphere, Energies 14, 269 \
                (2021), natural period 0.76 s. Potential theory (A. Hulme, J. Fluid Mech. 121, 1982) gives 0.76 s too."
            .into(),
        resolution: "cells a diameter",
        curves: standard(PERIOD),
        runs: runs(&tank, 0.3, cells, 4.0, 0.01, |f| periods(f, 0.01, 0.76))?,
    })
}
