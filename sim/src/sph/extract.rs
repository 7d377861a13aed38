//! The surface of the particles as a heightfield.
//!
//! Cords 2007, equations 5 and 6: a potential φ(x) = Σ √(1 − r²/h²) over the particles nearer than h; the surface of a
//! column is the highest point where φ reaches a value, here the one that gives a lattice with a level top its true
//! height. Columns in which it never does are dry. Walls and ground mirror the particles before them, so that the
//! surface meets them level and a single layer of particles is as deep as it is.
//!
//! Particles are sorted by blocks of columns (`bins`). In each the columns are searched downwards, eight of them side by side
//! (`crossing`), taking up particles as they come within reach (`candidates`), so the cost grows with the number of columns and
//! not with the depth of the water.

use super::bins::Bins;
use super::boundary::Boundary;
use super::candidates::TILE;
use super::crossing::{Buffers, Row, Search};
use super::fluid::Fluid;
use crate::frame::{Channels, Frame, extend_into_dry};
use crate::grid::{Grid, GridSpec};
use glam::{Vec2, Vec3};
use rayon::prelude::*;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Radius h of the potential in particle spacings.
const RADIUS: f32 = 2.0;
/// Sides of a block of columns and thickness of its layers in particle spacings.
const BLOCK: [f32; 2] = [4.0, 4.0];
const LAYER: f32 = 0.5;
/// Radius of the sphere that holds a particle's water, in spacings: (3/4π)^⅓.
const DROPLET: f32 = 0.620_35;
/// Samples by which the surface continues below the shore.
const SHORE: usize = 3;
/// Evaluations of a fast root.
const FAST: usize = 5;
/// How the crossing is found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Root {
    /// Steps of half a spacing, then up to five evaluations: within a few 1e-3 of a spacing.
    Fast,
    /// Steps of an eighth of a spacing, then to the precision of the numbers.
    Exact,
}

/// Makes heightfields of particles, keeping its buffers.
#[derive(Debug)]
pub struct Extractor {
    spec: GridSpec,
    spacing: f32,
    search: Search,
    /// Columns along the sides of a block, which is a bin too.
    block: [usize; 2],
    bins: Bins,
    /// Buffers that no thread has at hand.
    spare: Mutex<Vec<Buffers>>,
    flow: Vec<[f32; 3]>,
}

/// Buffers of one thread, given back when it has done with them.
struct Lent<'a> {
    buffers: Buffers,
    spare: &'a Mutex<Vec<Buffers>>,
}

impl Drop for Lent<'_> {
    fn drop(&mut self) {
        lock(self.spare).push(std::mem::take(&mut self.buffers));
    }
}

