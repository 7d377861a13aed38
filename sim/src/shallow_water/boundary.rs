//! Ghost cells: what stands beyond each edge.

use super::edges::{Condition, Edges};
use super::real::Real;
use super::storage::{Fields, GHOSTS, Layout};
use crate::solvers::GRAVITY;

/// The edges of a grid with what stood there at the start.
#[derive(Clone, Debug)]
pub(crate) struct Boundary {
    layout: Layout,
    edges: Edges,
    /// Depth at the start in the outermost cells along each edge, ghost columns included, m: x_min, x_max, z_min, z_max.
    still: [Vec<f64>; 4],
}

/// What stands beyond an edge.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Beyond {
    /// The mirror image along X.
    MirrorX,
    /// The mirror image along Z.
    MirrorZ,
    /// The domain again.
    Repeat,
    /// Other water, whose state the edge condition makes.
    Foreign,
}

/// One ghost cell and the cells that it may take its state from, as padded indices.
#[derive(Clone, Copy)]
struct Ghost {
    at: usize,
    mirror: usize,
    nearest: usize,
    /// The cell behind the nearest one.
    second: usize,
    wrapped: usize,
    /// Number of the cell along the edge.
    along: usize,
    /// Distance from the nearest cell, in cells.
    distance: usize,
}

/// One of the four edges.
#[derive(Clone, Copy)]
struct Side {
    /// Number in [`Boundary::still`].
    number: usize,
    /// Whether its normal is along X.
    x: bool,
    /// Whether the outward normal points to larger coordinates.
    upper: bool,
}

/// In the order in which they are filled: Z edges after X edges, corners included, so that sources are filled before.
const SIDES: [Side; 4] = [
    Side {
        number: 0,
        x: true,
        upper: false,
    },
    Side {
        number: 1,
        x: true,
        upper: true,
    },
    Side {
        number: 2,
        x: false,
        upper: false,
    },
    Side {
        number: 3,
        x: false,
        upper: true,
    },
];

impl Side {
    fn condition(self, edges: &Edges) -> &Condition {
        [&edges.x_min, &edges.x_max, &edges.z_min, &edges.z_max][self.number]
    }

    /// The ghosts beyond this edge.
    fn ghosts(self, layout: Layout) -> impl Iterator<Item = Ghost> {
        let Layout { nx, nz, stride } = layout;
        let Self { x, upper, .. } = self;
        let count = if x { nx } else { nz };
        let along = if x {
            GHOSTS..GHOSTS + nz
        } else {
            0..nx + 2 * GHOSTS
        };
        (1..=GHOSTS).flat_map(move |g| {
            let last = GHOSTS + count - 1;
            let (at, mirror, nearest, second, wrapped) = if upper {
                (last + g, last + 1 - g, last, last - 1, GHOSTS + g - 1)
            } else {
                (GHOSTS - g, GHOSTS + g - 1, GHOSTS, GHOSTS + 1, last + 1 - g)
            };
            along.clone().map(move |k| {
                let index = |normal: usize| {
                    if x {
                        k * stride + normal
                    } else {
                        normal * stride + k
                    }
                };
                Ghost {
                    at: index(at),
                    mirror: index(mirror),
                    nearest: index(nearest),
                    second: index(second),
                    wrapped: index(wrapped),
                    along: k,
                    distance: g,
                }
            })
        })
    }
}

impl Boundary {
    /// Edges without memory of a start; see [`Self::remember`].
    pub(crate) fn new(layout: Layout, edges: Edges) -> Self {
        Self {
            layout,
            edges,
            still: Default::default(),
        }
    }

    pub(crate) fn bytes(&self) -> usize {
        self.still.iter().map(|v| v.len() * size_of::<f64>()).sum()
    }

    /// Beyond which edges (x_min, x_max, z_min, z_max) the state may change while nothing inside does.
    pub(crate) fn driven(&self) -> [bool; 4] {
        SIDES.map(|s| {
            matches!(
                s.condition(&self.edges),
                Condition::Elevation(_) | Condition::Discharge(_)
            )
        })
    }

