//! The model of Müller, Charypar & Gross 2003: state equation, explicit forces.
//!
//! Pressure p = k (ρ − ρ0) (eq. 12, with k the square of the speed of sound), forces −Σ m (p_i + p_j)/(2ρ_j) ∇W_spiky
//! (eq. 10), μ Σ m (v_j − v_i)/ρ_j ∇²W_viscosity (eq. 14) and σ κ n of the colour field (eq. 19). Boundaries are those of
//! `dfsph`. Pressures are kept from falling below 0, where they would clump the surface. What a pair adds to one of its
//! particles it takes from the other, so momentum is exact; its viscosity is not central, so angular momentum drifts. Its
//! compression under a column of height H is about g H / k.
//!
//! Two sums over pairs are all that a step needs, so no list of them is made: what the cells say is near a particle and
//! follows it is taken as it lies in memory, [`LANES`] particles side by side, and those out of reach have the weight 0. Both
//! particles of a pair get their share at once, in lists of their slab (`slabs`). The first sum says which part of each range
//! is within reach, and the second takes no more than that.

use super::cells::{Ahead, Cells};
use super::eight::{self, Kernel, LANES, Machine, eights, eights_mut};
use super::fluid::{Fluid, Stepped, TASK};
use super::kernel::Muller;
use super::neighbours::apart;
use super::slabs::{Slab, Slabs};
use glam::Vec3;
use rayon::prelude::*;

/// Length of the colour field's gradient below which a particle is inside, times the spacing (eq. 18, threshold).
const INSIDE: f32 = 0.5;
/// Farthest in particle spacings that the forces of one step may move a particle: what was put inside other water
/// leaves it instead of being thrown.
const FARTHEST: f32 = 0.1;
/// Distance over the support below which two particles stand in one place.
const COINCIDENT: f32 = 1e-3;

/// Particles of a range of which it is known which are within reach; few ranges hold more.
const BITS: usize = u64::BITS as usize;

/// What is read of neighbours, one array a quantity, each longer by [`LANES`] than the particles are many.
#[derive(Debug, Default)]
pub(crate) struct Fields {
    x: Vec<f32>,
    y: Vec<f32>,
    z: Vec<f32>,
    u: Vec<f32>,
    v: Vec<f32>,
    w: Vec<f32>,
    /// Half of the pressure over rest density, m²/s².
    half: Vec<f32>,
    /// Volume over that of the lattice and density ratio times the factor that both kernels of the forces have, 1/m³.
    weight: Vec<f32>,
    slabs: Slabs,
    /// Accelerations by other particles, m/s².
    push: [Vec<f32>; 3],
}

/// Takes over in `lists` what `values` says of each of `n` particles.
fn spread<const N: usize>(n: usize, lists: [&mut Vec<f32>; N], values: impl Fn(usize) -> [f32; N]) {
    let mut lists = lists.map(|list| {
        list.resize(n + LANES, 0.0);
        list[n..].fill(0.0);
        &mut list[..n]
    });
    for i in 0..n {
        for (list, value) in lists.iter_mut().zip(values(i)) {
            list[i] = value;
        }
    }
}

impl Fields {
    pub(crate) fn bytes(&self) -> usize {
        let lists = [&self.x, &self.y, &self.z, &self.u, &self.v, &self.w];
        let all = lists
            .into_iter()
            .chain([&self.half, &self.weight])
            .chain(&self.push);
        4 * all.map(Vec::capacity).sum::<usize>() + self.slabs.bytes()
    }
}

/// 0 for as many lanes as count, infinite for the others: what is added to squared distances.
const BEYOND: [[f32; LANES]; LANES + 1] = {
    let mut beyond = [[f32::INFINITY; LANES]; LANES + 1];
    let mut count = 1;
    while count <= LANES {
        beyond[count] = beyond[count - 1];
        beyond[count][count - 1] = 0.0;
        count += 1;
    }
    beyond
};

/// Densities.
pub(super) fn prepare(fluid: &mut Fluid) {
    let kernel = fluid.muller;
    let d = fluid.settings.spacing;
    // The lattice sum of poly6 is not 1 at this support, so densities are relative to it.
    let volume = d * d * d / fluid.settings.lattice_density();
    let (work, cells) = (&mut fluid.work, &fluid.cells);
    let place = &fluid.particles.position;
    let n = place.len();
    let Fields { x, y, z, slabs, .. } = &mut work.fields;
    spread(n, [&mut *x, &mut *y, &mut *z], |i| place[i].truncate().to_array());
    let coordinates = [&x[..], &y[..], &z[..]];
    slabs.cut(cells);
    slabs.each(|slab| {
        eight::dispatch(Fill {
            square: kernel.support() * kernel.support(),
            coincident: (COINCIDENT * kernel.support()).powi(2),
            slab,
            cells,
            coordinates,
        });
    });
    slabs.collect(0, &mut work.density);
    let own = kernel.support().powi(6);
    let scale = volume * kernel.poly6_factor();
    let densities = work.density.par_iter_mut().with_min_len(TASK);
    densities.zip(&work.touch).for_each(|(density, touch)| {
        *density = scale * (own + *density) + touch.share;
    });
}

