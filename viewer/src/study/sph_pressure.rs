//! The pressure that a collapsing column gives the wall that it hits.

use super::case::{Case, Curves, Outcome, Run};
use super::measure::Probe;
use super::sph::water;
use meniscus_sim::sph::{Model, cases};

/// Of the first probe and of the third.
const PEAK: [&str; 2] = ["peak at P1, relative error", "peak at P3, relative error"];
const ARRIVAL: [&str; 2] = ["arrival at P1, relative error", "arrival at P3, relative error"];

/// Depth of the column, m.
const DEPTH: f32 = 0.3;

/// Published curves: t √(g/H), P / ρ g H.
const PROBES: [&str; 2] = [
    include_str!("../../../data/reference/lobovsky-2014-p1.csv"),
    include_str!("../../../data/reference/lobovsky-2014-p3.csv"),
];

pub(super) fn probes(sweep: &[f32]) -> anyhow::Result<Case> {
    let read = |text: &str| {
        let rows = text.lines().skip(1).map(|line| {
            let (t, p) = line
                .split_once(',')
                .ok_or_else(|| anyhow::anyhow!("no comma in {line}"))?;
            Ok((t.parse()?, p.parse()?))
        });
        let mut rows = rows.collect::<anyhow::Result<Vec<(f64, f64)>>>()?;
        // Digitised from a plot, whose steep part doubles back.
        rows.sort_by(|a, b| a.0.total_cmp(&b.0));
        anyhow::Ok(rows)
    };
    let truth = [read(PROBES[0])?, read(PROBES[1])?];
    let mut runs = Vec::new();
    for (model, name) in [(Model::Dfsph, "dfsph"), (Model::Mcg03, "mcg03")] {
        for &n in sweep {
            let truth = truth.clone();
            let run = Run::new(name, f64::from(n), move |probe: &mut Probe| {
                let settings = water(model, DEPTH / n, DEPTH);
                let window = cases::Blow::window(&settings, DEPTH);
                let found = probe.time(|| cases::wall_blow(settings, DEPTH));
                let truth = truth.clone().map(|curve| cases::Blow::of(&curve, window));
                let relative = |found: f64, truth: f64| (found / truth - 1.0).abs();
                let peak = |k: usize| relative(found[k].peak, truth[k].peak);
                let arrival = |k: usize| relative(found[k].arrival, truth[k].arrival);
                Ok(Outcome::of(PEAK[0], peak(0))
                    .and(PEAK[1], peak(1))
                    .and(ARRIVAL[0], arrival(0))
                    .and(ARRIVAL[1], arrival(1)))
            });
            runs.push(run);
        }
    }
    Ok(Case {
        name: "blow on a wall",
        truth: "A column 0.6 m wide and 0.3 m deep collapses in a tank of 1.61 m: pressures that Lobovský et al. 2014 measured on the \
                far wall 3 mm and 30 mm above the floor."
            .to_owned()
            + " Pressures are means over the time that water of 2 √(g H) takes to pass a kernel.",
        resolution: "particles in the depth",
        curves: PEAK.into_iter().flat_map(Curves::standard).collect(),
        runs,
    })
}
