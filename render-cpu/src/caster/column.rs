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

/// The four samples of a cell in the order of travel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Quad {
    /// At the line where the ray enters the column: the lower and the upper along the minor axis.
    near: [f64; 2],
    /// At the line where it leaves.
    far: [f64; 2],
}

impl Quad {
    /// Coefficient of `u v` in the bilinear patch.
    #[inline(always)]
    fn twist(&self) -> f64 {
        (self.near[0] - self.far[0]) - (self.near[1] - self.far[1])
    }

    /// Height, and its slopes along `u` (in the direction of travel) and `v` (along the minor axis).
    ///
    /// `backward` says whether `u` runs against the major axis, on which the diagonal of two triangles depends.
    #[inline(always)]
    fn sample(&self, patch: Patch, backward: bool, u: f64, v: f64) -> (f64, f64, f64) {
        let ([a, c], [b, d]) = (self.near, self.far);
        match patch {
            Patch::Bilinear => (
                lerp(lerp(a, b, u), lerp(c, d, u), v),
                lerp(b - a, d - c, v),
                lerp(c - a, d - b, u),
            ),
            Patch::Triangles if backward && 1.0 - u >= v => {
                (b + (a - b) * (1.0 - u) + (c - a) * v, b - a, c - a)
            }
            Patch::Triangles if backward => (b + (c - d) * (1.0 - u) + (d - b) * v, d - c, d - b),
            Patch::Triangles if u >= v => (a + (b - a) * u + (d - b) * v, b - a, d - b),
            Patch::Triangles => (a + (d - c) * u + (c - a) * v, d - c, c - a),
        }
    }
}

/// A hit before its position and normal are worked out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Crossing {
    pub(crate) t: f64,
    /// Cell along the major and the minor axis.
    major: u32,
    minor: u32,
    quad: Quad,
}

impl Crossing {
    /// What a caller is told.
    #[inline(always)]
    pub(crate) fn hit(&self, surface: &Surface, ray: &Ray, walk: &Walk) -> Hit {
        let backward = !walk.forward();
        let u = ahead(walk, self.major, self.t);
        let v = walk.minor.at(self.t) - f64::from(self.minor);
        let (height, along, across) = self.quad.sample(surface.patch, backward, u, v);
        let along = if backward { -along } else { along };
        let (i, j, x, z) = if walk.major_is_x {
            (self.major, self.minor, along, across)
        } else {
            (self.minor, self.major, across, along)
        };
        let point = ray.at(self.t);
        let normal = DVec3::new(-x, surface.spacing(), -z).normalize();
        Hit {
            t: self.t,
            position: DVec3::new(point.x, height, point.z),
            normal,
            cell: (i, j),
        }
    }
}

