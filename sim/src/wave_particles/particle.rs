//! One wave particle between two events, and many of them as plain arrays.
//!
//! A particle runs straight at the constant speed c, so everything about it is a closed form in the time since its last
//! event: nothing accumulates, and the front stands where theory says after any number of frames.

use glam::DVec2;
use serde::{Deserialize, Serialize};

/// A wave particle. Lengths in metres, times in seconds.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Particle {
    /// Where it was at `since`.
    pub(super) base: DVec2,
    /// Unit direction of travel.
    pub(super) direction: DVec2,
    /// Time of its last event.
    pub(super) since: f64,
    /// Distance to its neighbours along the front at `since`; negative where the front has its focus still ahead.
    pub(super) spacing: f64,
    /// Angle between the directions of neighbours, radians; 0 on a straight front.
    pub(super) angle: f64,
    /// Amplitude that carries its share of the front's volume.
    pub(super) amplitude: f64,
    pub(super) radius: f64,
    /// Distance from the focus at which the energy law scales the amplitude by 1; not positive: no scaling.
    pub(super) reference: f64,
    /// Wall events since it last travelled a radius: a bound on what a cusp can cost.
    pub(super) bounces: u32,
    /// Path length left until `bounces` is forgotten.
    pub(super) patience: f64,
}

impl Particle {
    /// Where it is at `time`.
    #[inline(always)]
    pub(super) fn position(&self, time: f64, speed: f64) -> DVec2 {
        self.base + speed * (time - self.since) * self.direction
    }

    /// Distance to its neighbours at `time`, negative before the focus.
    pub(super) fn spacing_at(&self, time: f64, speed: f64) -> f64 {
        self.spacing + self.angle * speed * (time - self.since)
    }

    /// Distance from the focus of its front, infinite on a straight one.
    pub(super) fn focus_distance(&self, time: f64, speed: f64) -> f64 {
        if self.angle > 0.0 {
            self.spacing_at(time, speed) / self.angle
        } else {
            f64::INFINITY
        }
    }

    /// Time at which its spacing reaches `limit` on a diverging front; infinite if never.
    pub(super) fn split_time(&self, limit: f64, speed: f64) -> f64 {
        if self.angle > 0.0 {
            // A spacing beyond the limit already is due at once.
            self.since + ((limit - self.spacing) / (self.angle * speed)).max(0.0)
        } else {
            f64::INFINITY
        }
    }

    /// The amplitude that it shows at `time`: the one that carries its volume, or under the energy law √(R/R₀) times that,
    /// so that the crest a r/(β R) of the front falls as 1/√R.
    #[inline(always)]
    pub(super) fn shown(&self, time: f64, speed: f64) -> f64 {
        if self.reference > 0.0 && self.angle > 0.0 {
            let distance = self.focus_distance(time, speed).abs().max(self.radius);
            self.amplitude * (distance / self.reference).sqrt()
        } else {
            self.amplitude
        }
    }

    /// The particle with its base moved to `time`.
    pub(super) fn rebased(&self, time: f64, speed: f64) -> Self {
        Self {
            base: self.position(time, speed),
            spacing: self.spacing_at(time, speed),
            since: time,
            ..*self
        }
    }
}

/// Particles as arrays, each with the time of its next event.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Particles {
    base: Vec<DVec2>,
    direction: Vec<DVec2>,
    since: Vec<f64>,
    spacing: Vec<f64>,
    angle: Vec<f64>,
    amplitude: Vec<f64>,
    radius: Vec<f64>,
    reference: Vec<f64>,
    bounces: Vec<u32>,
    patience: Vec<f64>,
    /// Time of the next event.
    next: Vec<f64>,
}

