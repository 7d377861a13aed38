//! The exact part: where a ray meets the surface within one column of cells, in `f64`.
//!
//! Along a ray, `f` is its height above the surface. Within one cell `f` is the quadratic through its values at both ends
//! of the segment plus `twist · Δu · Δv · s (1 − s)`, and the values at the ends stand on cell edges, where they are
//! computed from the two samples of the edge alone. Both cells at an edge therefore see the same value, and a ray cannot
//! slip between them.

use super::surface::{Layout, Patch, Surface, lerp};
use super::walk::{Walk, cell, larger, smaller};
use super::{Hit, Ray};
use glam::DVec3;

/// Which side of the surface a ray is on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Side {
    Above,
    Below,
    /// On it to within rounding; the side is where the ray leaves it to.
    #[default]
    On,
}

/// A hit before its position and normal are worked out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Crossing {
    pub(crate) t: f64,
    /// Cell along the major and the minor axis.
    pub(crate) major: u32,
    pub(crate) minor: u32,
}

impl Crossing {
    /// What a caller is told.
    #[inline(always)]
    pub(crate) fn hit(&self, surface: &Surface, ray: &Ray, walk: &Walk) -> Hit {
        let u = walk.major.at(self.t) - f64::from(self.major);
        let v = walk.minor.at(self.t) - f64::from(self.minor);
        let (i, j, u, v) = if walk.major_is_x {
            (self.major, self.minor, u, v)
        } else {
            (self.minor, self.major, v, u)
        };
        let point = ray.at(self.t);
        let (height, normal) = surface.height_and_normal(i, j, u, v);
        Hit {
            t: self.t,
            position: DVec3::new(point.x, height, point.z),
            normal,
            cell: (i, j),
        }
    }
}

/// The exact solver for the columns of one walk.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Columns<'a> {
    layout: Layout<'a>,
    walk: &'a Walk,
    pub(crate) side: Side,
}

/// A place on the ray and its height above the surface there.
#[derive(Clone, Copy, Debug)]
struct Place {
    t: f64,
    f: f64,
}

impl<'a> Columns<'a> {
    /// For a walk that is known to be on `side`.
    #[inline(always)]
    pub(crate) fn on_side(layout: Layout<'a>, walk: &'a Walk, side: Side) -> Self {
        Self { layout, walk, side }
    }

    /// Finds out on which side the walk starts.
    #[inline(always)]
    pub(crate) fn new(layout: Layout<'a>, walk: &'a Walk) -> Self {
        let mut columns = Self {
            layout,
            walk,
            side: walk.enters,
        };
        if columns.side == Side::On {
            let minor = cell(walk.minor.at(walk.start), layout.minor_cells);
            let above = columns.inside(walk.first, minor, walk.start);
            if above > walk.rounding {
                columns.side = Side::Above;
            } else if above < -walk.rounding {
                columns.side = Side::Below;
            }
        }
        columns
    }

    /// The first crossing in the column `major`. Columns must be asked in the order of travel; those that certainly
    /// hold no crossing may be left out once the side is known.
    #[inline(always)]
    pub(crate) fn crossing(&mut self, major: u32) -> Option<Crossing> {
        let walk = self.walk;
        let forward = u32::from(walk.forward());
        let (near, far) = (major + 1 - forward, major + forward);
        let (is_first, is_last) = (major == walk.first, major == walk.last);
        let within = |t: f64| smaller(larger(t, walk.start), walk.end);
        let t_near = if is_first {
            walk.start
        } else {
            within(walk.major.time(near))
        };
        let t_far = if is_last {
            walk.end
        } else {
            within(walk.major.time(far))
        };
        let row_near = cell(walk.minor.at(t_near), self.layout.minor_cells);
        let row_far = cell(walk.minor.at(t_far), self.layout.minor_cells);

        let f = if is_first {
            self.inside(major, row_near, t_near)
        } else {
            self.on_line(near, row_near, t_near)
        };
        let mut from = Place { t: t_near, f };
        let mut row = row_near;
        // At most one crossing, but rounding at 45° can make two of it.
        while row != row_far {
            let (line, next) = if row_far > row {
                (row + 1, row + 1)
            } else {
                (row, row - 1)
            };
            let t = smaller(larger(walk.minor.time(line), from.t), t_far);
            let to = Place {
                t,
                f: self.on_row(major, line, t),
            };
            let found = self.segment(major, row, from, to);
            if found.is_some() {
                return found;
            }
            (from, row) = (to, next);
        }
        let f = if is_last {
            self.inside(major, row, t_far)
        } else {
            self.on_line(far, row, t_far)
        };
        self.segment(major, row, from, Place { t: t_far, f })
    }

