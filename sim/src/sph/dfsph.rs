//! Incompressible water: velocities that compress nothing, and displacements that undo what finite steps have compressed.
//!
//! After Bender & Koschier 2015 and Cornelis et al. 2019, with corrected gradients (`correction`) and both systems solved
//! to a tolerance (`pressure`). With ρ the density ratio, D the corrected rate of compression and D₀ that of the
//! kernel sum, a step finds
//!
//!   p ≥ 0:  min(ρ̃ − 1, 0) + Δt D v ≤ 0     for velocities: no compression, but what is too thin may close;
//!   q ≥ 0:  min((ρ − 1)⁺ / 2, 2 %) + (ρ − 1)⁻ + Δt D₀ v ≤ 0     for displacements alone.
//!
//! Displacements do no work on velocities, so that what rounding, finite steps and disorder compress does not heat the water.
//! ρ̃ counts a surface as though the water went on beyond it: otherwise its particles would be thought too thin and
//! bear no pressure.

use super::correction::{self, Local};
use super::fluid::{Fluid, Stepped, TASK};
use super::kernel::CubicSpline;
use super::neighbours::Shape;
use super::pressure::{Solution, System, inverse_diagonal};
use rayon::prelude::*;

/// Share of the compression that a step removes, and the most that it does: particles put inside each other move apart
/// instead of being thrown.
const SHARE: f32 = 0.5;
const GENTLE: f32 = 0.02;
/// Smallest diagonal of the systems, times the spacing squared.
const LEAST_DIAGONAL: f32 = 0.02;
/// How exactly velocities are solved for, which decides how still water stands, and how displacements are.
const VELOCITIES: Solution = Solution {
    firm: 0.02,
    guess: 0.3,
    enough: [0.15, 0.8],
    share: 0.25,
};
const SHIFTS: Solution = Solution {
    firm: 0.005,
    guess: 0.3,
    enough: [0.9; 2],
    share: 1.0,
};
/// Farthest displacement in particle spacings.
const FARTHEST: f32 = 0.25;

/// Neighbours with gradients, and what they say of each particle.
pub(super) fn prepare(fluid: &mut Fluid) {
    let d = fluid.settings.spacing;
    let volume = d * d * d;
    let kernel = fluid.kernel;
    let shape = Pair {
        kernel,
        volume,
        least: (1e-3 * d).powi(2),
    };
    let (n, work) = (fluid.particles.position.len(), &mut fluid.work);
    let (touch, own) = (&work.touch, volume * kernel.at(0.0));
    let reach = fluid.kernel.depth_of_gradient(d);
    let cells = [&fluid.cells, &fluid.mirrors.cells];
    let (place, local) = (&work.place, &mut work.local[..n]);
    fluid
        .neighbours
        .find(cells, place, kernel.support(), shape, local, |i, sums| {
            let touch = &touch[i];
            let sum = sums.gradient.truncate() + touch.gradient;
            let density = own + sums.density + touch.share;
            Local {
                rows: correction::rows(sums.moment, touch),
                sum,
                density,
                filled: density + reach * sum.length(),
                inverse: [0.0; 2],
            }
        });
    let (mirrors, local) = (&fluid.mirrors, &work.local);
    let least = LEAST_DIAGONAL / (d * d);
    fluid.neighbours.pair_with(
        |i, j, g| {
            let own = local[i].correct(g);
            let other = if j < n {
                local[j].correct(g)
            } else {
                let (source, sign) = mirrors.behind(j, n);
                let sign = sign.extend(0.0);
                sign * local[source].correct(sign * g)
            };
            [own.with_w(g.w), other]
        },
        &mut work.inverse,
        |i, sums| inverse_diagonal(sums, &local[i], [SHIFTS.firm, VELOCITIES.firm], least),
    );
    for ((local, inverse), density) in work.local.iter_mut().zip(&work.inverse).zip(&mut work.density) {
        local.inverse = *inverse;
        *density = local.density;
    }
}

/// What the solvers need of a pair. The value beside g = −F x is F, 1/m².
#[derive(Clone, Copy)]
struct Pair {
    kernel: CubicSpline,
    volume: f32,
    /// Squared distance below which the kernel is flat.
    least: f32,
}

impl Shape for Pair {
    #[inline(always)]
    fn of(&self, square: f32) -> [f32; 3] {
        let r = square.max(self.least).sqrt();
        let factor = self.volume * self.kernel.gradient_factor(r);
        [factor, -factor, self.volume * self.kernel.at(r)]
    }
}

/// Makes the velocities in `work.flow` free of compression.
pub(super) fn remove_divergence(fluid: &mut Fluid, dt: f32, stepped: &mut Stepped) {
    let n = fluid.len();
    let mass = fluid.particle_mass();
    let work = &mut fluid.work;
    fluid.floating.carried(true, n, &mut work.carried);
    let system = System {
        neighbours: &fluid.neighbours,
        mirrors: &fluid.mirrors,
        local: &work.local,
        touch: &work.touch,
        corrected: true,
        gain: dt * dt,
        floating: (!fluid.floating.floats.is_empty()).then_some((&fluid.floating, mass)),
        solution: VELOCITIES,
    };
    let carried = &work.carried;
    let besides = |i: usize| (work.local[i].filled - 1.0).min(0.0) - dt * (system.moving(i) + carried.at(i));
    let tolerance = fluid.settings.velocity_tolerance(dt);
    let guess = &mut fluid.particles.pressure;
    let (iterations, left) = system.solve(guess, (&work.flow, dt), besides, &mut work.buffers, tolerance);
    work.flow[..n]
        .par_iter_mut()
        .with_min_len(TASK)
        .zip(&work.buffers.acceleration)
        .for_each(|(v, a)| *v += dt * a.with_w(0.0));
    fluid.mirrors.extend_vectors(&mut work.flow, n);
    fluid.floating.push(&work.buffers.carried, dt);
    stepped.iterations[1] = iterations;
    stepped.divergence = left / f64::from(dt);
    stepped.stalled |= left > tolerance;
}

/// Finds in `work.change` the displacements after which no particle will be denser than at rest, but for what is
/// removed gently.
pub(super) fn keep_density(fluid: &mut Fluid, dt: f32, stepped: &mut Stepped) {
    let n = fluid.len();
    let work = &mut fluid.work;
    fluid.floating.carried(false, n, &mut work.carried);
    let system = System {
        neighbours: &fluid.neighbours,
        mirrors: &fluid.mirrors,
        local: &work.local,
        touch: &work.touch,
        corrected: false,
        gain: 1.0,
        floating: None,
        solution: SHIFTS,
    };
    let carried = &work.carried;
    let besides = |i: usize| {
        let over = work.local[i].density - 1.0;
        (SHARE * over.max(0.0)).min(GENTLE) + over.min(0.0) - dt * (system.moving(i) + carried.at(i))
    };
    let tolerance = fluid.settings.density_tolerance;
    let guess = &mut fluid.particles.shift;
    let (iterations, left) = system.solve(guess, (&work.flow, dt), besides, &mut work.buffers, tolerance);
    let most = FARTHEST * fluid.settings.spacing;
    work.change
        .par_iter_mut()
        .with_min_len(TASK)
        .zip(&work.buffers.acceleration)
        .for_each(|(x, a)| *x = a.truncate().clamp_length_max(most).extend(0.0));
    stepped.iterations[0] = iterations;
    let over = |i: usize| f64::from((work.local[i].density - 1.0).max(0.0));
    stepped.compression = crate::reduce::sum(n, over) / n as f64;
    stepped.stalled |= left > tolerance;
}
