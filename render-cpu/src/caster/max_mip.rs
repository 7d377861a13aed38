//! A walk down a pyramid of lowest and highest heights (Tevs, Ihrke & Seidel 2008): the common way to skip empty space
//! over a heightfield, exact here, for comparison.

use super::brute::{BruteForce, Local};
use super::surface::{HeightfieldError, Patch};
use super::{Caster, Hit, Ray};
use meniscus_sim::Grid;

/// Share of its height by which a node's slab is widened, for rounding.
const PAD: f64 = 1e-9;

/// Casts rays by a quadtree over the cells, front to back.
#[derive(Clone, Debug)]
pub struct MaxMip {
    cells: BruteForce,
    /// From single cells to one node for all.
    levels: Vec<Level>,
}

#[derive(Clone, Debug, Default)]
struct Level {
    columns: u32,
    rows: u32,
    /// Lowest and highest height of each node, metres.
    slabs: Vec<[f32; 2]>,
}

impl Level {
    fn slab(&self, i: u32, j: u32) -> Option<[f32; 2]> {
        let inside = i < self.columns && j < self.rows;
        inside.then(|| self.slabs[(j * self.columns + i) as usize])
    }
}

impl MaxMip {
    /// The pyramid of `elevation`.
    ///
    /// # Errors
    /// [`HeightfieldError`] if a sample is not finite, or the grid impossible.
    pub fn build(elevation: &Grid<f32>, patch: Patch) -> Result<Self, HeightfieldError> {
        let mut mip = Self {
            cells: BruteForce::build(elevation, patch)?,
            levels: Vec::new(),
        };
        mip.raise(elevation);
        Ok(mip)
    }

    fn raise(&mut self, elevation: &Grid<f32>) {
        self.levels.clear();
        let spec = elevation.spec();
        let (columns, rows) = (spec.size.x.saturating_sub(1), spec.size.y.saturating_sub(1));
        if columns == 0 || rows == 0 {
            return;
        }
        let mut slabs = Vec::with_capacity(columns as usize * rows as usize);
        for j in 0..rows as usize {
            for i in 0..columns as usize {
                let corners = [(i, j), (i + 1, j), (i, j + 1), (i + 1, j + 1)].map(|k| elevation[k]);
                let low = corners.into_iter().fold(f32::INFINITY, f32::min);
                slabs.push([low, corners.into_iter().fold(f32::NEG_INFINITY, f32::max)]);
            }
        }
        let mut level = Level { columns, rows, slabs };
        while level.columns > 1 || level.rows > 1 {
            let (columns, rows) = (level.columns.div_ceil(2), level.rows.div_ceil(2));
            let mut slabs = Vec::with_capacity(columns as usize * rows as usize);
            for j in 0..rows {
                for i in 0..columns {
                    let children = [(0, 0), (1, 0), (0, 1), (1, 1)]
                        .into_iter()
                        .filter_map(|(a, b)| level.slab(2 * i + a, 2 * j + b));
                    slabs.push(
                        children.fold([f32::INFINITY, f32::NEG_INFINITY], |[l, h], [low, high]| {
                            [l.min(low), h.max(high)]
                        }),
                    );
                }
            }
            self.levels
                .push(std::mem::replace(&mut level, Level { columns, rows, slabs }));
        }
        self.levels.push(level);
    }

    /// First hit in a node, and the cell that it is in.
    fn node(&self, local: &Local, node: (usize, u32, u32), span: (f64, f64)) -> Option<(f64, u32, u32)> {
        let (level, i, j) = node;
        let [low, high] = self.levels.get(level)?.slab(i, j)?;
        let side = f64::from(1_u32 << level);
        let (t0, t1) = local.clip([f64::from(i) * side, f64::from(j) * side], side, span)?;
        let (y0, y1) = (local.y + local.dy * t0, local.y + local.dy * t1);
        let (low, high) = (f64::from(low), f64::from(high));
        let pad = PAD * (high - low + y0.abs().max(y1.abs()));
        if y0.min(y1) > high + pad || y0.max(y1) < low - pad {
            return None;
        }
        if level == 0 {
            return self.cells.cell(local, i, j, span.0, span.1).map(|t| (t, i, j));
        }
        // A line meets the near child first and the far one last, and at most one of the other two.
        let near = (u32::from(local.dx < 0.0), u32::from(local.dz < 0.0));
        [(0, 0), (1, 0), (0, 1), (1, 1)].into_iter().find_map(|(a, b)| {
            let child = (level - 1, 2 * i + (near.0 ^ a), 2 * j + (near.1 ^ b));
            self.node(local, child, span)
        })
    }
}

impl Caster for MaxMip {
    fn name(&self) -> &'static str {
        "max-mip"
    }

    fn rebuild(&mut self, elevation: &Grid<f32>) -> Result<(), HeightfieldError> {
        self.levels.clear();
        self.cells.rebuild(elevation)?;
        self.raise(elevation);
        Ok(())
    }

    /// As `Heightfield::cast`, save that a root where the ray starts counts.
    fn cast(&self, ray: &Ray, t_min: f64, t_max: f64) -> Option<Hit> {
        let local = self.cells.local(ray);
        let top = self.levels.len().checked_sub(1)?;
        let (t, i, j) = self.node(&local, (top, 0, 0), (t_min, t_max))?;
        Some(self.cells.hit(ray, &local, t, (i, j)))
    }

    fn bytes(&self) -> usize {
        let slabs = self.levels.iter().map(|l| size_of_val(l.slabs.as_slice()));
        self.cells.bytes() + slabs.sum::<usize>()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{DVec3, UVec2, Vec2};
    use meniscus_sim::GridSpec;
    use meniscus_sim::rng::Rng;

    #[test]
    fn it_finds_what_testing_every_cell_finds() {
        let spec = GridSpec::new(Vec2::new(-3.0, 1.0), 0.5, UVec2::new(23, 38)).unwrap();
        let mut rng = Rng::new(3, 1);
        let field = Grid::from_fn(spec, |_, _| rng.uniform_f32());
        for patch in [Patch::Bilinear, Patch::Triangles] {
            let (mip, brute) = (
                MaxMip::build(&field, patch).unwrap(),
                BruteForce::build(&field, patch).unwrap(),
            );
            let mut hits = 0;
            for k in 0..2000 {
                let mut point = |height: f64| {
                    DVec3::new(
                        -5.0 + 15.0 * rng.uniform(),
                        height * (2.0 * rng.uniform() - 0.5),
                        23.0 * rng.uniform(),
                    )
                };
                let (from, to) = (point(2.0), point(1.0));
                let direction = match k % 5 {
                    0 => DVec3::NEG_Y,
                    1 => DVec3::new((to - from).x.signum(), 0.0, 0.0),
                    2 => DVec3::new(1.0, -0.1, -1.0).normalize(),
                    _ => (to - from).normalize(),
                };
                let ray = Ray {
                    origin: from,
                    direction,
                };
                let (a, b) = (mip.cast(&ray, 0.0, 1e9), brute.cast(&ray, 0.0, 1e9));
                match (a, b) {
                    (Some(a), Some(b)) => {
                        hits += 1;
                        assert!((a.t - b.t).abs() < 1e-9, "{ray:?}: {a:?} {b:?}");
                    }
                    (a, b) => assert_eq!(a.is_some(), b.is_some(), "{ray:?}"),
                }
            }
            assert!(hits > 300, "{hits}");
        }
    }
}
