//! Study `raycast`: casters against brute force.

use super::case::{Against, Case, Curves, Outcome, Run, Study};
use super::march::{March, Pace};
use super::measure::Probe;
use anyhow::Context as _;
#[cfg(feature = "bvh")]
use meniscus_render_cpu::caster::TriangleBvh;
use meniscus_render_cpu::caster::{BruteForce, Caster, Heightfield, Hit, MaxMip, Patch, Ray};
use meniscus_sim::glam::{DVec3, UVec2, Vec2};
use meniscus_sim::rng::Rng;
use meniscus_sim::{Grid, GridSpec};
use rayon::prelude::*;
use std::sync::{Arc, OnceLock};

/// The study.
pub(crate) struct RaycastStudy;

/// Mean over all rays of the error of the distance over the extent of the grid.
const MEAN: &str = "mean error of the distance over the extent";
/// Largest of these errors among rays that should hit and do.
const LARGEST: &str = "largest error of the distance over the extent";
/// Rays that hit where they should miss, or miss where they should hit.
const MISMATCH: &str = "share of wrong hits and misses";

/// How often the rays are cast while the clock runs: a single pass of a fast caster is too short to time.
const PASSES: usize = 16;

/// Rays that brute force is timed with.
const FEW: usize = 64;

/// Safety radii, cells.
const RADII: [f64; 6] = [32.0, 16.0, 8.0, 4.0, 2.0, 1.0];

/// Steps of the march.
const STEPS: [u32; 8] = [8, 16, 32, 64, 128, 256, 512, 1024];

impl Study for RaycastStudy {
    fn name(&self) -> &'static str {
        "raycast"
    }

    fn title(&self) -> &'static str {
        "Casting rays at heightfields"
    }

    fn summary(&self) -> &'static str {
        "heightfield casters, a triangle hierarchy and ray marching against brute force: error against time a ray"
    }

    fn about(&self) -> &'static str {
        "Rays are cast at surfaces from smooth to spiky, from an eye above, from anywhere, and nearly level. The truth is \
         brute force in double precision: the exact intersection with the patch of every cell, the nearest taken. Casters of \
         bilinear patches are compared with bilinear brute force, casters of triangles with that of the same triangles.\n\n\
         `blocks` is the caster of the renderers; `max-mip` walks down a pyramid of lowest and highest heights; `bvh` is a general triangle hierarchy; `march` takes equal steps through \
         the slab that holds the surface and bisects the one in which it crossed, as shaders do, with 8 to 1024 steps; `safety radius` does so with steps of 32 cells to one (Baboud & Décoret's \
         constant radius). A \
         wrong hit or miss counts as an error of the whole extent. Times are of one thread, for rays handed over all at \
         once. A caster whose every answer equals the truth stands on the line of zero."
    }

    fn expectations(&self) -> &'static str {
        include_str!("../../../data/expectations/raycast.toml")
    }

    fn cases(&self, quick: bool) -> anyhow::Result<Vec<Case>> {
        let (size, count) = if quick { (97, 1000) } else { (257, 4000) };
        let mut cases = Vec::new();
        for field in Field::ALL {
            let surface = Arc::new(field.surface(size)?);
            for kind in Kind::ALL {
                cases.push(case(field, kind, &surface, count)?);
            }
        }
        Ok(cases)
    }
}

/// Shapes of the surface.
#[derive(Clone, Copy)]
enum Field {
    Smooth,
    Noise,
    Spikes,
}

impl Field {
    const ALL: [Self; 3] = [Self::Smooth, Self::Noise, Self::Spikes];

    fn surface(self, size: u32) -> anyhow::Result<Grid<f32>> {
        let grid = GridSpec::new(Vec2::ZERO, 0.25, UVec2::splat(size))?;
        let mut rng = Rng::new(21, 0);
        Ok(match self {
            Self::Smooth => Grid::from_fn(grid, |i, j| {
                let (x, z) = (i as f32, j as f32);
                let waves = [
                    (0.31, 0.05, 0.20),
                    (0.11, 0.27, 0.15),
                    (-0.42, 0.33, 0.08),
                    (0.90, -0.55, 0.03),
                ];
                waves
                    .iter()
                    .map(|(kx, kz, a)| a * (kx * x + kz * z + 9.0 * a).sin())
                    .sum()
            }),
            Self::Noise => Grid::from_fn(grid, |_, _| 0.25 * (2.0 * rng.uniform_f32() - 1.0)),
            Self::Spikes => Grid::from_fn(grid, |_, _| match rng.next_u64() % 40 {
                0 => 3.0 * rng.uniform_f32(),
                _ => 0.002 * rng.uniform_f32(),
            }),
        })
    }

