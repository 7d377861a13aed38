//! Breaking waves throw droplets, which fly, fall back and make foam.
//!
//! Grid and droplets hold the same water: depth, momentum and energy go from one to the other through
//! [`Exchange`], and [`Ledger`] says what went anywhere else. The method follows Chentanez & Müller 2010 and Ojeda &
//! Susín 2013 in its parts (breaking cells, ballistic droplets, foam where they fall); thresholds and amounts are those
//! of breaking waves instead of those of a grid.

mod breaking;
mod flight;
mod foam;
mod landing;
mod ledger;
#[cfg(test)]
mod tests;

pub use ledger::Ledger;

use super::checkpoint::SplashMemory;
use super::edges::{Condition, Edges};
use super::exchange::Exchange;
use super::settings::SetupError;
use crate::frame::Droplets;
use crate::grid::{Grid, GridSpec};
use crate::reduce;
use crate::solvers::GRAVITY;
use flight::Flock;
use foam::Foam;
use glam::Vec3;
use rayon::prelude::*;

/// Density of water, kg/m³.
const DENSITY: f64 = 1000.0;
/// Default radius of a droplet in spacings.
const RADIUS: f64 = 0.1;
/// Largest default radius of a droplet in depths of the water that throws it: the lip of a plunging breaker is about a
/// tenth of the depth thick, whatever the spacing of the grid.
const RADIUS_OF_DEPTH: f64 = 0.05;

/// What is splashed and how.
#[derive(Clone, Debug, PartialEq)]
pub struct SplashSettings {
    /// Slope of the surface above which a running front breaks, > 0; 0.36 is a front of 20°.
    pub slope: f64,
    /// Share of the water that rises in a breaking cell which leaves as droplets, 0 to 1.
    pub amount: f64,
    /// Mean radius of a droplet, m; default: a tenth of the spacing, but at most a twentieth of the depth where it is
    /// thrown.
    pub droplet_radius: Option<f64>,
    /// Most droplets in flight; 0 for none. What would be thrown beyond stays in the water and is counted.
    pub max_droplets: usize,
    /// Time in seconds in which foam fades to 1/e; absent: no foam.
    pub foam_life: Option<f64>,
    /// Seed of sizes and directions.
    pub seed: u64,
}

impl Default for SplashSettings {
    fn default() -> Self {
        Self {
            slope: 0.36,
            amount: 0.05,
            droplet_radius: None,
            max_droplets: 20_000,
            foam_life: Some(4.0),
            seed: 0,
        }
    }
}

impl SplashSettings {
    /// Checks every parameter.
    ///
    /// # Errors
    /// [`SetupError::Parameter`].
    pub(crate) fn check(&self) -> Result<(), SetupError> {
        for (name, value, sound, range) in [
            (
                "splash.slope",
                self.slope,
                self.slope > 0.0 && self.slope <= 100.0,
                "above 0 and at most 100",
            ),
            (
                "splash.amount",
                self.amount,
                (0.0..=1.0).contains(&self.amount),
                "between 0 and 1",
            ),
            (
                "splash.droplet_radius",
                self.droplet_radius.unwrap_or(1.0),
                self.droplet_radius.is_none_or(|r| r > 0.0 && r <= 1e4),
                "above 0 and at most 1e4 m",
            ),
            (
                "splash.max_droplets",
                self.max_droplets as f64,
                self.max_droplets <= 10_000_000,
                "at most 1e7",
            ),
            (
                "splash.foam_life",
                self.foam_life.unwrap_or(1.0),
                self.foam_life.is_none_or(|t| t > 0.0 && t <= 1e9),
                "a positive time in seconds",
            ),
        ] {
            if !sound {
                return Err(SetupError::Parameter { name, value, range });
            }
        }
        Ok(())
    }
}

/// What an edge does to droplets.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Wall {
    Bounces,
    Repeats,
    Leaves,
}

impl From<&Condition> for Wall {
    fn from(condition: &Condition) -> Self {
        match condition {
            Condition::Wall => Self::Bounces,
            Condition::Periodic => Self::Repeats,
            _ => Self::Leaves,
        }
    }
}

