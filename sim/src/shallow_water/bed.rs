//! Ground that moves under the water: uplifts whose share of a fixed shape changes in time, and humps that slide.
//!
//! Moving ground carries the water that stands on it: the depth of a column and its momentum stay as they are, so the
//! volume is that of before to the last bit, whatever the ground does, and the new surface flows as the scheme makes it
//! flow over any ground. During a sub-step the ground stands as in the step's middle, after it as at its end: second
//! order in time. Heights are functions of time alone, rounded to the scheme's quantum, so that a run continued from a
//! checkpoint is the unbroken one.

use super::edges::Series;
use super::finite_volume::FiniteVolume;
use super::real::Real;
use super::settings::{HEIGHT_LIMIT, SetupError, position};
use crate::grid::{Grid, GridSpec};
use crate::scene::{along, hump};
use glam::DVec2;

/// Largest part of a cell that a hump slides in a sub-step.
const SLIDE_OF_CELL: f64 = 0.5;

/// One motion of the ground; several add up.
#[derive(Clone, Debug, PartialEq)]
pub enum BedMotion {
    /// `share(t)` × `shape`.
    Uplift {
        /// Height in metres at every sample, row-major.
        shape: Vec<f64>,
        /// Factor, by time.
        share: Series,
    },
    /// A hump `height` × (1 − r²/radius²)² that slides along a path.
    Slide {
        /// Height at the centre, m; negative for a hollow.
        height: f64,
        /// Radius at which it ends, m.
        radius: f64,
        /// X and Z of the centre in metres at increasing times in seconds; it rests before the first and after the last.
        path: Vec<(f64, [f64; 2])>,
    },
}

impl BedMotion {
    /// Checks it against a grid.
    ///
    /// # Errors
    /// [`SetupError`] names what is wrong.
    pub(crate) fn check(&self, spec: &GridSpec) -> Result<(), SetupError> {
        match self {
            Self::Uplift { shape, share } => {
                if shape.len() != spec.len() {
                    return Err(SetupError::Length {
                        what: "uplift of the ground",
                        expected: spec.len(),
                        found: shape.len(),
                    });
                }
                let factor = share.largest().max(1.0);
                match shape.iter().position(|h| !((h * factor).abs() <= HEIGHT_LIMIT)) {
                    None => Ok(()),
                    Some(k) => Err(SetupError::Value {
                        what: "uplift of the ground in m",
                        value: shape[k] * factor,
                        i: k % spec.width(),
                        j: k / spec.width(),
                        limit: HEIGHT_LIMIT,
                    }),
                }
            }
            Self::Slide { height, radius, path } => {
                let parameter = |name, value: f64, sound: bool, range| {
                    let error = SetupError::Parameter { name, value, range };
                    if sound { Ok(()) } else { Err(error) }
                };
                parameter(
                    "bed.height",
                    *height,
                    height.abs() <= HEIGHT_LIMIT,
                    "within ±1e6 m",
                )?;
                let sound = *radius > 0.0 && radius.is_finite();
                parameter("bed.radius", *radius, sound, "a positive length in metres")?;
                let error = |at, message| Err(SetupError::Series { at, message });
                if path.is_empty() {
                    return error(0, "there is no point; give at least one");
                }
                for (at, (time, [x, z])) in path.iter().enumerate() {
                    if !(time.is_finite() && x.is_finite() && z.is_finite()) {
                        return error(at, "time and position must be finite");
                    }
                    if at > 0 && *time <= path[at - 1].0 {
                        return error(at, "times must increase");
                    }
                }
                Ok(())
            }
        }
    }

    /// Height above the ground at rest at sample `(i, j)`, m.
    fn height(&self, spec: &GridSpec, [i, j]: [usize; 2], time: f64) -> f64 {
        match self {
            Self::Uplift { shape, share } => match shape[j * spec.width() + i] {
                0.0 => 0.0,
                height => height * share.at(time),
            },
            Self::Slide { height, radius, path } => {
                let (at, centre) = (position(spec, i, j), along(path, time));
                height * hump(DVec2::from_array(at) - DVec2::from_array(centre), *radius)
            }
        }
    }

