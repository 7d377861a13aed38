//! Lists of neighbours with what every pass needs of a pair, made once a step.

use super::cells::Cells;
use crate::rng::Rng;
use glam::{Vec3, Vec4};
use rayon::prelude::*;

/// Particles whose lists lie together. Fixed: sums over blocks are folded in their order.
pub(crate) const BLOCK: usize = 256;

/// Distance over the support below which two particles stand in one place.
const COINCIDENT: f32 = 1e-3;

/// Neighbours of consecutive particles.
#[derive(Debug, Default)]
struct Block {
    start: Vec<u32>,
    index: Vec<u32>,
    pair: Vec<Vec4>,
    own: Vec<Vec4>,
    other: Vec<Vec4>,
    /// Candidates of one particle that are within the support.
    near: Vec<u32>,
    square: Vec<f32>,
    /// What the kernel says of each.
    shape: [Vec<f32>; 3],
}

/// What sums over the neighbours of one particle say.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Sums {
    /// Σ g.
    pub(crate) gradient: Vec4,
    /// −Σ x ⊗ g, rows with the components of x.
    pub(crate) moment: [Vec4; 3],
    /// Σ W times the volume of a particle.
    pub(crate) density: f32,
}

/// What a pair is by its squared distance: what its vector is multiplied with to give g, the fourth value beside g, and
/// W times the volume of a particle.
pub(crate) trait Shape: Copy + Sync {
    fn of(&self, square: f32) -> [f32; 3];
}

/// For each particle the numbers of its neighbours, and four values of each pair.
///
/// The lists of [`BLOCK`] particles share one buffer that is kept from step to step, so that they are filled in one
/// parallel pass and nothing is allocated once the buffers have grown.
#[derive(Debug, Default)]
pub(crate) struct Neighbours {
    blocks: Vec<Block>,
}

/// What a pass sees of one particle.
pub(crate) struct Near<'a> {
    /// The particle.
    pub(crate) i: usize,
    /// Its neighbours, itself excluded.
    pub(crate) index: &'a [u32],
    /// Four values of each pair.
    pub(crate) pair: &'a [Vec4],
    /// The vectors that [`Neighbours::pair_with`] gave each pair.
    pub(crate) own: &'a [Vec4],
    pub(crate) other: &'a [Vec4],
}

impl Near<'_> {
    /// Neighbour and pair values, in order.
    #[inline]
    pub(crate) fn pairs(&self) -> impl Iterator<Item = (usize, Vec4)> {
        self.index
            .iter()
            .map(|&j| j as usize)
            .zip(self.pair.iter().copied())
    }

    /// Σ `f(neighbour, vector)` over `vectors`, one a pair: even and odd ones apart, so that an addition need not wait for
    /// the one before.
    #[inline]
    pub(crate) fn sums<const K: usize>(
        &self,
        vectors: &[Vec4],
        f: impl Fn(usize, Vec4) -> [Vec4; K],
    ) -> [Vec4; K] {
        let (mut even, mut odd) = ([Vec4::ZERO; K], [Vec4::ZERO; K]);
        let (twos, one) = self.index.as_chunks::<2>();
        let (pairs, last) = vectors.as_chunks::<2>();
        let add = |to: &mut [Vec4; K], j: u32, g: Vec4| {
            let values = f(j as usize, g);
            for k in 0..K {
                to[k] += values[k];
            }
        };
        for (j, g) in twos.iter().zip(pairs) {
            add(&mut even, j[0], g[0]);
            add(&mut odd, j[1], g[1]);
        }
        if let (Some(&j), Some(&g)) = (one.first(), last.first()) {
            add(&mut even, j, g);
        }
        std::array::from_fn(|k| even[k] + odd[k])
    }
}

