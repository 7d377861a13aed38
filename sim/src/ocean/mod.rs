//! An ocean as the sum of many linear waves with random phases (Tessendorf 2001; Horvath 2015), in SI units.
//!
//! A scene names wind seas and swells, each with a frequency [`spectrum`] and a directional [`spreading`]; together they
//! are a [`sea::WaveField`]. It is drawn onto one or several periodic patches (a [`lattice`] of wave numbers each, with
//! disjoint bands whose variances add), and a frame is the sum of their Fourier transforms ([`transform`], [`patch`]) at
//! the frame's time, taken to the frame's samples ([`placement`]). Phases are kept in double precision: a wave is as
//! exact after a day as at the start. 4 √(variance) is the significant wave height that the spectrum says.
//!
//! Nothing acts on these waves: no event, no shore. As a layer over a solver with a shore they fade where it is shallow.

mod foam;
mod from_scene;
pub mod lattice;
pub mod patch;
mod placement;
pub mod query;
pub mod sea;
pub mod snapshot;
pub mod spectrum;
pub mod spreading;
#[cfg(test)]
mod tests;
pub mod transform;

pub use query::SurfacePoint;
pub use snapshot::{Sampler, Sampling, Snapshot};

use crate::events::{Action, EventError};
use crate::frame::{Channels, Frame};
use crate::grid::{Grid, GridSpec};
use crate::solver::{Solver, StepError, StepReport};
use foam::Foam;
use glam::{DVec2, UVec2, Vec2};
use patch::{Field, Patch, Work};
use placement::{Placement, Planes, Sample};
use rayon::prelude::*;
use rustfft::num_complex::Complex32;
use std::cell::RefCell;

/// What to use where the water has to react.
const REACTING: &str = "put the ocean as a [[layer]] over `wave-equation` or `shallow-water`, which react";

/// An ocean.
pub struct Ocean {
    spec: GridSpec,
    level: f32,
    /// Depth of the water in metres; `None` for deep water.
    depth: Option<f64>,
    ground: Option<Grid<f32>>,
    choppiness: f64,
    /// Ticks of [`TICK`] a loop.
    loop_ticks: Option<i64>,
    cascades: Vec<Cascade>,
    /// Variance of the whole sea in m², waves of every length included.
    sea_variance: f64,
    time: f64,
    /// Work space of each cascade; filled when a frame is asked for.
    work: RefCell<Vec<(Work, Planes)>>,
    foam: Option<RefCell<Foam>>,
}

/// Seconds by which an ocean that repeats moves on: steps are `f32`, so the clock is off by their rounding, and without
/// ticks the second round would be off by that much.
const TICK: f64 = 1.0 / (1 << 20) as f64;

/// A patch and where its samples stand.
struct Cascade {
    patch: Patch,
    place: Placement,
    band: (f64, f64),
}

/// What one patch of an ocean holds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Band {
    /// Period along X and Z in metres.
    pub period: DVec2,
    /// Samples along X and Z.
    pub size: UVec2,
    /// Wave numbers in rad/m: from the first up to below the second.
    pub wave_numbers: (f64, f64),
    /// Variance expected of its waves, m².
    pub variance: f64,
}

/// How far a surface has folded over itself.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fold {
    /// Share of the samples whose surface element is turned over, J < 0.
    pub share: f64,
    /// Smallest J: the area that a surface element has left, 1 at rest.
    pub smallest: f64,
}

impl Ocean {
    /// Significant wave height 4 √m0 in metres of the waves that the patches hold, as the spectrum expects it.
    pub fn significant_height(&self) -> f64 {
        4.0 * self.bands().map(|b| b.variance).sum::<f64>().sqrt()
    }

    /// Significant wave height in metres of the whole sea: more than [`Self::significant_height`] by the waves that are
    /// too long or too short for the patches.
    pub fn sea_height(&self) -> f64 {
        4.0 * self.sea_variance.sqrt()
    }

