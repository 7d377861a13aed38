//! The smooth footprints with which actions touch a grid, in discrete sums that are exact.

use crate::grid::GridSpec;
use glam::Vec2;
use std::f64::consts::PI;

/// Volume of a cosine bump ½(1 + cos πd/r) of unit height over unit radius squared: π/2 − 2/π.
pub const BUMP_VOLUME: f64 = PI / 2.0 - 2.0 / PI;

/// Volume of the depression of a press of unit depth over its radius squared: 27π/64.
pub const PRESS_VOLUME: f64 = 27.0 * PI / 64.0;

/// Smallest radius of a bump in samples: a narrower one is widened to it, keeping its volume, so that the grid can
/// tell where between samples it stands.
const SMALLEST_RADIUS: f64 = 2.0;

/// Which axes of a grid wrap around.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Wrap {
    pub(crate) x: bool,
    pub(crate) z: bool,
}

/// Samples under a footprint with their weights; reused from action to action.
#[derive(Clone, Debug, Default)]
pub(crate) struct Stamp {
    /// Index of the sample and weight.
    pub(crate) weights: Vec<(usize, f64)>,
    /// Squared distance from the centre over the squared radius, beside `weights`.
    reach: Vec<f64>,
    /// Sum of the weights over the whole lattice, samples outside the grid and on land included.
    whole: f64,
}

/// Offsets a footprint along one axis covers: lattice index and position of the centre in samples.
fn window(centre: f64, radius: f64, size: usize, wraps: bool) -> (i64, i64, f64) {
    let n = size as f64;
    if wraps {
        // More than one period on either side only repeats what is already covered.
        let centre = centre.rem_euclid(n);
        let radius = radius.min(n);
        (
            (centre - radius).floor() as i64,
            (centre + radius).ceil() as i64,
            centre,
        )
    } else {
        // Samples beyond the grid count towards the whole; far ones of a huge footprint cannot matter.
        let low = (centre - radius).floor().clamp(-2.0 * n - 8.0, 3.0 * n + 8.0);
        let high = (centre + radius).ceil().clamp(-2.0 * n - 8.0, 3.0 * n + 8.0);
        (low as i64, high as i64, centre)
    }
}

impl Stamp {
    /// Fills the weights with `profile(d²/r²)` for the samples within `radius` samples of `centre` (in metres) for
    /// which `wet` holds.
    fn fill(
        &mut self,
        spec: &GridSpec,
        wrap: Wrap,
        centre: Vec2,
        radius: f64,
        wet: impl Fn(usize) -> bool,
        profile: impl Fn(f64) -> f64,
    ) {
        self.weights.clear();
        self.reach.clear();
        self.whole = 0.0;
        let spacing = f64::from(spec.spacing);
        let (w, h) = (spec.width(), spec.height());
        let at = |p: f32, o: f32| (f64::from(p) - f64::from(o)) / spacing;
        let (i0, i1, cx) = window(at(centre.x, spec.origin.x), radius, w, wrap.x);
        let (j0, j1, cz) = window(at(centre.y, spec.origin.y), radius, h, wrap.z);
        let fold = |k: i64, n: usize, wraps: bool| -> Option<usize> {
            if wraps {
                Some(k.rem_euclid(n as i64) as usize)
            } else {
                usize::try_from(k).ok().filter(|&k| k < n)
            }
        };
        for j in j0..=j1 {
            let row = fold(j, h, wrap.z);
            for i in i0..=i1 {
                let (dx, dz) = (i as f64 - cx, j as f64 - cz);
                let s2 = (dx * dx + dz * dz) / (radius * radius);
                if s2 >= 1.0 {
                    continue;
                }
                let weight = profile(s2);
                self.whole += weight;
                let Some((column, row)) = fold(i, w, wrap.x).zip(row) else {
                    continue;
                };
                let k = row * w + column;
                if wet(k) {
                    self.weights.push((k, weight));
                    self.reach.push(s2);
                }
            }
        }
    }

    /// The cosine bump of a push: 1 at the centre, 0 at `radius` metres.
    pub(crate) fn bump(
        &mut self,
        spec: &GridSpec,
        wrap: Wrap,
        centre: Vec2,
        radius: f32,
        wet: impl Fn(usize) -> bool,
    ) {
        let radius = (f64::from(radius) / f64::from(spec.spacing)).max(SMALLEST_RADIUS);
        self.fill(spec, wrap, centre, radius, wet, |s2| {
            0.5 * (1.0 + (PI * s2.sqrt()).cos())
        });
    }

    /// Weights of a drop, in metres of elevation: they sum to `volume` over the cell area where the whole drop falls
    /// on water. What falls on land or beyond the grid is lost.
    pub(crate) fn drop(
        &mut self,
        spec: &GridSpec,
        wrap: Wrap,
        centre: Vec2,
        radius: f32,
        volume: f32,
        wet: impl Fn(usize) -> bool,
    ) {
        self.bump(spec, wrap, centre, radius, wet);
        let factor = if self.whole > 0.0 {
            f64::from(volume) / (self.whole * spec.cell_area())
        } else {
            0.0
        };
        for (_, weight) in &mut self.weights {
            *weight *= factor;
        }
    }

