//! The lattice Boltzmann scheme of Ojeda & Susín (2013, section 2): nine velocities, one relaxation time.
//!
//! It is kept for comparison. Its equilibrium has the right second but not the right third moments, and it is only
//! positive for slow water, so a step that leaves the scheme's range is refused by name.

mod kernels;

use super::boundary::Beyond;
use super::finite_volume::kernels::rub;
use super::finite_volume::{FiniteVolume, Refusal, Stepped};
use super::real::Real;
use super::settings::DEFAULT_COURANT;
use crate::reduce;
use crate::solvers::GRAVITY;
use kernels::{Constants, DIRECTIONS, Links, RowView, Star};
use rayon::prelude::*;

/// Rows of a band, which one thread steps at a time.
const BAND: usize = 32;
/// Largest (|u| + √(g h)) Δt/Δx at the default Courant number: above it the rest population turns negative.
const REACH: f64 = 0.8;
/// Largest Froude number: beyond it runs die whatever the relaxation time.
const LARGEST_FROUDE: f64 = 1.0;
/// Share of the largest depth, rounded up to a power of two, below which a cell takes no part.
const THIN: f64 = 0.01;
/// Change of the step that is worth a change of the lattice.
const SAME: f64 = 1e-9;

/// The water with its populations beyond rest, in padded arrays.
pub(crate) struct Bgk<T> {
    water: FiniteVolume<T>,
    relaxation: f64,
    /// φᵢ of the eight moving populations, m; streamed in place.
    pub(super) populations: Vec<Vec<T>>,
    /// Length of the step that they belong to, s; 0 before the first, when they are at equilibrium.
    pub(super) step: f64,
}

/// The largest values of a state.
#[derive(Clone, Copy, Debug, Default)]
struct Extremes {
    /// max(|u|, |v|) + √(g h), m/s.
    signal: f64,
    /// |(u, v)|² / (g h) and where.
    froude: (f64, [usize; 2]),
    /// Smallest depth and where.
    least: (f64, [usize; 2]),
    deepest: f64,
    broken: bool,
}

/// Populations of a band's outermost neighbours before anything is overwritten.
struct Rim<T> {
    before: Star<T>,
    behind: Star<T>,
}

impl<T: Real> Bgk<T> {
    pub(super) fn new(water: FiniteVolume<T>, relaxation: f64) -> Self {
        let len = water.layout().len();
        Self {
            water,
            relaxation,
            populations: vec![vec![T::ZERO; len]; DIRECTIONS],
            step: 0.0,
        }
    }

    pub(super) fn water(&self) -> &FiniteVolume<T> {
        &self.water
    }

    pub(super) fn water_mut(&mut self) -> &mut FiniteVolume<T> {
        &mut self.water
    }

    /// Depth up to which a cell takes no part, m.
    fn thin(&self) -> f64 {
        // A quantum is the power of two above the largest depth over 2^(digits − 2).
        THIN * self.water.quantum.length() * 2.0_f64.powi(T::DIGITS - 2)
    }

    /// Fastest signal of the present state in m/s, weighted so that the solver's default Courant number allows a step
    /// of [`REACH`].
    pub(super) fn probe(&self) -> f64 {
        self.extremes(false).signal * (DEFAULT_COURANT / REACH)
    }

    /// Largest values of the cells that take part; of the next state if `next`.
    fn extremes(&self, next: bool) -> Extremes {
        let fields = if next { &self.water.next } else { &self.water.now };
        let (layout, thin) = (self.water.layout, self.thin());
        let limit = self.water.constants(0.0).momentum_limit.to_f64();
        let row = |j: usize| {
            let mut found = Extremes {
                least: (f64::INFINITY, [0, j]),
                froude: (0.0, [0, j]),
                ..Extremes::default()
            };
            for (i, k) in layout.row(j).enumerate() {
                let (h, qx, qz) = (fields.h[k].to_f64(), fields.qx[k].to_f64(), fields.qz[k].to_f64());
                found.broken |= !(qx.abs() < limit && qz.abs() < limit && h.is_finite());
                if h < found.least.0 {
                    found.least = (h, [i, j]);
                }
                found.deepest = found.deepest.max(h);
                if h > thin {
                    let (u, v) = (qx / h, qz / h);
                    let square = (u * u + v * v) / (GRAVITY * h);
                    if square > found.froude.0 {
                        found.froude = (square, [i, j]);
                    }
                    found.signal = found.signal.max(u.abs().max(v.abs()) + (GRAVITY * h).sqrt());
                }
            }
            found
        };
        reduce::fold_blocks(layout.nz, row, |a, b| Extremes {
            signal: a.signal.max(b.signal),
            froude: if b.froude.0 > a.froude.0 {
                b.froude
            } else {
                a.froude
            },
            least: if b.least.0 < a.least.0 { b.least } else { a.least },
            deepest: a.deepest.max(b.deepest),
            broken: a.broken || b.broken,
        })
        .unwrap_or_default()
    }

