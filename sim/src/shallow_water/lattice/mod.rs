//! Six-moment lattice Boltzmann in calm, deep water; finite volumes on every face that is not amid it.

mod in_place;
mod kernels;
mod tile;

use super::boundary::Beyond;
use super::finite_volume::{FiniteVolume, Outcome, Refusal, SPEED_LIMIT, Stepped, flag, part, volume_step};
use super::real::Real;
use super::settings::{DEFAULT_COURANT, LatticeSettings};
use super::storage::{Fields, GHOSTS};
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
    calm: Calm,
    /// Whether `next` is behind `now` where tiles sleep, after steps in place.
    stale: bool,
    /// Of each tile: whether anything moved in it after the last step, where that was in place.
    moved: Vec<bool>,
}

/// Whether the present water is calm everywhere. What is known decides how a step is computed, not what comes of it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Calm {
    /// To be looked at.
    Unknown,
    /// Inside the domain; what touches its edges is to be looked at.
    Inside,
    /// Not worth a look before the tiles are looked at one by one.
    Doubtful,
}

/// What a sweep found.
struct Swept {
    /// Fastest signal, m/s.
    speed: f64,
    flags: u32,
    /// Whether all water that is awake was calm and the step is one that its state before allows.
    granted: bool,
    in_place: bool,
    /// What is known of the new state.
    calm: Calm,
}

