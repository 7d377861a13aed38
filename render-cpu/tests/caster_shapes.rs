//! The caster on odd shapes of grid and in odd ways of asking: batches, single rows, long and narrow grids, dry cells.

#![allow(clippy::unwrap_used, missing_docs, reason = "test code")]

mod caster_support;

use caster_support::{Bounds, Field, Kind, ray, spec};
use glam::DVec3;
use meniscus_render_cpu::caster::{BruteForce, Caster, Heightfield, Hit, Patch, Ray};
use meniscus_sim::Grid;
use meniscus_sim::rng::Rng;

/// Rays of all kinds, some of which no caster can do anything with.
fn rays(count: usize, bounds: &Bounds, field: &Heightfield, rng: &mut Rng) -> Vec<Ray> {
    (0..count)
        .map(|n| match n % 41 {
            7 => Ray {
                origin: bounds.point(0.5, 2.0, 0.5),
                direction: DVec3::ZERO,
            },
            29 => Ray {
                origin: DVec3::NAN,
                direction: DVec3::NEG_Y,
            },
            _ => ray(Kind::ALL[n % Kind::ALL.len()], bounds, field, rng),
        })
        .collect()
}

/// A batch mixes rays of every length and kind, and none may see the state that another left behind.
#[test]
fn a_batch_answers_as_single_rays_do_to_the_last_bit() {
    let mut rng = Rng::new(31, 0);
    let mut hit = 0;
    for (n, field) in Field::ALL.into_iter().cycle().take(30).enumerate() {
        let (w, d) = [(40, 33), (2, 2), (129, 5), (7, 150), (65, 65), (2, 90)][n % 6];
        let grid = field.grid(spec(w, d, &mut rng), &mut rng);
        let bounds = Bounds::of(&grid);
        let patch = [Patch::Bilinear, Patch::Triangles][n % 2];
        let caster = Heightfield::build_with(&grid, patch).unwrap();
        // Around the length of a batch, and several.
        for count in [1, 127, 128, 129, 300] {
            let rays = rays(count, &bounds, &caster, &mut rng);
            let far = [f64::INFINITY, 0.7 * bounds.extent()][count % 2];
            let near = [0.0, 0.01 * bounds.spacing][n % 2];
            // What stood there before must not show.
            let stale = Hit {
                t: -1.0,
                position: DVec3::ZERO,
                normal: DVec3::X,
                cell: (9, 9),
            };
            let mut answers = vec![Some(stale); count];
            caster.cast_batch(&rays, near, far, &mut answers);
            for (ray, answer) in rays.iter().zip(&answers) {
                let single = caster.cast(ray, near, far);
                assert_eq!(*answer, single, "{field:?} {w}x{d} {patch:?} {ray:?}");
                assert_eq!(
                    caster.occluded(ray, near, far),
                    single.is_some(),
                    "{field:?} {w}x{d} {ray:?}"
                );
                hit += usize::from(single.is_some());
            }
        }
    }
    assert!(hit > 4000, "the rays do not test much: {hit} hits");
}

#[test]
fn a_batch_fills_as_many_answers_as_the_shorter_side_has() {
    let mut rng = Rng::new(32, 0);
    let grid = Field::Smooth.grid(spec(20, 20, &mut rng), &mut rng);
    let bounds = Bounds::of(&grid);
    let caster = Heightfield::build(&grid).unwrap();
    let down = |x: f64| Ray {
        origin: bounds.point(x, 3.0, 0.5),
        direction: DVec3::NEG_Y,
    };
    let rays: Vec<Ray> = (1..=5).map(|k| down(f64::from(k) / 6.0)).collect();
    let mut few = [None; 3];
    caster.cast_batch(&rays, 0.0, f64::INFINITY, &mut few);
    assert!(few.iter().all(Option::is_some));
    let mut many = [None; 7];
    caster.cast_batch(&rays, 0.0, f64::INFINITY, &mut many);
    assert!(many[..5].iter().all(Option::is_some) && many[5..].iter().all(Option::is_none));
    caster.cast_batch(&[], 0.0, f64::INFINITY, &mut many);
    assert!(many[0].is_some(), "no ray, no answer");
}

/// A single row or column spans no area: no ray hits it, nothing is above it, and no way of asking panics.
#[test]
fn single_rows_and_columns_have_no_surface() {
    let mut rng = Rng::new(33, 0);
    for (w, d) in [(1, 1), (1, 2), (1, 50), (2, 1), (64, 1), (300, 1)] {
        let grid = Field::Noise.grid(spec(w, d, &mut rng), &mut rng);
        // Rays for a grid of some area at the same place: through, along and past the row.
        let area = Grid::from_fn(spec(9, 9, &mut rng), |i, j| 0.1 * (i as f32 - j as f32));
        let around = Heightfield::build(&area).unwrap();
        for patch in [Patch::Bilinear, Patch::Triangles] {
            let caster = Heightfield::build_with(&grid, patch).unwrap();
            let mut rays = rays(400, &Bounds::of(&area), &around, &mut rng);
            let first = grid.spec().origin.as_dvec2();
            rays.push(Ray {
                origin: DVec3::new(first.x, 100.0, first.y),
                direction: DVec3::NEG_Y,
            });
            let mut answers = vec![None; rays.len()];
            caster.cast_batch(&rays, 0.0, f64::INFINITY, &mut answers);
            assert!(answers.iter().all(Option::is_none), "{w}x{d}");
            for ray in &rays {
                assert_eq!(caster.cast(ray, 0.0, f64::INFINITY), None, "{w}x{d} {ray:?}");
                assert!(!caster.occluded(ray, 0.0, f64::INFINITY));
            }
            assert_eq!(caster.height(first.x, first.y), None);
            assert_eq!(caster.shading_normal(first.x, first.y), None);
        }
    }
}

