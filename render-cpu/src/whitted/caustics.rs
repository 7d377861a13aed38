//! Sunlight gathered by waves: how much of it falls where on the ground below.
//!
//! The surface is cut into small patches. Each sends its share of sunlight down its own refracted direction, and what
//! arrives is summed on a grid over the ground, relative to flat water: 1 everywhere under a still surface, more where
//! waves focus, less between. Every patch carries exactly what it receives, so the sum over the grid is the light that
//! enters. Patches are as fine as the grid needs: bilinear shares of a regular lattice twice as dense add up to exactly
//! the same everywhere when nothing is focused.
//!
//! Sums are whole numbers in units of 2⁻¹⁶, which do not depend on the order in which threads add them.

use crate::sky::Sun;
use crate::stage::light::Light;
use crate::stage::surface::Surface;
use glam::{DVec2, DVec3, Vec2, Vec3};
use meniscus_sim::optics::{fresnel, refract};
use meniscus_sim::{Grid, GridSpec};
use rayon::prelude::*;
use std::sync::atomic::{AtomicU32, Ordering};

/// Patches a sample along each axis.
const PATCHES: usize = 2;
/// Fixed-point one.
const ONE: f32 = 65_536.0;
/// Rays that are followed to the ground by this many steps of "go as deep as the ground is there".
const STEPS: usize = 4;
/// Largest share by which waves may move light, in samples of the grid, that is not worth a map.
const NEGLIGIBLE: f64 = 0.05;

/// Relative sunlight on the ground, on the grid of the water.
#[derive(Debug)]
pub(super) struct Caustics {
    map: Grid<f32>,
}

impl Caustics {
    /// `None` where there is no sun, no ground, or waves too slight to matter.
    pub(super) fn build(
        heights: &Grid<f32>,
        water: &Surface,
        ground: &Surface,
        light: &Light,
        index: f32,
    ) -> Option<Self> {
        let sun = light.sun.filter(|_| light.beam.is_some())?;
        let spec = *heights.spec();
        if spec.width() < 2 || spec.height() < 2 || !matters(heights, ground, &spec, index) {
            return None;
        }
        let sums: Vec<AtomicU32> = (0..spec.len()).map(|_| AtomicU32::new(0)).collect();
        (0..(spec.height() - 1) * PATCHES)
            .into_par_iter()
            .for_each(|row| {
                for column in 0..(spec.width() - 1) * PATCHES {
                    let offset = |k: usize| (k as f64 + 0.5) / PATCHES as f64;
                    let at = spec.origin.as_dvec2()
                        + f64::from(spec.spacing) * DVec2::new(offset(column), offset(row));
                    if let Some((landed, share)) = descend(at, water, ground, &sun, index) {
                        deposit(&sums, &spec, landed, share);
                    }
                }
            });
        let unit = 1.0 / (ONE * (PATCHES * PATCHES) as f32);
        let mut map = Grid::filled(spec, 1.0);
        for (value, sum) in map.as_mut_slice().iter_mut().zip(&sums) {
            *value = sum.load(Ordering::Relaxed) as f32 * unit;
        }
        fill_rim(&mut map, heights, ground, light);
        Some(Self { map })
    }

    /// Sunlight at a point of the ground relative to that below flat water; 1 outside the grid.
    pub(super) fn at(&self, p: Vec2) -> f32 {
        let spec = self.map.spec();
        let g = spec.to_grid(p);
        let last = spec.size.as_vec2() - Vec2::ONE;
        if g.min_element() < 0.0 || (last - g).min_element() < 0.0 {
            return 1.0;
        }
        self.map.sample(p)
    }

    pub(super) fn bytes_for(samples: u64) -> u64 {
        8 * samples
    }
}

/// Whether waves move light by more than a fraction of a sample: slope times depth times the share of refraction.
fn matters(heights: &Grid<f32>, ground: &Surface, spec: &GridSpec, index: f32) -> bool {
    let data = heights.as_slice();
    let w = spec.width();
    let bend = f64::from(1.0 - 1.0 / index.max(1.0));
    (0..spec.height() - 1).step_by(2).any(|j| {
        (0..w - 1).step_by(2).any(|i| {
            let k = j * w + i;
            let depth = f64::from(data[k]) - ground.height(spec.position(i, j).as_dvec2());
            let rise = (data[k + 1] - data[k]).abs().max((data[k + w] - data[k]).abs());
            let slope = f64::from(rise / spec.spacing);
            depth > 0.0 && slope * depth * bend > NEGLIGIBLE * f64::from(spec.spacing)
        })
    })
}

/// Where the sunlight that enters at `at` meets the ground, and how much it is relative to flat water.
fn descend(at: DVec2, water: &Surface, ground: &Surface, sun: &Sun, index: f32) -> Option<(DVec2, f32)> {
    let height = water.height(at);
    if ground.height(at) >= height {
        return None;
    }
    let (slope, _) = water.slope(at);
    let normal = Vec3::new(-slope.x, 1.0, -slope.y).normalize();
    let cos = normal.dot(sun.direction);
    if cos <= 0.0 {
        return None;
    }
    let down = refract(-sun.direction, normal, 1.0 / index)?;
    if down.y > -1e-3 {
        return None;
    }
    // The patch's area is its share of the plane over the normal's upward part; what it receives goes with cos.
    let flat = (1.0 - fresnel(sun.direction.y, 1.0 / index)) * sun.direction.y;
    let share = (1.0 - fresnel(cos, 1.0 / index)) * cos / normal.y / flat;
    let across = DVec2::new(f64::from(down.x), f64::from(down.z)) / f64::from(-down.y);
    let mut landed = at;
    for _ in 0..STEPS {
        landed = at + across * (height - ground.height(landed)).max(0.0);
    }
    Some((landed, share))
}

