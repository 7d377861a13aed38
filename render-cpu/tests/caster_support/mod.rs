//! Heightfields and rays for the tests and benches of the caster.
#![allow(dead_code, reason = "each test or bench uses its own part")]
#![allow(unreachable_pub, missing_docs, clippy::unwrap_used, reason = "test code")]

use glam::{DVec3, UVec2, Vec2};
use meniscus_render_cpu::caster::{Heightfield, Ray};
use meniscus_sim::rng::Rng;
use meniscus_sim::{Grid, GridSpec};

/// Shapes that a caster may meet, from kind to nasty.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Field {
    Flat,
    Tilted,
    Smooth,
    Choppy,
    Noise,
    Spikes,
    Steps,
    DryTerrain,
    HighPlateau,
    Microscopic,
}

impl Field {
    pub const ALL: [Self; 10] = [
        Self::Flat,
        Self::Tilted,
        Self::Smooth,
        Self::Choppy,
        Self::Noise,
        Self::Spikes,
        Self::Steps,
        Self::DryTerrain,
        Self::HighPlateau,
        Self::Microscopic,
    ];

    pub fn grid(self, spec: GridSpec, rng: &mut Rng) -> Grid<f32> {
        let s = spec.spacing;
        let (a, b, c) = (rng.uniform_f32(), rng.uniform_f32(), rng.uniform_f32());
        let wave = move |i: usize, j: usize, length: f32| {
            let (x, z) = (i as f32 / length, j as f32 / length);
            (x + 6.0 * a).sin() * (0.7 * z + 6.0 * b).cos() + 0.3 * (1.7 * x - 2.3 * z + c).sin()
        };
        match self {
            Self::Flat => Grid::filled(spec, s * (a - 0.5)),
            Self::Tilted => Grid::from_fn(spec, |i, j| s * ((a - 0.5) * i as f32 + (b - 0.5) * j as f32 + c)),
            Self::Smooth => Grid::from_fn(spec, |i, j| s * wave(i, j, 6.0)),
            Self::Choppy => Grid::from_fn(spec, |i, j| s * (wave(i, j, 6.0) + 0.4 * wave(j, i, 1.3))),
            Self::Noise => Grid::from_fn(spec, |_, _| s * (2.0 * rng.uniform_f32() - 1.0)),
            Self::Spikes => Grid::from_fn(spec, |_, _| match rng.next_u64() % 20 {
                0 => 12.0 * s * rng.uniform_f32(),
                1 => -12.0 * s * rng.uniform_f32(),
                _ => 0.01 * s * rng.uniform_f32(),
            }),
            Self::Steps => Grid::from_fn(spec, |i, j| s * ((i / 3 + j / 5) % 3) as f32),
            // Water at a level, with land that rises out of it.
            Self::DryTerrain => Grid::from_fn(spec, |i, j| s * (3.0 * wave(i, j, 5.0)).max(0.5)),
            Self::HighPlateau => Grid::from_fn(spec, |i, j| 3000.0 + s * wave(i, j, 4.0)),
            Self::Microscopic => Grid::from_fn(spec, |i, j| 1e-6 * wave(i, j, 3.0)),
        }
    }
}

/// Where rays come from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// From one eye above, over a fan of directions.
    Primary,
    /// From anywhere around to anywhere within.
    Random,
    /// Along the surface, nearly level.
    Grazing,
    /// Off the surface, mirrored, and through it.
    Reflected,
    AxisAligned,
    /// Exactly 45° in the horizontal plane, through samples.
    Diagonal,
    Vertical,
    FromBelow,
    /// Aimed at samples and edge midpoints exactly.
    AtSamples,
}

impl Kind {
    pub const ALL: [Self; 9] = [
        Self::Primary,
        Self::Random,
        Self::Grazing,
        Self::Reflected,
        Self::AxisAligned,
        Self::Diagonal,
        Self::Vertical,
        Self::FromBelow,
        Self::AtSamples,
    ];
}

/// The rectangle and the heights that rays are aimed at.
#[derive(Clone, Copy, Debug)]
pub struct Bounds {
    pub low: DVec3,
    pub high: DVec3,
    pub spacing: f64,
}

impl Bounds {
    pub fn of(grid: &Grid<f32>) -> Self {
        let spec = grid.spec();
        let (lo, hi) = grid.range();
        let origin = spec.origin.as_dvec2();
        let spacing = f64::from(spec.spacing);
        let far = origin + spacing * (spec.size.as_dvec2() - 1.0);
        Self {
            low: DVec3::new(origin.x, f64::from(lo), origin.y),
            high: DVec3::new(far.x, f64::from(hi), far.y),
            spacing,
        }
    }

    /// The longest side of the rectangle in metres.
    pub fn extent(&self) -> f64 {
        (self.high.x - self.low.x).max(self.high.z - self.low.z)
    }