    fn constants(&self, dt: f64) -> Constants<T> {
        let of = T::from_f64;
        let speed = self.water.spacing / dt;
        Constants {
            lambda: of(1.0 / speed),
            speed: of(speed),
            sixth: of(GRAVITY / (6.0 * speed * speed)),
            rate: of(1.0 / self.relaxation),
            rounder: self.water.quantum.rounder(),
        }
    }

    /// Takes one step of `dt` seconds unless the present state's fastest signal would cross more than `courant` (of a
    /// cell, at the solver's scale) in it.
    pub(super) fn try_step(&mut self, time: f64, dt: f64, courant: f64) -> Result<Stepped, Refusal> {
        let before = self.extremes(false);
        let weighted = before.signal * (DEFAULT_COURANT / REACH);
        if weighted * dt > courant * self.water.spacing {
            return Err(Refusal::TooFast(weighted));
        }
        self.check(&before)?;
        let base = self.water.base;
        let film = self.water.film();
        self.water
            .boundary
            .fill(time + 0.5 * dt, base, film, &self.water.bed, &mut self.water.now);
        self.rescale(dt);
        self.fill_ghosts(dt);
        self.sweep(dt);
        let after = self.extremes(true);
        if after.broken {
            self.forget();
            return Err(Refusal::Broken);
        }
        if let Err(refusal) = self.check(&after) {
            self.forget();
            return Err(refusal);
        }
        std::mem::swap(&mut self.water.now, &mut self.water.next);
        let deep = after.deepest >= self.water.quantum.depth_limit::<T>();
        if deep {
            self.water.coarsen(after.deepest);
        }
        Ok(Stepped {
            speed: after.signal * (DEFAULT_COURANT / REACH),
            signal: after.signal,
            deep,
        })
    }

    /// Whether the scheme may be trusted with a state.
    fn check(&self, found: &Extremes) -> Result<(), Refusal> {
        let refuse = |quantity, value, limit, at, remedy| {
            Err(Refusal::OutOfRange {
                quantity,
                value,
                limit,
                at,
                remedy,
            })
        };
        let elsewhere =
            "use `solver.scheme = \"lattice\"` or \"finite-volume\", which know dry ground and fast flow";
        if found.least.0 < 0.0 {
            return refuse("depth in m", found.least.0, 0.0, found.least.1, elsewhere);
        }
        let froude = found.froude.0.sqrt();
        if froude > LARGEST_FROUDE {
            return refuse("Froude number", froude, LARGEST_FROUDE, found.froude.1, elsewhere);
        }
        Ok(())
    }

    /// Starts the populations again from depth and momentum, after a step that was not taken.
    fn forget(&mut self) {
        self.step = 0.0;
    }

    /// Fits the populations to another lattice speed: momentum over e, and the part beyond equilibrium, a stress that is
    /// proportional to Δt, over e². Before the first step they are put at equilibrium.
    fn rescale(&mut self, dt: f64) {
        let ratio = dt / self.step;
        if (ratio - 1.0).abs() < SAME {
            return;
        }
        let fresh = self.step <= 0.0;
        let (old, new) = (self.step / self.water.spacing, dt / self.water.spacing);
        let carried = if fresh { 0.0 } else { ratio.powi(3) };
        let layout = self.water.layout;
        for k in (0..layout.nz).flat_map(|j| layout.row(j)) {
            let now = &self.water.now;
            let (h, qx, qz) = (now.h[k].to_f64(), now.qx[k].to_f64(), now.qz[k].to_f64());
            let before = kernels::equilibrium(h, qx * old, qz * old);
            let after = kernels::equilibrium(h, qx * new, qz * new);
            for (i, plane) in self.populations.iter_mut().enumerate() {
                let beyond = if fresh { 0.0 } else { plane[k].to_f64() - before[i] };
                plane[k] = T::from_f64(after[i] + carried * beyond);
            }
        }
        self.step = dt;
    }

