//! What reflects: straight walls with water on one side, found fast along a ray or around a point.

use glam::DVec2;

/// A straight wall. Water is where `normal` points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Segment {
    pub(super) a: DVec2,
    pub(super) b: DVec2,
    pub(super) normal: DVec2,
}

impl Segment {
    /// The wall from `a` to `b` with the water towards `side`; `None` if it has no length.
    pub(super) fn towards(a: DVec2, b: DVec2, side: DVec2) -> Option<Self> {
        let along = b - a;
        let length = along.length();
        if !(length > 0.0 && length.is_finite()) {
            return None;
        }
        let normal = along.perp() / length;
        let normal = if normal.dot(side) < 0.0 { -normal } else { normal };
        Some(Self { a, b, normal })
    }

    /// How far `p` stands in front of the wall's line, metres.
    pub(super) fn front(&self, p: DVec2) -> f64 {
        (p - self.a).dot(self.normal)
    }

    /// Mirror image of a point.
    pub(super) fn mirror(&self, p: DVec2) -> DVec2 {
        p - 2.0 * self.front(p) * self.normal
    }

    /// Mirror image of a direction.
    pub(super) fn reflect(&self, u: DVec2) -> DVec2 {
        u - 2.0 * u.dot(self.normal) * self.normal
    }

    /// Distance from a point to the wall.
    pub(super) fn distance(&self, p: DVec2) -> f64 {
        let along = self.b - self.a;
        let share = ((p - self.a).dot(along) / along.length_squared()).clamp(0.0, 1.0);
        (self.a + share * along - p).length()
    }
}

/// All walls, sorted into the cells of a coarse grid. The outermost cells reach to infinity.
#[derive(Clone, Debug)]
pub(super) struct Walls {
    segments: Vec<Segment>,
    low: DVec2,
    cell: DVec2,
    count: [usize; 2],
    /// Where the list of each cell begins in `items`.
    starts: Vec<u32>,
    items: Vec<u32>,
    /// For each cell a distance within which no point of it has a wall, metres.
    clear: Vec<f64>,
    /// Lengths below it are rounding.
    tolerance: f64,
}

/// Fewest cells along the longer axis.
const FEWEST_CELLS: f64 = 64.0;

/// Most cells along an axis.
const MOST_CELLS: f64 = 512.0;

impl Walls {
    /// Walls in and around the rectangle from `low` to `high`.
    pub(super) fn new(segments: Vec<Segment>, low: DVec2, high: DVec2) -> Self {
        let extent = (high - low).max(DVec2::splat(f64::MIN_POSITIVE));
        // About as many cells as walls, as square as the rectangle allows.
        let across = (16.0 * segments.len() as f64)
            .sqrt()
            .clamp(FEWEST_CELLS, MOST_CELLS);
        let longest = extent.max_element();
        let count = (extent / longest * across).ceil().max(DVec2::ONE);
        let tolerance = 1e-9 * longest.max(low.abs().max(high.abs()).max_element() * 1e-3);
        let mut walls = Self {
            segments,
            low,
            cell: extent / count,
            count: [count.x as usize, count.y as usize],
            starts: Vec::new(),
            items: Vec::new(),
            clear: Vec::new(),
            tolerance,
        };
        let mut pairs: Vec<(u32, u32)> = Vec::new();
        for (k, segment) in walls.segments.iter().enumerate() {
            walls.cover(segment, |cell| pairs.push((cell as u32, k as u32)));
        }
        pairs.sort_unstable();
        let cells = walls.count[0] * walls.count[1];
        walls.starts = vec![0; cells + 1];
        for &(cell, _) in &pairs {
            walls.starts[cell as usize + 1] += 1;
        }
        for cell in 0..cells {
            walls.starts[cell + 1] += walls.starts[cell];
        }
        walls.items = pairs.into_iter().map(|(_, k)| k).collect();
        walls.clear = walls.clearance();
        walls
    }

    /// How far from every point of a cell walls are at least: the cells between it and the nearest one with a wall.
    fn clearance(&self) -> Vec<f64> {
        let [w, h] = self.count;
        // Cells away, diagonal ones too, by one sweep down and one up.
        let mut away: Vec<u32> = (0..w * h)
            .map(|cell| {
                if self.starts[cell + 1] > self.starts[cell] {
                    0
                } else {
                    u32::MAX
                }
            })
            .collect();
        let forward = [(-1, -1), (0, -1), (1, -1), (-1, 0)];
        for backwards in [false, true] {
            for step in 0..w * h {
                let cell = if backwards { w * h - 1 - step } else { step };
                for (di, dj) in forward {
                    let (di, dj) = if backwards { (-di, -dj) } else { (di, dj) };
                    let i = (cell % w).checked_add_signed(di).filter(|&i| i < w);
                    let j = (cell / w).checked_add_signed(dj).filter(|&j| j < h);
                    if let (Some(i), Some(j)) = (i, j) {
                        away[cell] = away[cell].min(away[j * w + i].saturating_add(1));
                    }
                }
            }
        }
        // A wall is listed in cells with a margin; half a cell less is more than that.
        let side = self.cell.min_element();
        away.into_iter()
            .map(|n| match n {
                u32::MAX => f64::INFINITY,
                n => (f64::from(n) - 1.5).max(0.0) * side,
            })
            .collect()
    }

