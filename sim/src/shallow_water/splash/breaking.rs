//! Where waves break, and what they throw up.

use super::Splash;
use super::column_energy;
use super::foam::Foam;
use crate::rng::Rng;
use crate::shallow_water::exchange::Exchange;
use crate::solvers::GRAVITY;
use rayon::prelude::*;

/// Share of the depth by which a front must rise over two cells to count as breaking on a grid that is too coarse for
/// its slope: bores are undular below a depth ratio of 1.42 and break above (Favre 1935, Treske 1994).
const FAVRE: f64 = 0.42;
/// ∂η/∂t of a breaking front in units of its critical slope times √(g h): steep water that does not run is no wave.
const RISING: f64 = 0.5;
/// Share of what a front dissipates that droplets may carry off.
const EFFICIENCY: f64 = 0.5;
/// Most droplets that one cell throws in a sub-step.
const MOST_A_CELL: f64 = 8.0;
/// Least part of its water that a cell keeps in a sub-step.
const KEPT: f64 = 0.8;
/// Area of foam that a breaking front leaves for each part of the depth by which it rises: one that doubles the depth
/// leaves patches of about 1.7 times the area that it runs over, which overlap at random and so leave a fifth of it free.
const WHITENESS: f64 = 2.5;
/// Radius of a patch of foam, least and range, in heights of the front: the eddies of a roller are as
/// large as it is high.
const PATCH: [f64; 2] = [0.25, 1.25];
/// Most patches that one cell makes in a sub-step.
const MOST_PATCHES: f64 = 8.0;
/// Elevation of a plunging jet's rebound, least and range, radians (15° to 65°).
const ELEVATION: [f64; 2] = [0.26, 0.87];
/// Half the range of directions about that of the front, radians (25°).
const SPREAD: f64 = 0.44;

/// A cell in which a wave breaks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Break {
    pub(super) at: [usize; 2],
    /// Direction in which the front runs.
    normal: [f64; 2],
    /// Speed of the front, m/s.
    speed: f64,
    /// Depth that leaves in this step, m.
    height: f64,
    /// Part of the depth by which the front rises in this step.
    risen: f64,
    /// Height of the front, m: that over two cells, but at least that of the weakest bore that breaks.
    front: f64,
    /// Energy per area and density that may leave with it, m³/s².
    energy: f64,
}

/// What a look at the whole grid found.
pub(super) struct Seen {
    pub(super) breaks: Vec<Break>,
    /// Fastest water, m/s.
    pub(super) fastest: f64,
}

/// Looks for breaking fronts. The outermost cells, whose slope is not known, never break.
///
/// A cell breaks where the surface is steeper than a front at the onset of breaking (20°: Schäffer, Madsen & Deigaard
/// 1993) or, on a grid too coarse for that, rises by [`FAVRE`] of the depth over two cells; where it rises as a running
/// front does; and where ∇²η < 0, which is the upper half of the front.
pub(super) fn look<E: Exchange + Sync + ?Sized>(splash: &Splash, water: &E, film: f64, dt: f64) -> Seen {
    let [nx, nz] = splash.size;
    let rows: Vec<(Vec<Break>, f64)> = (0..nz)
        .into_par_iter()
        .map(|j| {
            let (mut breaks, mut fastest) = (Vec::new(), 0.0_f64);
            for i in 0..nx {
                let h = water.depth(i, j);
                if h <= film {
                    continue;
                }
                let q = water.discharge(i, j);
                fastest = fastest.max((q[0] * q[0] + q[1] * q[1]) / (h * h));
                let inner = i > 0 && j > 0 && i + 1 < nx && j + 1 < nz;
                if inner && let Some(found) = breaking(splash, water, [i, j], dt) {
                    breaks.push(found);
                }
            }
            (breaks, fastest)
        })
        .collect();
    let mut seen = Seen {
        breaks: Vec::new(),
        fastest: 0.0,
    };
    for (breaks, fastest) in rows {
        seen.breaks.extend(breaks);
        seen.fastest = seen.fastest.max(fastest);
    }
    seen.fastest = seen.fastest.sqrt();
    seen
}

fn breaking<E: Exchange + ?Sized>(splash: &Splash, water: &E, [i, j]: [usize; 2], dt: f64) -> Option<Break> {
    let two = 2.0 * splash.spacing;
    let h = water.depth(i, j);
    let critical = splash.settings.slope.min(FAVRE * h / two);
    let (east, west) = (water.discharge(i + 1, j), water.discharge(i - 1, j));
    let (south, north) = (water.discharge(i, j + 1), water.discharge(i, j - 1));
    // ∂η/∂t = −∇·q
    let rise = ((west[0] - east[0]) + (north[1] - south[1])) / two;
    let celerity = (GRAVITY * h).sqrt();
    if !(rise > RISING * critical * celerity) {
        return None;
    }
    let own = water.bed(i, j) + h;
    // A bank that stands out of the water has no surface.
    let surface = |i: usize, j: usize| {
        let (h, z) = (water.depth(i, j), water.bed(i, j));
        if h > 0.0 { h + z } else { z.min(own) }
    };
    let (e, w, s, n) = (
        surface(i + 1, j),
        surface(i - 1, j),
        surface(i, j + 1),
        surface(i, j - 1),
    );
    let gradient = [(e - w) / two, (s - n) / two];
    let steepness = gradient[0].hypot(gradient[1]);
    if !(steepness > critical) || (e + w) + (s + n) - 4.0 * own >= 0.0 {
        return None;
    }
    let normal = gradient.map(|g| -g / steepness);
    let q = water.discharge(i, j);
    let along = (q[0] * normal[0] + q[1] * normal[1]) / h;
    // The surface η(x·n − S t) has S = η_t / |∇η|.
    let speed = (rise / steepness).min(along.abs() + 2.0 * celerity);
    // A front of height J dissipates ρ g J³ S / 4h a metre of crest (Lamb 1932, §187); here it is two cells wide.
    let dissipation = GRAVITY * two * two * steepness.powi(3) * speed / (4.0 * h);
    Some(Break {
        at: [i, j],
        normal,
        speed,
        height: splash.settings.amount * rise * dt,
        risen: rise * dt / h,
        front: (two * steepness).max(FAVRE * h),
        energy: EFFICIENCY * dissipation * dt,
    })
}

