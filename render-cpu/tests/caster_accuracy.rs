//! The caster against brute force over fuzzed heightfields, ray by ray; batches against single rays.
//!
//! `MENISCUS_CASTER_RAYS=1200000` sets how many rays are compared (the bar is 10⁶); the default is a quick subset.

#![allow(clippy::unwrap_used, missing_docs, reason = "test code")]

mod caster_support;

use caster_support::{Bounds, Field, Kind, ray, spec};
use glam::DVec3;
use meniscus_render_cpu::caster::{BruteForce, Caster, Heightfield, Hit, Patch, Ray};
use meniscus_sim::rng::Rng;

/// Bar for the distance of hits, as a share of the rectangle's longest side.
const BAR: f64 = 1e-6;

#[derive(Debug, Default)]
struct Tally {
    rays: u64,
    hits: u64,
    /// Disagreements on which a shift of the ray by rounding decides.
    silhouettes: u64,
    worst: f64,
    wrong: Vec<String>,
}

/// What is compared: the answers to one ray of the caster and of the oracle.
struct Case<'a> {
    brute: &'a BruteForce,
    bounds: &'a Bounds,
    ray: &'a Ray,
    t_min: f64,
}

impl Case<'_> {
    /// Distance between two answers as a share of the extent; infinite if only one is a hit.
    fn distance(&self, a: Option<Hit>, b: Option<Hit>) -> f64 {
        match (a, b) {
            (None, None) => 0.0,
            (Some(a), Some(b)) => (a.t - b.t).abs() * self.ray.direction.length() / self.bounds.extent(),
            _ => f64::INFINITY,
        }
    }

    /// Whether a shift of the ray by what rounding does to coordinates turns the oracle's answer into `answer`: then the
    /// ray passes exactly along a crest, along the rim of the grid, or along the surface.
    fn is_edge(&self, answer: Option<Hit>) -> bool {
        let size = self
            .bounds
            .low
            .abs()
            .max(self.bounds.high.abs())
            .max_element()
            .max(self.ray.origin.abs().max_element());
        let rise = (self.bounds.high.y - self.bounds.low.y) / self.bounds.spacing;
        [1e-15, 1e-13, 2e-12].into_iter().any(|share| {
            let by = share * size;
            [
                DVec3::X,
                DVec3::Y * (1.0 + rise),
                DVec3::Z,
                DVec3::new(1.0, 0.0, 1.0),
                DVec3::new(1.0, 0.0, -1.0),
            ]
            .into_iter()
            .flat_map(|d| [d * by, -d * by])
            .any(|shift| {
                let moved = Ray {
                    origin: self.ray.origin + shift,
                    direction: self.ray.direction,
                };
                let oracle = self.brute.cast(&moved, self.t_min, f64::INFINITY);
                self.distance(answer, oracle) <= BAR
            })
        })
    }
}

/// Rays to which a batch does not answer with the bits of [`Heightfield::cast`]: kinds mixed, so that the rays of a packet have
/// nothing in common, and kind by kind.
fn unlike_batches(caster: &Heightfield, rays: &[(Kind, Ray)]) -> Vec<String> {
    let bits = |hit: Option<Hit>| {
        hit.map(|h| {
            let numbers = [h.t]
                .into_iter()
                .chain(h.position.to_array())
                .chain(h.normal.to_array());
            (numbers.map(f64::to_bits).collect::<Vec<_>>(), h.cell)
        })
    };
    let by_kind = Kind::ALL
        .iter()
        .flat_map(|kind| rays.iter().filter(move |(k, _)| k == kind));
    let orders: [Vec<Ray>; 2] = [
        rays.iter().map(|&(_, ray)| ray).collect(),
        by_kind.map(|&(_, ray)| ray).collect(),
    ];
    let mut unlike = Vec::new();
    for rays in orders {
        let mut answers = vec![None; rays.len()];
        caster.cast_batch(&rays, 0.0, f64::INFINITY, &mut answers);
        for (ray, answer) in rays.iter().zip(answers) {
            let alone = caster.cast(ray, 0.0, f64::INFINITY);
            if bits(answer) != bits(alone) {
                unlike.push(format!("{ray:?} alone: {alone:?}, in a batch: {answer:?}"));
            }
        }
    }
    unlike
}

fn compare(total: u64, patch: Patch, seed: u64) -> Tally {
    let sizes = [
        (2, 2),
        (3, 2),
        (9, 9),
        (17, 8),
        (33, 20),
        (20, 41),
        (64, 48),
        (2, 70),
    ];
    let per_field = 40 * Kind::ALL.len() as u64;
    let mut tally = Tally::default();
    let mut rng = Rng::new(seed, 0);
    let mut round = 0_usize;
    while tally.rays < total {
        let field = Field::ALL[round % Field::ALL.len()];
        let (w, d) = sizes[(round / Field::ALL.len()) % sizes.len()];
        round += 1;
        let grid = field.grid(spec(w, d, &mut rng), &mut rng);
        let bounds = Bounds::of(&grid);
        let caster = Heightfield::build_with(&grid, patch).unwrap();
        let brute = BruteForce::build(&grid, patch).unwrap();
        let rays: Vec<(Kind, Ray)> = (0..per_field)
            .map(|n| {
                let kind = Kind::ALL[(n % Kind::ALL.len() as u64) as usize];
                (kind, ray(kind, &bounds, &caster, &mut rng))
            })
            .collect();
        tally.wrong.extend(unlike_batches(&caster, &rays));
        for (kind, ray) in rays {
            // The oracle counts a root where a ray starts, so rays from the surface start just off it.
            let t_min = if kind == Kind::Reflected {
                1e-5 * bounds.spacing / ray.direction.length()
            } else {
                0.0
            };
            let case = Case {
                brute: &brute,
                bounds: &bounds,
                ray: &ray,
                t_min,
            };
            let answer = caster.cast(&ray, t_min, f64::INFINITY);
            let oracle = brute.cast(&ray, t_min, f64::INFINITY);
            let distance = case.distance(answer, oracle);
            tally.rays += 1;
            tally.hits += u64::from(oracle.is_some());
            if distance <= BAR {
                tally.worst = tally.worst.max(distance);
            } else if case.is_edge(answer) {
                tally.silhouettes += 1;
            } else {
                tally.wrong.push(format!(
                    "{field:?} {w}x{d} {kind:?} {ray:?}: {answer:?}, oracle {oracle:?}"
                ));
            }
        }
    }
    tally
}

#[test]
fn every_ray_meets_the_surface_where_brute_force_says() {
    let total = std::env::var("MENISCUS_CASTER_RAYS")
        .ok()
        .and_then(|v| v.parse().ok())
        .unwrap_or(40_000);
    for (patch, share) in [(Patch::Bilinear, 0.7), (Patch::Triangles, 0.3)] {
        let tally = compare((total as f64 * share) as u64, patch, 11);
        println!(
            "{patch:?}: {} rays, {} hits, {} on an edge, {} wrong, worst distance {:.1e} of the extent",
            tally.rays,
            tally.hits,
            tally.silhouettes,
            tally.wrong.len(),
            tally.worst
        );
        assert!(tally.hits > tally.rays / 4, "the rays do not test much");
        assert!(
            tally.silhouettes < tally.rays / 100,
            "too many rays pass as edge cases"
        );
        assert!(
            tally.wrong.is_empty(),
            "{} wrong, the first: {}",
            tally.wrong.len(),
            tally.wrong[0]
        );
    }
}