impl Neighbours {
    /// Finds all pairs nearer than `support` of the particles that `out` is for, in `cells`, with those and with the images
    /// that follow them in `positions`, in `images`. Stores g and the value beside it of each pair, and in `out` what
    /// `finish` makes of the sums of each particle.
    pub(crate) fn find<T: Send>(
        &mut self,
        cells: [&Cells; 2],
        positions: &[Vec4],
        support: f32,
        shape: impl Shape,
        out: &mut [T],
        finish: impl Fn(usize, &Sums) -> T + Sync,
    ) {
        let count = out.len();
        let blocks = count.div_ceil(BLOCK);
        self.blocks.resize_with(blocks, Block::default);
        let square = support * support;
        let coincident = COINCIDENT * COINCIDENT * square;
        let [cells, images] = cells;
        let blocks = self.blocks.par_iter_mut().zip(out.par_chunks_mut(BLOCK));
        blocks.enumerate().for_each(|(b, (block, out))| {
            block.start.clear();
            block.index.clear();
            block.pair.clear();
            block.start.push(0);
            for (k, out) in out.iter_mut().enumerate() {
                let i = b * BLOCK + k;
                let p = positions[i];
                let found = near(block, cells, &positions[..count], (i, p), square, (0, 0));
                let found = near(block, images, &positions[count..], (i, p), square, (found, count));
                for square in &mut block.square[..found] {
                    *square = square.max(coincident);
                }
                let density = pulp::Arch::new().dispatch(Evaluate { shape, block, found });
                let mut sums = Sums {
                    density,
                    ..Sums::default()
                };
                block.index.extend_from_slice(&block.near[..found]);
                let [factors, values, _] = &block.shape;
                let each = block.near[..found].iter().zip(&block.square[..found]);
                block.pair.extend(each.zip(factors.iter().zip(values)).map(
                    |((&j, &r2), (factor, value))| {
                        let x = if r2 > coincident {
                            p - positions[j as usize]
                        } else {
                            (apart(i, j as usize) * coincident.sqrt()).extend(0.0)
                        };
                        let g = *factor * x;
                        sums.gradient += g;
                        sums.moment[0] -= x.x * g;
                        sums.moment[1] -= x.y * g;
                        sums.moment[2] -= x.z * g;
                        Vec4::new(g.x, g.y, g.z, *value)
                    },
                ));
                block.start.push(block.index.len() as u32);
                *out = finish(i, &sums);
            }
        });
    }

    /// Gives each pair two vectors more, `f(particle, neighbour, pair)`, and writes to `out` what `finish` makes of a
    /// particle and the sums of the squares of its pairs and of the first of these vectors, and of the values beside g.
    pub(crate) fn pair_with<T: Send>(
        &mut self,
        f: impl Fn(usize, usize, Vec4) -> [Vec4; 2] + Sync,
        out: &mut [T],
        finish: impl Fn(usize, [f32; 3]) -> T + Sync,
    ) {
        let blocks = self.blocks.par_iter_mut().zip(out.par_chunks_mut(BLOCK));
        blocks.enumerate().for_each(|(b, (block, out))| {
            block.own.resize(block.pair.len(), Vec4::ZERO);
            block.other.resize(block.pair.len(), Vec4::ZERO);
            for (k, out) in out.iter_mut().enumerate() {
                let i = b * BLOCK + k;
                let range = block.start[k] as usize..block.start[k + 1] as usize;
                let (mut plain, mut square, mut beside) = (Vec4::ZERO, Vec4::ZERO, 0.0);
                let own = block.own[range.clone()]
                    .iter_mut()
                    .zip(&mut block.other[range.clone()]);
                let pairs = block.index[range.clone()].iter().zip(&block.pair[range]);
                for ((&j, &g), (own, other)) in pairs.zip(own) {
                    [*own, *other] = f(i, j as usize, g);
                    plain += g * g;
                    square += *own * *own;
                    beside += g.w;
                }
                let [plain, square] = [plain, square].map(|s| s.truncate().element_sum());
                *out = finish(i, [plain, square, beside]);
            }
        });
    }

