//! Surfaces whose samples are displaced sideways, brought back to a heightfield.
//!
//! A frame may say that the surface point of the sample at x₀ stands at x₀ + D(x₀). The height over a place x is then
//! that of the x₀ with x₀ + D(x₀) = x, found by the iteration x₀ ← x − D(x₀), which converges where the surface does
//! not fold over itself (|∂D/∂x| < 1). Where it nearly folds, the last iterate is taken: a sharp crest.

use crate::Grid;
use glam::{BVec2, DVec2, Vec2};
use rayon::prelude::*;

const ITERATIONS: usize = 24;
/// Samples by which an iterate may still move.
const CLOSE: f64 = 1e-4;

/// Heights over the samples' own places, of elevations that are displaced by `displacement` (metres).
pub fn undisplaced(elevation: &Grid<f32>, displacement: &Grid<Vec2>, periodic: BVec2, out: &mut Grid<f32>) {
    let spec = *elevation.spec();
    let width = spec.width();
    let scale = 1.0 / f64::from(spec.spacing);
    out.as_mut_slice()
        .par_chunks_mut(width)
        .enumerate()
        .for_each(|(j, row)| {
            for (i, out) in row.iter_mut().enumerate() {
                let x = DVec2::new(i as f64, j as f64);
                let mut from = x;
                for _ in 0..ITERATIONS {
                    let moved = scale * bilinear(displacement, from, periodic).as_dvec2();
                    let next = x - moved;
                    let change = (next - from).abs().max_element();
                    // Halved steps also converge where the full ones would swing.
                    from = if change > 0.5 { 0.5 * (from + next) } else { next };
                    if change < CLOSE {
                        break;
                    }
                }
                *out = cubic(elevation, from, periodic);
            }
        });
}

fn index(k: isize, n: usize, periodic: bool) -> usize {
    (if periodic {
        k.rem_euclid(n as isize)
    } else {
        k.clamp(0, n as isize - 1)
    }) as usize
}

fn bilinear(grid: &Grid<Vec2>, p: DVec2, periodic: BVec2) -> Vec2 {
    let (w, h) = (grid.spec().width(), grid.spec().height());
    let cell = p.floor();
    let f = (p - cell).as_vec2();
    let at = |a: isize, b: isize| {
        grid[(
            index(cell.x as isize + a, w, periodic.x),
            index(cell.y as isize + b, h, periodic.y),
        )]
    };
    at(0, 0)
        .lerp(at(1, 0), f.x)
        .lerp(at(0, 1).lerp(at(1, 1), f.x), f.y)
}

fn cubic(grid: &Grid<f32>, p: DVec2, periodic: BVec2) -> f32 {
    let (w, h) = (grid.spec().width(), grid.spec().height());
    let cell = p.floor();
    let f = (p - cell).as_vec2();
    let (wx, wz) = (
        super::continuation::catmull_rom(f.x),
        super::continuation::catmull_rom(f.y),
    );
    let mut sum = 0.0;
    for (b, wz) in wz.into_iter().enumerate() {
        let j = index(cell.y as isize + b as isize - 1, h, periodic.y);
        for (a, wx) in wx.into_iter().enumerate() {
            sum += wx * wz * grid[(index(cell.x as isize + a as isize - 1, w, periodic.x), j)];
        }
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::GridSpec;
    use glam::UVec2;

    #[test]
    fn a_trochoid_lies_on_its_own_curve() {
        let spec = GridSpec::new(Vec2::ZERO, 0.1, UVec2::new(128, 4)).unwrap();
        let k = std::f32::consts::TAU / (spec.spacing * 64.0);
        let a = 0.7 / k;
        let elevation = Grid::from_fn(spec, |i, _| a * (k * spec.position(i, 0).x).cos());
        let displacement = Grid::from_fn(spec, |i, _| {
            Vec2::new(-a * (k * spec.position(i, 0).x).sin(), 0.0)
        });
        let mut out = Grid::filled(spec, 0.0);
        undisplaced(&elevation, &displacement, BVec2::TRUE, &mut out);
        for i in 0..spec.width() {
            // Newton in f64 on the closed form.
            let x = f64::from(spec.position(i, 0).x);
            let (k, a) = (f64::from(k), f64::from(a));
            let mut q = x;
            for _ in 0..200 {
                q -= (q - a * (k * q).sin() - x) / (1.0 - a * k * (k * q).cos());
            }
            let truth = a * (k * q).cos();
            // Interpolating the displacement between samples is of second order: h²/8 · a k² / (1 − a k) here.
            assert!(
                (f64::from(out[(i, 1)]) - truth).abs() < 4e-3,
                "{i}: {} {truth}",
                out[(i, 1)]
            );
        }
    }
}
