//! Walls, ground and obstacles: what share of a particle's kernel they fill, and that nothing passes them.
//!
//! Every boundary is known by its distance. Flat ones have mirror images (`mirrors`). A particle at distance z from any
//! other has the share L(z) of its kernel filled by it, as by the plane that touches there ([`CubicSpline::wall`]; after
//! the density maps of Koschier & Bender 2017, with mirrored layers in place of their integral). Boundaries that meet
//! multiply what they leave free: 1 − λ = Π (1 − L).

use super::kernel::CubicSpline;
use super::obstacle::Obstacle;
use crate::grid::Grid;
use glam::{Vec2, Vec3};

/// Entries of the table of L.
const ENTRIES: usize = 512;
/// Least share of a kernel that boundaries leave free.
const LEAST_FREE: f32 = 0.05;
/// Distance in particle spacings that particles keep from walls and ground.
const GAP: f32 = 0.05;
/// Farthest in particle spacings that one step moves a particle out of an obstacle, so that one put into water
/// pushes it aside rather than blasting it away.
const SQUEEZE: f32 = 0.25;

/// Outline of the vessel, seen from above.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outline {
    /// The rectangle of the domain.
    Box,
    /// The largest circle in the rectangle.
    Round,
}

/// The ground below the water.
#[derive(Clone, Debug, PartialEq)]
pub enum Ground {
    /// None: water falls without end.
    None,
    /// Level, at this height in metres.
    Flat(f32),
    /// Heights in metres.
    Heights(Grid<f32>),
}

/// Everything that water cannot pass.
#[derive(Clone, Debug)]
pub struct Boundary {
    /// Smallest X and Z of the vessel in metres.
    pub low: Vec2,
    /// Largest X and Z of the vessel in metres.
    pub high: Vec2,
    /// Whether there is a wall at `low.x`, `high.x`, `low.y`, `high.y`. Ignored where the outline is round.
    pub walls: [bool; 4],
    /// Outline of the vessel.
    pub outline: Outline,
    /// The ground.
    pub ground: Ground,
    /// Bodies in the water.
    pub obstacles: Vec<Obstacle>,
}

impl Boundary {
    /// Nothing anywhere.
    pub fn none() -> Self {
        Self {
            low: Vec2::splat(-1.0),
            high: Vec2::splat(1.0),
            walls: [false; 4],
            outline: Outline::Box,
            ground: Ground::None,
            obstacles: Vec::new(),
        }
    }

    /// A box open at the top.
    pub fn tank(low: Vec2, high: Vec2, floor: f32) -> Self {
        Self {
            low,
            high,
            walls: [true; 4],
            ground: Ground::Flat(floor),
            ..Self::none()
        }
    }

    /// Heights along X, Y and Z of the walls that are flat and upright or level, low and high: those that `mirrors` makes
    /// images of.
    pub(crate) fn mirrors(&self) -> [[Option<f32>; 2]; 3] {
        let ground = match self.ground {
            Ground::Flat(height) => Some(height),
            _ => None,
        };
        let wall = |k: usize, at: f32| (self.walls[k] && self.outline == Outline::Box).then_some(at);
        [
            [wall(0, self.low.x), wall(1, self.high.x)],
            [ground, None],
            [wall(2, self.low.y), wall(3, self.high.y)],
        ]
    }

    /// Height of the ground and its unit normal, where there is ground.
    pub(crate) fn ground_at(&self, p: Vec3) -> Option<(f32, Vec3)> {
        match &self.ground {
            Ground::None => None,
            Ground::Flat(height) => Some((*height, Vec3::Y)),
            Ground::Heights(grid) => {
                let at = Vec2::new(p.x, p.z);
                let step = 0.5 * grid.spec().spacing;
                let slope =
                    |e: Vec2| (grid.sample(at + step * e) - grid.sample(at - step * e)) / (2.0 * step);
                let normal = Vec3::new(-slope(Vec2::X), 1.0, -slope(Vec2::Y)).normalize();
                Some((grid.sample(at), normal))
            }
        }
    }