    /// Weights of a press, in metres of elevation: (1 − s²)²(1 − 4s²) with s the distance over twice the radius,
    /// negative sign. The 4 is replaced by what makes the discrete sum over the water exactly nothing, also beside
    /// land and walls.
    pub(crate) fn press(
        &mut self,
        spec: &GridSpec,
        wrap: Wrap,
        centre: Vec2,
        radius: f32,
        depth: f32,
        wet: impl Fn(usize) -> bool,
    ) {
        let asked = 2.0 * f64::from(radius) / f64::from(spec.spacing);
        let reach = asked.max(1.5 * SMALLEST_RADIUS);
        let depth = f64::from(depth) * (asked / reach).powi(2);
        self.fill(spec, wrap, centre, reach, wet, |s2| (1.0 - s2).powi(2));
        let sum: f64 = self.weights.iter().map(|(_, b)| b).sum();
        let moment: f64 = self
            .weights
            .iter()
            .zip(&self.reach)
            .map(|((_, b), s2)| b * s2)
            .sum();
        if moment <= 0.0 {
            // A single sample has nowhere to put the water that is pressed out of it.
            self.weights.clear();
            return;
        }
        let beta = sum / moment;
        for ((_, weight), s2) in self.weights.iter_mut().zip(&self.reach) {
            *weight *= -depth * (1.0 - beta * s2);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::UVec2;

    fn spec() -> GridSpec {
        GridSpec::new(Vec2::new(-3.0, 5.0), 0.25, UVec2::new(64, 48)).unwrap()
    }

    fn total(stamp: &Stamp) -> f64 {
        stamp.weights.iter().map(|(_, w)| w).sum::<f64>() * spec().cell_area()
    }

    #[test]
    fn a_drop_adds_its_volume_wherever_it_stands_between_samples() {
        let mut stamp = Stamp::default();
        for (x, radius) in [(1.0, 1.3), (1.11, 0.01), (2.37, 0.6)] {
            stamp.drop(&spec(), Wrap::default(), Vec2::new(x, 9.07), radius, 0.02, |_| {
                true
            });
            assert!((total(&stamp) / 0.02 - 1.0).abs() < 1e-7);
        }
    }

    #[test]
    fn the_bump_has_its_closed_form_volume() {
        let mut stamp = Stamp::default();
        stamp.bump(&spec(), Wrap::default(), Vec2::new(4.0, 11.0), 3.0, |_| true);
        // The cosine bump is smooth, so the lattice sum converges quickly: 12 samples a radius leave 1e-3.
        assert!((total(&stamp) / (BUMP_VOLUME * 9.0) - 1.0).abs() < 1e-3);
    }

    #[test]
    fn a_press_keeps_the_volume_also_beside_land_and_corners() {
        let mut stamp = Stamp::default();
        for centre in [Vec2::new(4.0, 11.0), Vec2::new(-3.0, 5.0), Vec2::new(0.3, 16.5)] {
            stamp.press(&spec(), Wrap::default(), centre, 1.5, 0.3, |k| k % 64 != 20);
            let size: f64 = stamp.weights.iter().map(|(_, w)| w.abs()).sum();
            assert!(size > 0.0);
            assert!(total(&stamp).abs() < 1e-13 * size, "{centre}");
        }
    }

    #[test]
    fn the_depression_of_a_press_has_its_closed_form_volume() {
        let mut stamp = Stamp::default();
        stamp.press(&spec(), Wrap::default(), Vec2::new(4.0, 11.0), 2.0, 0.3, |_| true);
        let down: f64 = stamp.weights.iter().map(|(_, w)| w.min(0.0)).sum::<f64>() * spec().cell_area();
        assert!((-down / (PRESS_VOLUME * 4.0 * 0.3) - 1.0).abs() < 0.01);
    }

    #[test]
    fn wrapping_footprints_cover_the_other_side() {
        let mut stamp = Stamp::default();
        let wrap = Wrap { x: true, z: true };
        stamp.drop(&spec(), wrap, Vec2::new(-3.0, 5.0), 1.0, 1.0, |_| true);
        assert!((total(&stamp) - 1.0).abs() < 1e-12);
        assert!(stamp.weights.iter().any(|(k, _)| *k == 64 * 48 - 1));
        // A footprint far larger than the grid ends, and keeps the volume.
        stamp.drop(&spec(), wrap, Vec2::new(1e9, -1e9), 1e12, 1.0, |_| true);
        assert!((total(&stamp) - 1.0).abs() < 1e-9);
    }

    #[test]
    fn what_falls_beside_the_grid_is_lost() {
        let mut stamp = Stamp::default();
        stamp.drop(
            &spec(),
            Wrap::default(),
            Vec2::new(-3.125, 10.0),
            1.0,
            1.0,
            |_| true,
        );
        assert!((total(&stamp) - 0.5).abs() < 0.01);
        stamp.drop(&spec(), Wrap::default(), Vec2::new(1e30, 10.0), 1.0, 1.0, |_| {
            true
        });
        assert!(stamp.weights.is_empty());
    }
}