    /// The patches, longest waves first.
    pub fn bands(&self) -> impl Iterator<Item = Band> + '_ {
        self.cascades.iter().map(|c| {
            let lattice = c.patch.lattice();
            Band {
                period: lattice.period,
                size: lattice.size,
                wave_numbers: c.band,
                variance: lattice.variance,
            }
        })
    }

    /// How far the surface is folded at `time` seconds.
    pub fn fold(&self, time: f64) -> Fold {
        let mut j = Vec::new();
        self.jacobian(self.moment(time), &mut j);
        let over = j.iter().filter(|j| **j < 0.0).count();
        Fold {
            share: over as f64 / j.len().max(1) as f64,
            smallest: f64::from(j.iter().copied().fold(f32::INFINITY, f32::min)),
        }
    }

    /// Time as patches take it: seconds, or the fraction of the loop.
    fn moment(&self, time: f64) -> f64 {
        match self.loop_ticks {
            Some(ticks) => ((time / TICK).round() as i64).rem_euclid(ticks) as f64 / ticks as f64,
            None => time,
        }
    }

    /// Turns the waves of every cascade as far as `fields` need it.
    fn turn(&self, moment: f64, fields: &[Field]) {
        for (cascade, (work, _)) in self.cascades.iter().zip(&mut *self.work.borrow_mut()) {
            cascade.patch.turn(moment, fields, work);
        }
    }

    /// Hands each row of the frame's samples of `fields` at the moment of the last [`Self::turn`], summed over the cascades, to
    /// `write` with its part of `out`.
    fn sample<T: Sample, U: Send>(
        &self,
        fields: T::Fields,
        out: &mut [U],
        write: impl Fn(&[T], &mut [U]) + Sync,
    ) {
        let (w, h) = (self.spec.width(), self.spec.height());
        let mut works = self.work.borrow_mut();
        if let ([cascade], [(work, _)]) = (&self.cascades[..], &mut works[..])
            && cascade.place.is_direct(w, h)
        {
            let write = |row: &[T], out: &mut [U]| write(&row[..w], out);
            return T::make(fields, &cascade.patch, work, h, out, write);
        }
        let cascades = self.cascades.iter().zip(&mut *works);
        let places: Vec<(&Placement, &[T])> = cascades
            .map(|(cascade, (work, planes))| {
                let size = cascade.patch.lattice().size.as_usizevec2();
                let plane = T::plane(planes);
                plane.resize(size.element_product(), T::default());
                T::make(fields, &cascade.patch, work, size.y, plane, |row, out| {
                    out.copy_from_slice(row);
                });
                (&cascade.place, &plane[..])
            })
            .collect();
        out.par_chunks_mut(w).enumerate().for_each_init(
            || (vec![T::default(); w], Vec::new()),
            |(sum, work), (j, out)| {
                sum.fill(T::default());
                for (place, plane) in &places {
                    place.add(plane, j, work, sum);
                }
                write(sum, out);
            },
        );
    }

    /// J at the samples.
    fn jacobian(&self, moment: f64, out: &mut Vec<f32>) {
        use Field::{StretchXX, StretchXZ, StretchZZ};
        let c = self.choppiness as f32;
        out.resize(self.spec.len(), 1.0);
        self.turn(moment, &[StretchXZ, StretchXX, StretchZZ]);
        self.sample(StretchXZ, out, |xz: &[f32], out| out.copy_from_slice(xz));
        self.sample((StretchXX, StretchZZ), out, |stretch: &[Complex32], out| {
            for (out, s) in out.iter_mut().zip(stretch) {
                *out = (1.0 + c * s.re) * (1.0 + c * s.im) - c * c * *out * *out;
            }
        });
    }
}