/// Whoever panicked with them left buffers that are as good as any.
fn lock(spare: &Mutex<Vec<Buffers>>) -> MutexGuard<'_, Vec<Buffers>> {
    spare.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Extractor {
    /// For particles of that `spacing`, on the samples of `spec`.
    pub fn new(spec: GridSpec, spacing: f32, root: Root) -> Self {
        let (step, most, close) = match root {
            Root::Fast => (0.5, FAST, 1e-2),
            Root::Exact => (0.125, 60, 1e-6),
        };
        // Whole tiles. Wider blocks share more, but not all of it is within reach of each tile.
        let across = |side: usize, width: f32| {
            let tiles = width * spacing / (spec.spacing * side as f32);
            side * (tiles.round() as usize).max(1)
        };
        let block = [across(TILE[0], BLOCK[0]), across(TILE[1], BLOCK[1])];
        Self {
            spec,
            spacing,
            search: Search {
                radius: RADIUS * spacing,
                level: level(RADIUS),
                step: step * spacing,
                most,
                close: close * spacing,
            },
            block,
            bins: Bins::new(spec, block, LAYER * spacing),
            spare: Mutex::default(),
            flow: Vec::new(),
        }
    }

    /// Value of the potential at the surface.
    pub fn level(&self) -> f32 {
        self.search.level
    }

    /// Radius of the potential in metres.
    pub fn radius(&self) -> f32 {
        self.search.radius
    }

    /// Radius in metres of the sphere that holds a particle's water.
    pub fn droplet(&self) -> f32 {
        DROPLET * self.spacing
    }

    /// Writes surface and wanted channels of `fluid` to `out`, over ground of these heights. With `all`, every
    /// particle is a droplet of the frame, not only those clear of the surface.
    pub fn extract(&mut self, fluid: &Fluid, ground: &Grid<f32>, want: Channels, all: bool, out: &mut Frame) {
        let offered = Channels::DEPTH | Channels::VELOCITY | Channels::DROPLETS;
        out.prepare(self.spec, want & offered);
        self.bins.sort(fluid);
        self.heights(fluid.boundary(), ground, &mut out.elevation);
        if let Some(droplets) = &mut out.droplets {
            let elevation = &out.elevation;
            for (p, v) in fluid.positions().iter().zip(fluid.velocities()) {
                let p = p.truncate();
                if all || p.y - 0.5 * self.spacing > self.highest_near(elevation, p) {
                    droplets.position.push(p);
                    droplets.velocity.push(v.truncate());
                    droplets.radius.push(self.droplet());
                }
            }
        }
        // Dry columns hold −∞ so far.
        let wet = |k: usize, e: &Grid<f32>| e.as_slice()[k] > ground.as_slice()[k];
        let depth = Grid::from_fn(self.spec, |i, j| {
            let k = self.spec.index(i, j);
            if wet(k, &out.elevation) {
                out.elevation.as_slice()[k] - ground.as_slice()[k]
            } else {
                0.0
            }
        });
        extend_into_dry(&mut out.elevation, &depth, ground, SHORE);
        if let Some(velocity) = &mut out.velocity {
            self.flows(fluid, &depth, velocity);
        }
        if out.depth.is_some() {
            out.depth = Some(depth);
        }
    }

    /// Heights of all columns; −∞ where there is no surface.
    fn heights(&self, boundary: &Boundary, ground: &Grid<f32>, elevation: &mut Grid<f32>) {
        let rows = elevation
            .as_mut_slice()
            .par_chunks_mut(self.spec.width() * self.block[1]);
        let rows = rows.enumerate();
        let lend = || Lent {
            buffers: lock(&self.spare).pop().unwrap_or_default(),
            spare: &self.spare,
        };
        rows.for_each_init(lend, |lent, (row, out)| {
            pulp::Arch::new().dispatch(Row {
                search: &self.search,
                bins: &self.bins,
                spec: &self.spec,
                boundary,
                ground,
                first: row * self.block[1],
                across: self.block[0],
                buffers: &mut lent.buffers,
                out,
            });
        });
    }

    /// Height of the highest surface among the four columns about `p`.
    fn highest_near(&self, elevation: &Grid<f32>, p: Vec3) -> f32 {
        let g = self.spec.to_grid(Vec2::new(p.x, p.z)).max(Vec2::ZERO);
        let (w, h) = (self.spec.width(), self.spec.height());
        let (i, j) = ((g.x as usize).min(w - 1), (g.y as usize).min(h - 1));
        let (i1, j1) = ((i + 1).min(w - 1), (j + 1).min(h - 1));
        let at = |i, j| elevation[(i, j)];
        at(i, j).max(at(i1, j)).max(at(i, j1)).max(at(i1, j1))
    }

    /// Mean horizontal velocity over the particles about each column.
    fn flows(&mut self, fluid: &Fluid, depth: &Grid<f32>, out: &mut Grid<Vec2>) {
        let side = (self.spacing / self.spec.spacing).round().max(1.0);
        let bins = |columns: usize| columns.div_ceil(side as usize);
        let [nx, nz] = [bins(self.spec.width()), bins(self.spec.height())];
        self.flow.clear();
        self.flow.resize(nx * nz, [0.0; 3]);
        for (p, v) in fluid.positions().iter().zip(fluid.velocities()) {
            let g = (self.spec.to_grid(Vec2::new(p.x, p.z)) + 0.5) / side;
            // Conversion saturates at 0.
            let bin = (g.y as usize).min(nz - 1) * nx + (g.x as usize).min(nx - 1);
            let flow = &mut self.flow[bin];
            flow[0] += v.x;
            flow[1] += v.z;
            flow[2] += 1.0;
        }
        for j in 0..self.spec.height() {
            for i in 0..self.spec.width() {
                out[(i, j)] = Vec2::ZERO;
                if depth[(i, j)] <= 0.0 {
                    continue;
                }
                // Where the column stands between the centres of bins.
                let g = (Vec2::new(i as f32, j as f32) + 0.5) / side - 0.5;
                let base = g.floor();
                let (mut sum, mut weight) = (Vec2::ZERO, 0.0);
                for (dx, dz) in [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)] {
                    let b = base + Vec2::new(dx, dz);
                    if b.min_element() < 0.0 || b.x as usize >= nx || b.y as usize >= nz {
                        continue;
                    }
                    let tent = (1.0 - (g - b).abs()).max(Vec2::splat(1e-3));
                    let flow = self.flow[b.y as usize * nx + b.x as usize];
                    sum += tent.x * tent.y * Vec2::new(flow[0], flow[1]);
                    weight += tent.x * tent.y * flow[2];
                }
                if weight > 0.0 {
                    out[(i, j)] = sum / weight;
                }
            }
        }
    }

    /// Bytes held.
    pub fn bytes(&self) -> u64 {
        let spare: usize = lock(&self.spare).iter().map(Buffers::bytes).sum();
        (self.bins.bytes() + spare + 12 * self.flow.capacity()) as u64
    }
}

