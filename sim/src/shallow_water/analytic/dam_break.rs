//! Dam breaks on a level bed.

use super::{Water, roots::bisect};
use crate::solvers::GRAVITY;

/// Dam break onto still water (Stoker 1957; SWASHES §4.1.1): a rarefaction, a plateau and a bore.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stoker {
    dam: f64,
    left: f64,
    right: f64,
    /// Celerity of the plateau, m/s.
    middle: f64,
    /// Speed of the plateau, m/s.
    speed: f64,
    /// Speed of the bore, m/s.
    bore: f64,
}

impl Stoker {
    /// Water `left` m deep before `dam` and `right` m behind it (0 < right < left).
    pub fn new(dam: f64, left: f64, right: f64) -> Self {
        let (cl, cr) = ((GRAVITY * left).sqrt(), (GRAVITY * right).sqrt());
        // Jump conditions of the bore against the invariant of the rarefaction, in terms of the plateau's celerity c.
        let bore_speed = |c: f64| {
            let (h, hr) = (c * c / GRAVITY, right);
            (GRAVITY * h * (h + hr) / (2.0 * hr)).sqrt()
        };
        let speed_behind = |c: f64| {
            let h = c * c / GRAVITY;
            bore_speed(c) * (1.0 - right / h)
        };
        let middle = bisect(cr, cl, |c| speed_behind(c) - 2.0 * (cl - c));
        Self {
            dam,
            left,
            right,
            middle,
            speed: 2.0 * (cl - middle),
            bore: bore_speed(middle),
        }
    }

    /// Speed of the bore, m/s.
    pub fn bore(&self) -> f64 {
        self.bore
    }

    /// The water at `x` m and `time` s > 0.
    pub fn at(&self, x: f64, time: f64) -> Water {
        let cl = (GRAVITY * self.left).sqrt();
        let s = (x - self.dam) / time;
        if s <= -cl {
            Water::along_x(self.left, 0.0)
        } else if s <= self.speed - self.middle {
            let c = (2.0 * cl - s) / 3.0;
            Water::along_x(c * c / GRAVITY, 2.0 * (cl + s) / 3.0)
        } else if s <= self.bore {
            Water::along_x(self.middle * self.middle / GRAVITY, self.speed)
        } else {
            Water::along_x(self.right, 0.0)
        }
    }
}

/// Dam break onto dry ground (Ritter 1892; SWASHES §4.1.2).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ritter {
    /// Where the dam stands, m.
    pub dam: f64,
    /// Depth of the water before it, m.
    pub left: f64,
}

impl Ritter {
    /// The water at `x` m and `time` s > 0.
    pub fn at(&self, x: f64, time: f64) -> Water {
        let cl = (GRAVITY * self.left).sqrt();
        let s = (x - self.dam) / time;
        if s <= -cl {
            Water::along_x(self.left, 0.0)
        } else if s < 2.0 * cl {
            let c = (2.0 * cl - s) / 3.0;
            Water::along_x(c * c / GRAVITY, 2.0 * (cl + s) / 3.0)
        } else {
            Water::DRY
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stoker_satisfies_the_jump_conditions_and_is_continuous_elsewhere() {
        let exact = Stoker::new(5.0, 0.005, 0.001);
        let h = exact.at(5.0 + 0.5 * (exact.speed + exact.bore), 1.0);
        // Mass and momentum across the bore.
        let (hm, um, s) = (h.depth, h.velocity[0], exact.bore);
        assert!((s * (hm - 0.001) - hm * um).abs() < 1e-15);
        let momentum = hm * um * um + 0.5 * GRAVITY * (hm * hm - 1e-6);
        assert!((s * hm * um - momentum).abs() < 1e-15);
        let corner = 5.0 + exact.speed - exact.middle;
        let (a, b) = (exact.at(corner - 1e-9, 1.0), exact.at(corner + 1e-9, 1.0));
        assert!((a.depth - b.depth).abs() < 1e-9 && (a.velocity[0] - b.velocity[0]).abs() < 1e-7);
    }

    #[test]
    fn ritter_keeps_the_volume() {
        let exact = Ritter { dam: 0.0, left: 2.0 };
        let n = 20_000;
        let dx = 40.0 / f64::from(n);
        let volume: f64 = (0..n)
            .map(|i| dx * exact.at(-20.0 + (f64::from(i) + 0.5) * dx, 1.5).depth)
            .sum();
        assert!((volume - 40.0).abs() < 1e-5, "{volume}");
    }
}