    /// First and last column and row of the samples that change between two times; `None` if none do.
    fn reach(&self, spec: &GridSpec, from: f64, to: f64) -> Option<[[usize; 2]; 2]> {
        let (w, h) = (spec.width(), spec.height());
        match self {
            Self::Uplift { shape, share } => {
                if share.at(from) == share.at(to) {
                    return None;
                }
                let mut found: Option<[[usize; 2]; 2]> = None;
                for k in (0..shape.len()).filter(|&k| shape[k] != 0.0) {
                    let at = [k % w, k / w];
                    let so_far = found.get_or_insert([at, at]);
                    for a in 0..2 {
                        so_far[0][a] = so_far[0][a].min(at[a]);
                        so_far[1][a] = so_far[1][a].max(at[a]);
                    }
                }
                found
            }
            Self::Slide { radius, path, .. } => {
                let (a, b) = (along(path, from), along(path, to));
                if a == b {
                    return None;
                }
                let origin = [f64::from(spec.origin.x), f64::from(spec.origin.y)];
                let mut reach = [[0; 2]; 2];
                for (axis, count) in [w, h].into_iter().enumerate() {
                    let cell = |x: f64| (x - origin[axis]) / f64::from(spec.spacing);
                    let (low, high) = (a[axis].min(b[axis]) - radius, a[axis].max(b[axis]) + radius);
                    let (low, high, last) = (cell(low).floor(), cell(high).ceil(), (count - 1) as f64);
                    if high < 0.0 || low > last {
                        return None;
                    }
                    reach[0][axis] = low.max(0.0) as usize;
                    reach[1][axis] = high.min(last) as usize;
                }
                Some(reach)
            }
        }
    }

    /// Fastest motion along the ground, m/s, in the sub-step from `time`.
    fn speed(&self, time: f64) -> f64 {
        let Self::Slide { path, .. } = self else {
            return 0.0;
        };
        let leg = path.windows(2).filter(|leg| leg[1].0 > time);
        // The next leg too: a sub-step may reach into it.
        leg.take(2).fold(0.0, |fastest, leg| {
            let ((t0, a), (t1, b)) = (leg[0], leg[1]);
            fastest.max((b[0] - a[0]).hypot(b[1] - a[1]) / (t1 - t0))
        })
    }
}

/// The moving ground of a run.
pub(crate) struct MovingBed {
    motions: Vec<BedMotion>,
    spec: GridSpec,
    /// Height of the ground without its motions, m.
    rest: Vec<f64>,
    /// When the ground stands as it does, s.
    now: f64,
}

impl MovingBed {
    /// Motions over the ground `rest`, which then stands as at time 0.
    pub(crate) fn new(motions: Vec<BedMotion>, spec: GridSpec, rest: Vec<f64>) -> Self {
        Self {
            motions,
            spec,
            rest,
            now: 0.0,
        }
    }

    /// Height of the ground at sample `(i, j)`, m.
    fn height(&self, at: [usize; 2], time: f64) -> f64 {
        let raised: f64 = self.motions.iter().map(|m| m.height(&self.spec, at, time)).sum();
        self.rest[at[1] * self.spec.width() + at[0]] + raised
    }

    /// The whole ground at a time, m.
    pub(crate) fn heights(&self, time: f64) -> Vec<f64> {
        let w = self.spec.width();
        (0..self.spec.len())
            .map(|k| self.height([k % w, k / w], time))
            .collect()
    }

    /// Longest sub-step from `time` in seconds.
    pub(crate) fn largest_step(&self, time: f64) -> f64 {
        let speed = self.motions.iter().fold(0.0_f64, |s, m| s.max(m.speed(time)));
        SLIDE_OF_CELL * f64::from(self.spec.spacing) / speed
    }

    /// Moves the ground below the water, and that of the frames, to where it is at `time`; whether that of the frames
    /// changed.
    pub(crate) fn move_to<T: Real>(
        &mut self,
        water: &mut FiniteVolume<T>,
        ground: &mut Grid<f32>,
        time: f64,
    ) -> bool {
        let reaches: Vec<_> = self
            .motions
            .iter()
            .filter_map(|m| m.reach(&self.spec, self.now, time))
            .collect();
        self.now = time;
        let (mut moved, mut changed) = (false, false);
        for [[i0, j0], [i1, j1]] in reaches {
            for j in j0..=j1 {
                for i in i0..=i1 {
                    let z = self.height([i, j], time);
                    moved |= water.set_bed(i, j, z);
                    changed |= ground[(i, j)] != z as f32;
                    ground[(i, j)] = z as f32;
                }
            }
        }
        if moved {
            water.settle_bed();
        }
        changed
    }

    /// Goes on at `time`, at which the water's ground already stands.
    pub(crate) fn resume(&mut self, ground: &mut Grid<f32>, time: f64) {
        self.now = time;
        for (ground, z) in ground.as_mut_slice().iter_mut().zip(self.heights(time)) {
            *ground = z as f32;
        }
    }

    pub(crate) fn bytes(&self) -> usize {
        let shapes = self.motions.iter().map(|m| match m {
            BedMotion::Uplift { shape, .. } => shape.len() * size_of::<f64>(),
            BedMotion::Slide { path, .. } => path.len() * size_of::<(f64, [f64; 2])>(),
        });
        self.rest.len() * size_of::<f64>() + shapes.sum::<usize>()
    }
}