    /// The first crossing between two places within one cell.
    #[inline(always)]
    fn segment(&mut self, major: u32, minor: u32, from: Place, to: Place) -> Option<Crossing> {
        let t = match self.layout.patch {
            Patch::Bilinear => {
                let [h00, h10, h01, h11] = self.corners(major, minor);
                let twist = (h00 - h10) - (h01 - h11);
                let (du, dv) = (
                    self.walk.major.step * (to.t - from.t),
                    self.walk.minor.step * (to.t - from.t),
                );
                self.piece(from, to, twist * du * dv)
            }
            Patch::Triangles => self.two_triangles(major, minor, from, to),
        }?;
        Some(Crossing { t, major, minor })
    }

    /// As [`Self::segment`] where the diagonal, on which both coordinates within the cell are equal, may lie between.
    fn two_triangles(&mut self, major: u32, minor: u32, from: Place, to: Place) -> Option<f64> {
        let walk = self.walk;
        let gap = |t: f64| (walk.major.at(t) - f64::from(major)) - (walk.minor.at(t) - f64::from(minor));
        let (a, b) = (gap(from.t), gap(to.t));
        if (a > 0.0) == (b > 0.0) {
            return self.piece(from, to, 0.0);
        }
        let t = lerp(from.t, to.t, a / (a - b)).max(from.t).min(to.t);
        let u = walk.major.at(t) - f64::from(major);
        let [h00, _, _, h11] = self.corners(major, minor);
        let between = Place {
            t,
            f: walk.height(t) - lerp(h00, h11, u),
        };
        self.piece(from, between, 0.0)
            .or_else(|| self.piece(between, to, 0.0))
    }

    /// When `f(s) = fa (1 − s) + fb s + c s (1 − s)` first vanishes, `s` running over `[0, 1]` between two places.
    #[inline(always)]
    fn piece(&mut self, from: Place, to: Place, c: f64) -> Option<f64> {
        let s = match self.side {
            Side::Above => first_root(from.f, to.f, c),
            Side::Below => first_root(-from.f, -to.f, -c),
            Side::On => self.leave(to.f, c),
        }?;
        Some(lerp(from.t, to.t, s))
    }

    /// As [`first_root`] for a segment that starts on the surface, whose root at 0 does not count. Decides the side.
    #[cold]
    fn leave(&mut self, fb: f64, c: f64) -> Option<f64> {
        let rounding = self.walk.rounding;
        let slope = fb + c;
        let lean = if slope.abs() > rounding {
            slope
        } else if c.abs() > rounding {
            -c
        } else {
            // In the surface all along.
            return None;
        };
        self.side = if lean > 0.0 { Side::Above } else { Side::Below };
        let s = slope / c;
        (slope.abs() > rounding && s > 0.0 && s <= 1.0).then_some(s)
    }

    /// The samples of a cell: `[h00, h10, h01, h11]`, the first index along the major axis.
    #[inline(always)]
    fn corners(&self, major: u32, minor: u32) -> [f64; 4] {
        [
            self.layout.sample(major, minor),
            self.layout.sample(major + 1, minor),
            self.layout.sample(major, minor + 1),
            self.layout.sample(major + 1, minor + 1),
        ]
    }

    /// Height of the ray above the surface at `t`, on the line between two columns.
    #[inline(always)]
    fn on_line(&self, line: u32, row: u32, t: f64) -> f64 {
        let v = self.walk.minor.at(t) - f64::from(row);
        self.walk.height(t)
            - lerp(
                self.layout.sample(line, row),
                self.layout.sample(line, row + 1),
                v,
            )
    }

