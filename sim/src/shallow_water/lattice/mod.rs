//! Six-moment lattice Boltzmann in calm, deep water; finite volumes on every face that is not amid it.

mod kernels;
mod tile;

use super::boundary::Beyond;
use super::finite_volume::{FiniteVolume, Outcome, Refusal, SPEED_LIMIT, Stepped, flag, part, volume_step};
use super::real::Real;
use super::settings::{DEFAULT_COURANT, LatticeSettings};
use super::storage::GHOSTS;
use crate::solvers::GRAVITY;
use kernels::{Constants, Keep};
use rayon::prelude::*;
use tile::{Scratch, Sink, Source, Water};

/// Second moments that a cell holds besides depth and momentum.
const MOMENTS: usize = 3;

/// The water with its second moments, in padded arrays.
pub(crate) struct Lattice<T> {
    water: FiniteVolume<T>,
    settings: LatticeSettings,
    /// Second central moments xx, zz, xz beyond equilibrium after collision, over Δt, m³/s³: a stress is proportional to
    /// the step, so what is held does not depend on it.
    pub(super) moments: Vec<Vec<T>>,
    next: Vec<Vec<T>>,
}

impl<T: Real> Lattice<T> {
    pub(super) fn new(water: FiniteVolume<T>, settings: LatticeSettings) -> Self {
        let zeros = vec![vec![T::ZERO; water.layout().len()]; MOMENTS];
        Self {
            water,
            settings,
            next: zeros.clone(),
            moments: zeros,
        }
    }

    pub(super) fn water(&self) -> &FiniteVolume<T> {
        &self.water
    }

    pub(super) fn water_mut(&mut self) -> &mut FiniteVolume<T> {
        &mut self.water
    }

    /// Bytes of the moments.
    pub(super) fn bytes(&self) -> usize {
        2 * MOMENTS * self.water.layout.len() * size_of::<T>()
    }

    /// Goes on from moments that were written from outside.
    pub(super) fn resume(&mut self) {
        self.next.clone_from(&self.moments);
    }

    fn constants(&self, dt: f64) -> Constants<T> {
        let of = T::from_f64;
        let spacing = self.water.spacing;
        let speed = spacing / dt;
        let unfold = dt * dt * dt / (spacing * spacing);
        let fold = 1.0 / unfold;
        let (shear, bulk) = (1.0 - self.settings.shear_rate, 1.0 - self.settings.bulk_rate);
        Constants {
            gravity: of(GRAVITY),
            lambda: of(1.0 / speed),
            speed: of(speed),
            half_gravity: of(GRAVITY / (2.0 * speed * speed)),
            sixth: of(GRAVITY / (6.0 * speed * speed)),
            unfold: of(unfold),
            keep: Keep {
                own: of(0.5 * (bulk + shear) * fold),
                other: of(0.5 * (bulk - shear) * fold),
                mixed: of(shear * fold),
            },
            guess: {
                let (shear, bulk) = (-shear / self.settings.shear_rate, -bulk / self.settings.bulk_rate);
                Keep {
                    own: of(0.5 * (bulk + shear) * fold),
                    other: of(0.5 * (bulk - shear) * fold),
                    mixed: of(shear * fold),
                }
            },
            sluggish: of(0.5 * self.settings.sluggish),
            rounder: self.water.quantum.rounder(),
            // A quantum is the power of two above the largest depth over 2^(digits − 2).
            thin: of(self.settings.thin * self.water.quantum.length() * 2.0_f64.powi(T::DIGITS - 2)),
            froude: of(self.settings.froude * self.settings.froude),
            jump: of(self.settings.jump),
        }
    }

    /// Takes one step of `dt` seconds unless the fastest signal would then cross more than `courant` of a cell, at the
    /// solver's scale.
    pub(super) fn try_step(&mut self, time: f64, dt: f64, courant: f64) -> Result<Stepped, Refusal> {
        let (speed, flags) = self.sweep(time, dt);
        if flags & flag::BROKEN != 0 || !(speed < SPEED_LIMIT) {
            return Err(Refusal::Broken);
        }
        if speed * dt > courant * self.water.spacing {
            return Err(Refusal::TooFast(speed));
        }
        std::mem::swap(&mut self.water.now, &mut self.water.next);
        std::mem::swap(&mut self.moments, &mut self.next);
        self.water.wake();
        let deep = flags & flag::DEEP != 0;
        if deep {
            let deepest = self.water.deepest();
            self.water.coarsen(deepest);
        }
        Ok(Stepped {
            speed,
            signal: speed,
            deep,
        })
    }