    /// Calls `wall` with distance and inward normal of every wall and the ground within `reach` of `p`; opposite walls
    /// follow each other.
    fn walls_near(&self, p: Vec3, reach: f32, mut wall: impl FnMut(f32, Vec3)) {
        if self.outline == Outline::Round {
            let centre = 0.5 * (self.low + self.high);
            let radius = 0.5 * (self.high - self.low).min_element();
            let away = Vec2::new(p.x, p.z) - centre;
            let distance = radius - away.length();
            if distance < reach {
                let inward = -away.normalize_or_zero();
                wall(distance, Vec3::new(inward.x, 0.0, inward.y));
            }
        } else {
            let distances = [
                (p.x - self.low.x, Vec3::X),
                (self.high.x - p.x, Vec3::NEG_X),
                (p.z - self.low.y, Vec3::Z),
                (self.high.y - p.z, Vec3::NEG_Z),
            ];
            for ((distance, inward), present) in distances.into_iter().zip(self.walls) {
                if present && distance < reach {
                    wall(distance, inward);
                }
            }
        }
        if let Some((height, normal)) = self.ground_at(p) {
            let distance = (p.y - height) * normal.y;
            if distance < reach {
                wall(distance, normal);
            }
        }
    }

    /// Distance from walls and ground below which [`Self::confine`] moves a particle, m.
    pub(crate) fn gap(spacing: f32) -> f32 {
        GAP * spacing
    }

    /// Moves a particle that has passed a boundary back and takes away the velocity that brought it there. Returns
    /// whether it had to.
    pub(crate) fn confine(&self, spacing: f32, p: &mut Vec3, v: &mut Vec3) -> bool {
        let mut moved = false;
        for obstacle in &self.obstacles {
            if let Some((distance, normal, velocity)) = obstacle.near(*p, 0.0) {
                *p += normal * (-distance).min(SQUEEZE * spacing);
                stop(v, velocity, normal);
                moved = true;
            }
        }
        // Twice, since one wall may push through another where ground and walls meet at an angle.
        for _ in 0..2 {
            let (gap, start) = (Self::gap(spacing), *p);
            self.walls_near(start, gap, |distance, normal| {
                *p += normal * (gap - distance);
                stop(v, Vec3::ZERO, normal);
                moved = true;
            });
        }
        if self.outline == Outline::Box {
            // To the last bit: a sloping ground must not push anything out of the tank.
            let (low, high) = (self.low, self.high);
            if self.walls[0] {
                p.x = p.x.max(low.x);
            }
            if self.walls[1] {
                p.x = p.x.min(high.x);
            }
            if self.walls[2] {
                p.z = p.z.max(low.y);
            }
            if self.walls[3] {
                p.z = p.z.min(high.y);
            }
        }
        moved
    }
}

/// Takes away the part of `v` that approaches a surface of that normal and velocity.
fn stop(v: &mut Vec3, surface: Vec3, normal: Vec3) {
    let approach = (*v - surface).dot(normal).min(0.0);
    *v -= approach * normal;
}

/// What boundaries do to one particle.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Touch {
    /// Density ratio contributed, 0 to 1.
    pub(crate) share: f32,
    /// Its gradient in 1/m.
    pub(crate) gradient: Vec3,
    /// From the boundary to the particle, m.
    pub(crate) arm: Vec3,
    /// Gradients times the velocities of the boundaries, 1/s.
    pub(crate) moving: f32,
    /// Friction of the walls per viscosity, 1/m²; 0 where water slides.
    pub(crate) drag: f32,
    /// The same times the velocities of the boundaries.
    pub(crate) dragged: Vec3,
}

/// L(z) and its slope as a table, for particles of one spacing.
#[derive(Clone, Debug)]
pub(crate) struct WallTable {
    reach: f32,
    inverse: f32,
    entries: Vec<(f32, f32)>,
    spacing: f32,
}

impl WallTable {
    pub(crate) fn new(kernel: &CubicSpline, spacing: f32) -> Self {
        let reach = 0.5 * kernel.support();
        let step = reach / ENTRIES as f32;
        Self {
            reach,
            inverse: 1.0 / step,
            entries: (0..=ENTRIES + 1)
                .map(|k| kernel.wall(spacing, step * k as f32))
                .collect(),
            spacing,
        }
    }

    fn at(&self, z: f32) -> (f32, f32) {
        let x = (z.max(0.0) * self.inverse).min(ENTRIES as f32);
        let k = x as usize;
        let (a, b, t) = (self.entries[k], self.entries[k + 1], x - k as f32);
        (a.0 + t * (b.0 - a.0), a.1 + t * (b.1 - a.1))
    }

