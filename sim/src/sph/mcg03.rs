//! The model of Müller, Charypar & Gross 2003: state equation, explicit forces.
//!
//! Pressure p = k (ρ − ρ0) (eq. 12, with k the square of the speed of sound), forces −Σ m (p_i + p_j)/(2ρ_j) ∇W_spiky
//! (eq. 10), μ Σ m (v_j − v_i)/ρ_j ∇²W_viscosity (eq. 14) and σ κ n of the colour field (eq. 19). Boundaries are those of
//! `dfsph`. Pressures are kept from falling below 0, where they would clump the surface. Its viscosity is not central, so
//! angular momentum drifts; its compression under a column of height H is about g H / k.
//!
//! Two sums over neighbours are all that a step needs, so no list is made: what the cells say is near is taken as it lies
//! in memory, [`LANES`] particles side by side, and those out of reach have the weight 0.

use super::boundary::Touch;
use super::cells::Runs;
use super::fluid::{Fluid, Stepped, TASK};
use super::kernel::Muller;
use super::neighbours::apart;
use glam::{Vec3, Vec4};
use rayon::prelude::*;
use std::ops::Range;

/// Length of the colour field's gradient below which a particle is inside, times the spacing (eq. 18, threshold).
const INSIDE: f32 = 0.5;
/// Farthest in particle spacings that the forces of one step may move a particle: what was put inside other water
/// leaves it instead of being thrown.
const FARTHEST: f32 = 0.1;
/// Particles taken side by side. Fixed, so that sums are the same on any machine.
const LANES: usize = 8;
/// Particles of one task.
const BLOCK: usize = 256;
/// Distance over the support below which two particles stand in one place.
const COINCIDENT: f32 = 1e-3;

type Lanes = [f32; LANES];

/// What is read of neighbours, one array a quantity, each longer by [`LANES`] than the particles are many.
#[derive(Debug, Default)]
pub(crate) struct Fields {
    x: Vec<f32>,
    y: Vec<f32>,
    z: Vec<f32>,
    u: Vec<f32>,
    v: Vec<f32>,
    w: Vec<f32>,
    pressure: Vec<f32>,
    /// Volume over that of the lattice and 1/ρ, m³.
    share: Vec<f32>,
    /// Where the neighbours of each particle are, and whether another stands in its place.
    near: Vec<(Runs, bool)>,
}

impl Fields {
    /// Takes over what `vectors` are in `of`.
    fn spread(vectors: &[Vec4], of: [&mut Vec<f32>; 3]) {
        let [x, y, z] = of;
        for list in [&mut *x, &mut *y, &mut *z] {
            list.clear();
            list.reserve(vectors.len() + LANES);
        }
        for p in vectors {
            x.push(p.x);
            y.push(p.y);
            z.push(p.z);
        }
        for list in [x, y, z] {
            list.resize(vectors.len() + LANES, 0.0);
        }
    }

    pub(crate) fn bytes(&self) -> usize {
        let lists = [&self.x, &self.y, &self.z, &self.u, &self.v, &self.w];
        let all = lists.into_iter().chain([&self.pressure, &self.share]);
        4 * all.map(Vec::capacity).sum::<usize>() + size_of::<(Runs, bool)>() * self.near.capacity()
    }
}

/// 1 for as many lanes as count, 0 for the others.
const COUNTS: [Lanes; LANES + 1] = {
    let mut counts = [[0.0; LANES]; LANES + 1];
    let mut count = 1;
    while count <= LANES {
        counts[count] = counts[count - 1];
        counts[count][count - 1] = 1.0;
        count += 1;
    }
    counts
};

#[inline(always)]
fn lanes<const N: usize>(list: &[f32], at: usize) -> &[f32; N] {
    // The lists go on beyond the particles.
    list[at..].first_chunk().unwrap_or(&[0.0; N])
}

/// Calls `f` with the first place of each group of `N` in `runs`, and 1 for each of it that counts.
#[inline(always)]
fn groups<const N: usize>(runs: &Runs, mut f: impl FnMut(usize, &[f32; N])) {
    for Range { start, end } in runs.iter() {
        let mut at = start;
        while at < end {
            let counts = COUNTS[(end - at).min(N)].first_chunk();
            f(at, counts.unwrap_or(&[0.0; N]));
            at += N;
        }
    }
}

