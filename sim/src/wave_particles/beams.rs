//! Particles near walls: what of their shape is reflected, and what lies in the shadow of a wall.
//!
//! A particle is a small round wave. The part of it that would reach behind a wall is mirrored, as if every ray from its
//! centre were folded at the walls: the direct part loses the walls' shadows, and each visible stretch of wall shows the
//! mirror image through itself as through a window. Every point of the shape comes down exactly once, so its volume
//! stays; and a particle whose centre passes a wall turns into its own image without a jump.

use super::walls::{Segment, Walls};
use glam::DVec2;

/// Reflections of reflections that are followed.
const DEEPEST: u32 = 6;

/// Radii that a particle on a wall is moved off it.
const HAIR: f64 = 1e-7;

/// Most images of a particle.
const MOST_BEAMS: usize = 512;

/// The points x with normal · x ≥ offset.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct HalfPlane {
    normal: DVec2,
    offset: f64,
}

impl HalfPlane {
    fn through(point: DVec2, normal: DVec2) -> Self {
        Self {
            normal,
            offset: normal.dot(point),
        }
    }

    fn excess(&self, p: DVec2) -> f64 {
        self.normal.dot(p) - self.offset
    }

    /// The stretch of the row at `z` that lies inside.
    fn on_row(&self, z: f64) -> (f64, f64) {
        let rest = self.offset - self.normal.y * z;
        if self.normal.x > 0.0 {
            (rest / self.normal.x, f64::INFINITY)
        } else if self.normal.x < 0.0 {
            (f64::NEG_INFINITY, rest / self.normal.x)
        } else if rest <= 0.0 {
            (f64::NEG_INFINITY, f64::INFINITY)
        } else {
            (f64::INFINITY, f64::NEG_INFINITY)
        }
    }

    fn mirrored(&self, wall: &Segment) -> Self {
        let along = self.normal.dot(wall.normal);
        Self {
            normal: self.normal - 2.0 * along * wall.normal,
            offset: self.offset - 2.0 * wall.a.dot(wall.normal) * along,
        }
    }
}

/// The points inside three half-planes: two sides of a cone and a wall's line.
pub(super) type Wedge = [HalfPlane; 3];

/// The stretch of a row inside a wedge.
pub(super) fn wedge_on_row(wedge: &Wedge, z: f64) -> (f64, f64) {
    wedge
        .iter()
        .fold((f64::NEG_INFINITY, f64::INFINITY), |(a, b), plane| {
            let (c, d) = plane.on_row(z);
            (a.max(c), b.min(d))
        })
}

/// A particle or an image of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Beam {
    pub(super) centre: DVec2,
    pub(super) direction: DVec2,
    /// Where it is seen; everywhere for the particle itself.
    pub(super) window: Option<Wedge>,
    /// Its shadows in the list of shadows.
    pub(super) shadows: (usize, usize),
}

/// The beams of one particle; reused from particle to particle.
#[derive(Clone, Debug, Default)]
pub(super) struct Beams {
    pub(super) list: Vec<Beam>,
    pub(super) shadows: Vec<Wedge>,
    near: Vec<usize>,
}

/// A stretch of wall that a source sees.
#[derive(Clone, Copy)]
struct Seen {
    wall: usize,
    from: DVec2,
    to: DVec2,
}

/// The cone from `source` through a stretch of wall, on one side of a line.
fn cone(source: DVec2, from: DVec2, to: DVec2, line: HalfPlane) -> Wedge {
    let middle = 0.5 * (from + to) - source;
    let plane = |end: DVec2| {
        let normal = (end - source).perp();
        HalfPlane::through(source, if normal.dot(middle) < 0.0 { -normal } else { normal })
    };
    [plane(from), plane(to), line]
}

/// The part of a stretch inside a wedge; `None` if there is none.
fn clipped(mut from: DVec2, mut to: DVec2, wedge: &Wedge) -> Option<(DVec2, DVec2)> {
    for plane in wedge {
        let (a, b) = (plane.excess(from), plane.excess(to));
        if a <= 0.0 && b <= 0.0 {
            return None;
        }
        let cut = from + a / (a - b) * (to - from);
        if a < 0.0 {
            from = cut;
        } else if b < 0.0 {
            to = cut;
        }
    }
    ((to - from).length_squared() > 0.0).then_some((from, to))
}