/// Finds the pairs of a slab and sums (h² − r²)³ over them.
struct Fill<'a> {
    /// h².
    square: f32,
    /// Squared distance below which two particles are in one place.
    coincident: f32,
    slab: &'a mut Slab,
    cells: &'a Cells,
    coordinates: [&'a [f32]; 3],
}

impl Kernel for Fill<'_> {
    #[inline(always)]
    fn run<M: Machine>(self, m: M) {
        // Squares of distances are the same along any axes.
        let [x, y, z] = self.cells.axes().map(|k| self.coordinates[k]);
        self.slab.clear::<1>(LANES);
        let Slab {
            first,
            end,
            ahead,
            together,
            sums: [sums, ..],
            ..
        } = self.slab;
        let first = *first;
        ahead.clear();
        together.clear();
        let (zero, square, coincident) = (m.all(0.0), m.all(self.square), m.all(self.coincident));
        for i in first..*end {
            let (px, py, pz) = (m.all(x[i]), m.all(y[i]), m.all(z[i]));
            let (mut own, mut nearest) = (zero, square);
            let mut found = Ahead::default();
            for run in self.cells.runs_ahead(m, i, Vec3::new(x[i], y[i], z[i])).iter() {
                let (mut rest, mut near, mut shift) = (run.len(), 0_u64, 0);
                let start = run.start as u32;
                let others = eights(x, &run).iter().zip(eights(y, &run)).zip(eights(z, &run));
                let sums = eights_mut(sums, &(run.start - first..run.end - first));
                for (((x, y), z), sums) in others.zip(sums) {
                    let (dx, dy, dz) = (px - m.eight(x), py - m.eight(y), pz - m.eight(z));
                    let r2 = dx * dx + dy * dy + dz * dz + m.eight(&BEYOND[rest.min(LANES)]);
                    let left = (square - r2).max(zero);
                    let sum = left * left * left;
                    own = own + sum;
                    *sums = (m.eight(sums) + sum).values();
                    nearest = nearest.min(r2);
                    near |= u64::from(zero.less(left)) << (shift % BITS);
                    shift += LANES;
                    rest = rest.saturating_sub(LANES);
                }
                found.push(if run.len() <= BITS {
                    let (before, after) = (near.trailing_zeros(), near.leading_zeros());
                    (start + before, start + BITS as u32 - after)
                } else {
                    (start, run.end as u32)
                });
            }
            sums[i - first] += own.sum();
            ahead.push(found);
            if nearest.less(coincident) != 0 {
                together.push(i as u32);
            }
        }
    }
}

/// Takes the velocities in `work.flow` through `dt`.
pub(super) fn accelerate(fluid: &mut Fluid, dt: f32) -> Stepped {
    let s = &fluid.settings;
    let d = s.spacing;
    let kernel = fluid.muller;
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
        half,
        weight,
        ..
    } = &mut work.fields;
    let (flow, pressure) = (&work.flow, &fluid.particles.pressure);
    let factor = volume * kernel.force_factor();
    spread(n, [u, v, w, half, weight], |i| {
        let v = flow[i];
        [v.x, v.y, v.z, 0.5 * pressure[i], factor / density[i]]
    });
    let mut slabs = std::mem::take(&mut work.fields.slabs);
    let pairs = Pairs {
        fields: &work.fields,
        support: kernel.support(),
        near: COINCIDENT * kernel.support(),
        viscosity: s.viscosity,
        least: (1e-6 * d).powi(2),
        density,
    };
    slabs.each(|slab| eight::dispatch(Push { pairs: &pairs, slab }));
    let [x, y, z] = &mut work.fields.push;
    for (k, list) in [&mut *x, &mut *y, &mut *z].into_iter().enumerate() {
        list.resize(n, 0.0);
        slabs.collect(k, list);
    }
    let (touch, limit) = (&work.touch, FARTHEST * d / dt);
    let tension = s.surface_tension / s.density;
    let single = Single {
        fields: &work.fields,
        cells: &fluid.cells,
        kernel,
        factor: kernel.force_factor(),
        steepest: INSIDE / d,
    };
    let [x, y, z] = &work.fields.push;
    let flows = work.flow[..n].par_iter_mut().with_min_len(TASK).enumerate();
    flows.for_each(|(i, flow)| {
        let touch = &touch[i];
        // A wall mirrors the pressure of the particle before it.
        let wall = 0.5 * pressure[i] / density[i] * touch.gradient;
        let mut a = Vec3::new(x[i], y[i], z[i]) - wall;
        if tension > 0.0 && touch.share == 0.0 {
            a -= tension / density[i] * single.curved(i);
        }
        a += s.gravity + s.viscosity * (touch.dragged - touch.drag * flow.truncate());
        *flow += (dt * a).clamp_length_max(limit).extend(0.0);
    });
    work.fields.slabs = slabs;
    let over = |i: usize| f64::from((work.density[i] - 1.0).max(0.0));
    Stepped {
        compression: crate::reduce::sum(n, over) / n as f64,
        ..Stepped::default()
    }
}