/// Mean of φ, with a radius in spacings, over the level plane half a spacing above a half-space of lattice.
fn level(radius: f32) -> f32 {
    const PLACES: i32 = 8;
    let reach = radius.ceil() as i32 + 1;
    let mut sum = 0.0;
    for a in 0..PLACES {
        for b in 0..PLACES {
            let x = (a as f32 + 0.5) / PLACES as f32;
            let z = (b as f32 + 0.5) / PLACES as f32;
            for k in 0..reach {
                for i in -reach..=reach {
                    for j in -reach..=reach {
                        let r2 = (x - i as f32).powi(2) + (z - j as f32).powi(2) + (0.5 + k as f32).powi(2);
                        sum += (1.0 - r2 / (radius * radius)).max(0.0).sqrt();
                    }
                }
            }
        }
    }
    sum / (PLACES * PLACES) as f32
}

#[cfg(test)]
mod tests {
    use super::super::mirrors::mirror;
    use super::*;
    use crate::rng::Rng;
    use crate::sph::Settings;
    use glam::UVec2;

    #[test]
    fn crossings_are_the_highest_of_all_particles_for_any_spacing_of_the_columns() {
        let d = 0.05;
        let tank = Boundary::tank(Vec2::ZERO, Vec2::new(1.0, 0.6), 0.0);
        let mut fluid = Fluid::new(Settings::water(d), tank.clone());
        let mut rng = Rng::new(11, 0);
        for k in 0..20 * 12 * 8 {
            let mut place = |n: u32| d * (n as f32 + 0.5 + 0.3 * (rng.uniform_f32() - 0.5));
            let p = Vec3::new(place(k % 20), place(k / 240), place(k / 20 % 12));
            // A slope, and an empty corner.
            if p.y < 0.1 + 0.3 * p.x && p.x + p.z > 0.3 {
                fluid.add(p, Vec3::ZERO);
            }
        }
        // Those far away cost memory no more than others, and change nothing.
        fluid.add(Vec3::new(0.5, 900.0, 0.3), Vec3::ZERO);
        fluid.add(Vec3::new(-700.0, 0.2, 0.3), Vec3::ZERO);
        let h = RADIUS * d;
        let mut points = Vec::new();
        for p in fluid.positions() {
            points.push(p.truncate());
            mirror(&tank, p.truncate(), h, |image| points.push(image));
        }
        for spacing in [0.012, 0.025, 0.05, 0.15] {
            let size = UVec2::new((1.0 / spacing) as u32 + 1, (0.6 / spacing) as u32 + 1);
            let spec = GridSpec::new(Vec2::ZERO, spacing, size).unwrap();
            let ground = Grid::filled(spec, 0.0);
            for (root, step, close) in [(Root::Fast, 4, 0.03), (Root::Exact, 1, 1e-4)] {
                let mut extractor = Extractor::new(spec, d, root);
                let mut frame = Frame::new(spec);
                extractor.extract(&fluid, &ground, Channels::DEPTH, false, &mut frame);
                let depth = frame.depth.as_ref().unwrap();
                for j in 0..spec.height() {
                    for i in 0..spec.width() {
                        let at = spec.position(i, j);
                        let beside = |p: &&Vec3| at.distance(Vec2::new(p.x, p.z)) < h;
                        let near: Vec<&Vec3> = points.iter().filter(beside).collect();
                        let potential = |y: f32| -> f32 {
                            let left =
                                |p: &Vec3| 1.0 - p.distance_squared(Vec3::new(at.x, y, at.y)) / (h * h);
                            near.iter().map(|p| left(p).max(0.0).sqrt()).sum()
                        };
                        let found = depth[(i, j)];
                        let level = extractor.level();
                        // What is thinner than a step may be missed, but nothing thicker.
                        let (mut thickness, mut thickest) = (0, 0);
                        for k in (found / d * 8.0) as u32 + 1..80 {
                            let y = 0.125 * d * k as f32;
                            let water = y > found + close * d && potential(y) >= level;
                            thickness = if water { thickness + 1 } else { 0 };
                            thickest = thickest.max(thickness);
                        }
                        assert!(thickest <= step, "{root:?} {spacing} {i} {j} {found}: {thickest}");
                        if found > 0.0 {
                            // Near a cliff φ is level with the water for long, and heights say little.
                            let near = (potential(found) - level).abs() < 1e-2 * level;
                            let (over, under) = (potential(found + close * d), potential(found - close * d));
                            let within = over < level && under >= level;
                            assert!(
                                near || within,
                                "{root:?} {spacing} {i} {j} {found}: {over} {under}"
                            );
                        }
                    }
                }
            }
        }
    }
}
