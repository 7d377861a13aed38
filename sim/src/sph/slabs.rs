//! Sums over pairs, each pair taken once.
//!
//! What a pair adds goes to both of its particles, so two threads could write to one place. Particles are therefore cut into
//! slabs of whole layers of cells, a layer being all that reaches out of a slab, since the earlier particle of a pair
//! finds the later one. Each slab sums into its own lists, which also hold the layer that follows it, and the lists are
//! added in the order of the slabs. Slabs do not depend on the number of threads, so neither do sums.

use super::cells::{Ahead, Cells};
use rayon::prelude::*;

/// Particles of a slab at least, unless it is the last one.
const SLAB: usize = 512;
/// Particles of which one task adds up the lists.
const TASK: usize = 2048;

/// Whole layers of cells.
#[derive(Debug, Default)]
pub(crate) struct Slab {
    /// Its first particle.
    pub(crate) first: usize,
    /// The first one after it.
    pub(crate) end: usize,
    /// The first one that is out of its reach.
    reach: usize,
    /// Where the later particles of the pairs of each of its particles are.
    pub(crate) ahead: Vec<Ahead>,
    /// Particles of it that have a later one in their place.
    pub(crate) together: Vec<u32>,
    /// Sums for the particles from `first` to what is out of reach, and a few places more.
    pub(crate) sums: [Vec<f32>; 3],
}

impl Slab {
    /// The first `N` lists of sums, all 0, for `lanes` places more than there are particles within reach.
    pub(crate) fn clear<const N: usize>(&mut self, lanes: usize) {
        for list in &mut self.sums[..N] {
            list.clear();
            list.resize(self.reach - self.first + lanes, 0.0);
        }
    }
}

/// All particles in the order of memory.
#[derive(Debug, Default)]
pub(crate) struct Slabs {
    list: Vec<Slab>,
    count: usize,
}

impl Slabs {
    /// Cuts what is in `cells`.
    pub(crate) fn cut(&mut self, cells: &Cells) {
        self.count = 0;
        let (mut layer, mut first) = (0, 0);
        while layer < cells.layers() {
            layer += 1;
            let end = cells.layer(layer);
            if end - first < SLAB && layer < cells.layers() {
                continue;
            }
            if self.count == self.list.len() {
                self.list.push(Slab::default());
            }
            let slab = &mut self.list[self.count];
            (slab.first, slab.end, slab.reach) = (first, end, cells.layer(layer + 1));
            self.count += 1;
            first = end;
        }
    }

    /// Calls `f` with each slab, in parallel.
    pub(crate) fn each(&mut self, f: impl Fn(&mut Slab) + Sync + Send) {
        self.list[..self.count].par_iter_mut().for_each(f);
    }

    /// Stores list `k` of sums in `out`.
    pub(crate) fn collect(&self, k: usize, out: &mut [f32]) {
        let slabs = &self.list[..self.count];
        let chunks = out.par_chunks_mut(TASK).enumerate();
        chunks.for_each(|(c, out)| {
            let (first, end) = (c * TASK, c * TASK + out.len());
            out.fill(0.0);
            let from = slabs.partition_point(|s| s.reach <= first);
            for slab in slabs[from..].iter().take_while(|s| s.first < end) {
                let (from, to) = (slab.first.max(first), slab.reach.min(end));
                if from < to {
                    let parts = &slab.sums[k][from - slab.first..to - slab.first];
                    for (out, part) in out[from - first..].iter_mut().zip(parts) {
                        *out += part;
                    }
                }
            }
        });
    }

    pub(crate) fn bytes(&self) -> usize {
        let one = |s: &Slab| {
            size_of::<Slab>()
                + size_of::<Ahead>() * s.ahead.capacity()
                + 4 * s.together.capacity()
                + 4 * s.sums.iter().map(Vec::capacity).sum::<usize>()
        };
        self.list.iter().map(one).sum()
    }
}