/// What sums over pairs see.
struct Pairs<'a> {
    fields: &'a Fields,
    /// h.
    support: f32,
    /// Distance below which two particles are in one place.
    near: f32,
    viscosity: f32,
    /// Square that the smallest ones count as, m².
    least: f32,
    density: &'a [f32],
}

/// The accelerations of the pairs of a slab by pressure and viscosity.
struct Push<'a> {
    pairs: &'a Pairs<'a>,
    slab: &'a mut Slab,
}

impl Kernel for Push<'_> {
    #[inline(always)]
    fn run<M: Machine>(self, m: M) {
        let (pairs, f) = (self.pairs, self.pairs.fields);
        self.slab.clear::<3>(LANES);
        let Slab {
            first,
            ahead,
            together,
            sums: [sx, sy, sz],
            ..
        } = self.slab;
        let first = *first;
        let zero = m.all(0.0);
        let (h, least, viscosity) = (m.all(pairs.support), m.all(pairs.least), m.all(pairs.viscosity));
        for (i, ahead) in (first..).zip(&*ahead) {
            let (px, py, pz) = (m.all(f.x[i]), m.all(f.y[i]), m.all(f.z[i]));
            let (pu, pv, pw) = (m.all(f.u[i]), m.all(f.v[i]), m.all(f.w[i]));
            let (half, inverse) = (m.all(f.half[i]), m.all(1.0 / pairs.density[i]));
            let (mut ax, mut ay, mut az) = (zero, zero, zero);
            for run in ahead.iter() {
                let mut rest = run.len();
                let place = eights(&f.x, &run)
                    .iter()
                    .zip(eights(&f.y, &run))
                    .zip(eights(&f.z, &run));
                let flow = eights(&f.u, &run)
                    .iter()
                    .zip(eights(&f.v, &run))
                    .zip(eights(&f.w, &run));
                let other = eights(&f.half, &run).iter().zip(eights(&f.weight, &run));
                let sums = run.start - first..run.end - first;
                let sums = eights_mut(sx, &sums)
                    .iter_mut()
                    .zip(eights_mut(sy, &sums))
                    .zip(eights_mut(sz, &sums));
                for ((((x, y), z), ((u, v), w)), ((others, weight), ((sx, sy), sz))) in
                    place.zip(flow).zip(other.zip(sums))
                {
                    let (dx, dy, dz) = (px - m.eight(x), py - m.eight(y), pz - m.eight(z));
                    let r2 = dx * dx + dy * dy + dz * dz + m.eight(&BEYOND[rest.min(LANES)]);
                    let r = r2.max(least).sqrt();
                    let left = (h - r).max(zero);
                    let weight = m.eight(weight) * inverse * left;
                    let push = (m.eight(others) + half) * weight * left.over(r);
                    let drag = weight * viscosity;
                    let x = push * dx + drag * (m.eight(u) - pu);
                    let y = push * dy + drag * (m.eight(v) - pv);
                    let z = push * dz + drag * (m.eight(w) - pw);
                    (ax, ay, az) = (ax + x, ay + y, az + z);
                    *sx = (m.eight(sx) - x).values();
                    *sy = (m.eight(sy) - y).values();
                    *sz = (m.eight(sz) - z).values();
                    rest = rest.saturating_sub(LANES);
                }
            }
            sx[i - first] += ax.sum();
            sy[i - first] += ay.sum();
            sz[i - first] += az.sum();
        }
        for &i in &*together {
            let i = i as usize;
            pairs.part(i, &ahead[i - first], |j, a| {
                sx[j - first] += a.x;
                sy[j - first] += a.y;
                sz[j - first] += a.z;
            });
        }
    }
}