    /// A point over the rectangle; `up` counts from the lowest (0) to the highest sample (1), and at least one spacing.
    pub fn point(&self, x: f64, up: f64, z: f64) -> DVec3 {
        let thickness = (self.high.y - self.low.y).max(self.spacing);
        DVec3::new(
            self.low.x + x * (self.high.x - self.low.x),
            self.low.y + up * thickness,
            self.low.z + z * (self.high.z - self.low.z),
        )
    }
}

fn one_in(n: u64, rng: &mut Rng) -> bool {
    rng.next_u64().is_multiple_of(n)
}

/// One ray. `field` is where reflected rays start.
pub fn ray(kind: Kind, bounds: &Bounds, field: &Heightfield, rng: &mut Rng) -> Ray {
    let inside = |rng: &mut Rng, up: f64| bounds.point(rng.uniform(), up, rng.uniform());
    let around =
        |rng: &mut Rng, up: f64| bounds.point(1.8 * rng.uniform() - 0.4, up, 1.8 * rng.uniform() - 0.4);
    let (origin, direction) = match kind {
        Kind::Primary => {
            let eye = bounds.point(-0.2, 1.0, -0.3) + DVec3::Y * 0.4 * bounds.extent();
            let target = inside(rng, 0.5);
            (eye, target - eye)
        }
        Kind::Random => {
            let up = 4.0 * rng.uniform() - 1.5;
            let from = around(rng, up);
            let up = 2.0 * rng.uniform() - 0.5;
            (from, around(rng, up) - from)
        }
        Kind::Grazing => {
            let up = 1.4 * rng.uniform() - 0.2;
            let from = around(rng, up);
            let steep = 10.0_f64.powf(-6.0 * rng.uniform());
            let mut direction = around(rng, up) - from;
            direction.y = (rng.uniform() - 0.5) * steep * direction.length();
            (from, direction)
        }
        Kind::Reflected => {
            let eye = Ray {
                origin: inside(rng, 3.0) + DVec3::Y * bounds.spacing,
                direction: DVec3::new(rng.normal(), -rng.uniform(), rng.normal()),
            };
            match field.cast(&eye, 0.0, f64::INFINITY) {
                Some(hit) => {
                    let d = eye.direction;
                    let mirrored = d - 2.0 * d.dot(hit.normal) * hit.normal;
                    let bent = d - 0.25 * d.dot(hit.normal) * hit.normal;
                    (hit.position, if one_in(4, rng) { bent } else { mirrored })
                }
                None => (eye.origin, eye.direction),
            }
        }
        Kind::AxisAligned => {
            let up = 1.4 * rng.uniform() - 0.2;
            let from = around(rng, up);
            let steep = if one_in(3, rng) { 0.0 } else { 0.1 * rng.normal() };
            let sign = if one_in(2, rng) { 1.0 } else { -1.0 };
            let along_x = one_in(2, rng);
            (
                from,
                DVec3::new(
                    if along_x { sign } else { 0.0 },
                    steep,
                    if along_x { 0.0 } else { sign },
                ),
            )
        }
        Kind::Diagonal => {
            let cells = ((bounds.high - bounds.low) / bounds.spacing).round();
            let step = |rng: &mut Rng, n: f64| (rng.uniform() * (n + 1.0)).floor();
            let (i, j) = (step(rng, cells.x), step(rng, cells.z));
            let up = 1.4 * rng.uniform() - 0.2;
            let mut from = bounds.point(0.0, up, 0.0);
            from.x += i * bounds.spacing;
            from.z += j * bounds.spacing;
            let sign = |rng: &mut Rng| if one_in(2, rng) { 1.0 } else { -1.0 };
            let steep = if one_in(3, rng) { 0.0 } else { 0.1 * rng.normal() };
            (from, DVec3::new(sign(rng), steep, sign(rng)))
        }
        Kind::Vertical => {
            let up = 4.0 * rng.uniform() - 1.5;
            let from = around(rng, up);
            (
                from,
                DVec3::new(0.0, if one_in(2, rng) { 1.0 } else { -2.5 }, 0.0),
            )
        }
        Kind::FromBelow => {
            let up = -1.0 - rng.uniform();
            let from = around(rng, up);
            let up = 0.5 + rng.uniform();
            (from, inside(rng, up) - from)
        }
        Kind::AtSamples => {
            let cells = (2.0 * (bounds.high - bounds.low) / bounds.spacing).round();
            let step = |rng: &mut Rng, n: f64| 0.5 * (rng.uniform() * (n + 1.0)).floor();
            let up = 3.0 * rng.uniform() - 1.0;
            let from = around(rng, up);
            let up = rng.uniform();
            let mut target = bounds.point(0.0, up, 0.0);
            target.x += step(rng, cells.x) * bounds.spacing;
            target.z += step(rng, cells.z) * bounds.spacing;
            (from, target - from)
        }
    };
    let length = direction.length();
    let direction = if length > 0.0 && !one_in(4, rng) {
        direction / length
    } else {
        direction
    };
    Ray { origin, direction }
}

