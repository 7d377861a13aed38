//! The exact part: where a ray meets the surface within one column of cells, in `f64`.
//!
//! Along a ray, `f` is its height above the surface. Within one cell `f` is the quadratic through its values at both ends
//! of the segment plus `twist · Δu · Δv · s (1 − s)`, and the values at the ends stand on cell edges, where they are
//! computed from the two samples of the edge alone. Both cells at an edge therefore see the same value, and a ray cannot
//! slip between them.

use super::surface::{Patch, Surface, lerp};
use super::walk::Walk;

/// Which side of the surface a ray is on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Side {
    Above,
    Below,
    /// On it to within rounding; the side is where the ray leaves it to.
    On,
}

/// A hit before its position and normal are worked out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Crossing {
    pub(crate) t: f64,
    /// Cell along the major and the minor axis.
    pub(crate) major: usize,
    pub(crate) minor: usize,
}

/// The exact solver for the columns of one walk.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Columns<'a> {
    surface: &'a Surface,
    walk: &'a Walk,
    pub(crate) side: Side,
}

impl<'a> Columns<'a> {
    /// Finds out on which side the walk starts.
    pub(crate) fn new(surface: &'a Surface, walk: &'a Walk) -> Self {
        let mut columns = Self {
            surface,
            walk,
            side: Side::On,
        };
        let minor = walk.minor.cell(walk.minor.at(walk.start));
        let above = columns.inside(walk.first, minor, walk.start);
        if above > walk.rounding {
            columns.side = Side::Above;
        } else if above < -walk.rounding {
            columns.side = Side::Below;
        }
        columns
    }

    /// The first crossing in the column `major`. Columns must be asked in the order of travel; those that certainly
    /// hold no crossing may be left out once the side is known.
    pub(crate) fn crossing(&mut self, major: usize) -> Option<Crossing> {
        let walk = self.walk;
        let (near, far) = if walk.major.step >= 0.0 {
            (major, major + 1)
        } else {
            (major + 1, major)
        };
        let (is_first, is_last) = (major == walk.first, major == walk.last);
        let within = |t: f64| t.max(walk.start).min(walk.end);
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
        let row_near = walk.minor.cell(walk.minor.at(t_near));
        let row_far = walk.minor.cell(walk.minor.at(t_far));

        let mut t = t_near;
        let mut f = if is_first {
            self.inside(major, row_near, t)
        } else {
            self.on_line(near, row_near, t)
        };
        let mut row = row_near;
        // At most one crossing, but rounding at 45° can make two of it.
        while row != row_far {
            let (line, next) = if row_far > row {
                (row + 1, row + 1)
            } else {
                (row, row - 1)
            };
            let t_row = walk.minor.time(line).max(t).min(t_far);
            let f_row = self.on_row(major, line, t_row);
            let found = self.segment(major, row, t, f, t_row, f_row);
            if found.is_some() {
                return found;
            }
            (t, f, row) = (t_row, f_row, next);
        }
        let f_far = if is_last {
            self.inside(major, row, t_far)
        } else {
            self.on_line(far, row, t_far)
        };
        self.segment(major, row, t, f, t_far, f_far)
    }

    /// The first crossing within one cell, between times `a` and `b` where the ray is `fa` and `fb` above the surface.
    fn segment(&mut self, major: usize, minor: usize, a: f64, fa: f64, b: f64, fb: f64) -> Option<Crossing> {
        let (i, j) = self.cell(major, minor);
        let (du, dv) = (self.walk.major.step * (b - a), self.walk.minor.step * (b - a));
        match self.surface.patch {
            Patch::Bilinear => {
                let [h00, h10, h01, h11] = self.surface.corners(i, j);
                let twist = (h00 - h10) - (h01 - h11);
                self.piece(major, minor, a, fa, b, fb, twist * du * dv)
            }
            Patch::Triangles => {
                // The triangles meet where both coordinates within the cell are equal.
                let walk = self.walk;
                let gap = |t: f64| (walk.major.at(t) - major as f64) - (walk.minor.at(t) - minor as f64);
                let (ga, gb) = (gap(a), gap(b));
                if (ga > 0.0) != (gb > 0.0) {
                    let t = lerp(a, b, ga / (ga - gb)).max(a).min(b);
                    let u = walk.major.at(t) - major as f64;
                    let [h00, _, _, h11] = self.surface.corners(i, j);
                    let f = walk.height(t) - lerp(h00, h11, u);
                    let found = self.piece(major, minor, a, fa, t, f, 0.0);
                    return found.or_else(|| self.piece(major, minor, t, f, b, fb, 0.0));
                }
                self.piece(major, minor, a, fa, b, fb, 0.0)
            }
        }
    }

    /// The first root of `f(s) = fa (1 − s) + fb s + c s (1 − s)` as a crossing, `s` running over `[0, 1]` from `a` to `b`.
    #[expect(
        clippy::too_many_arguments,
        reason = "the coefficients of one quadratic and its place"
    )]
    fn piece(
        &mut self,
        major: usize,
        minor: usize,
        a: f64,
        fa: f64,
        b: f64,
        fb: f64,
        c: f64,
    ) -> Option<Crossing> {
        let s = match self.side {
            Side::Above => first_root(fa, fb, c),
            Side::Below => first_root(-fa, -fb, -c),
            Side::On => self.leave(fb, c),
        }?;
        Some(Crossing {
            t: lerp(a, b, s),
            major,
            minor,
        })
    }

    /// As [`first_root`] for a segment that starts on the surface, whose root at 0 does not count. Decides the side.
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

    fn cell(&self, major: usize, minor: usize) -> (usize, usize) {
        if self.walk.major_is_x {
            (major, minor)
        } else {
            (minor, major)
        }
    }

    fn sample(&self, major: usize, minor: usize) -> f64 {
        let k = major * self.walk.major.stride + minor * self.walk.minor.stride;
        f64::from(self.surface.heights().get(k).copied().unwrap_or(0.0))
    }

    /// Height of the ray above the surface at `t`, on the line between two columns.
    fn on_line(&self, line: usize, row: usize, t: f64) -> f64 {
        let v = self.walk.minor.at(t) - row as f64;
        self.walk.height(t) - lerp(self.sample(line, row), self.sample(line, row + 1), v)
    }

    /// Height of the ray above the surface at `t`, on the line between two rows.
    fn on_row(&self, column: usize, line: usize, t: f64) -> f64 {
        let u = self.walk.major.at(t) - column as f64;
        self.walk.height(t) - lerp(self.sample(column, line), self.sample(column + 1, line), u)
    }

    /// Height of the ray above the surface at `t`, within a cell.
    fn inside(&self, major: usize, minor: usize, t: f64) -> f64 {
        let u = self.walk.major.at(t) - major as f64;
        let v = self.walk.minor.at(t) - minor as f64;
        let (i, j) = self.cell(major, minor);
        let (x, z) = if self.walk.major_is_x { (u, v) } else { (v, u) };
        self.walk.height(t) - self.surface.height(i, j, x, z)
    }
}

/// The smallest root in `[0, 1]` of `f(s) = fa (1 − s) + fb s + c s (1 − s)` for a segment that starts at `fa > 0`.
/// One that starts at `fa ≤ 0` is a hit where it starts: a crossing that rounding hid is found late, never lost.
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
