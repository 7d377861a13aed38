//! From event to event: splitting, reflection, leaving and culling, each at its closed-form time.
//!
//! Particles do not act on each other, so each carries the time of its own next event; those that are due are taken
//! through all their events in turn, with their descendants, on any thread and in any order.

use super::kernel::VOLUME;
use super::ledger::Ledger;
use super::particle::{Particle, Particles};
use super::walls::Walls;
use crate::grid::GridSpec;
use glam::DVec2;
use rayon::prelude::*;
use std::f64::consts::TAU;
use std::sync::atomic::{AtomicU64, Ordering};

/// Walls that a particle may meet while it travels one radius, before it counts as stuck in a cusp. A wedge of angle θ
/// turns a ray back after π/θ; this is one of 0.04°.
const MOST_BOUNCES: u32 = 4096;

/// Walls that one sideways step of a split may meet.
const MOST_FOLDS: u32 = 64;

/// Events in one call of `advance`, over all particles; some minutes of work.
pub(super) const MOST_EVENTS: u64 = 300_000_000;

/// What happens at an edge of the rectangle, other than a wall.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Beyond {
    /// Nothing: a wall stands there.
    Wall,
    /// A particle leaves once no part of it is inside.
    Open,
    /// It comes in at the other side.
    Wrap,
}

/// What the particles run through, and by what rules.
#[derive(Clone, Debug)]
pub(super) struct Course {
    pub(super) spec: GridSpec,
    /// Samples with water at rest.
    pub(super) wet: Vec<bool>,
    pub(super) walls: Walls,
    /// The rectangle of water.
    pub(super) low: DVec2,
    pub(super) high: DVec2,
    /// x_min, x_max, z_min, z_max.
    pub(super) beyond: [Beyond; 4],
    /// Wave speed, m/s.
    pub(super) speed: f64,
    /// Spacing, in radii, at which a front splits.
    pub(super) split: f64,
    /// Amplitude, metres, below which a particle is dropped instead of split.
    pub(super) smallest: f64,
    /// Most particles.
    pub(super) limit: usize,
}

/// Why a flight was given up. Nothing was changed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Overrun {
    /// More particles than the limit.
    Particles,
    /// More events than [`MOST_EVENTS`].
    Events,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Event {
    Split,
    Wall(usize),
    /// Crosses this edge of a periodic rectangle.
    Wrap(usize),
    Leave,
}

/// Survivors of a batch with the times of their next events, and what became of the others.
#[derive(Clone, Debug, Default)]
struct Landing {
    flying: Vec<(Particle, f64)>,
    ledger: Ledger,
    events: u64,
}

/// Counts shared by the batches of one flight.
struct Tally {
    events: AtomicU64,
    particles: AtomicU64,
    limit: u64,
}

impl Tally {
    fn overrun(&self) -> Option<Overrun> {
        if self.particles.load(Ordering::Relaxed) > self.limit {
            Some(Overrun::Particles)
        } else if self.events.load(Ordering::Relaxed) > MOST_EVENTS {
            Some(Overrun::Events)
        } else {
            None
        }
    }
}

impl Course {
    /// Time and kind of the next event; infinite if there is none.
    fn next_event(&self, p: &Particle) -> (f64, Event) {
        let split = p.split_time(self.split * p.radius, self.speed);
        let mut best = (split, Event::Split);
        let u = p.direction;
        for edge in 0..4 {
            let (axis, outwards) = (edge / 2, if edge % 2 == 1 { 1.0 } else { -1.0 });
            let approach = u[axis] * outwards;
            if !(approach > 0.0) {
                continue;
            }
            let bound = if edge % 2 == 1 { self.high } else { self.low };
            let (margin, event) = match self.beyond[edge] {
                Beyond::Wall => continue,
                Beyond::Open => (p.radius, Event::Leave),
                Beyond::Wrap => (0.0, Event::Wrap(edge)),
            };
            let distance = (((bound[axis] - p.base[axis]) * outwards + margin) / approach).max(0.0);
            let time = p.since + distance / self.speed;
            if time < best.0 {
                best = (time, event);
            }
        }
        let reach = (best.0 - p.since) * self.speed;
        if let Some((distance, wall)) = self.walls.first_hit(p.base, u, reach) {
            best = (p.since + distance / self.speed, Event::Wall(wall));
        }
        best
    }