    /// Moments beyond the edges: mirrored or repeated; 0 where a condition makes the water.
    fn fill_ghosts(&mut self) {
        for (at, from, beyond) in self.water.boundary.ghosts() {
            let [xx, zz, xz]: [T; MOMENTS] = std::array::from_fn(|m| self.moments[m][from]);
            let values = match beyond {
                Beyond::Repeat => [xx, zz, xz],
                Beyond::MirrorX | Beyond::MirrorZ => [xx, zz, -xz],
                Beyond::Foreign => [T::ZERO; MOMENTS],
            };
            for (plane, value) in self.moments.iter_mut().zip(values) {
                plane[at] = value;
            }
        }
    }

    /// Steps every tile that is awake from `now` to `next`; the fastest signal and all flags.
    fn sweep(&mut self, time: f64, dt: f64) -> (f64, u32) {
        let k = self.constants(dt);
        let volume = self.water.constants(dt);
        let (base, film) = (self.water.base, self.water.film());
        self.water
            .boundary
            .fill(time + 0.5 * dt, base, film, &self.water.bed, &mut self.water.now);
        self.fill_ghosts();
        let weight = T::from_f64(DEFAULT_COURANT / self.settings.courant);
        let water = &mut self.water;
        let layout = water.layout;
        let foreign = water.boundary.foreign();
        let known = |low: bool, high: bool, count: usize, all: usize| {
            (if low { GHOSTS } else { 0 })..(if high { GHOSTS + count } else { all })
        };
        let moments: [&[T]; MOMENTS] = std::array::from_fn(|m| &self.moments[m][..]);
        let source = Source {
            h: &water.now.h,
            qx: &water.now.qx,
            qz: &water.now.qz,
            z: &water.bed,
            moments,
            stride: layout.stride,
            columns: known(foreign[0], foreign[1], layout.nx, layout.stride),
            rows: known(foreign[2], foreign[3], layout.nz, layout.nz + 2 * GHOSTS),
        };
        let tiles_x = water.tiles_x;
        let bands = water.tiles.len() / tiles_x;
        let interior = layout.interior();
        let mut planes: Vec<&mut [T]> = [&mut water.next.h, &mut water.next.qx, &mut water.next.qz]
            .into_iter()
            .chain(&mut self.next)
            .map(|plane| &mut plane[interior.clone()])
            .collect();
        let mut jobs = Vec::with_capacity(bands);
        for (band, tiles) in water.tiles.chunks_mut(tiles_x).enumerate() {
            let (from, to) = (part(layout.nz, bands, band), part(layout.nz, bands, band + 1));
            let values = (to - from) * layout.stride;
            let mut parts = planes
                .iter_mut()
                .map(|p| p.split_off_mut(..values).unwrap_or_default());
            let mut next = || parts.next().unwrap_or_default();
            let sink = Sink {
                h: next(),
                qx: next(),
                qz: next(),
                moments: [next(), next(), next()],
                first_row: from + GHOSTS,
            };
            jobs.push((sink, tiles, to - from));
        }
        let arch = pulp::Arch::new();
        jobs.into_par_iter()
            .for_each_init(Scratch::new, |scratch, (mut sink, tiles, rows)| {
                for (t, tile) in tiles.iter_mut().enumerate() {
                    if !tile.awake {
                        continue;
                    }
                    let (from, to) = (part(layout.nx, tiles_x, t), part(layout.nx, tiles_x, t + 1));
                    let extent = volume_step::Extent {
                        first_column: from + GHOSTS,
                        columns: to - from,
                        first_row: sink.first_row,
                        rows,
                    };
                    tile.outcome = arch.dispatch(TileStep {
                        k: &k,
                        volume: &volume,
                        source: &source,
                        sink: &mut sink,
                        extent,
                        scratch,
                        weight,
                    });
                }
            });
        let mut all = (0.0_f64, 0);
        for tile in &self.water.tiles {
            all.0 = all.0.max(tile.outcome.speed.to_f64());
            all.1 |= tile.outcome.flags;
        }
        all
    }
}

/// The step of one tile as something that can be compiled for several instruction sets.
struct TileStep<'a, 'b, T> {
    k: &'a Constants<T>,
    volume: &'a super::finite_volume::kernels::Constants<T>,
    source: &'a Source<'a, T>,
    sink: &'a mut Sink<'b, T>,
    extent: volume_step::Extent,
    scratch: &'a mut Scratch<T>,
    /// What the lattice's signals weigh against those of finite volumes.
    weight: T,
}

impl<T: Real> pulp::WithSimd for TileStep<'_, '_, T> {
    type Output = Outcome<T>;

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) -> Outcome<T> {
        let Self {
            k,
            volume,
            source,
            sink,
            extent,
            scratch,
            weight,
        } = self;
        match tile::look(k, source, extent, scratch) {
            Water::Calm => {
                let mut outcome = tile::stream(k, volume, source, sink, extent, scratch);
                outcome.speed = outcome.speed * weight;
                outcome
            }
            Water::Mixed => tile::mix(k, volume, source, sink, extent, scratch),
            Water::Restless => tile::restless(volume, source, sink, extent, scratch),
        }
    }
}
