//! Viscosity from water to honey: a central force between particles, explicit where that is stable (`noise` takes it along)
//! and else implicit.
//!
//! a_i = 10 ν Σ_j V (v_ij · x_ij) ∇W / (r² + h²/100) (Monaghan 2005; implicit after Weiler et al. 2018). Forces along the
//! line of a pair keep linear and angular momentum, and a rigid turn feels none. With the cached gradient g = −F x the sum
//! is −ν Σ_j w g (v_ij · g), w = 10 / (F (r² + h²/100)). Where water sticks, walls and obstacles pull with their own
//! velocity.

use super::fluid::{Fluid, TASK};
use super::kernel::CubicSpline;
use super::settings::Settings;
use crate::reduce;
use glam::Vec4;
use rayon::prelude::*;

/// Largest ν dt / spacing² of an explicit step. The largest eigenvalue of the operator is about 20 / spacing².
const EXPLICIT: f32 = 0.03;
/// Residual of the implicit solution, relative to the change of velocity that the first residual asks for.
const TOLERANCE: f64 = 1e-4;
/// Iterations at most.
const MOST: u32 = 400;

/// Whether a step of `dt` seconds may be explicit: what sticks is pulled too hard for it.
pub(super) fn explicit(settings: &Settings, dt: f32) -> bool {
    settings.viscosity * dt <= EXPLICIT * settings.spacing.powi(2) && !settings.sticks
}

/// Changes the velocities by the viscous force over `dt`, unless [`explicit`] is. Returns the iterations of the solution.
pub(super) fn apply(fluid: &mut Fluid, dt: f32) -> u32 {
    let scale = fluid.settings.viscosity * dt;
    if !(scale > 0.0) || explicit(&fluid.settings, dt) {
        return 0;
    }
    let n = fluid.len();
    for list in [&mut fluid.work.residual, &mut fluid.work.product] {
        list.resize(n, Vec4::ZERO);
    }
    // r = b − (1 + ν dt K) v with b = v + ν dt (pull of the walls): minus the viscous change itself.
    let mut residual = std::mem::take(&mut fluid.work.residual);
    operator(fluid, &fluid.work.flow, &mut residual);
    let touch = &fluid.work.touch;
    residual
        .par_iter_mut()
        .with_min_len(TASK)
        .zip(touch)
        .for_each(|(r, touch)| {
            *r = scale * (touch.dragged.extend(0.0) - *r);
        });
    fluid.work.residual = residual;
    conjugate_gradients(fluid, scale)
}

fn dot(a: &[Vec4], b: &[Vec4]) -> f64 {
    reduce::sum(a.len(), |k| f64::from(a[k].dot(b[k])))
}

/// Solves (1 + scale K) Δv = residual and adds Δv.
fn conjugate_gradients(fluid: &mut Fluid, scale: f32) -> u32 {
    let mut residual = std::mem::take(&mut fluid.work.residual);
    let mut direction = std::mem::take(&mut fluid.work.direction);
    let mut product = std::mem::take(&mut fluid.work.product);
    direction.clear();
    direction.extend_from_slice(&residual);
    let n = residual.len();
    let first = dot(&residual, &residual);
    let mut square = first;
    let mut iterations = 0;
    while iterations < MOST && square > TOLERANCE * TOLERANCE * first {
        fluid.mirrors.extend_vectors(&mut direction, n);
        operator(fluid, &direction, &mut product);
        product
            .par_iter_mut()
            .with_min_len(TASK)
            .zip(&direction)
            .for_each(|(q, p)| *q = *p + scale * *q);
        let curvature = dot(&direction[..n], &product);
        if !(curvature > 0.0) {
            break;
        }
        let along = (square / curvature) as f32;
        let v = &mut fluid.work.flow[..n];
        v.par_iter_mut()
            .zip(&mut residual)
            .zip(direction.par_iter().zip(&product))
            .with_min_len(TASK)
            .for_each(|((v, r), (p, q))| {
                *v += along * *p;
                *r -= along * *q;
            });
        let next = dot(&residual, &residual);
        let keep = (next / square) as f32;
        direction[..n]
            .par_iter_mut()
            .with_min_len(TASK)
            .zip(&residual)
            .for_each(|(p, r)| *p = *r + keep * *p);
        square = next;
        iterations += 1;
    }
    fluid.work.residual = residual;
    fluid.work.direction = direction;
    fluid.work.product = product;
    iterations
}

/// h²/100.
pub(super) fn soft(kernel: &CubicSpline) -> f32 {
    0.01 * kernel.support().powi(2)
}

/// The weight w of a pair at a distance of which `square` is the square.
#[inline(always)]
pub(super) fn weight(pair: Vec4, square: f32, soft: f32) -> f32 {
    10.0 / (pair.w.max(1e-20) * (square + soft))
}

/// K v: viscous deceleration per viscosity, 1/m² times m/s.
fn operator(fluid: &Fluid, velocity: &[Vec4], out: &mut [Vec4]) {
    let (touch, place, soft) = (&fluid.work.touch, &fluid.work.place, soft(&fluid.kernel));
    fluid.neighbours.map(out, |near| {
        let (p, v) = (place[near.i], velocity[near.i]);
        let mut sum = Vec4::ZERO;
        for (j, pair) in near.pairs() {
            // The fourth component of velocities is 0, so that of the pair takes no part.
            let weight = weight(pair, (p - place[j]).length_squared(), soft);
            sum += pair * (weight * pair.dot(v - velocity[j]));
        }
        (sum.truncate() + touch[near.i].drag * v.truncate()).extend(0.0)
    });
}