    /// Beyond which edges (x_min, x_max, z_min, z_max) the water is neither a mirror image nor the domain again.
    pub(crate) fn foreign(&self) -> [bool; 4] {
        SIDES.map(|s| !matches!(s.condition(&self.edges), Condition::Wall | Condition::Periodic))
    }

    /// Whether the domain repeats along X and along Z.
    pub(crate) fn wraps(&self) -> [bool; 2] {
        [&self.edges.x_min, &self.edges.z_min].map(|c| *c == Condition::Periodic)
    }

    /// Fills the ghosts of a bed: mirrored beyond walls, repeated beyond periodic edges, continued
    /// straight on beyond the others.
    pub(crate) fn fill_bed<T: Real>(&self, bed: &mut [T]) {
        for side in SIDES {
            for ghost in side.ghosts(self.layout) {
                bed[ghost.at] = match side.condition(&self.edges) {
                    Condition::Wall => bed[ghost.mirror],
                    Condition::Periodic => bed[ghost.wrapped],
                    _ => {
                        let slope = bed[ghost.nearest] - bed[ghost.second];
                        bed[ghost.nearest] + T::from_f64(ghost.distance as f64) * slope
                    }
                };
            }
        }
    }

    /// Where each ghost's state comes from, in an order in which sources are filled before: its padded index, the cell
    /// that it mirrors or repeats (the nearest one beyond other edges), and how.
    pub(crate) fn ghosts(&self) -> impl Iterator<Item = (usize, usize, Beyond)> {
        SIDES.into_iter().flat_map(move |side| {
            let condition = side.condition(&self.edges);
            side.ghosts(self.layout).map(move |ghost| match condition {
                Condition::Wall if side.x => (ghost.at, ghost.mirror, Beyond::MirrorX),
                Condition::Wall => (ghost.at, ghost.mirror, Beyond::MirrorZ),
                Condition::Periodic => (ghost.at, ghost.wrapped, Beyond::Repeat),
                _ => (ghost.at, ghost.nearest, Beyond::Foreign),
            })
        })
    }

    /// Keeps the present depths at open edges as those of the still water beyond.
    pub(crate) fn remember<T: Real>(&mut self, h: &[T], bed: &[T]) {
        for side in SIDES {
            let still = &mut self.still[side.number];
            still.clear();
            if *side.condition(&self.edges) != Condition::Open {
                continue;
            }
            let count = if side.x { self.layout.nz } else { self.layout.nx } + 2 * GHOSTS;
            still.resize(count, 0.0);
            for ghost in side.ghosts(self.layout) {
                // The columns beyond the corners hold no water yet: that of the outermost column at its level.
                let inside = ghost.along.clamp(GHOSTS, count - GHOSTS - 1);
                let step = if side.x { self.layout.stride } else { 1 };
                let from = ghost.nearest + inside * step - ghost.along * step;
                let fall = bed[from].to_f64() - bed[ghost.nearest].to_f64();
                still[ghost.along] = (h[from].to_f64() + fall).max(0.0);
            }
        }
    }

    /// Takes note that the bed of cell `(i, j)` has risen by `dz` m: beyond an open edge it rises with it, under water
    /// whose level stays.
    pub(crate) fn lift(&mut self, i: usize, j: usize, dz: f64) {
        let Layout { nx, nz, .. } = self.layout;
        for (number, at_edge, along, count) in [
            (0, i == 0, j, nz),
            (1, i + 1 == nx, j, nz),
            (2, j == 0, i, nx),
            (3, j + 1 == nz, i, nx),
        ] {
            let still = &mut self.still[number];
            if !at_edge || still.is_empty() {
                continue;
            }
            // The columns beyond a corner go with the one inside.
            let first = if along == 0 { 0 } else { along + GHOSTS };
            let last = if along + 1 == count {
                along + 2 * GHOSTS
            } else {
                along + GHOSTS
            };
            for depth in &mut still[first..=last] {
                // Land that rises out of that water is below it by as much, and may sink again.
                *depth -= dz;
            }
        }
    }

