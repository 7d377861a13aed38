//! Study `wave-particles`: a point drop against its Hankel integral, and what a frame costs.

use super::case::{Against, Case, Curves, Outcome, Run, Study};
use super::scenes::{Edges, scene};
use super::truth::radial_pulse;
use meniscus_sim::events::Action;
use meniscus_sim::glam::{DVec2, UVec2, Vec2};
use meniscus_sim::rng::Rng;
use meniscus_sim::scene::description::{
    AmplitudeLaw, Initial, Solver as Choice, WaveParticles as Parameters,
};
use meniscus_sim::wave_particles::WaveParticles;
use meniscus_sim::wave_particles::kernel::bump;
use meniscus_sim::{Channels, Frame, GridSpec, Scene, Solver, reduce};
use std::sync::Arc;

/// The study.
pub(crate) struct WaveParticlesStudy;

/// Error over the root mean square of the exact surface.
const L2: &str = "relative L2 error";
/// Particles of the run.
const COUNT: &str = "particles";
/// Largest difference from the sum over all particles in double precision, over the largest elevation.
const GATHER: &str = "largest error over the largest elevation";

impl Study for WaveParticlesStudy {
    fn name(&self) -> &'static str {
        "wave-particles"
    }

    fn title(&self) -> &'static str {
        "Wave particles against the linear wave equation"
    }

    fn summary(&self) -> &'static str {
        "a point drop by either amplitude law against its Hankel integral; cost of a frame against particles × samples"
    }

    fn about(&self) -> &'static str {
        "The solver `wave-particles` sums small round waves that run straight and split. A round hump at rest spreads; the \
         truth is the exact solution of the linear wave equation, its Hankel integral. The volume law of the paper keeps \
         the volume of the single crest, which then falls as 1/R; the truth is a crest that falls as 1/√R with a trough \
         behind it that takes the volume back. The energy law falls as 1/√R, and its train of fronts stands for crest and \
         trough. Each curve makes the fronts denser (particles split at a smaller spacing): what does not fall with the \
         number of particles is the error of the law and of the train.\n\n\
         The second case sums many particles over a grid and compares with the sum in double precision; its cost is \
         shown against particles times samples under each."
    }

    fn expectations(&self) -> &'static str {
        include_str!("../../../data/expectations/wave-particles.toml")
    }

    fn cases(&self, quick: bool) -> anyhow::Result<Vec<Case>> {
        Ok(vec![point_drop(quick)?, gather(quick)?])
    }
}

fn parameters(spacing: f32, law: AmplitudeLaw, train: f32, split: f32) -> Choice {
    Choice::WaveParticles(Parameters {
        spacing,
        speed: Some(1.0),
        depth: 1.0,
        law,
        train,
        radius: None,
        split,
        smallest: 1e-9,
        limit: 2e7,
        horizontal: 0.0,
        fronts: Vec::new(),
    })
}

/// Samples across and their spacing: 12 m, so that the rings end inside.
const ACROSS: u32 = 241;
const SPACING: f32 = 0.05;

fn point_drop(quick: bool) -> anyhow::Result<Case> {
    // Deviation 0.12 m: particles of 0.35 m radius; at 5 s the ring is 42 deviations wide.
    const WIDTH: f64 = 0.12;
    const TIME: f64 = 5.0;
    let grid = GridSpec::new(Vec2::ZERO, SPACING, UVec2::splat(ACROSS))?;
    let centre = Vec2::splat(0.5 * SPACING * (ACROSS - 1) as f32);
    let reach = f64::from(centre.x) * 1.5;
    let truth = radial_pulse(WIDTH, 1.0, TIME, reach);
    let mut runs = Vec::new();
    let laws = [
        ("volume law", AmplitudeLaw::Volume, 1.0),
        ("energy law, 1 front", AmplitudeLaw::Energy, 1.0),
        ("energy law, 4 fronts", AmplitudeLaw::Energy, 4.0),
        ("energy law, 16 fronts", AmplitudeLaw::Energy, 16.0),
    ];
    let splits: &[f32] = if quick {
        &[1.0, 0.5]
    } else {
        &[1.2, 1.0, 0.7, 0.5, 0.3, 0.2, 0.1]
    };
    for (label, law, train) in laws {
        for &split in splits {
            let mut made: Scene = scene(
                grid,
                parameters(SPACING, law, train, split),
                Edges::Open,
                None,
                None,
            )?;
            made.description.water.initial = Initial::Disturbance {
                position: centre,
                radius: WIDTH as f32,
                height: 0.1,
            };
            let (made, truth) = (Arc::new(made), truth.clone());
            let run = Run::new("wave-particles", f64::from(1.0 / split), move |probe| {
                let mut solver = WaveParticles::from_scene(&made)?;
                let mut frame = Frame::new(grid);
                probe.time(|| -> anyhow::Result<()> {
                    solver.advance(TIME as f32)?;
                    solver.extract(Channels::NONE, &mut frame);
                    Ok(())
                })?;
                let values = frame.elevation.as_slice();
                let exact = |k: usize| {
                    let at = UVec2::new((k % grid.width()) as u32, (k / grid.width()) as u32).as_dvec2();
                    let p = at * f64::from(SPACING) - centre.as_dvec2();
                    0.1 * truth.at(p.length())
                };
                let error = reduce::sum(values.len(), |k| (f64::from(values[k]) - exact(k)).powi(2));
                let whole = reduce::sum(values.len(), |k| exact(k).powi(2));
                Ok(Outcome::of(L2, (error / whole).sqrt()).and(COUNT, solver.count() as f64))
            });
            runs.push(run.with("law", label).on_curve(label));
        }
    }
    let mut curves = Curves::standard(L2);
    curves.push(Curves {
        metric: L2,
        against: Against::Metric {
            metric: COUNT,
            front: true,
        },
        slopes: &[],
    });
    Ok(Case {
        name: "point drop",
        truth: "A Gaussian hump of 0.12 m deviation at rest in the open, after 5 s at 1 m/s, when its ring has a radius of 42 \
                deviations; the truth is its Hankel integral in double precision. Particles start as bumps of the same volume \
                and second moment. Error is relative to the exact surface on the whole grid."
            .to_owned(),
        resolution: "particles a radius, along the front",
        curves,
        runs,
    })
}

