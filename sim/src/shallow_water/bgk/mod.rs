//! The lattice Boltzmann scheme of Ojeda & Susín (2013, section 2): nine velocities, one relaxation time.
//!
//! It is kept for comparison. Its equilibrium has the right second but not the right third moments, and it is only
//! positive for slow water, so a step that leaves the scheme's range is refused by name.

mod extremes;
mod kernels;
mod sweep;

use super::boundary::Beyond;
use super::finite_volume::{FiniteVolume, Refusal, Stepped};
use super::real::Real;
use super::settings::DEFAULT_COURANT;
use crate::solvers::GRAVITY;
use extremes::Largest;
use kernels::{Constants, DIRECTIONS};

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
    /// The largest values of the present state, unless it was touched since.
    known: Option<Largest>,
}

impl<T: Real> Bgk<T> {
    pub(super) fn new(water: FiniteVolume<T>, relaxation: f64) -> Self {
        let len = water.layout().len();
        Self {
            water,
            relaxation,
            populations: vec![vec![T::ZERO; len]; DIRECTIONS],
            step: 0.0,
            known: None,
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
        self.largest().signal * (DEFAULT_COURANT / REACH)
    }

    /// The largest values of the present state.
    fn largest(&self) -> Largest {
        match self.known {
            Some(known) if !self.water.touched => known,
            _ => extremes::survey(&self.constants(1.0), &self.water),
        }
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
            gravity: of(GRAVITY),
            thin: of(self.thin()),
            momentum_limit: self.water.constants(dt).momentum_limit,
        }
    }

    /// Takes one step of `dt` seconds unless the present state's fastest signal would cross more than `courant` (of a
    /// cell, at the solver's scale) in it.
    pub(super) fn try_step(&mut self, time: f64, dt: f64, courant: f64) -> Result<Stepped, Refusal> {
        let before = self.largest();
        self.water.touched = false;
        self.known = Some(before);
        let weighted = before.signal * (DEFAULT_COURANT / REACH);
        if weighted * dt > courant * self.water.spacing {
            return Err(Refusal::TooFast(weighted));
        }
        self.check(before, false)?;
        let base = self.water.base;
        let film = self.water.film();
        self.water
            .boundary
            .fill(time + 0.5 * dt, base, film, &self.water.bed, &mut self.water.now);
        self.rescale(dt);
        self.fill_ghosts(dt);
        let after = self.sweep(dt);
        if let Err(refusal) = self.check(after, true) {
            self.forget();
            return Err(refusal);
        }
        std::mem::swap(&mut self.water.now, &mut self.water.next);
        self.known = Some(after);
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

    /// Whether the scheme may be trusted with a state; `next` says which one the values are those of.
    fn check(&self, found: Largest, next: bool) -> Result<(), Refusal> {
        if found.broken {
            return Err(Refusal::Broken);
        }
        let fields = if next { &self.water.next } else { &self.water.now };
        let refuse = |quantity, value, limit, at| {
            Err(Refusal::OutOfRange {
                quantity,
                value,
                limit,
                at,
                remedy: "use `solver.scheme = \"lattice\"` or \"finite-volume\", which know dry ground and fast flow",
            })
        };
        if found.least < 0.0 {
            let (least, at) = extremes::shallowest(self.water.layout, fields);
            return refuse("depth in m", least, 0.0, at);
        }
        if found.froude > LARGEST_FROUDE {
            let (froude, at) = extremes::fastest(self.water.layout, fields, self.thin());
            return refuse("Froude number", froude, LARGEST_FROUDE, at);
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
}
