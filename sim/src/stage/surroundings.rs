//! What lies beyond the edges of the simulated rectangle.
//!
//! A picture has no edges, so something must. Rules, in this order:
//! - A periodic axis repeats.
//! - A *basin*, that is a domain without ground or whose walls all stand in water, is sunk into a level deck: its walls
//!   are seen, and the deck runs to the horizon. A wall that stands between the camera and the water (the camera is
//!   beyond it and below the deck) is left out and the water shows its side, as an aquarium does.
//! - Elsewhere, open edges and the walls of a landscape, water continues at its level of rest and ground as its mirror
//!   image fading into a plain of the mean height of its rim ([`Continuation`]).

use super::Ray;
use super::continuation::Continuation;
use crate::scene::description::{Edge, Initial};
use crate::{Grid, GridSpec, Scene};
use glam::{BVec2, DVec2, DVec3, UVec2};

/// Largest apron of the ground in samples.
const GROUND_APRON: u32 = 512;

/// A side of the domain that ends the water.
#[derive(Clone, Copy, Debug)]
pub struct Side {
    /// 0 for X, 2 for Z.
    pub axis: usize,
    /// Its coordinate along that axis, metres.
    pub at: f64,
    /// −1 at the smaller end of the axis, +1 at the larger.
    pub outwards: f64,
    /// Whether the water is seen through it.
    pub glass: bool,
}

impl Side {
    /// Metres beyond the side.
    fn beyond(&self, p: DVec3) -> f64 {
        self.outwards * (p[self.axis] - self.at)
    }

    fn normal(&self) -> DVec3 {
        let mut n = DVec3::ZERO;
        n[self.axis] = self.outwards;
        n
    }
}

/// The sides of the domain that end the water.
#[derive(Clone, Debug, Default)]
pub struct Edges {
    /// At most four.
    pub sides: Vec<Side>,
    /// Height of the deck around a basin, metres.
    pub deck: f64,
}

/// Highest level at which water stands at the start.
fn initial_level(scene: &Scene) -> f64 {
    let water = &scene.description.water;
    let level = match water.initial {
        Initial::Dam { level, .. } => level.max(water.level),
        _ => water.level,
    };
    f64::from(level)
}

/// Whether the walls of the scene are those of a basin.
pub fn is_basin(scene: &Scene) -> bool {
    let boundary = &scene.description.boundary;
    let walls = [boundary.x_min, boundary.x_max, boundary.z_min, boundary.z_max].map(|e| e == Edge::Wall);
    if walls == [false; 4] {
        return false;
    }
    let Some(terrain) = &scene.terrain else {
        return true;
    };
    let level = initial_level(scene) as f32;
    let spec = scene.grid;
    let (w, h) = (spec.width(), spec.height());
    let wet = |i: usize, j: usize| terrain.sample(spec.position(i, j)) < level;
    (!walls[0] || (0..h).all(|j| wet(0, j)))
        && (!walls[1] || (0..h).all(|j| wet(w - 1, j)))
        && (!walls[2] || (0..w).all(|i| wet(i, 0)))
        && (!walls[3] || (0..w).all(|i| wet(i, h - 1)))
}

impl Edges {
    /// The sides of a basin seen from `eye`; none for a landscape or the open sea.
    pub fn new(scene: &Scene, elevation: &Grid<f32>, eye: DVec3) -> Self {
        if !is_basin(scene) {
            return Self::default();
        }
        let spec = elevation.spec();
        let (low, extent) = (spec.origin.as_dvec2(), spec.extent().as_dvec2());
        let high = low + extent;
        let level = initial_level(scene);
        // Where a wave has climbed the wall the deck is raised with it: water has no side in the air.
        let (w, h) = (spec.width(), spec.height());
        let rim = (0..w)
            .flat_map(|i| [elevation[(i, 0)], elevation[(i, h - 1)]])
            .chain((0..h).flat_map(|j| [elevation[(0, j)], elevation[(w - 1, j)]]))
            .fold(f32::NEG_INFINITY, f32::max);
        let deck = (level + 0.03 * extent.max_element().max(f64::from(spec.spacing)))
            .max(f64::from(rim) + 1e-6 * extent.max_element());
        let boundary = &scene.description.boundary;
        let sides = [
            (boundary.x_min, 0, low.x, -1.0),
            (boundary.x_max, 0, high.x, 1.0),
            (boundary.z_min, 2, low.y, -1.0),
            (boundary.z_max, 2, high.y, 1.0),
        ];
        let sides = sides
            .into_iter()
            .filter(|(edge, ..)| *edge == Edge::Wall)
            .map(|(_, axis, at, outwards)| {
                let mut side = Side {
                    axis,
                    at,
                    outwards,
                    glass: false,
                };
                side.glass = eye.y < deck && side.beyond(eye) > 0.0;
                side
            })
            .collect();
        Self { sides, deck }
    }