/// Leaves foam where a front breaks: patches at random places of the cell, whose area is on average
/// [`WHITENESS`] × the part of the depth that rises. A roller's foam is patchy from the start; even foam would be one
/// white field with the outline of the water that the front has run over.
fn whiten(foam: &mut Foam, found: &Break, spacing: f64, rng: &mut Rng) {
    let radius = |share: f64| (PATCH[0] + PATCH[1] * share) * found.front;
    // The mean of the squares of radii that are spread evenly.
    let [least, most] = [radius(0.0), radius(1.0)];
    let mean = std::f64::consts::PI * (least * least + least * most + most * most) / 3.0;
    let wanted = (WHITENESS * found.risen * spacing * spacing / mean.max(1e-30)).min(MOST_PATCHES);
    for _ in 0..(wanted + rng.uniform()).floor() as u32 {
        let [x, z, share] = std::array::from_fn(|_| rng.uniform());
        let at = [found.at[0] as f64 + x - 0.5, found.at[1] as f64 + z - 0.5];
        foam.splat(at, radius(share));
    }
}

/// Throws droplets from the cells that break.
pub(super) fn throw<E: Exchange + ?Sized>(splash: &mut Splash, water: &mut E, breaks: &[Break], level: f64) {
    let spacing = splash.spacing;
    let area = spacing * spacing;
    for found in breaks {
        let [i, j] = found.at;
        let cell = (j * splash.size[0] + i) as u64;
        let key = (splash.steps << 28) ^ cell;
        if let Some(foam) = &mut splash.foam {
            let mut rng = Rng::new(splash.settings.seed ^ 0x464f_414d, key);
            whiten(foam, found, spacing, &mut rng);
        }
        let unit = splash.droplet_height(water.depth(i, j));
        let mut rng = Rng::new(splash.settings.seed ^ 0x5350_4c41, key);
        // A jet of the front's speed carries about ¾ of its square per volume beyond what it had.
        let paid = found.energy / (0.75 * unit * found.speed * found.speed).max(1e-30);
        let wanted = (found.height / unit).min(paid).min(MOST_A_CELL);
        let count = (wanted + rng.uniform()).floor() as u32;
        let mut budget = found.energy.max(0.0);
        let least = KEPT * water.depth(i, j);
        for _ in 0..count {
            let draw: [f64; 6] = std::array::from_fn(|_| rng.uniform());
            if splash.flock.len() >= splash.settings.max_droplets {
                splash.books.suppressed += 1;
                continue;
            }
            let height = unit * (0.5 + draw[0]);
            let (h0, z) = (water.depth(i, j), water.bed(i, j));
            if h0 - height < least {
                break;
            }
            let q0 = water.discharge(i, j);
            let jet = found.speed * (0.6 + 0.6 * draw[1]);
            let (sin, cos) = (ELEVATION[0] + ELEVATION[1] * draw[2]).sin_cos();
            let (turn_sin, turn_cos) = (SPREAD * (2.0 * draw[3] - 1.0)).sin_cos();
            let [nx, nz] = found.normal;
            let ahead = [nx * turn_cos - nz * turn_sin, nx * turn_sin + nz * turn_cos];
            // Along the crest the droplet goes with the water, ahead with the jet.
            let slip = (q0[1] * nx - q0[0] * nz) / h0;
            let aim = [jet * cos * ahead[0] - slip * nz, jet * cos * ahead[1] + slip * nx];
            let upwards = jet * sin;

            let (taken_momentum, taken) = water.take(i, j, height);
            if taken <= 0.0 {
                continue;
            }
            // What pushes the droplet ahead pushes the wave back.
            let kick: [f64; 2] = std::array::from_fn(|a| aim[a] * taken - taken_momentum[a]);
            let reaction = water.add_discharge(i, j, kick.map(|p| -p));
            let momentum: [f64; 2] = std::array::from_fn(|a| taken_momentum[a] - reaction[a]);
            let (h1, q1) = (water.depth(i, j), water.discharge(i, j));
            // Half way between the surfaces before and after: lifting it out costs nothing.
            let y = z + 0.5 * (h0 + h1);
            let velocity = [momentum[0] / taken, upwards, momentum[1] / taken];
            let flying = taken * (0.5 * velocity.iter().map(|v| v * v).sum::<f64>() + GRAVITY * (y - level));
            let gained = flying + column_energy(h1, q1, z, level) - column_energy(h0, q0, z, level);
            let radius = (0.75 * taken * area / std::f64::consts::PI).cbrt();
            let position = [
                splash.origin[0] + spacing * (i as f64 + draw[4] - 0.5),
                y,
                splash.origin[1] + spacing * (j as f64 + draw[5] - 0.5),
            ];
            splash.flock.push(position, velocity, taken, radius);
            splash.books.emitted += 1;
            splash.books.breaking_energy += gained;
            budget -= gained;
            if budget <= 0.0 {
                break;
            }
        }
    }
}