impl Pairs<'_> {
    /// Pushes particle `i` and those later ones that stand in its place apart, in directions of chance.
    #[cold]
    #[inline(never)]
    fn part(&self, i: usize, ahead: &Ahead, mut add: impl FnMut(usize, Vec3)) {
        let f = self.fields;
        let at = |i: usize| Vec3::new(f.x[i], f.y[i], f.z[i]);
        let left = self.support - self.near;
        for j in ahead.iter().flatten() {
            if at(i).distance_squared(at(j)) < self.near * self.near {
                let weight = f.weight[j] / self.density[i];
                let push = weight * (f.half[i] + f.half[j]) * left * left * apart(i, j);
                add(i, push);
                add(j, -push);
            }
        }
    }
}

/// What the surface tension of single particles sees.
struct Single<'a> {
    fields: &'a Fields,
    cells: &'a Cells,
    kernel: Muller,
    /// What weights are beside volumes over density ratios, 1/m⁶.
    factor: f32,
    /// Gradient of the colour field of what is inside, 1/m.
    steepest: f32,
}

impl Single<'_> {
    /// Curvature of the colour field about particle `i` times its unit gradient, unless it is inside.
    #[inline(never)]
    fn curved(&self, i: usize) -> Vec3 {
        let f = self.fields;
        let at = |i: usize| Vec3::new(f.x[i], f.y[i], f.z[i]);
        let (mut colour, mut curvature) = (Vec3::ZERO, 0.0);
        let near = self.cells.runs_around(at(i));
        for j in near.iter().flatten().filter(|j| *j != i) {
            let x = at(i) - at(j);
            let (r2, share) = (x.length_squared(), f.weight[j] / self.factor);
            colour += share * self.kernel.poly6_gradient_factor(r2) * x;
            curvature += share * self.kernel.poly6_laplacian(r2);
        }
        if colour.length() > self.steepest {
            curvature * colour.normalize_or_zero()
        } else {
            Vec3::ZERO
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rng::Rng;
    use crate::sph::{Boundary, Model, Settings, cases};
    use glam::Vec4;

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
            let sum = volume * near.map(|r2| fluid.muller.poly6(r2)).sum::<f32>();
            assert!((density - sum).abs() < 1e-5 * sum, "{density} {sum}");
        }
    }

    #[test]
    fn forces_are_the_sums_over_all_particles() {
        let (d, dt) = (0.1, 1e-3);
        let mut fluid = weightless(d);
        fluid.settings.viscosity = 0.3;
        fluid.settings.surface_tension = 50.0;
        let mut rng = Rng::new(6, 0);
        // Spaced, so that nothing is pushed farther than a step allows.
        for k in 0..8 * 6 * 5 {
            let at = Vec3::new((k % 8) as f32, (k / 8 % 6) as f32, (k / 48) as f32);
            let mut aside = || 0.3 * rng.uniform_f32();
            let at = 0.85 * d * (at + Vec3::new(aside(), aside(), aside()));
            fluid.add(at, Vec3::new(aside(), aside(), aside()));
        }
        fluid.refresh();
        let (at, v) = (fluid.positions().to_vec(), fluid.velocities().to_vec());
        fluid.step(dt);
        let (density, kernel, s) = (fluid.densities(), fluid.muller, &fluid.settings);
        let volume = d.powi(3) / s.lattice_density();
        let pressure = |i: usize| s.stiffness * (density[i] - 1.0).max(0.0);
        for i in 0..at.len() {
            let (mut force, mut colour, mut curvature) = (Vec3::ZERO, Vec3::ZERO, 0.0);
            for j in (0..at.len()).filter(|j| *j != i) {
                let (x, share) = ((at[i] - at[j]).truncate(), volume / density[j]);
                let (r, r2) = (x.length(), x.length_squared());
                let push = 0.5 * share * (pressure(i) + pressure(j)) * kernel.spiky_slope(r);
                force -= push * x / r;
                force += s.viscosity * share * kernel.viscosity_laplacian(r) * (v[j] - v[i]).truncate();
                // Beyond the support the Laplacian of poly6 is cut as its gradient is.
                colour += share * kernel.poly6_gradient_factor(r2) * x;
                curvature += share * kernel.poly6_laplacian(r2);
            }
            if colour.length() > INSIDE / d {
                force -= s.surface_tension / s.density * curvature * colour.normalize();
            }
            let a = (fluid.velocities()[i] - v[i]).truncate() / dt;
            let expected = force / density[i];
            assert!(
                (a - expected).length() < 1e-3 * (1.0 + expected.length()),
                "{a} {expected}"
            );
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