/// Densities.
pub(super) fn prepare(fluid: &mut Fluid) {
    let kernel = fluid.muller;
    let d = fluid.settings.spacing;
    // The lattice sum of poly6 is not 1 at this support, so densities are relative to it.
    let volume = d * d * d / fluid.settings.lattice_density();
    let (work, cells) = (&mut fluid.work, &fluid.cells);
    let place = &fluid.particles.position;
    let n = place.len();
    let Fields { x, y, z, near, .. } = &mut work.fields;
    Fields::spread(place, [&mut *x, &mut *y, &mut *z]);
    near.resize(n, (Runs::default(), false));
    let (coordinates, touch) = ([&x[..], &y[..], &z[..]], &work.touch[..]);
    let blocks = work.density.par_chunks_mut(BLOCK).zip(near.par_chunks_mut(BLOCK));
    blocks.enumerate().for_each(|(b, (density, near))| {
        for (k, near) in near.iter_mut().enumerate() {
            near.0 = cells.runs_around(place[b * BLOCK + k].truncate());
        }
        let first = b * BLOCK;
        pulp::Arch::new().dispatch(Fill {
            kernel,
            volume,
            first,
            coordinates,
            touch,
            density,
            near,
        });
    });
}

/// Densities of a block of particles from `first` on.
struct Fill<'a> {
    kernel: Muller,
    volume: f32,
    first: usize,
    coordinates: [&'a [f32]; 3],
    touch: &'a [Touch],
    density: &'a mut [f32],
    near: &'a mut [(Runs, bool)],
}

impl pulp::WithSimd for Fill<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) {
        for (k, (density, near)) in self.density.iter_mut().zip(self.near).enumerate() {
            let i = self.first + k;
            let (sum, here) = within(&self.kernel, &near.0, i, self.coordinates);
            *density = self.volume * sum + self.touch[i].share;
            near.1 = here;
        }
    }
}

/// Σ W over the particles of `runs` within reach of particle `i`, and whether another stands in its place.
#[inline(always)]
fn within(kernel: &Muller, runs: &Runs, i: usize, [x, y, z]: [&[f32]; 3]) -> (f32, bool) {
    let coincident = (COINCIDENT * kernel.support()).powi(2);
    let (px, py, pz) = (x[i], y[i], z[i]);
    // Vectors of four, since the compiler does not make any of this loop.
    let (mut sum, mut here) = (Vec4::ZERO, Vec4::ZERO);
    let coincident = Vec4::splat(coincident);
    groups(
        runs,
        #[inline(always)]
        |at, counts| {
            let four = |list| Vec4::from_array(*lanes(list, at));
            let (dx, dy, dz) = (px - four(x), py - four(y), pz - four(z));
            let r2 = dx * dx + dy * dy + dz * dz;
            let counts = Vec4::from_array(*counts);
            sum += counts * kernel.poly6(r2);
            here += counts * (coincident - r2).max(Vec4::ZERO);
        },
    );
    // The particle itself gives `coincident` alone.
    (sum.element_sum(), here.element_sum() > coincident.x)
}