    /// Moves from `from` by `step`, mirrored at every wall on the way, together with a direction. `None` if there is no
    /// end of walls.
    pub(super) fn fold(&self, from: DVec2, step: DVec2, direction: DVec2) -> Option<(DVec2, DVec2)> {
        let (mut p, mut left) = (from, step.length());
        if !(left > 0.0) {
            return Some((from, direction));
        }
        let (mut along, mut direction) = (step / left, direction);
        for _ in 0..MOST_FOLDS {
            let Some((distance, wall)) = self.walls.first_hit(p, along, left) else {
                return Some((p + left * along, direction));
            };
            let wall = self.walls.segment(wall);
            p += distance * along;
            left -= distance;
            along = wall.reflect(along).normalize_or(along);
            direction = wall.reflect(direction).normalize_or(direction);
        }
        None
    }

    /// Whether there is water at a point: in the rectangle, and in front of the walls between it and a sample of its cell
    /// that is wet.
    pub(super) fn is_water(&self, p: DVec2) -> bool {
        if !(p.cmpge(self.low).all() && p.cmple(self.high).all()) {
            return false;
        }
        let spacing = f64::from(self.spec.spacing);
        let last = self.spec.size.as_dvec2() - 1.0;
        let g = (p - self.spec.origin.as_dvec2()) / spacing;
        let first = g.floor().clamp(DVec2::ZERO, last);
        let second = g.ceil().clamp(DVec2::ZERO, last);
        let corners = [
            first,
            DVec2::new(second.x, first.y),
            DVec2::new(first.x, second.y),
            second,
        ];
        let wet = |c: &&DVec2| self.wet[c.y as usize * self.spec.width() + c.x as usize];
        let place = |c: &DVec2| self.spec.origin.as_dvec2() + spacing * *c;
        corners
            .iter()
            .find(wet)
            .is_some_and(|c| self.walls.is_open(p, place(c)))
    }

    /// A particle turned by part of the angle to its neighbour, about the focus of the front.
    fn child(&self, p: &Particle, turn: f64) -> Option<Particle> {
        let direction = DVec2::from_angle(turn)
            .rotate(p.direction)
            .normalize_or(p.direction);
        let focus_distance = p.spacing / p.angle;
        let (base, direction) = self.fold(p.base, focus_distance * (direction - p.direction), direction)?;
        Some(Particle {
            base,
            direction,
            amplitude: p.amplitude / 3.0,
            spacing: p.spacing / 3.0,
            angle: p.angle / 3.0,
            ..*p
        })
    }

    /// The particle after an event at a wall or an edge.
    fn turned(&self, p: &Particle, since: f64, event: Event) -> Option<Particle> {
        let mut p = *p;
        match event {
            Event::Wall(wall) => {
                p.direction = self
                    .walls
                    .segment(wall)
                    .reflect(p.direction)
                    .normalize_or(p.direction);
            }
            Event::Wrap(edge) => {
                let axis = edge / 2;
                let period = self.high[axis] - self.low[axis];
                p.base[axis] += if edge % 2 == 1 { -period } else { period };
            }
            Event::Split | Event::Leave => return None,
        }
        p.patience -= self.speed * (p.since - since);
        if p.patience <= 0.0 {
            (p.patience, p.bounces) = (p.radius, 0);
        }
        p.bounces += 1;
        (p.bounces <= MOST_BOUNCES).then_some(p)
    }