fn gather(quick: bool) -> anyhow::Result<Case> {
    let grid = GridSpec::new(Vec2::ZERO, 1.0, UVec2::splat(512))?;
    let mut runs = Vec::new();
    let counts: &[u32] = if quick {
        &[10_000, 100_000]
    } else {
        &[1000, 10_000, 100_000, 1_000_000, 10_000_000]
    };
    for radius in [2.0_f32, 4.0, 8.0, 16.0] {
        for &count in counts {
            if f64::from(radius).powi(2) * f64::from(count) > 5e7 {
                continue;
            }
            let mut made = scene(
                grid,
                parameters(1.0, AmplitudeLaw::Volume, 1.0, 0.5),
                Edges::Walls,
                None,
                None,
            )?;
            made.description.water.level = 0.0;
            let made = Arc::new(made);
            let footprint = f64::from(count) * std::f64::consts::PI * f64::from(radius).powi(2);
            let run = Run::new("gather", f64::from(count), move |probe| {
                let mut solver = WaveParticles::from_scene(&made)?;
                let mut rng = Rng::new(9, u64::from(count));
                // A drop is a ring of twelve.
                while solver.count() < count as usize {
                    let position = 512.0 * Vec2::new(rng.uniform_f32(), rng.uniform_f32()) - 0.5;
                    solver.apply(&Action::Drop {
                        position,
                        radius,
                        volume: radius * radius * (0.1 + rng.uniform_f32()),
                    })?;
                }
                solver.advance(0.25 * radius)?;
                let mut frame = Frame::new(grid);
                solver.extract(Channels::NONE, &mut frame);
                probe.time(|| solver.extract(Channels::NONE, &mut frame));
                let highest = frame.elevation.range().1;
                // Some samples away from the walls, against all particles near them.
                let near: Vec<(DVec2, f64, f64)> = solver.particles().collect();
                let worst = (0..24).map(|n| {
                    let at = UVec2::new(40 + 18 * n, 470 - 17 * n);
                    let p = at.as_dvec2();
                    let exact: f64 = near
                        .iter()
                        .map(|(c, a, r)| a * bump((p - *c).length_squared() / (r * r)))
                        .sum();
                    (f64::from(frame.elevation[(at.x as usize, at.y as usize)]) - exact).abs()
                });
                let worst = worst.fold(0.0, f64::max);
                Ok(Outcome::of(GATHER, worst / f64::from(highest)))
            });
            runs.push(
                run.with("radius", f64::from(radius))
                    .with("samples under particles", footprint)
                    .on_curve(format!("radius {radius} samples")),
            );
        }
    }
    Ok(Case {
        name: "gather",
        truth: "Rings from random drops in a square of 512 × 512 samples with walls, the elevation of one frame; the truth is \
                the sum over all particles in double precision at 24 samples away from the walls."
            .to_owned(),
        resolution: "particles",
        curves: vec![
            Curves {
                metric: GATHER,
                against: Against::Cpu,
                slopes: &[],
            },
            Curves {
                metric: GATHER,
                against: Against::CpuPer {
                    parameter: "samples under particles",
                    scale: 1e9,
                    label: "CPU ns a particle and sample",
                },
                slopes: &[],
            },
        ],
        runs,
    })
}
