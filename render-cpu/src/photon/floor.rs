//! The map of light on the ground under water.

use crate::stage::world::{World, in_plan};
use glam::{DVec2, DVec3, Vec2, Vec3};
use meniscus_sim::{Grid, GridSpec};
use rayon::prelude::*;

/// Points along each side of a cell at which it is asked whether ground there is under water.
const POINTS: usize = 4;

/// Light on the ground under water. Cells are centred on the samples of the grid.
#[derive(Clone, Debug, PartialEq)]
pub struct FloorMap {
    /// Flux that fell on each cell, W.
    flux: Grid<Vec3>,
    /// Area of its ground under water, m²: along the ground, and in plan.
    area: Grid<f32>,
    plan: Grid<f32>,
    /// Irradiance in plan that the sun would give it through still water, W/m².
    still: Grid<Vec3>,
}

impl FloorMap {
    pub(super) fn new(spec: GridSpec, world: &World<'_>) -> Self {
        let cells: Vec<(f32, f32, Vec3)> = (0..spec.len())
            .into_par_iter()
            .map(|k| {
                let centre = spec.position(k % spec.width(), k / spec.width()).as_dvec2();
                measure(centre, f64::from(spec.spacing), world)
            })
            .collect();
        let grid =
            |get: fn(&(f32, f32, Vec3)) -> f32| Grid::from_fn(spec, |i, j| get(&cells[spec.index(i, j)]));
        Self {
            flux: Grid::filled(spec, Vec3::ZERO),
            area: grid(|c| c.0),
            plan: grid(|c| c.1),
            still: Grid::from_fn(spec, |i, j| cells[spec.index(i, j)].2),
        }
    }

    /// The cell that a point of the ground lies in.
    pub(super) fn cell(&self, at: DVec2) -> Option<u32> {
        let spec = self.flux.spec();
        let g = ((at - spec.origin.as_dvec2()) / f64::from(spec.spacing) + 0.5).floor();
        let inside = g.min_element() >= 0.0 && g.x < spec.width() as f64 && g.y < spec.height() as f64;
        inside.then(|| spec.index(g.x as usize, g.y as usize) as u32)
    }

    /// Takes sums that were gathered by cell.
    pub(super) fn fill(&mut self, sums: &[DVec3]) {
        for (flux, sum) in self.flux.as_mut_slice().iter_mut().zip(sums) {
            *flux = sum.as_vec3();
        }
    }

    /// Where the cells are.
    pub fn spec(&self) -> &GridSpec {
        self.flux.spec()
    }

    /// Flux on each cell, W by colour.
    pub fn flux(&self) -> &Grid<Vec3> {
        &self.flux
    }

    /// Irradiance of the ground, W/m² by colour; 0 where none is under water.
    pub fn irradiance(&self) -> Grid<Vec3> {
        self.over(&self.area)
    }

    /// The sun's flux a level square metre over what still water would let through: 1 under a still surface, more where
    /// waves gather light; 0 where no ground is under water. Of use where the map was made of sunlight alone.
    pub fn relative(&self) -> Grid<f32> {
        let level = self.over(&self.plan);
        let spec = *self.spec();
        Grid::from_fn(spec, |i, j| {
            let still = self.still[(i, j)];
            if still.element_sum() > 0.0 {
                level[(i, j)].element_sum() / still.element_sum()
            } else {
                0.0
            }
        })
    }

    fn over(&self, area: &Grid<f32>) -> Grid<Vec3> {
        Grid::from_fn(*self.spec(), |i, j| {
            if area[(i, j)] > 0.0 {
                self.flux[(i, j)] / area[(i, j)]
            } else {
                Vec3::ZERO
            }
        })
    }

    /// Irradiance at a point, between the cells' middles; `None` beyond the map, and where nothing near is under water.
    pub(crate) fn at(&self, p: Vec2) -> Option<Vec3> {
        let spec = self.flux.spec();
        let g = spec.to_grid(p);
        let last = spec.size.as_vec2() - Vec2::ONE;
        if g.min_element() < -0.5 || (last - g).min_element() < -0.5 {
            return None;
        }
        let g = g.clamp(Vec2::ZERO, last);
        let cell = g.floor();
        let f = g - cell;
        let (i, j) = (cell.x as usize, cell.y as usize);
        let (mut flux, mut area) = (Vec3::ZERO, 0.0);
        for (di, wi) in [(0, 1.0 - f.x), (1, f.x)] {
            for (dj, wj) in [(0, 1.0 - f.y), (1, f.y)] {
                let (i, j) = ((i + di).min(spec.width() - 1), (j + dj).min(spec.height() - 1));
                flux += wi * wj * self.flux[(i, j)];
                area += wi * wj * self.area[(i, j)];
            }
        }
        (area > 0.0).then(|| flux / area)
    }
}

/// Of the cell about `centre`: area along the ground, area in plan, and what the sun gives it through still water.
fn measure(centre: DVec2, spacing: f64, world: &World<'_>) -> (f32, f32, Vec3) {
    let Some(ground) = world.ground else {
        return (0.0, 0.0, Vec3::ZERO);
    };
    let each = (spacing / POINTS as f64).powi(2);
    let (mut along, mut plan, mut depth) = (0.0, 0.0, 0.0);
    for k in 0..POINTS * POINTS {
        let offset = |k: usize| ((k as f64 + 0.5) / POINTS as f64 - 0.5) * spacing;
        let at = centre + DVec2::new(offset(k % POINTS), offset(k / POINTS));
        let p = DVec3::new(at.x, ground.height(at), at.y);
        let below = world.depth(p);
        let inside = world
            .edges
            .sides
            .iter()
            .all(|s| s.outwards * (p[s.axis] - s.at) <= 0.0);
        if below > 0.0 && inside {
            plan += each;
            along += each * (1.0 + ground.facet_slope(in_plan(p)).length_squared()).sqrt();
            depth += each * below;
        }
    }
    let still = match &world.light.beam {
        Some(beam) if plan > 0.0 => {
            let path = (depth / plan) as f32 / beam.direction.y;
            beam.irradiance * beam.direction.y * world.index.powi(2) * world.volume.transmittance(path)
        }
        _ => Vec3::ZERO,
    };
    (along as f32, plan as f32, still)
}