    /// Populations beyond the edges: mirrored, repeated, or at the equilibrium of what the condition makes with the
    /// part beyond equilibrium of the nearest cell (Guo, Zheng & Shi 2002, doi:10.1063/1.1471914).
    fn fill_ghosts(&mut self, dt: f64) {
        let lambda = dt / self.water.spacing;
        let now = &self.water.now;
        let thin = self.thin();
        let state = |k: usize| {
            kernels::equilibrium(
                now.h[k].to_f64(),
                now.qx[k].to_f64() * lambda,
                now.qz[k].to_f64() * lambda,
            )
        };
        for (at, from, beyond) in self.water.boundary.ghosts() {
            let source: [T; DIRECTIONS] = std::array::from_fn(|i| self.populations[i][from]);
            let turned = match beyond {
                Beyond::Repeat => [0, 1, 2, 3, 4, 5, 6, 7],
                Beyond::MirrorX => [1, 0, 2, 3, 7, 6, 5, 4],
                Beyond::MirrorZ => [0, 1, 3, 2, 6, 7, 4, 5],
                Beyond::Foreign => {
                    let wet = now.h[from].to_f64() > thin;
                    let (here, there) = (state(from), state(at));
                    for i in 0..DIRECTIONS {
                        let rest = if wet { source[i].to_f64() - here[i] } else { 0.0 };
                        self.populations[i][at] = T::from_f64(there[i] + rest);
                    }
                    continue;
                }
            };
            for (i, plane) in self.populations.iter_mut().enumerate() {
                plane[at] = source[turned[i]];
            }
        }
    }

    /// Steps every row from `now` to `next`, populations in place.
    fn sweep(&mut self, dt: f64) {
        let k = self.constants(dt);
        let friction = self.water.constants(dt);
        let (layout, thin) = (self.water.layout, T::from_f64(self.thin()));
        let stride = layout.stride;
        let (now, bed) = (&self.water.now, &self.water.bed);
        let first = super::storage::GHOSTS;
        let view = |r: usize| {
            let at = r * stride..(r + 1) * stride;
            RowView {
                h: &now.h[at.clone()],
                z: &bed[at.clone()],
                qx: &now.qx[at.clone()],
                qz: &now.qz[at],
            }
        };
        let foreign = self.water.boundary.foreign();
        let open = |r: usize, out: &mut [T]| {
            openings(thin, [view(r - 1), view(r), view(r + 1)], out);
            // Beyond an edge that prescribes something there is only water beside water: the bed there is made up.
            let both = |a: T, b: T| if a > thin && b > thin { T::ONE } else { T::ZERO };
            let inside = r.clamp(first, first + layout.nz - 1);
            if (r < inside && foreign[2]) || (r > inside && foreign[3]) {
                for (c, open) in out.iter_mut().enumerate() {
                    *open = both(view(r).h[c], view(inside).h[c]);
                }
            }
            let (west, east) = (first, first + layout.nx - 1);
            for c in (0..first).filter(|_| foreign[0]) {
                out[c] = both(view(r).h[c], view(r).h[west]);
            }
            for c in (east + 1..east + 1 + first).filter(|_| foreign[1]) {
                out[c] = both(view(r).h[c], view(r).h[east]);
            }
        };
        let bands = layout.nz.div_ceil(BAND);
        let part = |b: usize| layout.nz * b / bands;
        let arch = pulp::Arch::new();
        // Rows beside each band, from populations that nobody has overwritten yet.
        let populations = &self.populations;
        let collided = |r: usize| {
            let mut star = Star::new(stride);
            open(r, &mut star.open);
            let phi = std::array::from_fn(|i| &populations[i][r * stride..(r + 1) * stride]);
            arch.dispatch(Collide {
                k: &k,
                here: view(r),
                phi,
                out: &mut star,
            });
            star
        };
        let rims: Vec<Rim<T>> = (0..bands)
            .into_par_iter()
            .map(|b| Rim {
                before: collided(first + part(b) - 1),
                behind: collided(first + part(b + 1)),
            })
            .collect();
        let interior = layout.interior();
        let next = &mut self.water.next;
        let mut fields = [
            &mut next.h[interior.clone()],
            &mut next.qx[interior.clone()],
            &mut next.qz[interior.clone()],
        ];
        let mut planes: Vec<&mut [T]> = self
            .populations
            .iter_mut()
            .map(|p| &mut p[interior.clone()])
            .collect();
        let mut jobs = Vec::with_capacity(bands);
        for (b, rim) in rims.into_iter().enumerate() {
            let (from, to) = (part(b), part(b + 1));
            let values = (to - from) * stride;
            let fields = fields
                .each_mut()
                .map(|f| f.split_off_mut(..values).unwrap_or_default());
            let planes: Vec<&mut [T]> = planes
                .iter_mut()
                .map(|p| p.split_off_mut(..values).unwrap_or_default())
                .collect();
            jobs.push((first + from, to - from, rim, fields, planes));
        }
        jobs.into_par_iter()
            .for_each(|(start, rows, rim, mut fields, mut planes)| {
                let mut stars = [rim.before, Star::new(stride), Star::new(stride)];
                let mut links = [Links::new(stride), Links::new(stride)];
                let mut behind = Some(rim.behind);
                let collide = |r: usize, planes: &[&mut [T]], out: &mut Star<T>| {
                    let at = (r - start) * stride;
                    open(r, &mut out.open);
                    let phi = std::array::from_fn(|i| &planes[i][at..at + stride]);
                    arch.dispatch(Collide {
                        k: &k,
                        here: view(r),
                        phi,
                        out,
                    });
                };
                collide(start, &planes, &mut stars[1]);
                let [a, b, _] = &stars;
                arch.dispatch(Link {
                    k: &k,
                    rows: [view(start - 1), view(start)],
                    stars: [a, b],
                    out: &mut links[0],
                });
                for r in start..start + rows {
                    if r + 1 < start + rows {
                        collide(r + 1, &planes, &mut stars[2]);
                    } else if let Some(star) = behind.take() {
                        stars[2] = star;
                    }
                    let [_, here, ahead] = &stars;
                    arch.dispatch(Link {
                        k: &k,
                        rows: [view(r), view(r + 1)],
                        stars: [here, ahead],
                        out: &mut links[1],
                    });
                    let at = (r - start) * stride..(r - start + 1) * stride;
                    let new = fields.each_mut().map(|f| &mut f[at.clone()]);
                    let mut targets = planes.iter_mut().map(|p| &mut p[at.clone()]);
                    let phi = std::array::from_fn(|_| targets.next().unwrap_or_default());
                    let [sb, s, sf] = &stars;
                    let [lb, l] = &links;
                    arch.dispatch(Gather {
                        k: &k,
                        h: view(r).h,
                        stars: [sb, s, sf],
                        links: [lb, l],
                        new,
                        phi,
                    });
                    if friction.friction > T::ZERO {
                        let [h, qx, qz] = fields.each_mut().map(|f| &mut f[at.clone()]);
                        rub(&friction, h, qx, qz);
                    }
                    stars.rotate_left(1);
                    links.swap(0, 1);
                }
            });
    }
}

