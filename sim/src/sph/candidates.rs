//! The particles that the surface of a few columns may depend on, from the top down.
//!
//! What is near a block of tiles is gathered once from its bins, with mirror images, as deep as any of its tiles has come
//! ([`Gathered`]). Each tile takes from that what is within its reach ([`Candidates`]).

use super::bins::Bins;
use super::boundary::{Boundary, Outline};
use super::mirrors::{Inner, mirror};
use glam::{Vec2, Vec3, Vec4};
use std::ops::Range;

/// Columns of a tile, and along each of its sides. Fixed, so that sums are the same on any machine.
pub(super) const LANES: usize = 8;
pub(super) const TILE: [usize; 2] = [4, 2];

/// A value for each column of a tile.
pub(super) type Lanes = [f32; LANES];

/// Columns of a tile; those beyond the last one repeat it.
pub(super) struct Tile {
    pub(super) x: Lanes,
    pub(super) z: Lanes,
    /// The corners.
    pub(super) low: Vec2,
    pub(super) high: Vec2,
}

/// Where particles and their images come from.
#[derive(Clone, Copy)]
pub(super) struct Source<'a> {
    pub(super) bins: &'a Bins,
    pub(super) boundary: &'a Boundary,
    pub(super) inner: &'a Inner,
    /// Radius h of the potential, m.
    pub(super) radius: f32,
}

/// The particles and images about a block of tiles, layer by layer.
#[derive(Debug, Default)]
pub(super) struct Gathered {
    points: Vec<Vec3>,
    /// Entries that are points.
    count: usize,
    /// The layers among them: their number, and where they end.
    layers: Vec<(usize, usize)>,
    /// Bins about that hold more, and the highest layer of what they do.
    runs: Vec<Run>,
    head: usize,
    low: Vec2,
    high: Vec2,
}

/// What is left of a bin.
#[derive(Clone, Copy, Debug)]
struct Run {
    /// Number of the bin's first layer.
    first: usize,
    /// Next particle, its layer, and the end of the bin.
    next: usize,
    layer: usize,
    end: usize,
}

impl Gathered {
    /// Begins with a block between two corners. Returns whether there is any particle.
    pub(super) fn open(&mut self, low: Vec2, high: Vec2, from: &Source) -> bool {
        self.count = 0;
        self.layers.clear();
        self.runs.clear();
        (self.low, self.high, self.head) = (low, high, usize::MAX);
        let bins = from.bins;
        bins.between(
            low - from.radius,
            high + from.radius,
            |first, Range { start, end }| {
                if start < end {
                    let layer = bins.layer(bins.particles()[start].y);
                    self.head = self.head.min(layer);
                    self.runs.push(Run {
                        first,
                        next: start,
                        layer,
                        end,
                    });
                }
            },
        );
        !self.runs.is_empty()
    }

    /// Takes up the highest layer that is left.
    fn gather(&mut self, from: &Source) {
        let (bins, layer) = (from.bins, self.head);
        self.head = usize::MAX;
        let (begin, mut left) = (self.count, 0);
        for k in 0..self.runs.len() {
            let mut run = self.runs[k];
            if run.layer == layer {
                let until = bins.begin(run.first + layer + 1);
                self.take(&bins.particles()[run.next..until], from);
                if until == run.end {
                    continue;
                }
                run.next = until;
                run.layer = bins.layer(bins.particles()[until].y);
            }
            self.head = self.head.min(run.layer);
            self.runs[left] = run;
            left += 1;
        }
        self.runs.truncate(left);
        for k in begin..self.count {
            let p = self.points[k];
            if !from.inner.holds(p) {
                mirror(from.boundary, p, from.radius, |image| {
                    self.take(&[image.extend(0.0)], from);
                });
            }
        }
        self.layers.push((layer, self.count));
    }

    /// Takes up what is within reach of the block.
    #[inline(always)]
    fn take(&mut self, particles: &[Vec4], from: &Source) {
        let room = self.count + particles.len() + 1;
        if self.points.len() < room {
            self.points.resize(2 * room, Vec3::ZERO);
        }
        // Images in upright planes are farther from what is before them than what they are images of, but not in a round wall.
        let all = from.boundary.outline == Outline::Round;
        for p in particles {
            // Written before it is known whether it stays, without branches that are a matter of chance.
            self.points[self.count] = p.truncate();
            let at = Vec2::new(p.x, p.z);
            let near = at.distance_squared(at.clamp(self.low, self.high)) < from.radius * from.radius;
            self.count += usize::from(near | all);
        }
    }

    pub(super) fn bytes(&self) -> usize {
        size_of::<Vec3>() * self.points.capacity()
            + size_of::<(usize, usize)>() * self.layers.capacity()
            + size_of::<Run>() * self.runs.capacity()
    }
}

/// The particles within reach of a tile, between the height under search and a radius above and below.
///
/// Of each of them and every column 1 − ρ²/h² is kept, ρ being the horizontal distance, so that φ at any height is one root a
/// candidate, for all columns at once.
#[derive(Debug, Default)]
pub(super) struct Candidates {
    near: Vec<Lanes>,
    y: Vec<f32>,
    /// Those before are out of reach, those from `end` on are not taken up yet.
    begin: usize,
    end: usize,
    taken: Vec<Taken>,
    /// How many of them are out of reach.
    dropped: usize,
    /// The most that the others add to φ of each column.
    most: Lanes,
    /// Next point and layer of those that are gathered.
    next: usize,
    layer: usize,
}