    fn name(self) -> &'static str {
        match self {
            Self::Smooth => "smooth waves",
            Self::Noise => "noise from sample to sample",
            Self::Spikes => "spikes on a plain",
        }
    }
}

/// Where rays come from.
#[derive(Clone, Copy)]
enum Kind {
    Primary,
    Random,
    Grazing,
}

impl Kind {
    const ALL: [Self; 3] = [Self::Primary, Self::Random, Self::Grazing];

    fn describe(self) -> &'static str {
        match self {
            Self::Primary => "rays of a camera above one edge, over a fan of directions",
            Self::Random => "rays from anywhere around towards anywhere within",
            Self::Grazing => "rays that skim over the surface, nearly level",
        }
    }

    fn rays(self, surface: &Grid<f32>, count: usize) -> Vec<Ray> {
        let spec = surface.spec();
        let (low, high) = surface.range();
        let (low, high) = (f64::from(low), f64::from(high));
        let extent = spec.extent().as_dvec2();
        let side = extent.x;
        let mut rng = Rng::new(22, self as u64);
        let columns = (count as f64).sqrt().ceil();
        (0..count)
            .map(|k| {
                let mut within = |y: f64| DVec3::new(side * rng.uniform(), y, extent.y * rng.uniform());
                let (origin, target) = match self {
                    Self::Primary => {
                        let (u, v) = (
                            k as f64 % columns / columns,
                            (k as f64 / columns).floor() / columns,
                        );
                        let eye = DVec3::new(0.5 * side, high + 0.15 * side, -0.1 * side);
                        (
                            eye,
                            DVec3::new(
                                side * (1.6 * u - 0.3),
                                high + 0.1 * side - 0.55 * side * v,
                                0.6 * side,
                            ),
                        )
                    }
                    Self::Random => {
                        let target = within(0.5 * (low + high));
                        let out = within(0.0) - DVec3::new(0.5 * side, 0.0, 0.5 * extent.y);
                        let height = side * (0.05 + 0.6 * rng.uniform());
                        (target + 1.5 * out + DVec3::new(0.0, height, 0.0), target)
                    }
                    Self::Grazing => {
                        let (a, b) = (within(0.0), within(0.0));
                        let level = low + (high - low) * (0.6 + 0.5 * rng.uniform());
                        let fall = (high - low) * 0.4 * rng.uniform();
                        let away = (a - b).normalize_or(DVec3::X) * side;
                        (
                            DVec3::new(a.x, level, a.z) + away,
                            DVec3::new(b.x, level - fall, b.z),
                        )
                    }
                };
                Ray {
                    origin,
                    direction: (target - origin).normalize_or(DVec3::NEG_Y),
                }
            })
            .collect()
    }
}

/// Surface, rays and what brute force says of them.
struct Problem {
    surface: Arc<Grid<f32>>,
    rays: Vec<Ray>,
    extent: f64,
    bilinear: OnceLock<Vec<Option<f64>>>,
    triangles: OnceLock<Vec<Option<f64>>>,
}

impl Problem {
    /// Distances of the first hits by brute force, computed once and on all threads.
    fn truth(&self, patch: Patch) -> anyhow::Result<&[Option<f64>]> {
        let known = match patch {
            Patch::Bilinear => &self.bilinear,
            Patch::Triangles => &self.triangles,
        };
        if known.get().is_none() {
            let brute = BruteForce::build(&self.surface, patch)?;
            let cast = |ray: &Ray| brute.cast(ray, 0.0, f64::INFINITY).map(|hit| hit.t);
            // Whoever comes second drops an equal result.
            let _ = known.set(self.rays.par_iter().map(cast).collect());
        }
        known
            .get()
            .map(Vec::as_slice)
            .context("the truth was computed above")
    }

    /// Casts the first `count` rays `passes` times and compares the answers with the truth.
    fn measure(
        &self,
        caster: &dyn Caster,
        patch: Patch,
        count: usize,
        passes: usize,
        probe: &mut Probe,
    ) -> anyhow::Result<Outcome> {
        let rays = &self.rays[..count];
        let mut hits: Vec<Option<Hit>> = vec![None; count];
        probe.time(|| {
            for _ in 0..passes {
                caster.cast_batch(rays, 0.0, f64::INFINITY, &mut hits);
            }
        });
        let (mut sum, mut largest, mut mismatches) = (0.0, 0.0_f64, 0_u32);
        for (hit, truth) in hits.iter().zip(self.truth(patch)?) {
            match (hit, truth) {
                (Some(hit), Some(t)) => {
                    let error = (hit.t - t).abs() / self.extent;
                    sum += error.min(1.0);
                    largest = largest.max(error);
                }
                (None, None) => {}
                _ => {
                    sum += 1.0;
                    mismatches += 1;
                }
            }
        }
        let share = |x: f64| x / count as f64;
        Ok(Outcome::of(MEAN, share(sum))
            .and(LARGEST, largest)
            .and(MISMATCH, share(f64::from(mismatches))))
    }
}