/// Applies an expression to every array.
macro_rules! each_array {
    ($self:ident, $list:ident => $do:expr) => {{
        {
            let $list = &mut $self.base;
            $do;
        }
        {
            let $list = &mut $self.direction;
            $do;
        }
        {
            let $list = &mut $self.since;
            $do;
        }
        {
            let $list = &mut $self.spacing;
            $do;
        }
        {
            let $list = &mut $self.angle;
            $do;
        }
        {
            let $list = &mut $self.amplitude;
            $do;
        }
        {
            let $list = &mut $self.radius;
            $do;
        }
        {
            let $list = &mut $self.reference;
            $do;
        }
        {
            let $list = &mut $self.bounces;
            $do;
        }
        {
            let $list = &mut $self.patience;
            $do;
        }
        {
            let $list = &mut $self.next;
            $do;
        }
    }};
}

impl Particles {
    pub(super) fn len(&self) -> usize {
        self.since.len()
    }

    #[inline(always)]
    pub(super) fn get(&self, k: usize) -> Particle {
        Particle {
            base: self.base[k],
            direction: self.direction[k],
            since: self.since[k],
            spacing: self.spacing[k],
            angle: self.angle[k],
            amplitude: self.amplitude[k],
            radius: self.radius[k],
            reference: self.reference[k],
            bounces: self.bounces[k],
            patience: self.patience[k],
        }
    }

    pub(super) fn push(&mut self, p: Particle, next: f64) {
        self.base.push(p.base);
        self.direction.push(p.direction);
        self.since.push(p.since);
        self.spacing.push(p.spacing);
        self.angle.push(p.angle);
        self.amplitude.push(p.amplitude);
        self.radius.push(p.radius);
        self.reference.push(p.reference);
        self.bounces.push(p.bounces);
        self.patience.push(p.patience);
        self.next.push(next);
    }

    /// Times of the next events.
    pub(super) fn next(&self) -> &[f64] {
        &self.next
    }

    /// Removes the particles at `dead` (ascending), keeping the order of the others.
    pub(super) fn remove(&mut self, dead: &[usize]) {
        let Some(&first) = dead.first() else {
            return;
        };
        each_array!(self, list => {
            let mut gone = dead.iter().copied().peekable();
            let mut to = first;
            for from in first..list.len() {
                if gone.peek() == Some(&from) {
                    gone.next();
                } else {
                    list[to] = list[from];
                    to += 1;
                }
            }
            list.truncate(to);
        });
    }

    /// Whether all arrays are as long and every number is one: what a state from a file must be.
    pub(super) fn is_sound(&self) -> bool {
        let n = self.len();
        let finite = |list: &[f64]| list.len() == n && list.iter().all(|v| v.is_finite());
        let places = |list: &[DVec2]| list.len() == n && list.iter().all(|v| v.is_finite());
        places(&self.base)
            && places(&self.direction)
            && finite(&self.since)
            && finite(&self.spacing)
            && finite(&self.angle)
            && finite(&self.amplitude)
            && finite(&self.radius)
            && self.radius.iter().all(|r| *r > 0.0)
            && self.angle.iter().all(|r| *r >= 0.0)
            && finite(&self.reference)
            && finite(&self.patience)
            && self.bounces.len() == n
            && self.next.len() == n
            && !self.next.iter().any(|t| t.is_nan())
    }

    pub(super) fn bytes(&self) -> u64 {
        // Capacity of every array is about the same; 100 bytes a particle.
        (self.since.capacity() * (2 * 16 + 8 * 8 + 4)) as u64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn removal_keeps_the_order_of_the_rest() {
        let mut list = Particles::default();
        let particle = |a: f64| Particle {
            base: DVec2::ZERO,
            direction: DVec2::X,
            since: 0.0,
            spacing: 0.0,
            angle: 0.1,
            amplitude: a,
            radius: 1.0,
            reference: 0.0,
            bounces: 0,
            patience: 0.0,
        };
        for k in 0..10 {
            list.push(particle(f64::from(k)), 100.0 + f64::from(k));
        }
        list.remove(&[]);
        list.remove(&[0, 4, 5, 9]);
        let left: Vec<f64> = (0..list.len()).map(|k| list.get(k).amplitude).collect();
        assert_eq!(left, [1.0, 2.0, 3.0, 6.0, 7.0, 8.0]);
        assert_eq!(list.next(), [101.0, 102.0, 103.0, 106.0, 107.0, 108.0]);
    }
}