/// Takes the velocities in `work.flow` through `dt`.
pub(super) fn accelerate(fluid: &mut Fluid, dt: f32) -> Stepped {
    let s = &fluid.settings;
    let d = s.spacing;
    let volume = d * d * d / s.lattice_density();
    let stiffness = s.stiffness;
    let work = &mut fluid.work;
    let n = fluid.particles.position.len();
    let density = &work.density;
    let tasks = fluid.particles.pressure.par_iter_mut().with_min_len(TASK);
    tasks
        .zip(density)
        .for_each(|(p, density)| *p = stiffness * (density - 1.0).max(0.0));
    let Fields {
        u,
        v,
        w,
        pressure,
        share,
        ..
    } = &mut work.fields;
    Fields::spread(&work.flow, [u, v, w]);
    pressure.clear();
    pressure.extend_from_slice(&fluid.particles.pressure);
    share.clear();
    share.extend(density.iter().map(|density| volume / density));
    for list in [pressure, share] {
        list.resize(n + LANES, 0.0);
    }
    let forces = Forces {
        fields: &work.fields,
        kernel: fluid.muller,
        viscosity: s.viscosity,
        least: 1e-6 * d,
        density,
        touch: &work.touch,
        gravity: s.gravity,
        tension: s.surface_tension / s.density,
        steepest: INSIDE / d,
        dt,
        limit: FARTHEST * d / dt,
    };
    let blocks = work.flow[..n].par_chunks_mut(BLOCK).enumerate();
    blocks.for_each(|(b, flow)| {
        let first = b * BLOCK;
        pulp::Arch::new().dispatch(Push {
            forces: &forces,
            first,
            flow,
        });
    });
    let over = |i: usize| f64::from((work.density[i] - 1.0).max(0.0));
    Stepped {
        compression: crate::reduce::sum(n, over) / n as f64,
        ..Stepped::default()
    }
}

/// What sums of forces see.
struct Forces<'a> {
    fields: &'a Fields,
    kernel: Muller,
    viscosity: f32,
    /// Distance that the smallest ones count as.
    least: f32,
    density: &'a [f32],
    touch: &'a [Touch],
    gravity: Vec3,
    /// Surface tension over density, m³/s².
    tension: f32,
    /// Gradient of the colour field of what is inside, 1/m.
    steepest: f32,
    dt: f32,
    /// Fastest change of velocity.
    limit: f32,
}

/// The velocities of a block of particles from `first` on.
struct Push<'a> {
    forces: &'a Forces<'a>,
    first: usize,
    flow: &'a mut [Vec4],
}

impl pulp::WithSimd for Push<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) {
        let f = self.forces;
        for (i, flow) in (self.first..).zip(self.flow) {
            let touch = &f.touch[i];
            // A wall mirrors the pressure of the particle before it.
            let wall = 0.5 * f.fields.pressure[i] * touch.gradient;
            let mut a = (f.on(i) - wall) / f.density[i];
            if f.fields.near[i].1 {
                a += f.parting(i) / f.density[i];
            }
            if f.tension > 0.0 && touch.share == 0.0 {
                a -= f.tension / f.density[i] * f.curved(i);
            }
            a += f.gravity + f.viscosity * (touch.dragged - touch.drag * flow.truncate());
            *flow += (f.dt * a).clamp_length_max(f.limit).extend(0.0);
        }
    }
}

