//! Steady flow over a bump (Goutal & Maurel 1997; SWASHES §3.1.3–3.1.5).

use super::{Water, roots::bisect};
use crate::solvers::GRAVITY;

/// The parabolic bump of the benchmark: 0.2 m high, 4 m wide, centred at 10 m in a channel of 25 m.
const CENTRE: f64 = 10.0;
const HEIGHT: f64 = 0.2;
const CURVATURE: f64 = 0.05;

/// Which of the benchmark's flows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BumpFlow {
    /// q = 4.42 m²/s, 2 m deep downstream.
    Subcritical,
    /// q = 1.53 m²/s, free outflow.
    Transcritical,
    /// q = 0.18 m²/s, 0.33 m deep downstream: a jump stands behind the bump.
    Shock,
}

/// A steady flow over the bump.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bump {
    flow: BumpFlow,
    discharge: f64,
    /// Head at the downstream end, relative to the bed there, m.
    downstream_head: f64,
    /// Head at the crest for critical flow there, m.
    crest_head: f64,
    jump: f64,
}

impl Bump {
    /// Length of the channel, m.
    pub const LENGTH: f64 = 25.0;

    /// One of the benchmark's flows.
    pub fn new(flow: BumpFlow) -> Self {
        let (discharge, downstream) = match flow {
            BumpFlow::Subcritical => (4.42, 2.0),
            BumpFlow::Transcritical => (1.53, 0.66),
            BumpFlow::Shock => (0.18, 0.33),
        };
        let q = discharge;
        let mut bump = Self {
            flow,
            discharge,
            downstream_head: head(q, downstream),
            crest_head: HEIGHT + head(q, critical(q)),
            jump: f64::INFINITY,
        };
        if flow == BumpFlow::Shock {
            // Momentum on both sides of the jump is the same.
            let force = |h: f64| q * q / h + 0.5 * GRAVITY * h * h;
            bump.jump = bisect(CENTRE + 1e-6, CENTRE + 2.0, |x| {
                let fast = bump.depth_from(x, bump.crest_head, false);
                let slow = bump.depth_from(x, bump.downstream_head, true);
                force(fast) - force(slow)
            });
        }
        bump
    }

    /// Discharge per width, m²/s.
    pub fn discharge(&self) -> f64 {
        self.discharge
    }

    /// Position of the jump, m; infinite without one.
    pub fn jump(&self) -> f64 {
        self.jump
    }

    /// Height of the bed, m.
    pub fn bed(x: f64) -> f64 {
        (HEIGHT - CURVATURE * (x - CENTRE) * (x - CENTRE)).max(0.0)
    }

    /// Depth from the total head on the slow (subcritical) or the fast branch.
    fn depth_from(&self, x: f64, head_above_floor: f64, slow: bool) -> f64 {
        let (q, bed) = (self.discharge, Self::bed(x));
        let least = critical(q);
        let excess = |h: f64| head(q, h) + bed - head_above_floor;
        if excess(least) >= 0.0 {
            // At the crest rounding may leave no root: the flow is critical.
            return least;
        }
        if slow {
            bisect(least, head_above_floor, excess)
        } else {
            bisect(1e-3 * least, least, excess)
        }
    }

    /// The water at `x` m.
    pub fn at(&self, x: f64) -> Water {
        let depth = match self.flow {
            BumpFlow::Subcritical => self.depth_from(x, self.downstream_head, true),
            BumpFlow::Transcritical => self.depth_from(x, self.crest_head, x < CENTRE),
            BumpFlow::Shock if x < self.jump => self.depth_from(x, self.crest_head, x < CENTRE),
            BumpFlow::Shock => self.depth_from(x, self.downstream_head, true),
        };
        Water::along_x(depth, self.discharge / depth)
    }
}

/// Depth of critical flow, m.
fn critical(discharge: f64) -> f64 {
    (discharge * discharge / GRAVITY).cbrt()
}

/// Depth plus velocity head, m.
fn head(discharge: f64, depth: f64) -> f64 {
    depth + discharge * discharge / (2.0 * GRAVITY * depth * depth)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_head_is_constant_but_across_the_jump() {
        for flow in [BumpFlow::Subcritical, BumpFlow::Transcritical, BumpFlow::Shock] {
            let bump = Bump::new(flow);
            let total = |x: f64| head(bump.discharge, bump.at(x).depth) + Bump::bed(x);
            for k in 0..250 {
                let x = 0.1 * f64::from(k);
                let expected = match flow {
                    BumpFlow::Subcritical => total(24.9),
                    BumpFlow::Transcritical => total(0.0),
                    BumpFlow::Shock if x < bump.jump => total(0.0),
                    BumpFlow::Shock => total(24.9),
                };
                assert!((total(x) - expected).abs() < 1e-9, "{flow:?} at {x}");
            }
        }
        let bump = Bump::new(BumpFlow::Shock);
        assert!((11.6..11.75).contains(&bump.jump), "{}", bump.jump);
        // Energy is lost in the jump, never gained.
        assert!(bump.crest_head > bump.downstream_head);
    }
}