impl Solver for Ocean {
    fn name(&self) -> &'static str {
        "ocean"
    }

    fn spec(&self) -> GridSpec {
        self.spec
    }

    fn time(&self) -> f64 {
        self.time
    }

    /// Velocity is that of the surface points, not the mean over the depth.
    fn offers(&self) -> Channels {
        let mut channels = Channels::VELOCITY;
        if self.choppiness > 0.0 {
            channels |= Channels::DISPLACEMENT;
        }
        if self.ground.is_some() || self.depth.is_some() {
            channels |= Channels::DEPTH;
        }
        if self.foam.is_some() {
            channels |= Channels::FOAM;
        }
        channels
    }

    fn advance(&mut self, dt: f32) -> Result<StepReport, StepError> {
        StepError::check_step(dt)?;
        self.time += f64::from(dt);
        Ok(StepReport {
            substeps: 1,
            ..self.report()
        })
    }

    fn extract(&self, want: Channels, out: &mut Frame) {
        let want = want & self.offers();
        out.prepare(self.spec, want);
        out.time = self.time;
        let moment = self.moment(self.time);
        let displacement = (Field::DisplacementX, Field::DisplacementZ);
        let velocity = (Field::VelocityX, Field::VelocityZ);
        let mut fields = vec![Field::Elevation];
        if want.contains(Channels::VELOCITY) {
            fields.push(Field::VelocityX);
        }
        self.turn(moment, &fields);
        let level = self.level;
        self.sample(
            Field::Elevation,
            out.elevation.as_mut_slice(),
            |row: &[f32], out| {
                for (out, v) in out.iter_mut().zip(row) {
                    *out = level + v;
                }
            },
        );
        let vectors = |grid: &mut Option<Grid<Vec2>>, fields, factor: f32| {
            let Some(grid) = grid else { return };
            self.sample(fields, grid.as_mut_slice(), |row: &[Complex32], out| {
                for (out, v) in out.iter_mut().zip(row) {
                    *out = factor * Vec2::new(v.re, v.im);
                }
            });
        };
        vectors(&mut out.displacement, displacement, self.choppiness as f32);
        vectors(&mut out.velocity, velocity, 1.0);
        if let (Some(grid), Some(foam)) = (&mut out.foam, &self.foam) {
            let period = self.loop_ticks.map(|ticks| ticks as f64 * TICK);
            let time = period.map_or(self.time, |period| moment * period);
            let mut jacobian = |t: f64, j: &mut Vec<f32>| self.jacobian(self.moment(t), j);
            foam.borrow_mut().at(time, &mut jacobian, grid.as_mut_slice());
        }
        if let Some(depth) = &mut out.depth {
            let (elevation, rest) = (
                out.elevation.as_slice(),
                self.depth.unwrap_or(0.0) as f32 - self.level,
            );
            let ground = self.ground.as_ref().map(Grid::as_slice);
            for (k, depth) in depth.as_mut_slice().iter_mut().enumerate() {
                *depth = ground
                    .map_or(elevation[k] + rest, |g| elevation[k] - g[k])
                    .max(0.0);
            }
        }
    }

    fn apply(&mut self, action: &Action) -> Result<(), EventError> {
        Err(EventError::Unsupported {
            solver: self.name(),
            action: action.name(),
            remedy: REACTING,
        })
    }

    /// Energy and momentum are those of this draw's waves, averaged over the patch, which do not change; the mean level
    /// is that of still water, so the mass relative to rest is 0.
    fn report(&self) -> StepReport {
        let area = self.spec.cell_area() * self.spec.len() as f64;
        let mut report = StepReport {
            largest_stable_step: f64::INFINITY,
            ..StepReport::default()
        };
        for cascade in &self.cascades {
            let lattice = cascade.patch.lattice();
            report.energy += area * lattice.energy;
            report.momentum[0] += area * lattice.momentum.x;
            report.momentum[1] += area * lattice.momentum.y;
        }
        report
    }

    fn bytes(&self) -> u64 {
        let cascades: u64 = self
            .cascades
            .iter()
            .map(|c| c.patch.bytes() + c.place.bytes())
            .sum();
        let work: u64 = (self.work.borrow().iter())
            .map(|(work, planes)| work.bytes() + planes.bytes())
            .sum();
        let ground = self.ground.as_ref().map_or(0, |g| 4 * g.spec().len() as u64);
        cascades + work + ground + self.foam.as_ref().map_or(0, |f| f.borrow().bytes())
    }
}