/// Blocks are square and cut off at the rim, walks go along the longer side of a ray: long, narrow and odd grids, seen
/// along both axes, against brute force.
#[test]
fn narrow_and_odd_grids_agree_with_brute_force() {
    let mut rng = Rng::new(34, 0);
    let (mut cast, mut hits) = (0, 0);
    for (n, (w, d)) in [
        (2, 257),
        (257, 2),
        (3, 130),
        (131, 3),
        (64, 9),
        (15, 66),
        (17, 16),
        (65, 129),
    ]
    .into_iter()
    .cycle()
    .take(24)
    .enumerate()
    {
        let field = [Field::Choppy, Field::Noise, Field::Spikes][n % 3];
        let grid = field.grid(spec(w, d, &mut rng), &mut rng);
        let bounds = Bounds::of(&grid);
        let caster = Heightfield::build(&grid).unwrap();
        let brute = BruteForce::build(&grid, Patch::Bilinear).unwrap();
        for k in 0..120 {
            // Without kinds aimed at edges, where a shift by rounding decides.
            let kind = [Kind::Primary, Kind::Random, Kind::Grazing, Kind::FromBelow][k % 4];
            let ray = ray(kind, &bounds, &caster, &mut rng);
            let (a, b) = (
                caster.cast(&ray, 0.0, f64::INFINITY),
                brute.cast(&ray, 0.0, f64::INFINITY),
            );
            assert_eq!(
                a.is_some(),
                b.is_some(),
                "{field:?} {w}x{d} {kind:?} {ray:?}: {a:?}, {b:?}"
            );
            if let (Some(a), Some(b)) = (a, b) {
                let distance = (a.t - b.t).abs() * ray.direction.length() / bounds.extent();
                assert!(
                    distance <= 1e-6,
                    "{field:?} {w}x{d} {kind:?} {ray:?}: {distance:e}"
                );
                hits += 1;
            }
            cast += 1;
        }
    }
    assert!(hits > cast / 4, "the rays do not test much: {hits} of {cast}");
}

/// Over dry cells the water's surface is the ground's. A ray must meet both in the same cell and, to the rounding of its
/// length, in the same point; where the water stands higher it must be met first.
#[test]
fn dry_cells_meet_water_and_ground_in_the_same_point() {
    let mut rng = Rng::new(35, 0);
    let (mut dry, mut wet, mut shores) = (0, 0, 0);
    for n in 0..12 {
        let ground = Field::Smooth.grid(spec([48, 21][n % 2], 33, &mut rng), &mut rng);
        let level = 0.2 * ground.spec().spacing;
        let water = Grid::from_fn(*ground.spec(), |i, j| ground[(i, j)].max(level));
        let bounds = Bounds::of(&water);
        let (on_ground, on_water) = (
            Heightfield::build(&ground).unwrap(),
            Heightfield::build(&water).unwrap(),
        );
        let is_dry = |(i, j): (u32, u32)| {
            let corners = [(0, 0), (1, 0), (0, 1), (1, 1)];
            corners.map(|(a, b)| {
                water[(i as usize + a, j as usize + b)] == ground[(i as usize + a, j as usize + b)]
            })
        };
        for k in 0..400 {
            let kind = [Kind::Primary, Kind::Vertical, Kind::Random][k % 3];
            let mut ray = ray(kind, &bounds, &on_water, &mut rng);
            // From above the rectangle: below the ground the order of the two is another, and through the rim a ray may
            // come to the ground without having met the water.
            ray.origin = ray.origin.clamp(bounds.low, bounds.high);
            ray.origin.y = bounds.high.y + bounds.spacing;
            ray.direction.y = -ray.direction.y.abs();
            let (a, b) = (
                on_water.cast(&ray, 0.0, f64::INFINITY),
                on_ground.cast(&ray, 0.0, f64::INFINITY),
            );
            let Some(first) = a else {
                assert!(
                    b.is_none(),
                    "{ray:?} meets the ground below the water but not the water"
                );
                continue;
            };
            match is_dry(first.cell) {
                [true, true, true, true] => {
                    dry += 1;
                    let b = b.unwrap_or_else(|| panic!("{ray:?} meets no ground"));
                    // Distances are reckoned from where the ray enters the heights of the grid, which differ.
                    let apart = b.position.distance(first.position) / bounds.extent();
                    assert!(apart <= 1e-13, "{ray:?}: {first:?}, {b:?}");
                    assert!(
                        b.normal.distance(first.normal) <= 1e-12,
                        "{ray:?}: {first:?}, {b:?}"
                    );
                    assert_eq!(b.cell, first.cell, "{ray:?}");
                }
                [false, false, false, false] => {
                    wet += 1;
                    assert!(b.is_none_or(|b| b.t > first.t), "{ray:?}: {first:?}, {b:?}");
                }
                _ => {
                    shores += 1;
                    assert!(
                        b.is_none_or(|b| b.t >= first.t - 1e-12 * first.t),
                        "{ray:?}: {first:?}, {b:?}"
                    );
                }
            }
        }
    }
    assert!(
        dry > 400 && wet > 400 && shores > 50,
        "{dry} dry, {wet} wet, {shores} at the shore"
    );
}
