//! Divergence-free SPH: two pressure systems, one for the rate of compression and one for the compression.
//!
//! Bender & Koschier 2015, 2017. With particles of equal volume V, g_ij = V ∇W(x_i − x_j) and G_i the gradient of the
//! share that boundaries fill, a pressure over density p gives the acceleration
//!
//!   a_i = −Σ_j (p_i + p_j) g_ij − p_i G_i
//!
//! and accelerations change the density ratio at the rate
//! Σ_j g_ij · (a_i − a_j) + G_i · a_i. Jacobi steps relaxed by ½ find p ≥ 0 for which no particle is (or becomes) denser
//! than at rest. Pressures of the last step are the first guess. Pairs get opposite impulses along their line, so linear
//! and angular momentum are kept whatever the iteration has reached.

use super::fluid::{Fluid, Stepped};
use super::neighbours::Neighbours;
use glam::Vec4;
use rayon::prelude::*;

/// Relaxation of the Jacobi steps.
const RELAXATION: f32 = 0.5;
/// Iterations taken at least and at most.
const FEWEST: u32 = 2;
const MOST: u32 = 200;
/// Largest share of compression that one step removes: particles put inside each other move apart instead of
/// exploding.
const GENTLE: f32 = 0.1;
/// Density ratio below which a particle is spray: it is not kept free of divergence, since with half of its neighbours
/// missing that would hold drops together (Bender & Koschier 2017, section 3.2).
const SPRAY: f32 = 0.75;
/// Source of a particle that takes no part.
const IDLE: f32 = -1e9;
/// Smallest diagonal of the system, times the spacing squared.
const LEAST_DIAGONAL: f32 = 0.02;

/// Neighbours with gradients, densities and the diagonal, for the present positions.
pub(super) fn prepare(fluid: &mut Fluid) {
    let d = fluid.settings.spacing;
    let volume = d * d * d;
    let kernel = fluid.kernel;
    let soft = 0.01 * kernel.support() * kernel.support();
    let positions = &fluid.particles.position;
    // Fourth value: the weight of the viscous force (see `viscosity`).
    fluid
        .neighbours
        .find(&fluid.cells, positions, kernel.support(), |x, r2| {
            let factor = volume * kernel.gradient_factor(r2.sqrt().max(1e-3 * d));
            (factor * x).extend(10.0 / (-factor).max(1e-20) / (r2 + soft))
        });
    let (work, own) = (&mut fluid.work, volume * kernel.at(0.0));
    let touch = &work.touch;
    fluid.neighbours.map(&mut work.pair, |near| {
        let p = positions[near.i];
        let (mut density, mut sum, mut square) = (own, Vec4::ZERO, 0.0);
        for (j, pair) in near.pairs() {
            let g = pair.truncate().extend(0.0);
            density += volume * kernel.at((p - positions[j]).length());
            sum += g;
            square += g.length_squared();
        }
        let touch = &touch[near.i];
        let sum = sum.truncate();
        let diagonal = (sum + touch.gradient).length_squared() + square;
        [
            density + touch.share,
            1.0 / diagonal.max(LEAST_DIAGONAL / (d * d)),
        ]
    });
    for ((density, inverse), pair) in work.density.iter_mut().zip(&mut work.inverse).zip(&work.pair) {
        [*density, *inverse] = *pair;
    }
}

/// Rate at which the density ratio of each particle grows with `velocity`, 1/s, passed through `source`.
fn compression_rates(fluid: &mut Fluid, source: impl Fn(usize, f32) -> f32 + Sync) {
    let (velocity, touch) = (&fluid.particles.velocity, &fluid.work.touch);
    fluid.neighbours.map(&mut fluid.work.source, |near| {
        let v = velocity[near.i];
        let mut sum = Vec4::ZERO;
        for (j, g) in near.pairs() {
            sum += g * (v - velocity[j]);
        }
        let touch = &touch[near.i];
        let rate = sum.x + sum.y + sum.z + touch.gradient.dot(v.truncate()) - touch.moving;
        source(near.i, rate)
    });
}