    /// Distance in metres beyond which walls fill nothing.
    pub(crate) fn reach(&self) -> f32 {
        self.reach
    }

    /// Friction per viscosity beside a wall, 1/m²: the mirrored layer moves against the water as the water against the wall.
    fn friction(&self, distance: f32, slope: f32) -> f32 {
        slope.abs() / distance.max(0.25 * self.spacing)
    }

    /// What one boundary at `distance` adds to the gradient of the share, where all together fill `share` of the kernel, and
    /// its friction.
    pub(crate) fn part(&self, distance: f32, normal: Vec3, share: f32) -> (Vec3, f32) {
        let (own, slope) = self.at(distance);
        let others = (1.0 - share) / (1.0 - own).max(LEAST_FREE);
        (others * slope * normal, self.friction(distance, slope))
    }

    /// What `boundary` does to a particle at `p`; nothing if none is near. `sticks` adds friction. Of flat walls only
    /// friction counts where there are `mirrors` of them.
    pub(crate) fn touch(&self, boundary: &Boundary, p: Vec3, sticks: bool, mirrors: bool) -> Touch {
        let mut meeting = Meeting::new();
        let (mut drag, mut dragged) = (0.0, Vec3::ZERO);
        let mut add =
            |distance: f32, normal: Vec3, velocity: Vec3, floats: bool, mirrored: bool, opposite: bool| {
                let (share, slope) = self.at(distance);
                if !mirrored {
                    if !opposite {
                        meeting.close();
                    }
                    // How a body moves that the water moves is found with the pressure.
                    let known = if floats { Vec3::ZERO } else { velocity };
                    meeting.open.add(distance, share, slope, normal, known);
                }
                if sticks {
                    let friction = self.friction(distance, slope);
                    drag += friction;
                    dragged += friction * velocity;
                }
            };
        let flat = |normal: Vec3| match boundary.ground {
            // Upright normals are those of the ground; a slope that is level somewhere is no plane of symmetry.
            Ground::Heights(_) if normal.y != 0.0 => false,
            _ => boundary.outline == Outline::Box || normal.y != 0.0,
        };
        let mut before = Vec3::ZERO;
        boundary.walls_near(p, self.reach, |distance, normal| {
            add(
                distance,
                normal,
                Vec3::ZERO,
                false,
                mirrors && flat(normal),
                normal == -before,
            );
            before = normal;
        });
        for obstacle in &boundary.obstacles {
            if let Some((distance, normal, velocity)) = obstacle.near(p, self.reach) {
                add(distance, normal, velocity, obstacle.floats, false, false);
            }
        }
        meeting.close();
        Touch {
            share: 1.0 - meeting.free,
            gradient: meeting.gradient,
            arm: meeting.arm / meeting.gradient.length().max(1e-20),
            moving: meeting.moving,
            drag,
            dragged,
        }
    }
}

/// The product of what boundaries leave free, with its gradient; opposite walls of a thin tank do not overlap, so they
/// add up before they are multiplied.
struct Meeting {
    free: f32,
    gradient: Vec3,
    moving: f32,
    arm: Vec3,
    open: Walls,
}

/// The sum of walls that do not overlap.
#[derive(Default)]
struct Walls {
    share: f32,
    gradient: Vec3,
    moving: f32,
    arm: Vec3,
}

impl Walls {
    fn add(&mut self, distance: f32, share: f32, slope: f32, normal: Vec3, velocity: Vec3) {
        self.share += share;
        self.gradient += slope * normal;
        self.moving += slope * normal.dot(velocity);
        self.arm += distance * slope.abs() * normal;
    }
}

impl Meeting {
    fn new() -> Self {
        Self {
            free: 1.0,
            gradient: Vec3::ZERO,
            moving: 0.0,
            arm: Vec3::ZERO,
            open: Walls::default(),
        }
    }