fn distance_to(p: DVec2, from: DVec2, to: DVec2) -> f64 {
    let along = to - from;
    let share = ((p - from).dot(along) / along.length_squared()).clamp(0.0, 1.0);
    (from + share * along - p).length()
}

impl Beams {
    /// The beams of a particle; an empty list if no wall is within its radius.
    pub(super) fn find(&mut self, walls: &Walls, centre: DVec2, direction: DVec2, radius: f64) {
        self.list.clear();
        self.shadows.clear();
        if walls.is_clear(centre, radius) {
            return;
        }
        walls.around(centre, radius, &mut self.near);
        if self.near.is_empty() {
            return;
        }
        // On a wall a particle and its image are the same; a hair before it they can be told apart.
        let hair = HAIR * radius;
        let mut centre = centre;
        for _ in 0..4 {
            for &wall in &self.near {
                let s = walls.segment(wall);
                let front = s.front(centre);
                if front.abs() < hair && s.distance(centre) < hair {
                    centre += (hair - front) * s.normal;
                }
            }
        }
        self.follow(walls, centre, direction, radius, None, &[], 0);
    }

    #[allow(clippy::too_many_arguments)] // one recursion, each value changes from level to level
    fn follow(
        &mut self,
        walls: &Walls,
        source: DVec2,
        direction: DVec2,
        radius: f64,
        window: Option<(usize, Wedge)>,
        inherited: &[Wedge],
        depth: u32,
    ) {
        if self.list.len() >= MOST_BEAMS {
            return;
        }
        walls.around(source, radius, &mut self.near);
        let seen: Vec<Seen> = self
            .near
            .iter()
            .filter_map(|&wall| {
                let s = walls.segment(wall);
                if !(s.front(source) > 0.0) || window.as_ref().is_some_and(|(own, _)| *own == wall) {
                    return None;
                }
                let (from, to) = match &window {
                    None => (s.a, s.b),
                    Some((_, wedge)) => clipped(s.a, s.b, wedge)?,
                };
                (distance_to(source, from, to) < radius).then_some(Seen { wall, from, to })
            })
            .collect();
        let first = self.shadows.len();
        self.shadows.extend_from_slice(inherited);
        for s in &seen {
            let wall = walls.segment(s.wall);
            let behind = HalfPlane::through(wall.a, -wall.normal);
            self.shadows.push(cone(source, s.from, s.to, behind));
        }
        self.list.push(Beam {
            centre: source,
            direction,
            window: window.map(|w| w.1),
            shadows: (first, self.shadows.len()),
        });
        if depth == DEEPEST {
            return;
        }
        let all = self.shadows[first..].to_vec();
        for s in &seen {
            let wall = walls.segment(s.wall);
            let image = wall.mirror(source);
            let window = cone(image, s.from, s.to, HalfPlane::through(wall.a, wall.normal));
            let shadows = Self::mirrored(walls, &seen, s, inherited, &all);
            self.follow(
                walls,
                image,
                wall.reflect(direction),
                radius,
                Some((s.wall, window)),
                &shadows,
                depth + 1,
            );
        }
    }

    /// What hides parts of the wall `by` from the source, mirrored at it: the other shadows, save those of walls that
    /// stand behind it.
    fn mirrored(walls: &Walls, seen: &[Seen], by: &Seen, inherited: &[Wedge], all: &[Wedge]) -> Vec<Wedge> {
        let wall = walls.segment(by.wall);
        let turn = |wedge: &Wedge| wedge.map(|plane| plane.mirrored(wall));
        let mut out: Vec<Wedge> = inherited.iter().map(turn).collect();
        for (other, wedge) in seen.iter().zip(&all[inherited.len()..]) {
            if other.wall == by.wall {
                continue;
            }
            let hair = 1e-9 * (by.to - by.from).length();
            let before = wall.front(other.from) > hair || wall.front(other.to) > hair;
            // Only a shadow that falls on the wall matters.
            let falls = clipped(by.from, by.to, wedge).is_some();
            if before && falls {
                out.push(turn(wedge));
            }
        }
        out
    }
}
