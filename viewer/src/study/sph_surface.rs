//! The surface of particles as a heightfield, against the same potential on a fine grid in space.

use super::case::{Against, Case, Curves, Outcome, Run};
use super::measure::Probe;
use meniscus_sim::glam::{DVec2, DVec3, UVec2, Vec2, Vec3};
use meniscus_sim::sph::{Boundary, Extractor, Fluid, Root, Settings, cases};
use meniscus_sim::{Channels, Frame, Grid, GridSpec};
use std::sync::{Arc, LazyLock};

/// Root mean square over the columns that are wet in both.
const HEIGHT: &str = "height (particle spacings)";
/// The largest of them.
const LARGEST: &str = "largest error of a height (particle spacings)";
/// Columns that are wet in one and dry in the other.
const SHORE: &str = "share of columns wet or dry by mistake";

/// Heights of the grid in space, in particle spacings.
const FINE: f64 = 1.0 / 64.0;

/// Particles above level ground, and where the samples stand.
struct Water {
    fluid: Fluid,
    ground: Grid<f32>,
    /// The true heights; `None` where it is dry.
    truth: Vec<Option<f64>>,
}

impl Water {
    fn new(fluid: Fluid) -> anyhow::Result<Self> {
        let (d, boundary) = (fluid.settings().spacing, fluid.boundary());
        let size = ((boundary.high - boundary.low) / (0.5 * d)).round().as_uvec2() + 1;
        let spec = GridSpec::new(boundary.low, 0.5 * d, size)?;
        let mut water = Self {
            fluid,
            ground: Grid::filled(spec, 0.0),
            truth: Vec::new(),
        };
        water.truth = water.search();
        Ok(water)
    }

    fn extract(&self, root: Root) -> Frame {
        let spec = *self.ground.spec();
        let mut frame = Frame::new(spec);
        let d = self.fluid.settings().spacing;
        Extractor::new(spec, d, root).extract(&self.fluid, &self.ground, Channels::DEPTH, false, &mut frame);
        frame
    }

    /// The particles with their images beyond walls and ground.
    fn with_images(&self, reach: f64) -> Vec<DVec3> {
        let boundary = self.fluid.boundary();
        let (low, high) = (boundary.low.as_dvec2(), boundary.high.as_dvec2());
        let mut list: Vec<DVec3> = self
            .fluid
            .positions()
            .iter()
            .map(|p| p.truncate().as_dvec3())
            .collect();
        let mut reflect = |distance: &dyn Fn(DVec3) -> f64, image: &dyn Fn(DVec3) -> DVec3| {
            let images: Vec<DVec3> = list
                .iter()
                .filter(|p| distance(**p) < reach)
                .map(|p| image(*p))
                .collect();
            list.extend(images);
        };
        reflect(&|p| p.y, &|p| DVec3::new(p.x, -p.y, p.z));
        reflect(&|p| (p.x - low.x).abs(), &|p| {
            DVec3::new(2.0 * low.x - p.x, p.y, p.z)
        });
        reflect(&|p| (p.x - high.x).abs(), &|p| {
            DVec3::new(2.0 * high.x - p.x, p.y, p.z)
        });
        reflect(&|p| (p.z - low.y).abs(), &|p| {
            DVec3::new(p.x, p.y, 2.0 * low.y - p.z)
        });
        reflect(&|p| (p.z - high.y).abs(), &|p| {
            DVec3::new(p.x, p.y, 2.0 * high.y - p.z)
        });
        list
    }

    /// The highest crossing of every column, on levels of [`FINE`] spacings and then by halving.
    fn search(&self) -> Vec<Option<f64>> {
        let spec = *self.ground.spec();
        let d = f64::from(self.fluid.settings().spacing);
        let extractor = Extractor::new(spec, d as f32, Root::Exact);
        let (h, level) = (f64::from(extractor.radius()), f64::from(extractor.level()));
        let particles = self.with_images(h);
        let mut sorted: Vec<usize> = (0..particles.len()).collect();
        sorted.sort_by(|a, b| particles[*a].x.total_cmp(&particles[*b].x));
        let at = |k: usize| particles[sorted[k]];
        let columns = (0..spec.height()).flat_map(|j| (0..spec.width()).map(move |i| (i, j)));
        columns
            .map(|(i, j)| {
                let place = spec.position(i, j).as_dvec2();
                let first = sorted.partition_point(|k| particles[*k].x < place.x - h);
                let near: Vec<(f64, f64)> = (first..sorted.len())
                    .map(at)
                    .take_while(|p| p.x < place.x + h)
                    .map(|p| (1.0 - DVec2::new(p.x, p.z).distance_squared(place) / (h * h), p.y))
                    .filter(|n| n.0 > 0.0)
                    .collect();
                let potential = |y: f64| -> f64 {
                    let share = |n: &(f64, f64)| (n.0 - ((y - n.1) / h).powi(2)).max(0.0).sqrt();
                    near.iter().map(share).sum()
                };
                let top = near.iter().map(|n| n.1).fold(0.0, f64::max) + h;
                let steps = (top / (FINE * d)).ceil() as u32;
                let found = (0..=steps)
                    .map(|k| top - f64::from(k) * FINE * d)
                    .find(|y| *y > 0.0 && potential(*y) >= level)?;
                let (mut below, mut above) = (found, found + FINE * d);
                for _ in 0..40 {
                    let middle = 0.5 * (below + above);
                    if potential(middle) >= level {
                        below = middle;
                    } else {
                        above = middle;
                    }
                }
                Some(below)
            })
            .collect()
    }
}