/// A specification with random place, spacing and the given size.
pub fn spec(width: u32, depth: u32, rng: &mut Rng) -> GridSpec {
    let spacing = [1.0, 0.25, 0.1, 7.3][(rng.next_u64() % 4) as usize];
    let at = |rng: &mut Rng| spacing * (40.0 * (rng.uniform_f32() - 0.5)).round();
    GridSpec::new(Vec2::new(at(rng), at(rng)), spacing, UVec2::new(width, depth)).unwrap()
}

/// A lively sea of `size` × `size` samples, 1 m apart: 40 waves of 8 m to a third of the grid, rms slope about 0.15.
pub fn sea(size: u32) -> Grid<f32> {
    let mut rng = Rng::new(42, 0);
    let waves: Vec<[f64; 4]> = (0..40)
        .map(|k| {
            let length = 8.0 * (170.0_f64 / 8.0).powf(f64::from(k) / 39.0);
            let number = std::f64::consts::TAU / length;
            let heading = std::f64::consts::TAU * rng.uniform();
            let slope = 0.15 * (2.0_f64 / 40.0).sqrt();
            [
                number * heading.cos(),
                number * heading.sin(),
                std::f64::consts::TAU * rng.uniform(),
                slope / number,
            ]
        })
        .collect();
    let spec = GridSpec::new(Vec2::ZERO, 1.0, UVec2::splat(size)).unwrap();
    Grid::from_fn(spec, |i, j| {
        waves
            .iter()
            .map(|[kx, kz, phase, amplitude]| amplitude * (kx * i as f64 + kz * j as f64 + phase).sin())
            .sum::<f64>() as f32
    })
}

/// Rays as a renderer casts them: `primary` from a camera above the rim in scan-line order, `random` from points above
/// to points of the surface, `grazing` within 2° of level just above the mean, `reflected` off the primary hits.
pub fn workload(kind: &str, count: usize, bounds: &Bounds, field: &Heightfield) -> Vec<Ray> {
    let mut rng = Rng::new(7, 1);
    let extent = bounds.extent();
    let point = |x: f64, y: f64, z: f64| DVec3::new(bounds.low.x + x * extent, y, bounds.low.z + z * extent);
    let primary = || {
        let eye = point(0.5, 0.15 * extent, -0.2);
        let forward = (point(0.5, 0.0, 0.35) - eye).normalize();
        let right = forward.cross(DVec3::Y).normalize();
        let up = right.cross(forward);
        let width = (count as f64 * 4.0 / 3.0).sqrt().ceil() as usize;
        let height = count.div_ceil(width);
        (0..count).map(move |k| {
            let (x, y) = ((k % width) as f64 + 0.5, (k / width) as f64 + 0.5);
            let aspect = width as f64 / height as f64;
            let tangent = 0.42;
            let px = tangent * aspect * (2.0 * x / width as f64 - 1.0);
            let py = tangent * (1.0 - 2.0 * y / height as f64);
            Ray {
                origin: eye,
                direction: (forward + px * right + py * up).normalize(),
            }
        })
    };
    match kind {
        "primary" => primary().collect(),
        "random" => (0..count)
            .map(|_| {
                let origin = point(
                    rng.uniform(),
                    bounds.high.y + 0.2 * extent * rng.uniform(),
                    rng.uniform(),
                );
                let target = point(rng.uniform(), 0.0, rng.uniform());
                Ray {
                    origin,
                    direction: (target - origin).normalize(),
                }
            })
            .collect(),
        "grazing" => (0..count)
            .map(|_| {
                let origin = point(rng.uniform(), bounds.high.y * rng.uniform(), rng.uniform());
                let (sin, cos) = (std::f64::consts::TAU * rng.uniform()).sin_cos();
                let direction = DVec3::new(cos, 0.07 * (rng.uniform() - 0.5), sin);
                Ray {
                    origin,
                    direction: direction.normalize(),
                }
            })
            .collect(),
        _ => primary()
            .map(|ray| match field.cast(&ray, 0.0, f64::INFINITY) {
                Some(hit) => {
                    let d = ray.direction;
                    let normal = field
                        .shading_normal(hit.position.x, hit.position.z)
                        .unwrap_or(hit.normal);
                    Ray {
                        origin: hit.position,
                        direction: d - 2.0 * d.dot(normal) * normal,
                    }
                }
                None => ray,
            })
            .collect(),
    }
}