    fn close(&mut self) {
        let walls = std::mem::take(&mut self.open);
        let rest = (1.0 - walls.share).max(LEAST_FREE);
        self.gradient = self.gradient * rest + walls.gradient * self.free;
        self.moving = self.moving * rest + walls.moving * self.free;
        self.arm = self.arm * rest + walls.arm * self.free;
        self.free *= rest;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const D: f32 = 0.1;

    fn table() -> WallTable {
        WallTable::new(&CubicSpline::new(2.0 * D), D)
    }

    /// What a lattice lacks that begins half a spacing from `walls` walls at right angles.
    fn missing(walls: usize) -> f32 {
        let kernel = CubicSpline::new(2.0 * D);
        let from = |k: usize| if k < walls { 0 } else { -2 };
        let mut sum = 0.0;
        for i in from(0)..=2 {
            for j in from(1)..=2 {
                for k in from(2)..=2_i32 {
                    let r = D * ((i * i + j * j + k * k) as f32).sqrt();
                    sum += D.powi(3) * kernel.at(r);
                }
            }
        }
        1.0 - sum
    }

    /// Blocks before the planes X = 0, Y = 0 and Z = 0, as obstacles, and flat walls that have images besides.
    fn blocks(count: usize) -> Boundary {
        let mut tank = Boundary::tank(Vec2::splat(-9.0), Vec2::splat(9.0), -9.0);
        for axis in [Vec3::X, Vec3::Y, Vec3::Z].into_iter().take(count) {
            let pose = crate::frame::BodyPose {
                position: -2.0 * axis,
                ..crate::frame::BodyPose::default()
            };
            tank.obstacles
                .push(Obstacle::new(crate::sph::Solid::Box(Vec3::splat(2.0)), pose));
        }
        tank
    }

    #[test]
    fn faces_edges_and_corners_are_filled_as_a_lattice_would() {
        let h = 0.5 * D;
        for (walls, tolerance) in [(1, 1e-3), (2, 4e-3), (3, 1.2e-2)] {
            // Away from the edges of the other blocks.
            let p = Vec3::new(
                h,
                if walls > 1 { h } else { 1.0 },
                if walls > 2 { h } else { 1.0 },
            );
            let share = table().touch(&blocks(walls), p, false, true).share;
            assert!(
                (share - missing(walls)).abs() < tolerance,
                "{walls} walls: {share} {}",
                missing(walls)
            );
        }
        // Flat walls have images instead.
        let tank = Boundary::tank(Vec2::ZERO, Vec2::splat(2.0), 0.0);
        let touch = table().touch(&tank, Vec3::splat(h), true, true);
        assert!(touch.share == 0.0 && touch.gradient == Vec3::ZERO && touch.drag > 0.0);
        let share = table().touch(&tank, Vec3::splat(h), false, false).share;
        assert!((share - missing(3)).abs() < 1.2e-2, "{share}");
        let thin = Boundary::tank(Vec2::ZERO, Vec2::new(2.0, D), -1.0);
        let touch = table().touch(&thin, Vec3::new(1.0, 0.0, h), false, false);
        assert!(
            (touch.share - 2.0 * missing(1)).abs() < 2e-3 && touch.gradient.length() < 1e-4,
            "{touch:?}"
        );
    }

    #[test]
    fn the_gradient_is_that_of_the_share() {
        let tank = blocks(3);
        let (table, e) = (table(), 1e-3);
        let p = Vec3::new(0.06, 0.09, 0.03);
        let share = |p: Vec3| table.touch(&tank, p, false, true).share;
        let touch = table.touch(&tank, p, false, true);
        for axis in [Vec3::X, Vec3::Y, Vec3::Z] {
            let slope = (share(p + e * axis) - share(p - e * axis)) / (2.0 * e);
            assert!(
                (slope - touch.gradient.dot(axis)).abs() < 0.02 * touch.gradient.length(),
                "{axis} {slope} {touch:?}"
            );
        }
    }

    #[test]
    fn nothing_stays_outside() {
        let mut tank = Boundary::tank(Vec2::ZERO, Vec2::new(1.0, D), 0.0);
        for (outline, p) in [
            (Outline::Box, Vec3::new(-3.0, -2.0, 5.0)),
            (Outline::Box, Vec3::new(1e6, -0.5, -1e6)),
            (Outline::Round, Vec3::new(9.0, -1.0, 0.05)),
        ] {
            tank.outline = outline;
            let (mut p, mut v) = (p, Vec3::new(-4.0, -5.0, 60.0));
            assert!(tank.confine(D, &mut p, &mut v));
            assert!(
                (0.0..=1.0).contains(&p.x) && (0.0..=D).contains(&p.z) && p.y >= 0.0,
                "{p}"
            );
            assert!(v.y >= 0.0);
        }
    }
}
