//! Ground that moves: how high a scene's motions raise it where and when. Solvers and renderers ask the same functions.

use super::Scene;
use super::description::{Bed, SeriesPoint};
use crate::grid::{Grid, GridSpec};
use glam::{DVec2, Vec2};
use std::borrow::Cow;

impl Scene {
    /// Whether the ground moves.
    pub fn ground_moves(&self) -> bool {
        self.terrain.is_some() && !self.description.beds.is_empty()
    }

    /// The ground at a time in seconds: [`Self::terrain`], where it moves with the motions and at samples no further apart
    /// than the solver's, for a motion may be finer than the ground that moves.
    pub fn ground_at(&self, time: f64) -> Option<Cow<'_, Grid<f32>>> {
        let terrain = self.terrain.as_ref()?;
        if !self.ground_moves() {
            return Some(Cow::Borrowed(terrain));
        }
        let mut ground = no_coarser(terrain, &self.grid);
        let spec = *ground.spec();
        let mut uplifts = self.uplifts.iter();
        for bed in &self.description.beds {
            let array = match bed {
                Bed::Array { .. } => uplifts.next(),
                _ => None,
            };
            let share = bed.share(time);
            if share == 0.0 {
                continue;
            }
            for (k, height) in ground.as_mut_slice().iter_mut().enumerate() {
                let at = spec.position(k % spec.width(), k / spec.width());
                *height += (share * bed.shape(at, array, time)) as f32;
            }
        }
        Some(Cow::Owned(ground))
    }

    /// The scene as it stands at a time in seconds, for those to whom ground is at rest: itself where it is.
    pub fn at(&self, time: f64) -> Cow<'_, Self> {
        if !self.ground_moves() {
            return Cow::Borrowed(self);
        }
        let mut scene = self.clone();
        scene.terrain = self.ground_at(time).map(Cow::into_owned);
        scene.description.beds.clear();
        scene.uplifts.clear();
        Cow::Owned(scene)
    }
}

/// The ground at the samples of a grid and as far as it goes beyond them, by the grid's own size at most, if its own samples
/// are further apart.
fn no_coarser(ground: &Grid<f32>, grid: &GridSpec) -> Grid<f32> {
    let of = ground.spec();
    if of.spacing <= grid.spacing {
        return ground.clone();
    }
    let most = grid.size.as_vec2();
    let beyond = |length: Vec2| (length / grid.spacing).clamp(Vec2::ZERO, most).floor();
    let (before, behind) = (
        beyond(grid.origin - of.origin),
        beyond(of.origin + of.extent() - grid.origin - grid.extent()),
    );
    let spec = GridSpec {
        origin: grid.origin - grid.spacing * before,
        size: grid.size + before.as_uvec2() + behind.as_uvec2(),
        ..*grid
    };
    Grid::from_fn(spec, |i, j| ground.sample(spec.position(i, j)))
}

impl Bed {
    /// The points between which the share of this motion that has happened is linear; before the first and after the last
    /// it stays. Empty for what slides, all of which is there at all times.
    pub(crate) fn shares(&self) -> Vec<(f64, [f64; 1])> {
        let (start, rise, points): (_, _, &[SeriesPoint]) = match self {
            Self::Patch {
                start, rise, points, ..
            }
            | Self::Array {
                start, rise, points, ..
            } => (*start, *rise, points),
            Self::Slide { .. } => return Vec::new(),
        };
        if points.is_empty() {
            // "At once" is between two neighbouring moments.
            return vec![(start, [0.0]), ((start + rise).max(start.next_up()), [1.0])];
        }
        points.iter().map(|p| (p.time, [p.value])).collect()
    }

    /// Share of this motion that has happened at a time in seconds.
    fn share(&self, time: f64) -> f64 {
        match self.shares() {
            points if points.is_empty() => 1.0,
            points => along(&points, time)[0],
        }
    }

    /// Height in metres of the whole motion at a place; `array` holds the heights of an array in their own unit.
    fn shape(&self, at: Vec2, array: Option<&Grid<f32>>, time: f64) -> f64 {
        match self {
            Self::Patch { min, max, height, .. } => {
                let inside = at.cmpge(*min).all() && at.cmple(*max).all();
                if inside { f64::from(*height) } else { 0.0 }
            }
            Self::Array { scale, .. } => {
                array.map_or(0.0, |array| f64::from(*scale) * f64::from(array.sample(at)))
            }
            Self::Slide { height, radius, path } => {
                let path: Vec<_> = path
                    .iter()
                    .map(|p| (p.time, p.position.as_dvec2().to_array()))
                    .collect();
                let centre = DVec2::from_array(along(&path, time));
                f64::from(*height) * hump(at.as_dvec2() - centre, f64::from(*radius))
            }
        }
    }
}

/// The hump of height 1 that slides, (1 − r²/radius²)², at a place from its centre.
pub(crate) fn hump(at: DVec2, radius: f64) -> f64 {
    let free = (1.0 - (at / radius).length_squared()).max(0.0);
    free * free
}

/// Values at increasing times, linear between them and constant before the first and after the last; at least one.
pub(crate) fn along<const N: usize>(points: &[(f64, [f64; N])], time: f64) -> [f64; N] {
    let next = points.partition_point(|(t, _)| *t <= time);
    if next == 0 || next == points.len() {
        return points[next.saturating_sub(1)].1;
    }
    let ((t0, a), (t1, b)) = (points[next - 1], points[next]);
    let f = (time - t0) / (t1 - t0);
    std::array::from_fn(|k| a[k] + (b[k] - a[k]) * f)
}