    /// Fills the ghosts of the state for a step whose middle is at `time`; `base` is the height of bed 0.
    pub(crate) fn fill<T: Real>(&self, time: f64, base: f64, film: f64, bed: &[T], fields: &mut Fields<T>) {
        let Fields { h, qx, qz } = fields;
        for side in SIDES {
            let condition = side.condition(&self.edges);
            let value = match condition {
                Condition::Elevation(series) => series.at(time) - base,
                Condition::Discharge(series) => series.at(time),
                _ => 0.0,
            };
            for ghost in side.ghosts(self.layout) {
                let at = ghost.at;
                let copied = match condition {
                    Condition::Wall => {
                        let k = ghost.mirror;
                        h[at] = h[k];
                        (qx[at], qz[at]) = if side.x { (-qx[k], qz[k]) } else { (qx[k], -qz[k]) };
                        true
                    }
                    Condition::Periodic => {
                        let k = ghost.wrapped;
                        (h[at], qx[at], qz[at]) = (h[k], qx[k], qz[k]);
                        true
                    }
                    _ => false,
                };
                if copied {
                    continue;
                }
                let k = ghost.nearest;
                let sign = if side.upper { 1.0 } else { -1.0 };
                let (normal, across) = if side.x { (qx[k], qz[k]) } else { (qz[k], qx[k]) };
                let inside = Water::new(h[k].to_f64(), sign * normal.to_f64(), across.to_f64(), film);
                let z = |at: usize| bed[at].to_f64();
                // The slope of the surface inside goes on outside where the flow, not a wave, makes it.
                let slope = if h[k].to_f64() > film && h[ghost.second].to_f64() > film {
                    let slope = (h[k] - h[ghost.second]).to_f64() + (z(k) - z(ghost.second));
                    slope.clamp(-inside.h, inside.h)
                } else {
                    0.0
                };
                let distance = ghost.distance as f64;
                let (beyond, rise) = match condition {
                    // The value is that of the edge itself, half a cell before the first ghost.
                    Condition::Elevation(_) => (inside.at_depth(value - z(k)), (distance - 0.5) * slope),
                    Condition::Discharge(_) => (inside.at_discharge(value), distance * slope),
                    _ => (inside.leaving(self.still[side.number][ghost.along]), 0.0),
                };
                let fall = z(k) - z(at);
                let level = (beyond.h + rise + fall).max(0.0);
                let (depth, normal) = match condition {
                    // The discharge is what is given, or follows from the given depth.
                    Condition::Elevation(_) | Condition::Discharge(_) => (level, beyond.q),
                    // Over dry land: downhill as a uniform flow, uphill under a level surface.
                    _ if beyond.free => {
                        let depth = level.min(beyond.h);
                        (depth, beyond.u * depth)
                    }
                    _ => (level, beyond.u * level),
                };
                let normal = if depth > 0.0 { sign * normal } else { 0.0 };
                let across = if depth > 0.0 { beyond.across } else { 0.0 };
                h[at] = T::from_f64(depth);
                let (x, z) = if side.x {
                    (normal, across)
                } else {
                    (across, normal)
                };
                (qx[at], qz[at]) = (T::from_f64(x), T::from_f64(z));
            }
        }
    }
}

/// Water at an edge: depth, momentum outwards and along the edge.
///
/// In subcritical flow one wave arrives from inside and brings the invariant u + 2c (u outwards), the other comes from
/// beyond (Toro 2001, §6.3).
#[derive(Clone, Copy, Debug, PartialEq)]
struct Water {
    h: f64,
    q: f64,
    across: f64,
    u: f64,
    c: f64,
    /// Whether nothing stands against its leaving.
    free: bool,
}

impl Water {
    fn new(h: f64, q: f64, across: f64, film: f64) -> Self {
        let thick = h.max(film);
        Self {
            h,
            q,
            across,
            u: q * 2.0 * h / (h * h + thick * thick),
            c: (GRAVITY * h).sqrt(),
            free: false,
        }
    }

