//! The model of Müller, Charypar & Gross 2003: state equation, explicit forces.
//!
//! Pressure p = k (ρ − ρ0) (eq. 12, with k the square of the speed of sound), forces −Σ m (p_i + p_j)/(2ρ_j) ∇W_spiky
//! (eq. 10), μ Σ m (v_j − v_i)/ρ_j ∇²W_viscosity (eq. 14) and σ κ n of the colour field (eq. 19). Boundaries are those of
//! `dfsph`. Pressures are kept from falling below 0, where they would clump the surface. Its viscosity is not central, so
//! angular momentum drifts; its compression under a column of height H is about g H / k.

use super::fluid::{Fluid, Stepped, TASK};
use glam::Vec4;
use rayon::prelude::*;

/// Length of the colour field's gradient below which a particle is inside, times the spacing (eq. 18, threshold).
const INSIDE: f32 = 0.5;
/// Farthest in particle spacings that the forces of one step may move a particle: what was put inside other water
/// leaves it instead of being thrown.
const FARTHEST: f32 = 0.1;

/// Neighbours with their vector and distance; densities.
pub(super) fn prepare(fluid: &mut Fluid) {
    let kernel = fluid.muller;
    let d = fluid.settings.spacing;
    let volume = d * d * d;
    fluid.find_neighbours(|x, r2| x.extend(r2.sqrt()));
    let rest = fluid.settings.lattice_density();
    let (touch, own) = (&fluid.work.touch, volume * kernel.poly6(0.0));
    fluid.neighbours.map(&mut fluid.work.density, |near| {
        let sum: f32 = near.pair.iter().map(|p| kernel.poly6(p.w * p.w)).sum();
        // The lattice sum of poly6 is not 1 at this support, so densities are relative to it.
        (own + volume * sum) / rest + touch[near.i].share
    });
    let n = fluid.work.density.len();
    fluid.mirrors.extend_scalars(&mut fluid.work.density, n);
}

/// Takes the velocities through `dt`.
pub(super) fn accelerate(fluid: &mut Fluid, dt: f32) -> Stepped {
    let s = &fluid.settings;
    let kernel = fluid.muller;
    let d = s.spacing;
    let volume = d * d * d;
    let (stiffness, rest) = (s.stiffness, s.lattice_density());
    let n = fluid.particles.position.len();
    let work = &mut fluid.work;
    fluid
        .particles
        .pressure
        .par_iter_mut()
        .with_min_len(TASK)
        .zip(&work.density)
        .for_each(|(p, density)| *p = stiffness * (density - 1.0).max(0.0));
    work.buffers.pressure.clear();
    work.buffers.pressure.extend_from_slice(&fluid.particles.pressure);
    fluid.mirrors.extend_scalars(&mut work.buffers.pressure, n);
    let (density, pressure) = (&work.density, &work.buffers.pressure);
    let (velocity, touch) = (&work.flow, &work.touch);
    let viscosity = s.viscosity * volume / rest;
    let tension = s.surface_tension / s.density;
    let gravity = s.gravity;
    fluid.neighbours.map(&mut work.change, |near| {
        let i = near.i;
        let (p, v) = (pressure[i], velocity[i]);
        let (mut push, mut drag) = (Vec4::ZERO, Vec4::ZERO);
        let (mut colour, mut curvature) = (Vec4::ZERO, 0.0);
        for (j, pair) in near.pairs() {
            let x = pair.truncate().extend(0.0);
            let r = pair.w;
            let share = volume / (rest * density[j]);
            let pull = 0.5 * share * (p + pressure[j]) * kernel.spiky_slope(r) / r.max(1e-6 * d);
            push -= pull * x;
            drag += (viscosity / density[j] * kernel.viscosity_laplacian(r)) * (velocity[j] - v);
            if tension > 0.0 {
                colour += (share * kernel.poly6_gradient_factor(r * r)) * x;
                curvature += share * kernel.poly6_laplacian(r * r);
            }
        }
        // A wall mirrors the pressure of the particle before it.
        let touch = &touch[i];
        let mut a = (push + drag).truncate() / density[i] - 0.5 * p / density[i] * touch.gradient;
        if tension > 0.0 && touch.share == 0.0 && colour.length() * d > INSIDE {
            a -= tension / density[i] * curvature * colour.truncate().normalize_or_zero();
        }
        (a + gravity - s.viscosity * touch.drag * v.truncate() + s.viscosity * touch.dragged).extend(0.0)
    });
    let limit = FARTHEST * d / dt;
    work.flow[..n]
        .par_iter_mut()
        .with_min_len(TASK)
        .zip(&mut work.change)
        .for_each(|(v, change)| {
            *v += (dt * change.truncate()).clamp_length_max(limit).extend(0.0);
            *change = Vec4::ZERO;
        });
    let over = |i: usize| f64::from((work.density[i] - 1.0).max(0.0));
    let over = crate::reduce::sum(n, over);
    Stepped {
        compression: over / n as f64,
        ..Stepped::default()
    }
}