/// Droplets and foam over a grid of water.
pub(crate) struct Splash {
    settings: SplashSettings,
    size: [usize; 2],
    /// Position of the first sample, m.
    origin: [f64; 2],
    spacing: f64,
    /// At the smaller and the larger coordinate, along X and Z.
    walls: [[Wall; 2]; 2],
    flock: Flock,
    foam: Option<Foam>,
    /// Water that landed but did not make a whole quantum, m over one cell.
    carry: f64,
    /// Sub-steps so far: with the cell's number, the key of its random numbers.
    steps: u64,
    /// In units of depth over one cell and of density 1; [`Self::ledger`] has them in SI.
    books: Ledger,
}

/// Energy of a column per area and density relative to still water at `level`, m³/s².
fn column_energy(h: f64, q: [f64; 2], bed: f64, level: f64) -> f64 {
    let kinetic = if h > 0.0 {
        (q[0] * q[0] + q[1] * q[1]) / h
    } else {
        0.0
    };
    let eta = bed + h - level;
    0.5 * (kinetic + GRAVITY * eta * eta)
}

/// What droplets hold.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Held {
    /// kg.
    pub(crate) mass: f64,
    /// kg m/s.
    pub(crate) momentum: [f64; 2],
    /// J, relative to water at a level.
    pub(crate) energy: f64,
}

impl Splash {
    pub(crate) fn new(spec: &GridSpec, edges: &Edges, settings: SplashSettings) -> Self {
        let size = [spec.width(), spec.height()];
        let spacing = f64::from(spec.spacing);
        let wraps = [&edges.x_min, &edges.z_min].map(|c| *c == Condition::Periodic);
        let foam = settings
            .foam_life
            .map(|life| Foam::new(size, spacing, wraps, life));
        Self {
            size,
            origin: [f64::from(spec.origin.x), f64::from(spec.origin.y)],
            spacing,
            walls: [
                [(&edges.x_min).into(), (&edges.x_max).into()],
                [(&edges.z_min).into(), (&edges.z_max).into()],
            ],
            flock: Flock::default(),
            foam,
            carry: 0.0,
            steps: 0,
            books: Ledger::default(),
            settings,
        }
    }

    /// Mean volume of a droplet that leaves water of `depth` m, as depth over one cell, m.
    fn droplet_height(&self, depth: f64) -> f64 {
        let by_default = (RADIUS * self.spacing).min(RADIUS_OF_DEPTH * depth);
        let radius = self.settings.droplet_radius.unwrap_or(by_default);
        4.0 / 3.0 * std::f64::consts::PI * radius.powi(3) / (self.spacing * self.spacing)
    }

    /// Whether there is foam.
    pub(crate) fn has_foam(&self) -> bool {
        self.foam.is_some()
    }

    /// Whether there may be droplets.
    pub(crate) fn has_droplets(&self) -> bool {
        self.settings.max_droplets > 0
    }

    /// Adds a droplet of `volume` m³ from outside, for tests and studies.
    #[cfg(test)]
    fn add(&mut self, position: [f64; 3], velocity: [f64; 3], volume: f64) {
        let radius = (0.75 * volume / std::f64::consts::PI).cbrt();
        self.flock
            .push(position, velocity, volume / (self.spacing * self.spacing), radius);
    }

    /// What happens in the `dt` s that the water has just been stepped by: droplets fly and fall, foam drifts, waves
    /// break. `level` is the elevation to which energies are relative. Returns the droplets that were not thrown
    /// because too many flew.
    pub(crate) fn step<E: Exchange + Sync + ?Sized>(
        &mut self,
        water: &mut E,
        film: f64,
        level: f64,
        dt: f64,
    ) -> u64 {
        let before = self.books.suppressed;
        if self.flock.len() > 0 {
            landing::fly_all(self, dt);
            landing::settle(self, water, level);
        }
        let seen = breaking::look(self, water, film, dt);
        if let Some(foam) = &mut self.foam {
            let water = &*water;
            foam.advance(dt, seen.fastest, |i, j| {
                let h = water.depth(i, j);
                if h > film {
                    water.discharge(i, j).map(|q| q / h)
                } else {
                    [0.0; 2]
                }
            });
        }
        breaking::throw(self, water, &seen.breaks, level);
        self.steps += 1;
        self.books.suppressed - before
    }