    /// The same with another depth and velocity; momentum along the edge only leaves, none enters.
    fn with(self, h: f64, u: f64) -> Self {
        let across = if u > 0.0 && self.h > 0.0 {
            self.across / self.h * h
        } else {
            0.0
        };
        Self {
            h,
            q: h * u,
            across,
            u,
            c: (GRAVITY * h).sqrt(),
            free: false,
        }
    }

    /// Over a dry far field and in fast outflow everything leaves; else the incoming wave is that of still water.
    fn leaving(self, still: f64) -> Self {
        if still <= 0.0 || self.u >= self.c {
            return Self {
                q: self.q.max(0.0),
                u: self.u.max(0.0),
                free: true,
                ..self
            };
        }
        // What the outgoing invariant has more than still water; exactly 0 at rest.
        let c0 = (GRAVITY * still).sqrt();
        let excess = self.u + 2.0 * (self.c - c0);
        let rise = excess * (0.5 * c0 + 0.0625 * excess) / GRAVITY;
        self.with((still + rise).max(0.0), 0.5 * excess)
    }

    /// A given depth, with the velocity that the arriving wave leaves it.
    fn at_depth(self, depth: f64) -> Self {
        let depth = depth.max(0.0);
        if self.u >= self.c && self.h > 0.0 {
            return self;
        }
        let c = (GRAVITY * depth).sqrt();
        // Water never enters faster than its own waves.
        self.with(depth, (self.u + 2.0 * (self.c - c)).max(-c))
    }

    /// A given discharge inwards, with the depth that the arriving wave leaves it, but no faster than critical.
    fn at_discharge(self, inwards: f64) -> Self {
        if inwards <= 0.0 {
            // An outflow that takes no more than there is.
            let u = if self.h > 0.0 {
                (-inwards / self.h).min(self.c)
            } else {
                0.0
            };
            return Self {
                q: self.h * u,
                u,
                ..self
            };
        }
        let critical = (GRAVITY * inwards).cbrt();
        let invariant = self.u + 2.0 * self.c;
        // c² (R − 2c) = −g q; convex beyond its extremum, so Newton from above converges monotonically.
        let mut c = critical.max(self.c).max(0.5 * invariant.max(0.0)) + critical;
        for _ in 0..60 {
            let f = c * c * (2.0 * c - invariant) - GRAVITY * inwards;
            let slope = 2.0 * c * (3.0 * c - invariant);
            let next = c - f / slope;
            if !(next < c) {
                break;
            }
            c = next;
        }
        let c = c.max(critical);
        let h = c * c / GRAVITY;
        self.with(h, -inwards / h)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn still_water_stays_still_beyond_an_open_edge() {
        let water = Water::new(2.0, 0.0, 0.0, 1e-5).leaving(2.0);
        assert_eq!((water.h, water.q), (2.0, 0.0));
    }

    #[test]
    fn a_simple_wave_leaves_with_its_own_depth_and_speed() {
        // A wave into still water of depth 1 keeps u = 2 (c − c0).
        let h = 1.2_f64;
        let u = 2.0 * ((GRAVITY * h).sqrt() - GRAVITY.sqrt());
        let water = Water::new(h, u * h, 0.0, 1e-5).leaving(1.0);
        assert!((water.h - h).abs() < 1e-12 && (water.q - u * h).abs() < 1e-12);
    }

    #[test]
    fn a_steady_inflow_is_its_own_boundary_state() {
        // Inflow 4.42 m²/s at 2 m: the invariant of the state gives the state back.
        let inside = Water::new(2.0, -4.42, 0.0, 1e-5);
        let water = inside.at_discharge(4.42);
        assert!(
            (water.h - 2.0).abs() < 1e-12 && (water.q + 4.42).abs() < 1e-12,
            "{water:?}"
        );
        let water = inside.at_depth(2.0);
        assert!((water.h - 2.0).abs() < 1e-12 && (water.q + 4.42).abs() < 1e-12);
        // Onto dry ground it is critical.
        let water = Water::new(0.0, 0.0, 0.0, 1e-5).at_discharge(1.0);
        assert!((water.u.abs() - water.c).abs() < 1e-12 && (water.q + 1.0).abs() < 1e-12);
    }
}