    /// Height of the ray above the surface at `t`, on the line between two rows.
    #[inline(always)]
    fn on_row(&self, column: u32, line: u32, t: f64) -> f64 {
        let u = self.walk.major.at(t) - f64::from(column);
        self.walk.height(t)
            - lerp(
                self.layout.sample(column, line),
                self.layout.sample(column + 1, line),
                u,
            )
    }

    /// Height of the ray above the surface at `t`, within a cell.
    #[inline(always)]
    fn inside(&self, major: u32, minor: u32, t: f64) -> f64 {
        let u = self.walk.major.at(t) - f64::from(major);
        let v = self.walk.minor.at(t) - f64::from(minor);
        let [a, b, c, d] = self.corners(major, minor);
        let height = match self.layout.patch {
            Patch::Bilinear => lerp(lerp(a, b, u), lerp(c, d, u), v),
            Patch::Triangles if u >= v => a + (b - a) * u + (d - b) * v,
            Patch::Triangles => a + (d - c) * u + (c - a) * v,
        };
        self.walk.height(t) - height
    }
}

/// The smallest root in `[0, 1]` of `f(s) = fa (1 − s) + fb s + c s (1 − s)` for a segment that starts at `fa > 0`.
/// One that starts at `fa ≤ 0` is a hit where it starts: a crossing that rounding hid is found late, never lost.
#[inline(always)]
pub(crate) fn first_root(fa: f64, fb: f64, c: f64) -> Option<f64> {
    if fa <= 0.0 {
        return Some(0.0);
    }
    // f = fa + b s − c s²
    let b = (fb - fa) + c;
    if fb > 0.0 {
        // The ends are on the same side: there are two roots or none. Two need a dip between the ends.
        if c >= 0.0 || b >= 0.0 || b - 2.0 * c <= 0.0 {
            return None;
        }
    }
    let discriminant = b * b + 4.0 * c * fa;
    if discriminant < 0.0 {
        return None;
    }
    let root = discriminant.sqrt();
    let s = if b < 0.0 {
        2.0 * fa / (root - b)
    } else {
        (b + root) / (2.0 * c)
    };
    // With fb ≤ 0 there is a root; what rounding pushes outside belongs to the end.
    Some(if s.is_nan() { 1.0 } else { s.clamp(0.0, 1.0) })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn roots_are_the_first_of_the_quadratic() {
        let f = |fa: f64, fb: f64, c: f64, s: f64| fa * (1.0 - s) + fb * s + c * s * (1.0 - s);
        let mut found = 0;
        let mut rng = meniscus_sim::rng::Rng::new(1, 0);
        for _ in 0..20_000 {
            let (fa, fb, c) = (rng.uniform() + 1e-9, rng.normal(), 4.0 * rng.normal());
            let steps = 400;
            let first_low = (0..=steps)
                .map(|k| f64::from(k) / f64::from(steps))
                .find(|&s| f(fa, fb, c, s) <= 0.0);
            match (first_root(fa, fb, c), first_low) {
                (Some(s), low) => {
                    found += 1;
                    assert!(f(fa, fb, c, s).abs() < 1e-12, "{fa} {fb} {c}: {s}");
                    assert!(
                        low.is_none_or(|low| s <= low + 1e-12),
                        "{fa} {fb} {c}: {s}, but already {low:?}"
                    );
                }
                (None, low) => assert_eq!(low, None, "{fa} {fb} {c}"),
            }
        }
        assert!(found > 5_000);
    }

    #[test]
    fn nearly_linear_pieces_do_not_cancel() {
        // c → 0 must tend to the linear root fa / (fa − fb).
        for c in [0.0, 1e-300, 1e-18, -1e-18, 1e-12] {
            let s = first_root(1.0, -3.0, c).unwrap();
            assert!((s - 0.25).abs() < 1e-12);
        }
        assert_eq!(first_root(1.0, 0.0, 0.0), Some(1.0));
        assert_eq!(first_root(0.0, 1.0, 0.0), Some(0.0));
        assert_eq!(first_root(1.0, 1.0, 0.0), None);
    }
}