    /// Totals of the droplets, with what waits to make a whole quantum.
    pub(crate) fn held(&self, level: f64) -> Held {
        let flock = &self.flock;
        let sum = |value: &(dyn Fn(usize) -> f64 + Sync)| reduce::sum(flock.len(), value);
        let weight = DENSITY * self.spacing * self.spacing;
        Held {
            mass: weight * (sum(&|k| flock.height[k]) + self.carry),
            momentum: [0, 2].map(|a| weight * sum(&|k| flock.height[k] * flock.velocity[k][a])),
            energy: weight
                * sum(&|k| {
                    let square: f64 = flock.velocity[k].iter().map(|v| v * v).sum();
                    flock.height[k] * (0.5 * square + GRAVITY * (flock.position[k][1] - level))
                }),
        }
    }

    /// The books in SI units.
    pub(crate) fn ledger(&self) -> Ledger {
        let area = self.spacing * self.spacing;
        let weight = DENSITY * area;
        let b = self.books;
        Ledger {
            lost_volume: area * b.lost_volume,
            lost_momentum: b.lost_momentum.map(|p| weight * p),
            air_momentum: b.air_momentum.map(|p| weight * p),
            wall_momentum: b.wall_momentum.map(|p| weight * p),
            rounded_momentum: b.rounded_momentum.map(|p| weight * p),
            breaking_energy: weight * b.breaking_energy,
            air_energy: weight * b.air_energy,
            impact_energy: weight * b.impact_energy,
            lost_energy: weight * b.lost_energy,
            ..b
        }
    }

    pub(crate) fn bytes(&self) -> usize {
        self.flock.bytes() + self.foam.as_ref().map_or(0, Foam::bytes)
    }

    /// Writes the droplets into a frame's channel.
    pub(crate) fn show_droplets(&self, out: &mut Droplets) {
        out.clear();
        let narrow = |v: &[f64; 3]| Vec3::new(v[0] as f32, v[1] as f32, v[2] as f32);
        out.position.extend(self.flock.position.iter().map(narrow));
        out.velocity.extend(self.flock.velocity.iter().map(narrow));
        out.radius.extend(self.flock.radius.iter().map(|&r| r as f32));
    }

    /// Writes the foam into a frame's channel.
    pub(crate) fn show_foam(&self, out: &mut Grid<f32>) {
        if let Some(foam) = &self.foam {
            let rows = out.as_mut_slice().par_chunks_mut(self.size[0]);
            rows.enumerate().for_each(|(j, row)| foam.show(j, row));
        }
    }

    /// Everything that the further run depends on.
    pub(crate) fn memory(&self) -> SplashMemory {
        let (pending, cover) = self.foam.as_ref().map(Foam::memory).unzip();
        SplashMemory {
            position: self.flock.position.clone(),
            velocity: self.flock.velocity.clone(),
            height: self.flock.height.clone(),
            radius: self.flock.radius.clone(),
            carry: self.carry,
            steps: self.steps,
            ledger: self.books,
            foam_pending: pending.unwrap_or(0.0),
            foam: cover.map(<[f32]>::to_vec).unwrap_or_default(),
        }
    }

    /// Goes on from a memory that [`SplashMemory::check`] found sound.
    pub(crate) fn resume(&mut self, memory: &SplashMemory) {
        self.flock = Flock {
            position: memory.position.clone(),
            velocity: memory.velocity.clone(),
            height: memory.height.clone(),
            radius: memory.radius.clone(),
        };
        self.carry = memory.carry;
        self.steps = memory.steps;
        self.books = memory.ledger;
        if let Some(foam) = &mut self.foam {
            foam.resume(memory.foam_pending, &memory.foam);
        }
    }

    /// Values of foam that a memory of this run must hold.
    pub(crate) fn foam_len(&self) -> usize {
        if self.foam.is_some() {
            self.size[0] * self.size[1]
        } else {
            0
        }
    }
}