/// Candidates taken up at a time.
#[derive(Clone, Copy, Debug)]
struct Taken {
    begin: usize,
    /// Height of the lowest one.
    lowest: f32,
    /// The most that they add to φ of each column.
    most: Lanes,
}

impl Candidates {
    /// Begins with a tile of the block that is gathered.
    pub(super) fn open(&mut self) {
        self.taken.clear();
        (self.begin, self.end, self.dropped) = (0, 0, 0);
        self.most = [0.0; LANES];
        (self.next, self.layer) = (0, 0);
    }

    /// The most that φ of each column can be at the height under search.
    #[inline(always)]
    pub(super) fn most(&self) -> &Lanes {
        &self.most
    }

    /// Height that nothing is above which is not taken up yet, −∞ if there is nothing.
    #[inline(always)]
    pub(super) fn next(&self, gathered: &Gathered, bins: &Bins) -> f32 {
        match gathered.layers.get(self.layer) {
            Some(&(layer, _)) => bins.ceiling(layer),
            None if gathered.runs.is_empty() => f32::NEG_INFINITY,
            None => bins.ceiling(gathered.head),
        }
    }

    /// Drops what is not below `height`.
    #[inline(always)]
    pub(super) fn drop_above(&mut self, height: f32) {
        let dropped = self.dropped;
        while self
            .taken
            .get(self.dropped)
            .is_some_and(|taken| taken.lowest >= height)
        {
            self.dropped += 1;
        }
        if self.dropped > dropped {
            let left = &self.taken[self.dropped..];
            self.begin = left.first().map_or(self.end, |taken| taken.begin);
            self.most = [0.0; LANES];
            for taken in left {
                for k in 0..LANES {
                    self.most[k] += taken.most[k];
                }
            }
        }
    }

    /// Takes up what is not below `low` and within reach of the columns of `tile`.
    #[inline(always)]
    pub(super) fn take_down_to(&mut self, low: f32, tile: &Tile, gathered: &mut Gathered, from: &Source) {
        let last = from.bins.layer(low);
        while gathered.head <= last {
            gathered.gather(from);
        }
        let mut end = self.next;
        while let Some((_, to)) = gathered.layers.get(self.layer).filter(|layer| layer.0 <= last) {
            end = *to;
            self.layer += 1;
        }
        if end == self.next {
            return;
        }
        let points = &gathered.points[self.next..end];
        self.next = end;
        let (begin, room) = (self.end, self.end + points.len() + 1);
        if self.y.len() < room {
            self.near.resize(2 * room, [0.0; LANES]);
            self.y.resize(2 * room, 0.0);
        }
        let (reach, scale) = (from.radius * from.radius, 1.0 / (from.radius * from.radius));
        let (x, z) = (tile.x, tile.z);
        let (mut kept, mut lowest, mut most) = (begin, f32::MAX, [0.0; LANES]);
        for p in points {
            // Written before it is known whether it stays, without branches that are a matter of chance.
            let mut near = [0.0; LANES];
            for k in 0..LANES {
                let (dx, dz) = (p.x - x[k], p.z - z[k]);
                near[k] = 1.0 - scale * (dx * dx + dz * dz);
                most[k] += root(near[k]);
            }
            (self.near[kept], self.y[kept]) = (near, p.y);
            let at = Vec2::new(p.x, p.z);
            let within = at.distance_squared(at.clamp(tile.low, tile.high)) < reach;
            kept += usize::from(within);
            lowest = lowest.min(p.y);
        }
        self.end = kept;
        if kept > begin {
            self.taken.push(Taken { begin, lowest, most });
            for k in 0..LANES {
                self.most[k] += most[k];
            }
        }
    }

    /// φ of all columns at one height.
    #[inline(always)]
    pub(super) fn potential_at(&self, y: f32, radius: f32) -> Lanes {
        let near = self.taken[self.dropped..]
            .iter()
            .find(|taken| taken.lowest < y + radius);
        self.sum(near.map_or(self.end, |taken| taken.begin), &[y; LANES], radius)
    }

    /// φ of each column at a height of its own.
    #[inline(always)]
    pub(super) fn potential(&self, y: &Lanes, radius: f32) -> Lanes {
        self.sum(self.begin, y, radius)
    }

    /// φ of each column of the candidates from `begin` on.
    #[inline(always)]
    fn sum(&self, begin: usize, y: &Lanes, radius: f32) -> Lanes {
        let scale = 1.0 / (radius * radius);
        let mut sums = [0.0; LANES];
        let (near, heights) = (&self.near[begin..self.end], &self.y[begin..self.end]);
        for (near, height) in near.iter().zip(heights) {
            for k in 0..LANES {
                let dy = y[k] - height;
                sums[k] += root(near[k] - scale * dy * dy);
            }
        }
        sums
    }

    pub(super) fn bytes(&self) -> usize {
        size_of::<Lanes>() * self.near.capacity()
            + size_of::<f32>() * self.y.capacity()
            + size_of::<Taken>() * self.taken.capacity()
    }
}

/// √x of what is within reach, else 0. One instruction each, where `max` would take care of NaN.
#[inline(always)]
fn root(x: f32) -> f32 {
    if x > 0.0 { x } else { 0.0 }.sqrt()
}
