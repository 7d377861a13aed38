//! Water as bodies see it in the frames of a solver that does not know of bodies.

use crate::bodies::{Column, Water};
use crate::frame::{Channels, Frame};
use crate::grid::{Grid, GridSpec};
use crate::solver::Solver;
use glam::{BVec2, DVec2, DVec3, Vec2};
use std::ops::{Add, Mul};
use std::sync::Arc;

/// Steps by which the sample that stands over a place is found: x₀ ← x − D(x₀).
const STEPS: usize = 24;

/// Below which share of a sample's spacing the search ends.
const CLOSE: f64 = 1e-3;

/// What does not change from frame to frame.
#[derive(Clone, Debug)]
pub(super) struct Basin {
    pub(super) ground: Option<Arc<Grid<f32>>>,
    /// Height of the bed where there is no ground, metres above datum; −∞ for deep water.
    pub(super) bed: f64,
    /// Along which axes the domain repeats.
    pub(super) wrap: BVec2,
    /// Whether the waves that bodies make are in the frames.
    pub(super) radiates: bool,
}

/// The water of one frame.
#[derive(Clone, Debug)]
pub(super) struct View {
    basin: Basin,
    frame: Frame,
}

/// Four samples along an axis and their weights.
struct Taps {
    at: [usize; 4],
    weight: [f32; 4],
}

impl Taps {
    /// Around `x`, in samples, of an axis of `n`: Catmull–Rom. Samples beyond an end that does not repeat are its last.
    fn new(x: f64, n: usize, wrap: bool) -> Self {
        let cell = x.floor();
        let t = (x - cell) as f32;
        let at = [-1.0, 0.0, 1.0, 2.0].map(|k| {
            let k = cell + k;
            if wrap {
                k.rem_euclid(n as f64) as usize % n
            } else {
                k.clamp(0.0, (n - 1) as f64) as usize
            }
        });
        let (t2, t3) = (t * t, t * t * t);
        let weight = [
            -0.5 * t + t2 - 0.5 * t3,
            1.0 - 2.5 * t2 + 1.5 * t3,
            0.5 * t + 2.0 * t2 - 1.5 * t3,
            -0.5 * t2 + 0.5 * t3,
        ];
        Self { at, weight }
    }

    /// The same place by its two neighbours alone.
    fn linear(&self, x: f64) -> [f32; 4] {
        let t = (x - x.floor()) as f32;
        [0.0, 1.0 - t, t, 0.0]
    }
}

impl View {
    /// What bodies see in the present frame of `solver`.
    pub(super) fn of(solver: &dyn Solver, basin: &Basin) -> Self {
        let mut frame = Frame::new(solver.spec());
        let want = (Channels::VELOCITY | Channels::DISPLACEMENT) & solver.offers();
        solver.extract(want, &mut frame);
        Self {
            basin: basin.clone(),
            frame,
        }
    }

    fn spec(&self) -> &GridSpec {
        self.frame.spec()
    }

    /// A place in samples.
    fn samples(&self, x: DVec2) -> DVec2 {
        (x - self.spec().origin.as_dvec2()) / f64::from(self.spec().spacing)
    }

    fn taps(&self, g: DVec2) -> [Taps; 2] {
        let spec = self.spec();
        [
            Taps::new(g.x, spec.width(), self.basin.wrap.x),
            Taps::new(g.y, spec.height(), self.basin.wrap.y),
        ]
    }

    /// A channel at a place in samples: cubic among water, linear where ground is near, beyond which a surface is only
    /// continued.
    fn at<T>(&self, grid: &Grid<T>, g: DVec2) -> T
    where
        T: Copy + Default + Add<Output = T> + Mul<f32, Output = T>,
    {
        let [x, z] = self.taps(g);
        let (mut wx, mut wz) = (x.weight, z.weight);
        if let Some(ground) = &self.basin.ground {
            let dry = |&j: &usize| {
                x.at.iter()
                    .any(|&i| self.frame.elevation[(i, j)] <= ground[(i, j)])
            };
            if z.at.iter().any(dry) {
                (wx, wz) = (x.linear(g.x), z.linear(g.y));
            }
        }
        let mut sum = T::default();
        for (&j, wz) in z.at.iter().zip(wz) {
            for (&i, wx) in x.at.iter().zip(wx) {
                sum = sum + grid[(i, j)] * (wx * wz);
            }
        }
        sum
    }

    /// The sample, as a place in samples, whose water stands at `x`.
    fn source(&self, x: DVec2) -> DVec2 {
        let g = self.samples(x);
        let Some(displacement) = &self.frame.displacement else {
            return g;
        };
        let inverse = 1.0 / f64::from(self.spec().spacing);
        let mut from = g;
        for _ in 0..STEPS {
            let next = g - inverse * self.at(displacement, from).as_dvec2();
            let step = next - from;
            // Half steps: near a crest that leans over, whole ones circle around the place.
            from += if step.length() < 0.5 { step } else { 0.5 * step };
            if step.length() < CLOSE {
                break;
            }
        }
        from
    }

    fn bed(&self, x: DVec2) -> f64 {
        match &self.basin.ground {
            Some(ground) => f64::from(ground.sample(x.as_vec2())),
            None => self.basin.bed,
        }
    }

    fn column(&self, x: DVec2) -> Column {
        Column {
            surface: f64::from(self.at(&self.frame.elevation, self.source(x))),
            bed: self.bed(x),
        }
    }

    fn flow(&self, x: DVec2) -> DVec2 {
        match &self.frame.velocity {
            Some(velocity) => self.at::<Vec2>(velocity, self.source(x)).as_dvec2(),
            None => DVec2::ZERO,
        }
    }
}

/// The water of a moment between two frames.
pub(super) struct Between<'a> {
    pub(super) before: &'a View,
    pub(super) after: &'a View,
    /// Seconds from one to the other.
    pub(super) span: f64,
    /// How much of them has passed, 0 to 1.
    pub(super) share: f64,
}

impl Water for Between<'_> {
    fn column(&self, x: f64, z: f64) -> Column {
        let x = DVec2::new(x, z);
        let (a, b) = (self.before.column(x), self.after.column(x));
        Column {
            surface: a.surface + self.share * (b.surface - a.surface),
            bed: a.bed,
        }
    }

    /// Horizontally that of the frames, vertically how fast the surface rises: what a float at the surface meets.
    fn velocity(&self, at: DVec3) -> DVec3 {
        let x = DVec2::new(at.x, at.z);
        let flow = self.before.flow(x).lerp(self.after.flow(x), self.share);
        let rise = self.after.column(x).surface - self.before.column(x).surface;
        DVec3::new(flow.x, rise / self.span, flow.y)
    }

    fn acceleration(&self, at: DVec3) -> DVec3 {
        let x = DVec2::new(at.x, at.z);
        let change = (self.after.flow(x) - self.before.flow(x)) / self.span;
        DVec3::new(change.x, 0.0, change.y)
    }

    fn resolution(&self) -> f64 {
        f64::from(self.before.spec().spacing)
    }

    fn radiates(&self) -> bool {
        self.before.basin.radiates
    }
}