    /// Whether it is known at once that no wall is within `reach` of a point.
    #[inline(always)]
    pub(super) fn is_clear(&self, p: DVec2, reach: f64) -> bool {
        let cell = |axis: usize| {
            let at = (p[axis] - self.low[axis]) / self.cell[axis];
            // The cast saturates: what lies outside belongs to the outermost cells.
            (at as usize).min(self.count[axis] - 1)
        };
        self.clear[cell(1) * self.count[0] + cell(0)] >= reach
    }

    /// Cell numbers along an axis that a stretch of coordinates touches, with a margin for rounding.
    fn range(&self, axis: usize, a: f64, b: f64) -> std::ops::RangeInclusive<usize> {
        let margin = 1e-6;
        let last = (self.count[axis] - 1) as f64;
        let at = |x: f64| (x - self.low[axis]) / self.cell[axis];
        let (a, b) = (at(a.min(b)) - margin, at(a.max(b)) + margin);
        // NaN and what lies outside saturate to the outermost cells.
        (a.floor().clamp(0.0, last) as usize)..=(b.floor().clamp(0.0, last) as usize)
    }

    /// Calls `visit` with every cell that a wall touches.
    fn cover(&self, s: &Segment, mut visit: impl FnMut(usize)) {
        for j in self.range(1, s.a.y, s.b.y) {
            // The part of the wall within the row of cells, the outermost rows reaching to infinity.
            let edge = |k: usize| self.low.y + self.cell.y * k as f64;
            let (from, to) = (
                if j == 0 { f64::NEG_INFINITY } else { edge(j) },
                if j + 1 == self.count[1] {
                    f64::INFINITY
                } else {
                    edge(j + 1)
                },
            );
            let rise = s.b.y - s.a.y;
            let (mut x0, mut x1) = (s.a.x, s.b.x);
            if rise.abs() > self.cell.y * 1e-3 {
                let at = |z: f64| s.a.x + (s.b.x - s.a.x) * ((z - s.a.y) / rise).clamp(-1e-3, 1.001);
                (x0, x1) = (at(from), at(to));
            }
            for i in self.range(0, x0, x1) {
                visit(j * self.count[0] + i);
            }
        }
    }

    fn cell_items(&self, i: usize, j: usize) -> &[u32] {
        let cell = j * self.count[0] + i;
        &self.items[self.starts[cell] as usize..self.starts[cell + 1] as usize]
    }

    pub(super) fn segment(&self, k: usize) -> &Segment {
        &self.segments[k]
    }

    /// Calls `test` with the walls in the cells along a ray, nearest cells first, until the distance that it returns is
    /// less than where the next cells begin.
    fn along_ray(&self, p: DVec2, u: DVec2, reach: f64, mut test: impl FnMut(usize, f64) -> f64) {
        let mut reach = reach;
        let major = usize::from(u.y.abs() > u.x.abs());
        let minor = 1 - major;
        let slope = u[major];
        if self.segments.is_empty() || !(slope.abs() > 0.0) {
            return;
        }
        let last = self.count[major] - 1;
        let mut slab = *self.range(major, p[major], p[major]).start();
        let mut entered = 0.0_f64;
        if slope < 0.0 {
            slab = *self.range(major, p[major], p[major]).end();
        }
        loop {
            let edge = self.low[major] + self.cell[major] * (slab + usize::from(slope > 0.0)) as f64;
            let at_end = if slope > 0.0 { slab == last } else { slab == 0 };
            let left = if at_end {
                f64::INFINITY
            } else {
                ((edge - p[major]) / slope).max(entered)
            };
            let (m0, m1) = (
                p[minor] + entered * u[minor],
                p[minor] + left.min(reach) * u[minor],
            );
            for m in self.range(minor, m0, m1) {
                let (i, j) = if major == 0 { (slab, m) } else { (m, slab) };
                for &k in self.cell_items(i, j) {
                    reach = test(k as usize, reach);
                }
            }
            if at_end || left > reach {
                return;
            }
            entered = left;
            slab = if slope > 0.0 { slab + 1 } else { slab - 1 };
        }
    }

