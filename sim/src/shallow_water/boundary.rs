//! Ghost cells: what stands beyond each edge.

use super::real::Real;
use super::storage::{Fields, GHOSTS, Layout};
use crate::scene::description::{Boundary, Edge};

/// Fills the ghosts of a bed: level beyond open edges, mirrored beyond walls, repeated beyond periodic ones.
pub(crate) fn fill_bed<T: Real>(layout: Layout, boundary: &Boundary, bed: &mut [T]) {
    for_each_ghost(layout, boundary, |ghost| {
        bed[ghost.at] = match ghost.edge {
            Edge::Wall => bed[ghost.mirror],
            Edge::Open => bed[ghost.nearest],
            Edge::Periodic => bed[ghost.wrapped],
        };
    });
}

/// Still water beyond the open edges: the depth at the start in every ghost cell, 0 beyond the others.
#[derive(Clone, Debug)]
pub(crate) struct FarField<T> {
    /// Depth in each cell of the outermost ring of the domain, by padded index.
    depth: Vec<(usize, T)>,
}

/// One ghost cell and the cells that it may take its state from, as padded indices.
struct Ghost {
    at: usize,
    edge: Edge,
    /// Whether the edge is one along X (its normal is X).
    along_x: bool,
    /// Whether the outward normal points to larger coordinates.
    upper: bool,
    mirror: usize,
    nearest: usize,
    wrapped: usize,
}

/// Visits the ghosts beyond the X edges of all rows of the domain, then those beyond the Z edges of all columns,
/// corners included; sources are always filled before.
fn for_each_ghost(layout: Layout, boundary: &Boundary, mut visit: impl FnMut(Ghost)) {
    let Layout { nx, nz, stride } = layout;
    for j in 0..nz {
        let row = (j + GHOSTS) * stride;
        for g in 1..=GHOSTS {
            for (edge, upper) in [(boundary.x_min, false), (boundary.x_max, true)] {
                let column = |i: usize| row + i;
                let (at, mirror, nearest, wrapped) = if upper {
                    (
                        GHOSTS + nx + g - 1,
                        GHOSTS + nx - g,
                        GHOSTS + nx - 1,
                        GHOSTS + g - 1,
                    )
                } else {
                    (GHOSTS - g, GHOSTS + g - 1, GHOSTS, GHOSTS + nx - g)
                };
                visit(Ghost {
                    at: column(at),
                    edge,
                    along_x: true,
                    upper,
                    mirror: column(mirror),
                    nearest: column(nearest),
                    wrapped: column(wrapped),
                });
            }
        }
    }
    for g in 1..=GHOSTS {
        for (edge, upper) in [(boundary.z_min, false), (boundary.z_max, true)] {
            let (at, mirror, nearest, wrapped) = if upper {
                (
                    GHOSTS + nz + g - 1,
                    GHOSTS + nz - g,
                    GHOSTS + nz - 1,
                    GHOSTS + g - 1,
                )
            } else {
                (GHOSTS - g, GHOSTS + g - 1, GHOSTS, GHOSTS + nz - g)
            };
            for i in 0..nx + 2 * GHOSTS {
                visit(Ghost {
                    at: at * stride + i,
                    edge,
                    along_x: false,
                    upper,
                    mirror: mirror * stride + i,
                    nearest: nearest * stride + i,
                    wrapped: wrapped * stride + i,
                });
            }
        }
    }
}

impl<T: Real> FarField<T> {
    /// The water that stands at the edges at the start. Ghosts of `h` must be filled as if every open edge were level.
    pub(crate) fn new(layout: Layout, boundary: &Boundary, h: &[T]) -> Self {
        let mut depth = Vec::new();
        for_each_ghost(layout, boundary, |ghost| {
            if ghost.edge == Edge::Open {
                depth.push((ghost.nearest, h[ghost.nearest]));
            }
        });
        Self { depth }
    }

    pub(crate) fn bytes(&self) -> usize {
        self.depth.len() * size_of::<(usize, T)>()
    }
}

/// Fills the ghosts of the state.
pub(crate) fn fill<T: Real>(
    layout: Layout,
    boundary: &Boundary,
    far: &FarField<T>,
    gravity: T,
    film: T,
    fields: &mut Fields<T>,
) {
    let mut open = far.depth.iter();
    let Fields { h, qx, qz } = fields;
    for_each_ghost(layout, boundary, |ghost| {
        let at = ghost.at;
        match ghost.edge {
            Edge::Periodic => {
                let k = ghost.wrapped;
                (h[at], qx[at], qz[at]) = (h[k], qx[k], qz[k]);
            }
            Edge::Wall => {
                let k = ghost.mirror;
                h[at] = h[k];
                (qx[at], qz[at]) = if ghost.along_x {
                    (-qx[k], qz[k])
                } else {
                    (qx[k], -qz[k])
                };
            }
            Edge::Open => {
                let k = ghost.nearest;
                let still = open.next().map_or(T::ZERO, |&(_, depth)| depth);
                let sign = if ghost.upper { T::ONE } else { -T::ONE };
                let (normal, across) = if ghost.along_x {
                    (qx[k], qz[k])
                } else {
                    (qz[k], qx[k])
                };
                let (depth, normal, across) = leave(h[k], sign * normal, across, still, gravity, film);
                h[at] = depth;
                (qx[at], qz[at]) = if ghost.along_x {
                    (sign * normal, across)
                } else {
                    (across, sign * normal)
                };
            }
        }
    });
}

/// The state beyond an open edge, `q` counted outwards: outgoing waves keep their invariant u + 2c, incoming ones bring
/// that of still water of depth `still` (Toro 2001, §6.3). Over a dry far field and in fast outflow everything leaves.
#[inline]
fn leave<T: Real>(h: T, q: T, across: T, still: T, gravity: T, film: T) -> (T, T, T) {
    let out = q.larger(T::ZERO);
    if h <= film || still <= T::ZERO {
        return (h, out, across);
    }
    let (u, c, c0) = (q / h, (gravity * h).sqrt(), (gravity * still).sqrt());
    if u >= c {
        return (h, out, across);
    }
    // What the outgoing invariant has more than still water; exactly 0 at rest.
    let excess = u + T::TWO * (c - c0);
    let rise = excess * (T::HALF * c0 + T::QUARTER * T::QUARTER * excess) / gravity;
    let depth = (still + rise).larger(T::ZERO);
    let speed = T::HALF * excess;
    let across = if speed > T::ZERO {
        across / h * depth
    } else {
        T::ZERO
    };
    (depth, speed * depth, across)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn still_water_stays_still_beyond_an_open_edge() {
        assert_eq!(leave(2.0, 0.0, 0.0, 2.0, 9.81, 1e-5), (2.0, 0.0, 0.0));
    }

    #[test]
    fn a_simple_wave_leaves_with_its_own_depth_and_speed() {
        // A wave into still water of depth 1 keeps u = 2 (c − c0).
        let (g, h) = (9.81_f64, 1.2_f64);
        let u = 2.0 * ((g * h).sqrt() - g.sqrt());
        let (depth, q, _) = leave(h, u * h, 0.0, 1.0, g, 1e-5);
        assert!((depth - h).abs() < 1e-12 && (q - u * h).abs() < 1e-12);
    }
}