fn deposit(sums: &[AtomicU32], spec: &GridSpec, at: DVec2, share: f32) {
    let g = (at - spec.origin.as_dvec2()) / f64::from(spec.spacing);
    let cell = g.floor();
    let f = (g - cell).as_vec2();
    for (di, wi) in [(0, 1.0 - f.x), (1, f.x)] {
        for (dj, wj) in [(0, 1.0 - f.y), (1, f.y)] {
            let (i, j) = (cell.x + f64::from(di), cell.y + f64::from(dj));
            if i >= 0.0 && j >= 0.0 && i < spec.width() as f64 && j < spec.height() as f64 {
                let units = (share * wi * wj * ONE + 0.5).clamp(0.0, 64.0 * ONE) as u32;
                sums[spec.index(i as usize, j as usize)].fetch_add(units, Ordering::Relaxed);
            }
        }
    }
}

/// Near the rim light would also come from beyond the grid: there the map gives way to flat water, over as much as the
/// beam is shifted.
fn fill_rim(map: &mut Grid<f32>, heights: &Grid<f32>, ground: &Surface, light: &Light) {
    let spec = *map.spec();
    let Some(beam) = light.beam else { return };
    let across = Vec2::new(beam.direction.x, beam.direction.z).abs() / beam.direction.y.max(1e-3) + 0.1;
    let width = spec.width();
    map.as_mut_slice()
        .par_chunks_mut(width)
        .enumerate()
        .for_each(|(j, row)| {
            for (i, value) in row.iter_mut().enumerate() {
                let p = spec.position(i, j);
                let depth = (f64::from(heights[(i, j)]) - ground.height(p.as_dvec2())).max(0.0) as f32;
                let margin = across * depth / spec.spacing + 1.0;
                let g = Vec2::new(i as f32, j as f32);
                let inside = (g.min(spec.size.as_vec2() - Vec2::ONE - g) / margin).min_element();
                // Twice the margin: half of it is filled, half blends.
                let t = (inside - 1.0).clamp(0.0, 1.0);
                *value = 1.0 + (*value - 1.0) * t * t * (3.0 - 2.0 * t);
            }
        });
}

/// Irradiance of ground relative to the beam's, where `normal` is its shading normal and `geometric` its own.
pub(super) fn received(beam: Vec3, normal: Vec3, geometric: DVec3, share: f32) -> f32 {
    let g = geometric.as_vec3();
    let level = beam.y * g.y / g.dot(beam).max(0.1 * beam.y);
    normal.dot(beam).max(0.0) * share * level
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sky::Sky;
    use crate::stage::continuation::Continuation;
    use crate::stage::tests_support;
    use glam::{BVec2, UVec2};
    use meniscus_sim::scene::description::Sun as SunTable;

    fn light(elevation: f32) -> Light {
        let mut description = tests_support::description();
        description.light.sun = Some(SunTable {
            elevation,
            azimuth: 90.0,
            irradiance: Vec3::ONE,
            radius: 0.27,
        });
        let sky = Sky::new(&tests_support::scene(description.clone()));
        Light::new(&description, sky)
    }

    fn map(elevation: f32, depth: f32, wave: impl Fn(Vec2) -> f32) -> Option<Caustics> {
        let spec = GridSpec::new(Vec2::ZERO, 0.05, UVec2::splat(201)).unwrap();
        let how = Continuation {
            periodic: BVec2::FALSE,
            apron: UVec2::ZERO,
            level: 0.0,
        };
        let heights = Grid::from_fn(spec, |i, j| wave(spec.position(i, j)));
        let water = Surface::build(&heights, how).unwrap();
        let ground =
            Surface::build(&Grid::filled(spec, -depth), Continuation { level: -depth, ..how }).unwrap();
        Caustics::build(&heights, &water, &ground, &light(elevation), 1.333)
    }

    #[test]
    fn still_water_needs_no_map_and_a_tilted_plane_lights_evenly() {
        assert!(map(50.0, 1.0, |_| 0.0).is_none());
        let even = map(50.0, 1.0, |p| 0.02 * p.x).unwrap();
        let middle: Vec<f32> = (60..140)
            .flat_map(|j| (60..140).map(move |i| (i, j)))
            .map(|k| even.map[k])
            .collect();
        let (low, high) = middle
            .iter()
            .fold((f32::MAX, f32::MIN), |(a, b), &v| (a.min(v), b.max(v)));
        assert!(high - low < 0.01 && (low - 1.0).abs() < 0.03, "{low} {high}");
    }

    #[test]
    fn waves_move_light_and_lose_none() {
        let k = std::f32::consts::TAU / 1.0;
        let waves = map(90.0, 1.0, |p| 0.01 * (k * p.x).sin()).unwrap();
        let inner: Vec<f64> = (50..150)
            .flat_map(|j| (50..150).map(move |i| (i, j)))
            .map(|c| f64::from(waves.map[c]))
            .collect();
        let mean = inner.iter().sum::<f64>() / inner.len() as f64;
        // Five whole waves: as much leaves the window as enters it.
        assert!((mean - 1.0).abs() < 2e-3, "{mean}");
        let peak = inner.iter().copied().fold(0.0, f64::max);
        // Vertical sun, depth d: the density is 1/(1 − d (1 − 1/n) η'') to first order in the slope.
        let bend = 1.0 - 1.0 / 1.333;
        let closed = 1.0 / (1.0 - bend * 0.01 * f64::from(k * k));
        assert!((peak / closed - 1.0).abs() < 0.02, "{peak} {closed}");
    }
}