    /// Whether a side of the water is seen through.
    pub fn has_glass(&self) -> bool {
        self.sides.iter().any(|s| s.glass)
    }

    /// Whether a point is not beyond a glass side.
    pub fn within_glass(&self, p: DVec3) -> bool {
        self.sides.iter().all(|s| !s.glass || s.beyond(p) <= 0.0)
    }

    /// First wall or deck: ray parameter and normal. A solid side fills the half-space beyond it up to the deck.
    pub fn cast_solid(&self, ray: &Ray, t_max: f64) -> Option<(f64, DVec3)> {
        let mut best: Option<(f64, DVec3)> = None;
        let mut limit = t_max;
        for side in self.sides.iter().filter(|s| !s.glass) {
            let outwards = side.outwards * ray.direction[side.axis];
            let start = side.beyond(ray.origin);
            if outwards > 0.0 && start <= 0.0 {
                let t = -start / outwards;
                let y = ray.origin.y + t * ray.direction.y;
                if t <= limit && y <= self.deck {
                    (limit, best) = (t, Some((t, -side.normal())));
                }
            }
            if ray.direction.y < 0.0 && ray.origin.y >= self.deck {
                let t = (self.deck - ray.origin.y) / ray.direction.y;
                if t <= limit && side.beyond(ray.origin + t * ray.direction) >= 0.0 {
                    (limit, best) = (t, Some((t, DVec3::Y)));
                }
            }
        }
        best
    }

    /// First glass side at a point where there is water: ray parameter and normal into the air.
    pub fn cast_glass(&self, ray: &Ray, t_max: f64, wet: impl Fn(DVec3) -> bool) -> Option<(f64, DVec3)> {
        let mut best: Option<(f64, DVec3)> = None;
        let mut limit = t_max;
        for side in self.sides.iter().filter(|s| s.glass) {
            let speed = side.outwards * ray.direction[side.axis];
            let t = -side.beyond(ray.origin) / speed;
            if !(t >= 0.0 && t <= limit) {
                continue;
            }
            let p = ray.origin + t * ray.direction;
            let beside = self
                .sides
                .iter()
                .any(|other| other.axis != side.axis && other.beyond(p) > 0.0);
            if !beside && wet(p) {
                (limit, best) = (t, Some((t, side.normal())));
            }
        }
        best
    }
}

/// How the water surface goes on beyond its grid.
pub fn water_continuation(scene: &Scene) -> Continuation {
    let boundary = &scene.description.boundary;
    let periodic = BVec2::new(boundary.x_min == Edge::Periodic, boundary.z_min == Edge::Periodic);
    let spec = scene.grid;
    let apron = |n: u32, ends: [Edge; 2]| {
        // The sides of a basin are at the last samples: nothing goes on there.
        if is_basin(scene) && ends == [Edge::Wall; 2] {
            0
        } else {
            (n / 8).clamp(16, 128).min(n.saturating_sub(1))
        }
    };
    Continuation {
        periodic,
        apron: UVec2::new(
            apron(spec.size.x, [boundary.x_min, boundary.x_max]),
            apron(spec.size.y, [boundary.z_min, boundary.z_max]),
        ),
        level: scene.description.water.level,
    }
}

/// How the ground goes on beyond its grid, which need not be that of the water.
pub fn ground_continuation(terrain: &Grid<f32>, level: f32) -> Continuation {
    let spec: &GridSpec = terrain.spec();
    let (w, h) = (spec.width(), spec.height());
    let rim = (0..w)
        .flat_map(|i| [terrain[(i, 0)], terrain[(i, h - 1)]])
        .chain((1..h.max(1) - 1).flat_map(|j| [terrain[(0, j)], terrain[(w - 1, j)]]));
    let (mut sum, mut count) = (0.0_f64, 0.0_f64);
    for v in rim {
        sum += f64::from(v);
        count += 1.0;
    }
    let (low, high) = terrain.range();
    let mut plain = (sum / count.max(1.0)) as f32;
    // A plain at exactly the water's level would fight with it for every ray.
    let step = 0.01 * (high - low);
    if step > 0.0 && (plain - level).abs() < step {
        plain = level + if plain < level { -step } else { step };
    }
    let apron = |n: u32| {
        if low == high {
            1
        } else {
            (n / 2).clamp(8, GROUND_APRON).min(n.saturating_sub(1))
        }
    };
    Continuation {
        periodic: BVec2::FALSE,
        apron: UVec2::new(apron(spec.size.x), apron(spec.size.y)),
        level: plain,
    }
}

/// Side of the square that holds the scene, metres: what lengths are compared with.
pub fn scale(scene: &Scene) -> f64 {
    let water = scene.grid.extent().as_dvec2();
    let ground = scene
        .terrain
        .as_ref()
        .map_or(DVec2::ZERO, |t| t.spec().extent().as_dvec2());
    water.max(ground).max_element().max(f64::from(scene.grid.spacing))
}