impl Forces<'_> {
    /// Force of pressure and viscosity on particle `i`, times the density ratio.
    #[inline(always)]
    fn on(&self, i: usize) -> Vec3 {
        let f = self.fields;
        let (px, py, pz, pressure) = (f.x[i], f.y[i], f.z[i], f.pressure[i]);
        let (pu, pv, pw) = (f.u[i], f.v[i], f.w[i]);
        let runs = &f.near[i].0;
        let [mut ax, mut ay, mut az] = [[0.0; LANES]; 3];
        groups(
            runs,
            #[inline(always)]
            |at, counts: &Lanes| {
                let (x, y, z): (&Lanes, &Lanes, &Lanes) = (lanes(&f.x, at), lanes(&f.y, at), lanes(&f.z, at));
                let (u, v, w): (&Lanes, &Lanes, &Lanes) = (lanes(&f.u, at), lanes(&f.v, at), lanes(&f.w, at));
                let (others, share): (&Lanes, &Lanes) = (lanes(&f.pressure, at), lanes(&f.share, at));
                for k in 0..LANES {
                    let (dx, dy, dz) = (px - x[k], py - y[k], pz - z[k]);
                    let r = (dx * dx + dy * dy + dz * dz).sqrt();
                    let share = counts[k] * share[k];
                    let push = -0.5 * share * (pressure + others[k]) * self.kernel.spiky_slope(r)
                        / r.max(self.least);
                    let drag = self.viscosity * share * self.kernel.viscosity_laplacian(r);
                    // Of what is out of reach the kernels are 0.
                    ax[k] += push * dx + drag * (u[k] - pu);
                    ay[k] += push * dy + drag * (v[k] - pv);
                    az[k] += push * dz + drag * (w[k] - pw);
                }
            },
        );
        let sum = |a: Lanes| a.iter().sum::<f32>();
        Vec3::new(sum(ax), sum(ay), sum(az))
    }

    /// Curvature of the colour field about particle `i` times its unit gradient, unless it is inside.
    #[inline(never)]
    fn curved(&self, i: usize) -> Vec3 {
        let (mut colour, mut curvature) = (Vec3::ZERO, 0.0);
        self.each(i, |j, x| {
            let r2 = x.length_squared();
            colour += self.fields.share[j] * self.kernel.poly6_gradient_factor(r2) * x;
            curvature += self.fields.share[j] * self.kernel.poly6_laplacian(r2);
        });
        if colour.length() > self.steepest {
            curvature * colour.normalize_or_zero()
        } else {
            Vec3::ZERO
        }
    }

    /// Push of those that stand in one place with particle `i`, in a direction of chance.
    #[cold]
    #[inline(never)]
    fn parting(&self, i: usize) -> Vec3 {
        let f = self.fields;
        let near = COINCIDENT * self.kernel.support();
        let mut force = Vec3::ZERO;
        self.each(i, |j, x| {
            if x.length_squared() < near * near {
                let push = 0.5 * f.share[j] * (f.pressure[i] + f.pressure[j]);
                force -= push * self.kernel.spiky_slope(near) * apart(i, j);
            }
        });
        force
    }

    /// Calls `f` with every other particle near particle `i` and the way from it to there.
    fn each(&self, i: usize, mut f: impl FnMut(usize, Vec3)) {
        let (x, y, z) = (&self.fields.x, &self.fields.y, &self.fields.z);
        let at = |i: usize| Vec3::new(x[i], y[i], z[i]);
        let p = at(i);
        for j in self.fields.near[i].0.iter().flatten().filter(|j| *j != i) {
            f(j, p - at(j));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rng::Rng;
    use crate::sph::{Boundary, Model, Settings, cases};

    fn weightless(d: f32) -> Fluid {
        let settings = Settings {
            model: Model::Mcg03,
            stiffness: 20.0,
            gravity: Vec3::ZERO,
            ..Settings::water(d)
        };
        Fluid::new(settings, Boundary::none())
    }

    #[test]
    fn densities_are_the_sums_over_all_particles() {
        let d = 0.1;
        let mut fluid = weightless(d);
        let mut rng = Rng::new(5, 0);
        for _ in 0..700 {
            let mut side = || rng.uniform_f32();
            fluid.add(Vec3::new(1.5 * side(), side(), 0.7 * side()), Vec3::ZERO);
        }
        fluid.refresh();
        let volume = d.powi(3) / fluid.settings.lattice_density();
        for (p, density) in fluid.positions().iter().zip(fluid.densities()) {
            let near = fluid.positions().iter().map(|q| p.distance_squared(*q));
            let sum = volume * near.map(|r2| fluid.muller.poly6(Vec4::splat(r2)).x).sum::<f32>();
            assert!((density - sum).abs() < 1e-5 * sum, "{density} {sum}");
        }
    }

    #[test]
    fn what_stands_in_one_place_parts() {
        let mut fluid = weightless(0.1);
        // So many that a corner is compressed too.
        for _ in 0..5 {
            cases::fill(&mut fluid, Vec3::ZERO, Vec3::splat(0.3));
        }
        for _ in 0..50 {
            fluid.step(1e-3);
        }
        let at = fluid.positions();
        for (k, p) in at.iter().enumerate() {
            let nearest = at[k + 1..].iter().map(|q| p.distance(*q)).fold(1.0, f32::min);
            assert!(nearest > 1e-3, "{nearest}");
        }
        let momentum: Vec4 = fluid.velocities().iter().sum();
        assert!(momentum.length() < 1e-2, "{momentum}");
    }
}