/// Accelerations of `pressure`.
fn accelerations(
    neighbours: &Neighbours,
    pressure: &[f32],
    touch: &[super::boundary::Touch],
    out: &mut [Vec4],
) {
    neighbours.map(out, |near| {
        let p = pressure[near.i];
        let mut sum = Vec4::ZERO;
        for (j, g) in near.pairs() {
            sum -= (p + pressure[j]) * g;
        }
        (sum.truncate() - p * touch[near.i].gradient).extend(0.0)
    });
}

/// Solves for the pressures that keep `work.source` + `gain` · (rate of density change of their accelerations) ≤ 0, and
/// leaves their accelerations. Returns the iterations taken and the mean of what is left above 0.
fn solve(fluid: &mut Fluid, which: Which, gain: f32, tolerance: f64) -> (u32, f64) {
    let n = fluid.len() as f64;
    let work = &mut fluid.work;
    let pressure = match which {
        Which::Density => &mut fluid.particles.pressure,
        Which::Divergence => &mut fluid.particles.impulse,
    };
    let mut iterations = 0;
    loop {
        accelerations(&fluid.neighbours, pressure, &work.touch, &mut work.acceleration);
        let (a, touch, source, inverse) = (&work.acceleration, &work.touch, &work.source, &work.inverse);
        let before: &[f32] = pressure;
        let left = fluid
            .neighbours
            .map_sum(&mut work.pressure, &mut work.partial, |near| {
                let own = a[near.i];
                let mut sum = Vec4::ZERO;
                for (j, g) in near.pairs() {
                    sum += g * (own - a[j]);
                }
                let rate = sum.x + sum.y + sum.z + touch[near.i].gradient.dot(own.truncate());
                let residual = source[near.i] + gain * rate;
                let change = RELAXATION * residual * inverse[near.i] / gain;
                let p = before[near.i];
                ((p + change).max(0.0), f64::from(residual.max(0.0)))
            });
        iterations += 1;
        let mean = left / n;
        if (mean <= tolerance && iterations >= FEWEST) || iterations == MOST {
            return (iterations, mean);
        }
        std::mem::swap(pressure, &mut work.pressure);
    }
}

enum Which {
    Density,
    Divergence,
}

fn accelerate(fluid: &mut Fluid, dt: f32) {
    let v = &mut fluid.particles.velocity;
    let a = &fluid.work.acceleration;
    v.par_iter_mut()
        .with_min_len(super::fluid::TASK)
        .zip(a)
        .for_each(|(v, a)| *v += dt * *a);
}

/// Makes the velocities free of compression.
pub(super) fn remove_divergence(fluid: &mut Fluid, dt: f32) -> Stepped {
    let density = std::mem::take(&mut fluid.work.density);
    compression_rates(fluid, |i, rate| if density[i] < SPRAY { IDLE } else { rate });
    fluid.work.density = density;
    let tolerance = fluid.settings.divergence_tolerance / f64::from(dt);
    let (iterations, divergence) = solve(fluid, Which::Divergence, dt, tolerance);
    accelerate(fluid, dt);
    Stepped {
        iterations: [0, iterations],
        divergence,
        stalled: iterations == MOST,
        ..Stepped::default()
    }
}

/// Makes the densities after the step no larger than at rest.
pub(super) fn keep_density(fluid: &mut Fluid, dt: f32, stepped: &mut Stepped) {
    let density = std::mem::take(&mut fluid.work.density);
    compression_rates(fluid, |i, rate| (density[i] - 1.0).min(GENTLE) + dt * rate);
    fluid.work.density = density;
    let tolerance = fluid.settings.density_tolerance;
    let (iterations, compression) = solve(fluid, Which::Density, dt * dt, tolerance);
    accelerate(fluid, dt);
    stepped.iterations[0] = iterations;
    stepped.compression = compression;
    stepped.stalled |= iterations == MOST;
}