/// 1 for the cells of the middle row that take part: those deeper than a film, and films beside water that stands
/// higher than they do by as much.
fn openings<T: Real>(thin: T, rows: [RowView<'_, T>; 3], out: &mut [T]) {
    let [before, here, behind] = rows;
    let n = here.h.len();
    let level = |row: &RowView<'_, T>, c: usize| row.h[c] + row.z[c];
    for c in 0..n {
        let deep = here.h[c] > thin;
        let flooded = !deep && {
            let own = level(&here, c) + thin;
            let (first, last) = (c.saturating_sub(1), (c + 1).min(n - 1));
            [(&before, c), (&behind, c), (&here, first), (&here, last)]
                .into_iter()
                .any(|(row, c)| row.h[c] > thin && level(row, c) > own)
        };
        out[c] = if deep || flooded { T::ONE } else { T::ZERO };
    }
}

/// The kernels as things that can be compiled for several instruction sets, with the same bits from each.
struct Collide<'a, T> {
    k: &'a Constants<T>,
    here: RowView<'a, T>,
    phi: [&'a [T]; DIRECTIONS],
    out: &'a mut Star<T>,
}

impl<T: Real> pulp::WithSimd for Collide<'_, T> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) {
        kernels::collide(self.k, self.here, self.phi, self.out);
    }
}

struct Link<'a, T> {
    k: &'a Constants<T>,
    rows: [RowView<'a, T>; 2],
    stars: [&'a Star<T>; 2],
    out: &'a mut Links<T>,
}

impl<T: Real> pulp::WithSimd for Link<'_, T> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) {
        kernels::links(self.k, self.rows, self.stars, self.out);
    }
}

struct Gather<'a, T> {
    k: &'a Constants<T>,
    h: &'a [T],
    stars: [&'a Star<T>; 3],
    links: [&'a Links<T>; 2],
    new: [&'a mut [T]; 3],
    phi: [&'a mut [T]; DIRECTIONS],
}

impl<T: Real> pulp::WithSimd for Gather<'_, T> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) {
        kernels::gather(self.k, self.h, self.stars, self.links, self.new, self.phi);
    }
}