    /// Takes one particle and its descendants to `until`.
    fn fly(&self, particle: Particle, until: f64, out: &mut Landing, tally: &Tally) {
        let mut waiting = vec![particle];
        while let Some(mut p) = waiting.pop() {
            loop {
                let (time, event) = self.next_event(&p);
                if !(time <= until) {
                    out.flying.push((p, time));
                    break;
                }
                out.events += 1;
                if out.events.is_multiple_of(1024) {
                    tally.events.fetch_add(1024, Ordering::Relaxed);
                    if tally.overrun().is_some() {
                        return;
                    }
                }
                let since = p.since;
                p = p.rebased(time, self.speed);
                let volume = VOLUME * p.radius * p.radius * p.shown(time, self.speed);
                match event {
                    Event::Split => {
                        if p.shown(time, self.speed).abs() / 3.0 < self.smallest {
                            out.ledger.cull(&p, time, self.speed);
                            break;
                        }
                        tally.particles.fetch_add(2, Ordering::Relaxed);
                        for turn in [-p.angle / 3.0, p.angle / 3.0] {
                            match self.child(&p, turn) {
                                Some(child) => waiting.push(child),
                                None => out.ledger.strand(volume / 3.0),
                            }
                        }
                        // The middle one goes on straight.
                        p.amplitude /= 3.0;
                        p.spacing /= 3.0;
                        p.angle /= 3.0;
                        // An angle that no longer changes anything is none: the front is straight.
                        if p.angle < 1e-12 {
                            p.angle = 0.0;
                        }
                    }
                    Event::Leave => {
                        out.ledger.leave(volume);
                        break;
                    }
                    Event::Wall(_) | Event::Wrap(_) => match self.turned(&p, since, event) {
                        Some(turned) => p = turned,
                        None => {
                            out.ledger.strand(volume);
                            break;
                        }
                    },
                }
            }
        }
    }

    /// Takes a batch to `until`, in order.
    fn fly_all(&self, batch: &[Particle], until: f64, tally: &Tally) -> Vec<Landing> {
        batch
            .par_chunks(64)
            .map(|chunk| {
                let mut landing = Landing::default();
                for particle in chunk {
                    self.fly(*particle, until, &mut landing, tally);
                }
                landing
            })
            .collect()
    }

    /// Adds new particles, taken to `until`.
    ///
    /// # Errors
    /// [`Overrun`]; nothing is then changed.
    pub(super) fn launch(
        &self,
        particles: &mut Particles,
        new: &[Particle],
        until: f64,
        ledger: &mut Ledger,
    ) -> Result<u64, Overrun> {
        let tally = Tally {
            events: AtomicU64::new(0),
            particles: AtomicU64::new((particles.len() + new.len()) as u64),
            limit: self.limit as u64,
        };
        if let Some(overrun) = tally.overrun() {
            return Err(overrun);
        }
        let landings = self.fly_all(new, until, &tally);
        if let Some(overrun) = tally.overrun() {
            return Err(overrun);
        }
        Ok(Self::land(particles, landings, ledger))
    }

    fn land(particles: &mut Particles, landings: Vec<Landing>, ledger: &mut Ledger) -> u64 {
        let mut events = 0;
        for landing in landings {
            for (particle, next) in landing.flying {
                particles.push(particle, next);
            }
            ledger.add(&landing.ledger);
            events += landing.events;
        }
        events
    }

    /// Takes all particles to `until`: those that are due, through their events. Returns the number of events.
    ///
    /// # Errors
    /// [`Overrun`]; nothing is then changed.
    pub(super) fn advance(
        &self,
        particles: &mut Particles,
        until: f64,
        ledger: &mut Ledger,
    ) -> Result<u64, Overrun> {
        let next = particles.next();
        let due: Vec<usize> = (0..next.len()).filter(|&k| next[k] <= until).collect();
        if due.is_empty() {
            return Ok(0);
        }
        let tally = Tally {
            events: AtomicU64::new(0),
            particles: AtomicU64::new(particles.len() as u64),
            limit: self.limit as u64,
        };
        let batch: Vec<Particle> = due.iter().map(|&k| particles.get(k)).collect();
        let landings = self.fly_all(&batch, until, &tally);
        if let Some(overrun) = tally.overrun() {
            return Err(overrun);
        }
        particles.remove(&due);
        Ok(Self::land(particles, landings, ledger))
    }
}

/// Angle between neighbours of a full circle of `count` particles.
pub(super) fn circle_angle(count: usize) -> f64 {
    TAU / count as f64
}