/// How far the ray is within column `major` at `t`, in the direction of travel.
#[inline(always)]
fn ahead(walk: &Walk, major: u32, t: f64) -> f64 {
    let within = walk.major.at(t) - f64::from(major);
    if walk.forward() { within } else { 1.0 - within }
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
            let row = cell(walk.minor.at(walk.start), layout.minor_cells);
            let quad = columns.quad(walk.first, row);
            let above = columns.inside(&quad, walk.first, row, walk.start);
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
        let (walk, layout) = (self.walk, self.layout);
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
        let (z_near, z_far) = (walk.minor.at(t_near), walk.minor.at(t_far));
        let (mut row, row_far) = (cell(z_near, layout.minor_cells), cell(z_far, layout.minor_cells));

        let (near, far) = (layout.along.place(near), layout.along.place(far));
        let on_line = |row: u32| {
            let across = layout.across.place(row);
            [layout.at(near + across), layout.at(far + across)]
        };
        let quad = |[a, b]: [f64; 2], [c, d]: [f64; 2]| Quad {
            near: [a, c],
            far: [b, d],
        };
        let (mut below, mut above) = (on_line(row), on_line(row + 1));
        let mut cell = quad(below, above);
        let f = if is_first {
            self.inside(&cell, major, row, t_near)
        } else {
            walk.height(t_near) - lerp(cell.near[0], cell.near[1], z_near - f64::from(row))
        };
        let mut from = Place { t: t_near, f };
        // At most one crossing, but rounding at 45° can make two of it.
        while row != row_far {
            let up = row_far > row;
            let line = if up { row + 1 } else { row };
            let t = smaller(larger(walk.minor.time(line), from.t), t_far);
            let shared = if up { above } else { below };
            let f = walk.height(t) - lerp(shared[0], shared[1], ahead(walk, major, t));
            let to = Place { t, f };
            if let Some(t) = self.segment(&cell, major, row, from, to) {
                return Some(Crossing {
                    t,
                    major,
                    minor: row,
                    quad: cell,
                });
            }
            row = if up { row + 1 } else { row - 1 };
            let next = on_line(if up { row + 1 } else { row });
            (below, above) = if up { (shared, next) } else { (next, shared) };
            cell = quad(below, above);
            from = to;
        }
        let f = if is_last {
            self.inside(&cell, major, row, t_far)
        } else {
            walk.height(t_far) - lerp(cell.far[0], cell.far[1], z_far - f64::from(row))
        };
        let t = self.segment(&cell, major, row, from, Place { t: t_far, f })?;
        Some(Crossing {
            t,
            major,
            minor: row,
            quad: cell,
        })
    }

    /// When the ray first meets the surface between two places within one cell.
    #[inline(always)]
    fn segment(&mut self, quad: &Quad, major: u32, minor: u32, from: Place, to: Place) -> Option<f64> {
        match self.layout.patch {
            Patch::Bilinear => {
                let span = to.t - from.t;
                let (du, dv) = (self.walk.major.step.abs() * span, self.walk.minor.step * span);
                self.piece(from, to, quad.twist() * du * dv)
            }
            Patch::Triangles => self.two_triangles(quad, major, minor, from, to),
        }
    }

    /// As [`Self::segment`] where the diagonal, on which both coordinates within the cell are equal, may lie between.
    #[inline(never)]
    fn two_triangles(&mut self, quad: &Quad, major: u32, minor: u32, from: Place, to: Place) -> Option<f64> {
        let walk = self.walk;
        let gap = |t: f64| (walk.major.at(t) - f64::from(major)) - (walk.minor.at(t) - f64::from(minor));
        let (a, b) = (gap(from.t), gap(to.t));
        if (a > 0.0) == (b > 0.0) {
            return self.piece(from, to, 0.0);
        }
        let t = smaller(larger(lerp(from.t, to.t, a / (a - b)), from.t), to.t);
        let u = walk.major.at(t) - f64::from(major);
        let (first, last) = if walk.forward() {
            (quad.near[0], quad.far[1])
        } else {
            (quad.far[0], quad.near[1])
        };
        let between = Place {
            t,
            f: walk.height(t) - lerp(first, last, u),
        };
        self.piece(from, between, 0.0)
            .or_else(|| self.piece(between, to, 0.0))
    }

    /// When `f(s) = fa (1 − s) + fb s + c s (1 − s)` first vanishes, `s` running over `[0, 1]` between two places.
    #[inline(always)]
    fn piece(&mut self, from: Place, to: Place, c: f64) -> Option<f64> {
        let s = match self.side {
            Side::On => self.leave(to.f, c),
            side => {
                let mirror = if side == Side::Below { -1.0 } else { 1.0 };
                first_root(mirror * from.f, mirror * to.f, mirror * c)
            }
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

    /// The samples of a cell.
    #[inline(always)]
    fn quad(&self, major: u32, minor: u32) -> Quad {
        let layout = &self.layout;
        let forward = u32::from(self.walk.forward());
        let on_line = |line: u32| [layout.sample(line, minor), layout.sample(line, minor + 1)];
        Quad {
            near: on_line(major + 1 - forward),
            far: on_line(major + forward),
        }
    }

    /// Height of the ray above the surface at `t`, within a cell.
    #[inline(always)]
    fn inside(&self, quad: &Quad, major: u32, minor: u32, t: f64) -> f64 {
        let walk = self.walk;
        let v = walk.minor.at(t) - f64::from(minor);
        let (height, ..) = quad.sample(self.layout.patch, !walk.forward(), ahead(walk, major, t), v);
        walk.height(t) - height
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
