//! How many pixels are drawn: as many as there is time for while things move, all of them when they rest.

use meniscus_sim::glam::UVec2;

/// How many pixels are asked for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Quality {
    /// What can be drawn in [`BUDGET`]; all of them at rest.
    #[default]
    Auto,
    /// Every pixel.
    Full,
    /// Half of them along each side.
    Half,
    /// A quarter of them along each side.
    Quarter,
}

impl Quality {
    /// All of them, with their names.
    pub const ALL: [(Self, &'static str); 4] = [
        (Self::Auto, "automatic"),
        (Self::Full, "full"),
        (Self::Half, "1/2"),
        (Self::Quarter, "1/4"),
    ];
}

/// Seconds that a picture may take while things move.
pub const BUDGET: f64 = 0.07;

/// Seconds that a sample of a picture at rest may take.
pub const PATIENT: f64 = 2.0;

/// Divisors of the sides that are tried, finest first.
const DIVISORS: [u32; 7] = [1, 2, 3, 4, 6, 8, 12];

/// Where to begin with what was never drawn: on the safe side.
const BEGIN: usize = 3;

/// Pictures after which a finer size that was too slow is tried again.
const PATIENCE: u32 = 60;

/// Finds the finest size that can be drawn in [`BUDGET`], by trying: what a picture costs besides its pixels differs from
/// renderer to renderer.
#[derive(Clone, Debug, PartialEq)]
pub struct Pace {
    /// What is drawn: renderers and full size. All that is known is of this.
    subject: (String, UVec2),
    at: usize,
    /// Pictures until a finer size may be tried.
    wait: u32,
    /// Whether the next picture sets things up, so that its time says nothing.
    first: bool,
    /// From where it went coarser with the latest picture, and what that took.
    coarsened: Option<(usize, f64)>,
    /// Whether going coarser was of no use.
    settled: bool,
    /// Divisor and seconds of the latest picture.
    latest: Option<(u32, f64)>,
}

impl Default for Pace {
    fn default() -> Self {
        Self {
            subject: (String::new(), UVec2::ZERO),
            at: BEGIN,
            wait: 0,
            first: true,
            coarsened: None,
            settled: false,
            latest: None,
        }
    }
}

impl Pace {
    /// The divisor with which to draw `size` pixels by `renderers` now.
    pub fn divisor(&mut self, size: UVec2, renderers: &str) -> u32 {
        if self.subject.1 != size || self.subject.0 != renderers {
            *self = Self {
                subject: (renderers.to_owned(), size),
                ..Self::default()
            };
        }
        DIVISORS[self.at]
    }

    /// The divisor and the samples a pixel with which to draw at rest: as good as can be had in [`PATIENT`] a sample, so that
    /// whoever goes on does not wait for long.
    pub fn rest(&self) -> (u32, u32) {
        let Some((divisor, seconds)) = self.latest else {
            return (1, 1);
        };
        let of = |d: u32| seconds * (f64::from(divisor) / f64::from(d)).powi(2);
        let fits = DIVISORS
            .into_iter()
            .find(|d| of(*d) <= PATIENT)
            .unwrap_or(divisor);
        let samples = if of(fits) <= 0.25 * PATIENT { 4 } else { 1 };
        (fits.min(divisor), samples)
    }

    /// A picture of that size took so many seconds.
    pub fn took(&mut self, seconds: f64) {
        self.latest = Some((DIVISORS[self.at], seconds));
        if std::mem::take(&mut self.first) {
            return;
        }
        self.wait = self.wait.saturating_sub(1);
        if let Some((finer, then)) = self.coarsened.take()
            && seconds > 0.7 * then
        {
            // The time is not in the pixels: then there may as well be more of them.
            (self.at, self.wait, self.settled) = (finer, PATIENCE, true);
            return;
        }
        self.settled &= self.wait > 0;
        let last = DIVISORS.len() - 1;
        if seconds > BUDGET && self.at < last && !self.settled {
            self.coarsened = Some((self.at, seconds));
            let now = f64::from(DIVISORS[self.at]);
            let fits = |d: &u32| seconds * (now / f64::from(*d)).powi(2) <= BUDGET;
            let next = DIVISORS.iter().position(fits).unwrap_or(last);
            self.at = next.max(self.at + 1);
            self.wait = PATIENCE;
        } else if self.at > 0 && self.wait == 0 {
            let ratio = f64::from(DIVISORS[self.at]) / f64::from(DIVISORS[self.at - 1]);
            // Even if the time were all in the pixels; or it has little to do with them, then trying tells.
            if seconds * ratio * ratio <= BUDGET || seconds <= 0.5 * BUDGET {
                self.at -= 1;
            }
        }
    }
}

/// The size with its sides divided, at least one pixel.
pub fn divided(size: UVec2, divisor: u32) -> UVec2 {
    (size / divisor.max(1)).max(UVec2::ONE)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Where it settles, and how often it changed its mind in the last 200 pictures.
    fn settle(fixed: f64, pixel: f64) -> (u32, usize) {
        let size = UVec2::new(1280, 720);
        let mut pace = Pace::default();
        let mut changes = 0;
        let mut before = 0;
        for k in 0..400 {
            let divisor = pace.divisor(size, "a");
            let drawn = divided(size, divisor);
            // The first one makes pipelines.
            let extra = if k == 0 { 5.0 } else { 0.0 };
            pace.took(extra + fixed + pixel * f64::from(drawn.x * drawn.y));
            changes += usize::from(k > 200 && divisor != before);
            before = divisor;
        }
        (before, changes)
    }

    #[test]
    fn it_settles_on_the_finest_size_within_the_budget() {
        assert_eq!(settle(0.0, 1e-9), (1, 0));
        assert_eq!(settle(0.0, 1e-6).0, 4);
        assert_eq!(settle(0.0, 1e-3).0, 12);
        // What has nothing to do with pixels does not make pictures small.
        assert_eq!(settle(0.03, 1e-9), (1, 0));
        // Nor does it where that is too much for any number of them.
        assert_eq!(settle(0.3, 1e-9).0, 4);
        let (_, changes) = settle(0.02, 3e-7);
        assert!(changes <= 8, "{changes}");
    }

    #[test]
    fn at_rest_nobody_waits_for_long() {
        let size = UVec2::new(1280, 720);
        let at = |pixel: f64| {
            let mut pace = Pace::default();
            for _ in 0..50 {
                let drawn = divided(size, pace.divisor(size, "a"));
                pace.took(pixel * f64::from(drawn.x * drawn.y));
            }
            pace.rest()
        };
        assert_eq!(at(1e-8), (1, 4));
        assert_eq!(at(1e-6), (1, 1));
        assert_eq!(at(1e-5), (3, 1));
    }

    #[test]
    fn another_subject_begins_anew() {
        let mut pace = Pace::default();
        let size = UVec2::new(800, 600);
        for _ in 0..10 {
            pace.divisor(size, "a");
            pace.took(1e-4);
        }
        assert_eq!(pace.divisor(size, "a"), 1);
        assert_eq!(pace.divisor(size, "b"), DIVISORS[BEGIN]);
        assert_eq!(divided(UVec2::new(3, 900), 4), UVec2::new(1, 225));
    }
}
