//! Droplets meet edges, water and ground.

use super::flight::{drag, fly};
use super::{Splash, Wall, column_energy};
use crate::shallow_water::exchange::Exchange;
use crate::solvers::GRAVITY;
use rayon::prelude::*;

/// Radii of a droplet that the foam which it makes is wide.
const FOAM_SPREAD: f64 = 3.0;

/// Moves every droplet by `dt` s through the air.
pub(super) fn fly_all(splash: &mut Splash, dt: f64) {
    let flock = &mut splash.flock;
    let loss: Vec<[f64; 3]> = flock
        .position
        .par_iter_mut()
        .zip(&mut flock.velocity)
        .zip(flock.height.par_iter().zip(&flock.radius))
        .map(|((position, velocity), (&height, &radius))| {
            let energy =
                |x: &[f64; 3], v: &[f64; 3]| 0.5 * (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]) + GRAVITY * x[1];
            let (before, held) = (*velocity, energy(position, velocity));
            fly(position, velocity, drag(radius), dt);
            [
                height * (before[0] - velocity[0]),
                height * (before[2] - velocity[2]),
                height * (held - energy(position, velocity)),
            ]
        })
        .collect();
    for [x, z, energy] in loss {
        splash.books.air_momentum[0] += x;
        splash.books.air_momentum[1] += z;
        splash.books.air_energy += energy;
    }
}

/// Lands what has reached the surface or the ground, bounces what has reached a wall, and lets go what has flown out.
pub(super) fn settle<E: Exchange + ?Sized>(splash: &mut Splash, water: &mut E, level: f64) {
    let mut gone = vec![false; splash.flock.len()];
    for (k, gone) in gone.iter_mut().enumerate() {
        *gone = meet_edges(splash, k, level) || land(splash, water, k, level);
    }
    if gone.contains(&true) {
        splash.flock.retain(&gone);
    }
}

/// Whether droplet `k` has flown out; walls stand half a spacing beyond the outermost samples.
fn meet_edges(splash: &mut Splash, k: usize, level: f64) -> bool {
    let spacing = splash.spacing;
    for axis in 0..2 {
        let component = 2 * axis;
        let low = splash.origin[axis] - 0.5 * spacing;
        let length = spacing * splash.size[axis] as f64;
        let at = splash.flock.position[k][component] - low;
        if (0.0..length).contains(&at) {
            continue;
        }
        let height = splash.flock.height[k];
        let side = usize::from(at >= length);
        let back = match splash.walls[axis][side] {
            Wall::Repeats => at.rem_euclid(length),
            Wall::Bounces => {
                let speed = &mut splash.flock.velocity[k][component];
                let outwards = if side == 1 { *speed > 0.0 } else { *speed < 0.0 };
                if outwards {
                    splash.books.wall_momentum[axis] += 2.0 * height * *speed;
                    *speed = -*speed;
                }
                // Mirrored at the wall; who was thrown beyond the opposite one stays at this one.
                if side == 1 { 2.0 * length - at } else { -at }
            }
            Wall::Leaves => {
                let (x, v) = (splash.flock.position[k], splash.flock.velocity[k]);
                let books = &mut splash.books;
                books.lost += 1;
                books.lost_volume += height;
                books.lost_momentum[0] += height * v[0];
                books.lost_momentum[1] += height * v[2];
                books.lost_energy +=
                    height * (0.5 * v.iter().map(|v| v * v).sum::<f64>() + GRAVITY * (x[1] - level));
                return true;
            }
        };
        let last = length * (1.0 - 1e-12);
        splash.flock.position[k][component] = low + back.clamp(0.0, last);
    }
    false
}

/// Whether droplet `k` has come down; its volume, momentum and foam then belong to the cell there.
fn land<E: Exchange + ?Sized>(splash: &mut Splash, water: &mut E, k: usize, level: f64) -> bool {
    let position = splash.flock.position[k];
    let cell = |axis: usize| (position[2 * axis] - splash.origin[axis]) / splash.spacing;
    let place = [cell(0), cell(1)];
    let [i, j]: [usize; 2] =
        std::array::from_fn(|a| place[a].round().clamp(0.0, (splash.size[a] - 1) as f64) as usize);
    let (h0, z) = (water.depth(i, j), water.bed(i, j));
    if position[1] > h0 + z {
        return false;
    }
    let (height, velocity) = (splash.flock.height[k], splash.flock.velocity[k]);
    let q0 = water.discharge(i, j);
    // What earlier landings left over of a quantum comes along.
    let due = height + splash.carry;
    let added = water.add_depth(i, j, due);
    splash.carry = due - added;
    let momentum = [height * velocity[0], height * velocity[2]];
    let books = &mut splash.books;
    if h0 + added > water.dry() {
        let given = water.add_discharge(i, j, momentum);
        for a in 0..2 {
            books.rounded_momentum[a] += momentum[a] - given[a];
        }
    } else {
        // Too little water to move: the ground stops it.
        for a in 0..2 {
            books.wall_momentum[a] += momentum[a];
        }
    }
    let flying =
        height * (0.5 * velocity.iter().map(|v| v * v).sum::<f64>() + GRAVITY * (position[1] - level));
    let (h1, q1) = (water.depth(i, j), water.discharge(i, j));
    books.impact_energy += flying + column_energy(h0, q0, z, level) - column_energy(h1, q1, z, level);
    books.landed += 1;
    if let Some(foam) = &mut splash.foam {
        foam.splat(place, FOAM_SPREAD * splash.flock.radius[k]);
    }
    true
}