    /// Writes `f` of every particle to `out`.
    pub(crate) fn map<T: Send>(&self, out: &mut [T], f: impl Fn(Near<'_>) -> T + Sync) {
        self.blocks
            .par_iter()
            .zip(out.par_chunks_mut(BLOCK))
            .enumerate()
            .for_each(|(b, (block, out))| {
                for (k, out) in out.iter_mut().enumerate() {
                    *out = f(block.near_of(b, k));
                }
            });
    }

    /// Writes `f` of every particle to `out` and sums the two values that it says beside: block by block, so that the sum does not
    /// depend on threads. `partial` is work space.
    pub(crate) fn map_sum<T: Send>(
        &self,
        out: &mut [T],
        partial: &mut Vec<[f64; 2]>,
        f: impl Fn(Near<'_>) -> (T, [f64; 2]) + Sync,
    ) -> [f64; 2] {
        partial.resize(self.blocks.len(), [0.0; 2]);
        self.blocks
            .par_iter()
            .zip(out.par_chunks_mut(BLOCK))
            .zip(partial.par_iter_mut())
            .enumerate()
            .for_each(|(b, ((block, out), partial))| {
                *partial = [0.0; 2];
                for (k, out) in out.iter_mut().enumerate() {
                    let (value, [first, second]) = f(block.near_of(b, k));
                    *out = value;
                    partial[0] += first;
                    partial[1] += second;
                }
            });
        partial
            .iter()
            .fold([0.0; 2], |sum, p| [sum[0] + p[0], sum[1] + p[1]])
    }

    pub(crate) fn bytes(&self) -> usize {
        self.blocks
            .iter()
            .map(|b| {
                4 * (b.start.capacity() + b.index.capacity())
                    + 16 * (b.pair.capacity() + b.own.capacity() + b.other.capacity())
            })
            .sum()
    }
}

impl Block {
    #[inline]
    fn near_of(&self, b: usize, k: usize) -> Near<'_> {
        let range = self.start[k] as usize..self.start[k + 1] as usize;
        Near {
            i: b * BLOCK + k,
            index: &self.index[range.clone()],
            pair: &self.pair[range.clone()],
            own: self.own.get(range.clone()).unwrap_or_default(),
            other: self.other.get(range).unwrap_or_default(),
        }
    }
}

/// What the kernel says of the candidates of one particle that are near; gives Σ W.
struct Evaluate<'a, S> {
    shape: S,
    block: &'a mut Block,
    found: usize,
}

impl<K: Shape> pulp::WithSimd for Evaluate<'_, K> {
    type Output = f32;

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) -> f32 {
        let Block { square, shape, .. } = self.block;
        let [factors, values, shares] = shape;
        for list in [&mut *factors, &mut *values, &mut *shares] {
            if list.len() < self.found {
                list.resize(2 * self.found, 0.0);
            }
        }
        let (factors, values) = (&mut factors[..self.found], &mut values[..self.found]);
        let shares = &mut shares[..self.found];
        let each = square[..self.found].iter().zip(factors).zip(values);
        for (((square, factor), value), share) in each.zip(&mut *shares) {
            [*factor, *value, *share] = self.shape.of(*square);
        }
        shares.iter().sum()
    }
}

/// A direction in which two particles in one place part: of chance, but the same for any run, and opposite for both.
pub(super) fn apart(i: usize, j: usize) -> Vec3 {
    let mut rng = Rng::new(i.min(j) as u64, i.max(j) as u64);
    let mut side = || rng.uniform_f32() - 0.5;
    let direction = Vec3::new(side(), side(), side()).normalize_or(Vec3::X);
    if i < j { direction } else { -direction }
}

/// Lists in `block.near`, behind the `found` that are there, what of `cells` is within reach of particle `i` at `p`,
/// without a branch a candidate, since which are near is a matter of chance. Numbers are counted from `first`. Returns
/// how many there are in all.
#[inline]
fn near(
    block: &mut Block,
    cells: &Cells,
    positions: &[Vec4],
    (i, p): (usize, Vec4),
    square: f32,
    (mut found, first): (usize, usize),
) -> usize {
    for run in cells.runs_around(p.truncate()).iter() {
        let room = found + run.len() + 1;
        if block.near.len() < room {
            block.near.resize(2 * room, 0);
            block.square.resize(2 * room, 0.0);
        }
        let (list, squares) = (&mut block.near[..room], &mut block.square[..room]);
        for (j, q) in run.clone().zip(&positions[run]) {
            let x = p - *q;
            let r2 = x.x * x.x + x.y * x.y + x.z * x.z;
            let j = first + j;
            list[found] = j as u32;
            squares[found] = r2;
            found += usize::from(r2 < square && j != i);
        }
    }
    found
}