/// Builds a caster over a surface.
type Build = fn(&Grid<f32>) -> anyhow::Result<Box<dyn Caster>>;

/// The exact casters, with the patches that they cast at.
fn casters() -> Vec<(&'static str, Patch, Build)> {
    vec![
        ("blocks", Patch::Bilinear, |g| {
            Ok(Box::new(Heightfield::build(g)?))
        }),
        ("blocks, triangles", Patch::Triangles, |g| {
            Ok(Box::new(Heightfield::build_with(g, Patch::Triangles)?))
        }),
        ("max-mip", Patch::Bilinear, |g| {
            Ok(Box::new(MaxMip::build(g, Patch::Bilinear)?))
        }),
        #[cfg(feature = "bvh")]
        ("bvh", Patch::Triangles, |g| Ok(Box::new(TriangleBvh::build(g)?))),
    ]
}

fn case(field: Field, kind: Kind, surface: &Arc<Grid<f32>>, count: usize) -> anyhow::Result<Case> {
    let rays = kind.rays(surface, count);
    let extent = f64::from(surface.spec().extent().length());
    let problem = Arc::new(Problem {
        surface: Arc::clone(surface),
        rays,
        extent,
        bilinear: OnceLock::new(),
        triangles: OnceLock::new(),
    });
    let mut runs = Vec::new();
    for (name, patch, build) in casters() {
        let problem = Arc::clone(&problem);
        let run = Run::new(name, 0.0, move |probe| {
            let caster = build(&problem.surface)?;
            problem.measure(&*caster, patch, count, PASSES, probe)
        });
        runs.push(run.with("rays", count * PASSES));
    }
    let of_brute = Arc::clone(&problem);
    let brute = Run::new("brute force", 0.0, move |probe| {
        let brute = BruteForce::build(&of_brute.surface, Patch::Bilinear)?;
        of_brute.measure(&brute, Patch::Bilinear, FEW, 1, probe)
    });
    runs.push(brute.with("rays", FEW));
    let cells = f64::from(surface.spec().size.x - 1);
    let paces = STEPS.map(|n| ("march", f64::from(n), Pace::Steps(n)));
    let radii = RADII.map(|r| ("safety radius", cells / r, Pace::Radius(r)));
    for (method, resolution, pace) in paces.into_iter().chain(radii) {
        let problem = Arc::clone(&problem);
        let run = Run::new(method, resolution, move |probe| {
            let march = March::new(&problem.surface, pace);
            problem.measure(&march, Patch::Bilinear, count, 1, probe)
        });
        runs.push(run.with("rays", count));
    }
    Ok(Case {
        name: name(field, kind),
        truth: format!(
            "A surface of {} on {}² samples; {count} {}. An extent is the diagonal of the grid, {extent:.1} m.",
            field.name(),
            surface.spec().width(),
            kind.describe()
        ),
        resolution: "march steps a ray, safety radii across the grid (0: the method has neither)",
        curves: vec![Curves {
            metric: MEAN,
            against: Against::CpuPer {
                parameter: "rays",
                scale: 1e9,
                label: "CPU time (ns a ray)",
            },
            slopes: &[],
        }],
        runs,
    })
}

fn name(field: Field, kind: Kind) -> &'static str {
    match (field, kind) {
        (Field::Smooth, Kind::Primary) => "smooth waves, primary rays",
        (Field::Smooth, Kind::Random) => "smooth waves, random rays",
        (Field::Smooth, Kind::Grazing) => "smooth waves, grazing rays",
        (Field::Noise, Kind::Primary) => "noise, primary rays",
        (Field::Noise, Kind::Random) => "noise, random rays",
        (Field::Noise, Kind::Grazing) => "noise, grazing rays",
        (Field::Spikes, Kind::Primary) => "spikes, primary rays",
        (Field::Spikes, Kind::Random) => "spikes, random rays",
        (Field::Spikes, Kind::Grazing) => "spikes, grazing rays",
    }
}
