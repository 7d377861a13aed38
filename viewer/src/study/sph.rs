//! Study `sph`: particles against theory and experiment.

use super::case::{Against, Case, Curves, Outcome, Run, Study};
use super::measure::Probe;
use super::{sph_pressure, sph_surface};
use meniscus_sim::sph::{Model, Settings, cases};

/// The study.
pub(crate) struct SphStudy;

/// Root mean square over the published points.
const FRONT: &str = "surge front, relative error";
/// The same with the clock of the experiment moved to where the error is least.
const DELAYED: &str = "surge front, clock fitted, relative error";
const PERIOD: &str = "period, relative error";
const DEPTH: &str = "depth, largest relative error";
const PRESSURE: &str = "pressure, relative error";
const COMPRESSION: &str = "mean compression";

/// T and Z of Martin & Moyce 1952, n² = 2, by the width of the column in inches.
const MARTIN_MOYCE: [(f32, &str); 2] = [
    (
        2.25,
        include_str!("../../../data/reference/martin-moyce-1952-a2.25in.csv"),
    ),
    (
        1.125,
        include_str!("../../../data/reference/martin-moyce-1952-a1.125in.csv"),
    ),
];

impl Study for SphStudy {
    fn name(&self) -> &'static str {
        "sph"
    }

    fn title(&self) -> &'static str {
        "Particles against theory and experiment"
    }

    fn summary(&self) -> &'static str {
        "dfsph and mcg03 against measured dam breaks, sloshing and still water; the surface against a fine 3-D one"
    }

    fn about(&self) -> &'static str {
        "The solver `sph` follows water as particles, incompressible (`dfsph`) or with the state equation of the model that \
         it grew from (`mcg03`, whose speed of sound is ten times that of a fall through the depth). Each is run in a tank \
         one particle thick and compared with the surge front that Martin & Moyce measured in 1952, with the period of \
         the first sloshing mode by linear theory, and with a column at rest: its depth, its pressure and the compression \
         that its densities show.\n\n\
         A column that collapses onto a wall is compared with the pressures that Lobovský et al. measured there in 2014. \
         The last case takes the surface of particles in a wave and in a splash as a heightfield, and compares it with the same \
         potential in double precision over a fine grid in space: the highest place where it reaches its level."
    }

    fn expectations(&self) -> &'static str {
        include_str!("../../../data/expectations/sph.toml")
    }

    fn cases(&self, quick: bool) -> anyhow::Result<Vec<Case>> {
        let fine = if quick { 20.0 } else { 40.0 };
        let sweep: Vec<f32> = [10.0, 20.0, 30.0, 40.0]
            .into_iter()
            .filter(|n| *n <= fine)
            .collect();
        Ok(vec![
            dam(&sweep)?,
            sph_pressure::probes(if quick { &[10.0, 20.0, 30.0] } else { &sweep })?,
            sloshing(&sweep),
            still(&sweep),
            sph_surface::surface(),
        ])
    }
}

pub(super) fn water(model: Model, spacing: f32, depth: f32) -> Settings {
    Settings {
        model,
        stiffness: 100.0 * 9.81 * depth,
        viscosity: if model == Model::Mcg03 { 1e-3 * depth } else { 1e-6 },
        ..Settings::water(spacing)
    }
}

const MODELS: [(Model, &str); 2] = [(Model::Dfsph, "dfsph"), (Model::Mcg03, "mcg03")];

fn dam(sweep: &[f32]) -> anyhow::Result<Case> {
    let mut runs = Vec::new();
    for (inches, text) in MARTIN_MOYCE {
        let data: Vec<(f64, f64)> = text
            .lines()
            .skip(1)
            .map(|line| {
                let (t, z) = line
                    .split_once(',')
                    .ok_or_else(|| anyhow::anyhow!("no comma in {line}"))?;
                Ok((t.parse()?, z.parse()?))
            })
            .collect::<anyhow::Result<Vec<(f64, f64)>>>()?
            .into_iter()
            .filter(|p| p.0 <= 5.0)
            .collect();
        for (model, name) in MODELS {
            for &n in sweep {
                let (data, a) = (data.clone(), inches * 0.0254);
                let run = Run::new(name, f64::from(n), move |probe: &mut Probe| {
                    let front = probe.time(|| cases::surge_front(water(model, a / n, 2.0 * a), a, &data));
                    Ok(Outcome::of(FRONT, front.error).and(DELAYED, front.delayed_error))
                });
                runs.push(
                    run.with("inches", inches)
                        .on_curve(format!("{name}, a = {inches} in")),
                );
            }
        }
    }
    Ok(Case {
        name: "dam break",
        truth: "A column of water of width a and height 2a collapses: Martin & Moyce 1952, measured fronts up to T = 5."
            .to_owned(),
        resolution: "particles across the column",
        curves: Curves::standard(DELAYED),
        runs,
    })
}

fn sloshing(sweep: &[f32]) -> Case {
    let mut runs = Vec::new();
    for (model, name) in MODELS {
        for &n in sweep {
            let run = Run::new(name, f64::from(n), move |probe: &mut Probe| {
                let depth = 0.5;
                let (period, truth) =
                    probe.time(|| cases::sloshing(water(model, depth / n, depth), 1.0, depth));
                Ok(Outcome::of(PERIOD, (period / truth - 1.0).abs()))
            });
            runs.push(run);
        }
    }
    Case {
        name: "sloshing",
        truth: "First mode in a tank of 1 m by 0.5 m: ω² = g k tanh(k h), T = 1.1818 s.".to_owned(),
        resolution: "particles in the depth",
        curves: Curves::standard(PERIOD),
        runs,
    }
}

fn still(sweep: &[f32]) -> Case {
    let mut runs = Vec::new();
    for (model, name) in MODELS {
        for &n in sweep {
            let run = Run::new(name, f64::from(n), move |probe: &mut Probe| {
                let depth = 0.5;
                let still = probe.time(|| cases::still_column(water(model, depth / n, depth), depth, 2.0));
                let worst = (still.depth[0] - 1.0).abs().max((still.depth[1] - 1.0).abs());
                Ok(Outcome::of(DEPTH, worst)
                    .and(PRESSURE, still.pressure)
                    .and(COMPRESSION, still.compression))
            });
            runs.push(run);
        }
    }
    Case {
        name: "still column",
        truth: "Half a metre of water at rest: its depth from its volume, p = ρ g (H − y).".to_owned(),
        resolution: "particles in the depth",
        curves: [DEPTH, PRESSURE, COMPRESSION]
            .into_iter()
            .map(|metric| Curves {
                metric,
                against: Against::Cpu,
                slopes: &[],
            })
            .collect(),
        runs,
    }
}