/// Particles in a tank whose surface is a wave, in slight disorder.
fn wave() -> anyhow::Result<Water> {
    let (d, length, breadth) = (0.02_f32, 1.2, 0.6);
    let mut fluid = Fluid::new(
        Settings::water(d),
        Boundary::tank(Vec2::ZERO, Vec2::new(length, breadth), 0.0),
    );
    let mut rng = meniscus_sim::rng::Rng::new(7, 0);
    let count = |l: f32| (l / d).round() as u32;
    let size = UVec2::new(count(length), count(breadth));
    for z in 0..size.y {
        for x in 0..size.x {
            let at = d * Vec2::new(x as f32 + 0.5, z as f32 + 0.5);
            let top = 0.3 + 0.04 * (10.0 * at.x).sin() * (7.0 * at.y).cos();
            for y in 0..count(top) {
                let mut aside = || 0.2 * d * (rng.uniform_f32() - 0.5);
                let p = Vec3::new(at.x + aside(), d * (y as f32 + 0.5) + aside(), at.y + aside());
                fluid.add(p, Vec3::ZERO);
            }
        }
    }
    Water::new(fluid)
}

/// A column that has collapsed and runs up the far wall: sheets, holes, drops.
fn splash() -> anyhow::Result<Water> {
    let d = 0.02;
    let mut fluid = Fluid::new(
        Settings::water(d),
        Boundary::tank(Vec2::ZERO, Vec2::new(0.6, 0.24), 0.0),
    );
    cases::fill(&mut fluid, Vec3::ZERO, Vec3::new(0.2, 0.3, 0.24));
    cases::run(&mut fluid, 0.45, f64::INFINITY, |_, _| {});
    Water::new(fluid)
}

pub(super) fn surface() -> Case {
    type Made = LazyLock<anyhow::Result<Water>>;
    let mut runs = Vec::new();
    let makers: [fn() -> anyhow::Result<Water>; 2] = [wave, splash];
    for (make, (what, number)) in makers.into_iter().zip([("wave", 1.0), ("splash", 2.0)]) {
        // Made when it is first asked for, not to list the study.
        let water: Arc<Made> = Arc::new(LazyLock::new(make));
        for (name, root) in [("fast", Root::Fast), ("exact", Root::Exact)] {
            let water = Arc::clone(&water);
            let run = Run::new(name, number, move |probe: &mut Probe| {
                let water = (**water).as_ref().map_err(|e| anyhow::anyhow!("{e}"))?;
                let frame = probe.time(|| water.extract(root));
                let d = f64::from(water.fluid.settings().spacing);
                let depth = frame.depth.as_ref().map_or(&[][..], Grid::as_slice);
                let (mut square, mut largest, mut both, mut mistaken) = (0.0, 0.0_f64, 0.0, 0.0);
                for ((depth, height), truth) in depth.iter().zip(frame.elevation.as_slice()).zip(&water.truth)
                {
                    match truth {
                        Some(truth) if *depth > 0.0 => {
                            let error = (f64::from(*height) - truth) / d;
                            square += error * error;
                            largest = largest.max(error.abs());
                            both += 1.0;
                        }
                        Some(_) => mistaken += 1.0,
                        None if *depth > 0.0 => mistaken += 1.0,
                        None => {}
                    }
                }
                let all = water.truth.len() as f64;
                Ok(Outcome::of(HEIGHT, (square / f64::max(both, 1.0)).sqrt())
                    .and(LARGEST, largest)
                    .and(SHORE, mistaken / all))
            });
            runs.push(run.with("water", what).on_curve(format!("{name}, {what}")));
        }
    }
    Case {
        name: "surface",
        truth: "The same potential in double precision on levels a 64th of a spacing apart, solved by halving: the highest \
                crossing of every column of a wave (1) and of a splash (2)."
            .to_owned(),
        resolution: "water",
        curves: vec![Curves {
            metric: HEIGHT,
            against: Against::Cpu,
            slopes: &[],
        }],
        runs,
    }
}