    /// The first wall that a point moving along the unit vector `u` runs into within `reach` metres, and how far it is.
    /// A point that rounding has put a hair behind a wall hits it at once, so nothing slips through a corner.
    pub(super) fn first_hit(&self, p: DVec2, u: DVec2, reach: f64) -> Option<(f64, usize)> {
        let mut best = None;
        self.along_ray(p, u, reach, |k, reach| {
            let s = &self.segments[k];
            let approach = -u.dot(s.normal);
            let front = s.front(p);
            if !(approach > 0.0) || front < -self.tolerance {
                return reach;
            }
            let distance = front.max(0.0) / approach;
            if distance > reach || (distance == reach && best.is_some()) {
                return reach;
            }
            let along = s.b - s.a;
            let length = along.length();
            let at = (p + distance * u - s.a).dot(along) / length;
            if at < -self.tolerance || at > length + self.tolerance {
                return reach;
            }
            best = Some((distance, k));
            distance
        });
        best
    }

    /// Whether a point is on the water side of walls, told from a place `water` nearby that is: by the first wall on the way
    /// there, if any. On a wall is in front of it.
    pub(super) fn is_open(&self, p: DVec2, water: DVec2) -> bool {
        let way = water - p;
        let length = way.length();
        if length <= self.tolerance {
            return true;
        }
        let u = way / length;
        let mut open = true;
        self.along_ray(p, u, length, |k, reach| {
            let s = &self.segments[k];
            let approach = -u.dot(s.normal);
            let front = s.front(p);
            let distance = front / approach;
            let leaves = approach < 0.0 && front > -self.tolerance;
            if leaves || approach == 0.0 || !(distance >= 0.0) || distance >= reach {
                return reach;
            }
            let along = s.b - s.a;
            let at = (p + distance * u - s.a).dot(along) / along.length();
            if at < -self.tolerance || at > along.length() + self.tolerance {
                return reach;
            }
            open = approach > 0.0;
            distance
        });
        open
    }

    /// The walls within `reach` of a point, ascending.
    pub(super) fn around(&self, p: DVec2, reach: f64, out: &mut Vec<usize>) {
        out.clear();
        if self.segments.is_empty() {
            return;
        }
        for j in self.range(1, p.y - reach, p.y + reach) {
            for i in self.range(0, p.x - reach, p.x + reach) {
                for &k in self.cell_items(i, j) {
                    let k = k as usize;
                    if self.segments[k].distance(p) < reach {
                        out.push(k);
                    }
                }
            }
        }
        out.sort_unstable();
        out.dedup();
    }

    pub(super) fn bytes(&self) -> u64 {
        (self.segments.len() * size_of::<Segment>() + 4 * (self.starts.len() + self.items.len())) as u64
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rng::Rng;

    /// Hits by testing every wall.
    fn brute(walls: &Walls, p: DVec2, u: DVec2) -> Option<f64> {
        let hit = |s: &Segment| {
            let approach = -u.dot(s.normal);
            let distance = s.front(p) / approach;
            let at = (p + distance * u - s.a).dot(s.b - s.a) / (s.b - s.a).length_squared();
            (approach > 0.0 && distance >= 0.0 && (0.0..=1.0).contains(&at)).then_some(distance)
        };
        walls.segments.iter().filter_map(hit).min_by(f64::total_cmp)
    }

    #[test]
    fn the_cells_find_what_testing_every_wall_finds() {
        let mut rng = Rng::new(3, 1);
        let mut segments = Vec::new();
        let mut point = |scale: f64| DVec2::new(rng.uniform(), 0.4 * rng.uniform()) * scale;
        for _ in 0..300 {
            let a = point(20.0);
            let b = a + point(2.0) - DVec2::new(1.0, 0.4);
            segments.extend(Segment::towards(a, b, point(2.0) - DVec2::new(1.0, 0.4)));
        }
        let walls = Walls::new(segments, DVec2::ZERO, DVec2::new(20.0, 8.0));
        let mut hits = 0;
        for _ in 0..4000 {
            let p = point(22.0) - DVec2::new(1.0, 0.4);
            let u = (point(1.0) - DVec2::new(0.5, 0.2)).normalize();
            let (found, expected) = (walls.first_hit(p, u, f64::INFINITY), brute(&walls, p, u));
            match (found, expected) {
                (Some((a, _)), Some(b)) => assert!((a - b).abs() < 1e-9, "{a} {b}"),
                (a, b) => assert_eq!(a.map(|h| h.0), b),
            }
            hits += usize::from(expected.is_some());
            let mut near = Vec::new();
            walls.around(p, 0.7, &mut near);
            let all: Vec<usize> = (0..walls.segments.len())
                .filter(|&k| walls.segments[k].distance(p) < 0.7)
                .collect();
            assert_eq!(near, all);
        }
        assert!(hits > 1000);
    }
}