impl<T: Real> Lattice<T> {
    pub(super) fn new(water: FiniteVolume<T>, settings: LatticeSettings) -> Self {
        let zeros = vec![vec![T::ZERO; water.layout().len()]; MOMENTS];
        Self {
            settings,
            next: zeros.clone(),
            moments: zeros,
            calm: Calm::Unknown,
            stale: false,
            moved: vec![true; water.tiles.len()],
            water,
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
        self.calm = Calm::Unknown;
        self.stale = false;
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
    /// solver's scale. Where all water is calm that is asked of the state before the step: it cannot change much.
    pub(super) fn try_step(&mut self, time: f64, dt: f64, courant: f64) -> Result<Stepped, Refusal> {
        let may = self.water.fastest() * dt <= courant * self.water.spacing;
        let swept = self.sweep(time, dt, may);
        let Swept { speed, flags, .. } = swept;
        if flags & flag::BROKEN != 0 || !(speed < SPEED_LIMIT) {
            if swept.in_place {
                // Where the broken values are looked for.
                self.water.next.clone_from(&self.water.now);
            }
            return Err(Refusal::Broken);
        }
        if !swept.granted && speed * dt > courant * self.water.spacing {
            return Err(Refusal::TooFast(speed));
        }
        if !swept.in_place {
            std::mem::swap(&mut self.water.now, &mut self.water.next);
            std::mem::swap(&mut self.moments, &mut self.next);
        }
        self.stale = swept.in_place;
        self.calm = swept.calm;
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

    /// Steps all water: in place where all of it is calm, else every tile that is awake from `now` to `next`. `may`
    /// says that the state before allows the step.
    fn sweep(&mut self, time: f64, dt: f64, may: bool) -> Swept {
        let k = self.constants(dt);
        let volume = self.water.constants(dt);
        let (base, film) = (self.water.base, self.water.film());
        self.water
            .boundary
            .fill(time + 0.5 * dt, base, film, &self.water.bed, &mut self.water.now);
        self.fill_ghosts();
        let weight = T::from_f64(DEFAULT_COURANT / self.settings.courant);
        if std::mem::take(&mut self.water.touched) && self.calm == Calm::Inside {
            self.calm = Calm::Unknown;
        }
        let awake = self.water.tiles.iter().filter(|t| t.awake).count();
        let calm = may && 2 * awake > self.water.tiles.len() && self.is_calm(&k);
        let (granted, next) = if calm {
            let inside = self.step_in_place(&k, &volume, weight);
            (true, if inside { Calm::Inside } else { Calm::Doubtful })
        } else {
            let all = self.step_tiles(&k, &volume, weight);
            let unknown = all && awake == self.water.tiles.len();
            (may && all, if unknown { Calm::Unknown } else { Calm::Doubtful })
        };
        Swept {
            speed: self.water.fastest(),
            flags: self.water.tiles.iter().fold(0, |all, t| all | t.outcome.flags),
            granted,
            in_place: calm,
            calm: next,
        }
    }

    /// Whether all water is calm, as far as it is worth finding out.
    fn is_calm(&mut self, k: &Constants<T>) -> bool {
        if self.water.boundary.foreign().contains(&true) {
            return false;
        }
        match self.calm {
            Calm::Doubtful => false,
            Calm::Inside => in_place::calm_at_edges(k, &self.source(), self.water.layout),
            Calm::Unknown => self.survey(k),
        }
    }

    /// Looks at every tile: whether all are calm, and which move.
    fn survey(&mut self, k: &Constants<T>) -> bool {
        let mut moved = std::mem::take(&mut self.moved);
        let (layout, tiles_x) = (self.water.layout, self.water.tiles_x);
        let bands = moved.len() / tiles_x;
        let source = self.source();
        let arch = pulp::Arch::new();
        let calm = moved
            .par_iter_mut()
            .enumerate()
            .map_init(Scratch::new, |scratch, (t, moved)| {
                let extent = in_place::extent(layout, tiles_x, bands, t);
                let (calm, moves) = arch.dispatch(Look {
                    k,
                    source: &source,
                    extent,
                    scratch,
                });
                *moved = moves;
                calm
            })
            .reduce(|| true, |a, b| a & b);
        self.moved = moved;
        calm
    }

    /// The present state, with its ghosts filled.
    fn source(&self) -> Source<'_, T> {
        let water = &self.water;
        let layout = water.layout;
        let foreign = water.boundary.foreign();
        let known = |low: bool, high: bool, count: usize, all: usize| {
            (if low { GHOSTS } else { 0 })..(if high { GHOSTS + count } else { all })
        };
        Source {
            h: &water.now.h,
            qx: &water.now.qx,
            qz: &water.now.qz,
            z: &water.bed,
            moments: std::array::from_fn(|m| &self.moments[m][..]),
            stride: layout.stride,
            columns: known(foreign[0], foreign[1], layout.nx, layout.stride),
            rows: known(foreign[2], foreign[3], layout.nz, layout.nz + 2 * GHOSTS),
        }
    }

    /// Steps every tile that is awake from `now` to `next`; whether all of these were calm.
    fn step_tiles(
        &mut self,
        k: &Constants<T>,
        volume: &super::finite_volume::kernels::Constants<T>,
        weight: T,
    ) -> bool {
        let layout = self.water.layout;
        let tiles_x = self.water.tiles_x;
        let bands = self.water.tiles.len() / tiles_x;
        let interior = layout.interior();
        let mut into = std::mem::replace(&mut self.water.next, Fields::none());
        let mut moments = std::mem::take(&mut self.next);
        let mut tiles = std::mem::take(&mut self.water.tiles);
        let mut planes: Vec<&mut [T]> = [&mut into.h, &mut into.qx, &mut into.qz]
            .into_iter()
            .chain(&mut moments)
            .map(|plane| &mut plane[interior.clone()])
            .collect();
        let mut jobs = Vec::with_capacity(bands);
        for (band, tiles) in tiles.chunks_mut(tiles_x).enumerate() {
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
            jobs.push((sink, band, tiles));
        }
        let (source, stale) = (self.source(), self.stale);
        let arch = pulp::Arch::new();
        let calm = jobs
            .into_par_iter()
            .map_init(Scratch::new, |scratch, (mut sink, band, tiles)| {
                let mut all = true;
                for (t, tile) in tiles.iter_mut().enumerate() {
                    if !tile.awake && !stale {
                        continue;
                    }
                    let (outcome, calm) = arch.dispatch(TileStep {
                        k,
                        volume,
                        source: &source,
                        sink: &mut sink,
                        extent: in_place::extent(layout, tiles_x, bands, band * tiles_x + t),
                        scratch,
                        weight,
                    });
                    tile.outcome = outcome;
                    all &= calm | !tile.awake;
                }
                all
            })
            .reduce(|| true, |a, b| a & b);
        self.water.next = into;
        self.next = moments;
        self.water.tiles = tiles;
        calm
    }
}

/// A look at one tile as something that can be compiled for several instruction sets: whether it is calm, and whether
/// anything moves in it.
struct Look<'a, T> {
    k: &'a Constants<T>,
    source: &'a Source<'a, T>,
    extent: volume_step::Extent,
    scratch: &'a mut Scratch<T>,
}

impl<T: Real> pulp::WithSimd for Look<'_, T> {
    type Output = (bool, bool);

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) -> (bool, bool) {
        let Self {
            k,
            source,
            extent,
            scratch,
        } = self;
        let calm = tile::look(k, source, extent, scratch) == Water::Calm;
        (calm, calm && tile::moves(source, extent))
    }
}

/// The step of one tile in the same way, and whether it was calm.
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
    type Output = (Outcome<T>, bool);

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) -> (Outcome<T>, bool) {
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
                (outcome, true)
            }
            Water::Mixed => (tile::mix(k, volume, source, sink, extent, scratch), false),
            Water::Restless => (tile::restless(volume, source, sink, extent, scratch), false),
        }
    }
}
