//! Choosing directions towards the sky in proportion to its light.

use crate::sky::Sky;
use glam::Vec3;
use std::f32::consts::{PI, TAU};

/// Rows of the table; twice as many columns.
const ROWS: usize = 64;
const COLUMNS: usize = 2 * ROWS;
/// Solid angle of a cell: rows are equally high in `y`, so all cells are the same.
const CELL: f32 = 4.0 * PI / (ROWS * COLUMNS) as f32;
/// Share of the choice that is left to all directions alike, so that no direction is left out.
const EVEN: f32 = 0.1;

/// Chooses directions with a density that follows the sky's luminance, constant within each cell of an
/// equirectangular table (Pharr, Jakob & Humphreys, *Physically Based Rendering*, §12.5).
#[derive(Clone, Debug)]
pub(super) struct Dome {
    /// Running sums over the cells, the last 1.
    cumulative: Vec<f32>,
    /// Density of each cell per steradian.
    density: Vec<f32>,
}

impl Dome {
    pub(super) fn new(sky: &Sky) -> Self {
        let cells = ROWS * COLUMNS;
        let light: Vec<f32> = (0..cells)
            .map(|k| {
                // Four points a cell with a cone as wide as their distance: bright spots are not stepped over.
                let spread = 0.5 * PI / (2 * ROWS) as f32;
                let total: f32 = [(0.25, 0.25), (0.75, 0.25), (0.25, 0.75), (0.75, 0.75)]
                    .iter()
                    .map(|&(u, v)| luminance(sky.radiance(direction(k, u, v), spread)))
                    .sum();
                0.25 * total
            })
            .collect();
        let total = light.iter().sum::<f32>() * CELL;
        let even = 1.0 / (4.0 * PI);
        let density: Vec<f32> = light
            .iter()
            .map(|l| {
                if total > 0.0 && total.is_finite() {
                    EVEN * even + (1.0 - EVEN) * l / total
                } else {
                    even
                }
            })
            .collect();
        let mut sum = 0.0_f64;
        let mut cumulative: Vec<f32> = (0..cells)
            .map(|k| {
                sum += f64::from(density[k] * CELL);
                sum as f32
            })
            .collect();
        // The cells' densities then integrate to 1 to rounding; the choice must end exactly there.
        let scale = cumulative[cells - 1];
        for value in &mut cumulative {
            *value /= scale;
        }
        cumulative[cells - 1] = 1.0;
        Self {
            cumulative,
            density: density.into_iter().map(|d| d / scale).collect(),
        }
    }

    /// A direction and its density per steradian, from three numbers in [0, 1).
    pub(super) fn choose(&self, u: [f32; 3]) -> (Vec3, f32) {
        let k = self
            .cumulative
            .partition_point(|&c| c <= u[0])
            .min(self.density.len() - 1);
        (direction(k, u[1], u[2]), self.density[k])
    }

    /// Density per steradian with which [`Self::choose`] gives `direction`.
    pub(super) fn density(&self, direction: Vec3) -> f32 {
        let row = (0.5 * (1.0 - direction.y) * ROWS as f32) as usize;
        let turn = direction.x.atan2(-direction.z).rem_euclid(TAU) / TAU;
        let column = (turn * COLUMNS as f32) as usize;
        self.density[row.min(ROWS - 1) * COLUMNS + column.min(COLUMNS - 1)]
    }
}

/// The point (u, v) of cell `k`.
fn direction(k: usize, u: f32, v: f32) -> Vec3 {
    let (row, column) = (k / COLUMNS, k % COLUMNS);
    let y = 1.0 - 2.0 * (row as f32 + v) / ROWS as f32;
    let (sin, cos) = (TAU * (column as f32 + u) / COLUMNS as f32).sin_cos();
    let across = (1.0 - y * y).max(0.0).sqrt();
    Vec3::new(sin * across, y, -cos * across)
}

fn luminance(c: Vec3) -> f32 {
    0.2126 * c.x + 0.7152 * c.y + 0.0722 * c.z
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stage::tests_support;
    use meniscus_sim::rng::Rng;
    use meniscus_sim::scene::description::Sky as Kind;

    #[test]
    fn the_mean_over_chosen_directions_is_the_irradiance() {
        let mut description = tests_support::description();
        description.light.sky = Kind::Daylight {
            turbidity: 3.0,
            scale: 1.0,
        };
        let sky = Sky::new(&tests_support::scene(description));
        let dome = Dome::new(&sky);
        let mut rng = Rng::new(1, 2);
        let n = 40_000;
        let (mut chosen, mut even) = ([0.0_f64; 2], [0.0_f64; 2]);
        for _ in 0..n {
            let u = std::array::from_fn(|_| rng.uniform_f32());
            let (d, density) = dome.choose(u);
            assert!((dome.density(d) / density - 1.0).abs() < 1e-4 || on_a_border(d));
            let value = f64::from(luminance(sky.radiance(d, 0.0)) * d.y.max(0.0) / density);
            chosen = [chosen[0] + value, chosen[1] + value * value];
            let d = direction((u[0] * (ROWS * COLUMNS) as f32) as usize, u[1], u[2]);
            let value = f64::from(luminance(sky.radiance(d, 0.0)) * d.y.max(0.0) * 4.0 * PI);
            even = [even[0] + value, even[1] + value * value];
        }
        let moments = |[sum, square]: [f64; 2]| {
            let mean = sum / f64::from(n);
            (
                mean,
                ((square / f64::from(n) - mean * mean) / f64::from(n)).sqrt(),
            )
        };
        let ((chosen, scatter), (even, even_scatter)) = (moments(chosen), moments(even));
        let off = (chosen - even).abs() / scatter.hypot(even_scatter);
        assert!(off < 4.0, "{chosen} {even}: {off} standard errors");
        assert!(scatter < 0.95 * even_scatter, "{scatter} {even_scatter}");
    }

    /// Rounding may put a direction into the neighbouring cell.
    fn on_a_border(d: Vec3) -> bool {
        let near = |x: f32| (x - x.round()).abs() < 1e-3;
        near(0.5 * (1.0 - d.y) * ROWS as f32) || near(d.x.atan2(-d.z).rem_euclid(TAU) / TAU * COLUMNS as f32)
    }
}
