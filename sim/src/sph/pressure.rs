//! What pressures do: the accelerations that they give, and the rates of compression of those.
//!
//! With D the rate of compression, pressures p accelerate particles by a(p) = −Dᵀ p, so that c D a(p) = −c D Dᵀ p is what
//! they take from the compression, symmetric and never positive. `complementarity` looks for the pressures.
//!
//! Pressures that change from one particle to the next push hardly anything, so that D Dᵀ says little of them, and what it
//! says is mostly how the particles happen to lie. A small share of R p = Σ_j F_ij (p_i − p_j) is added to it, with g = −F x: of smooth
//! pressures that is half of what D Dᵀ makes of them, whatever their length, nothing of linear ones, but much of
//! those. It is symmetric and never negative as well, and costs nothing: it goes along as the fourth component of vectors.

use super::boundary::Touch;
use super::correction::Local;
use super::floating::{Carried, Floating};
use super::mirrors::Mirrors;
use super::neighbours::{Near, Neighbours};
use glam::Vec4;

/// One system: what it sees of the particles.
pub(crate) struct System<'a> {
    pub(crate) neighbours: &'a Neighbours,
    pub(crate) mirrors: &'a Mirrors,
    pub(crate) local: &'a [Local],
    pub(crate) touch: &'a [Touch],
    /// With L, or with the plain gradients of the density.
    pub(crate) corrected: bool,
    /// The factor c.
    pub(crate) gain: f32,
    /// Bodies that the pressure accelerates as well, and the mass of a particle in kg.
    pub(crate) floating: Option<(&'a Floating, f64)>,
    pub(crate) solution: Solution,
}

/// What is solved, and how exactly.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Solution {
    /// The share of R.
    pub(crate) firm: f32,
    /// Share of the tolerance that a guess may leave and be kept.
    pub(crate) guess: f64,
    /// Least and largest share of the tolerance at which a solution may end, and the share of what it began with.
    pub(crate) enough: [f64; 2],
    pub(crate) share: f64,
}

/// Pressures of `K` kinds side by side, and what they do.
#[derive(Debug)]
pub(crate) struct Applied<const K: usize> {
    /// With images.
    pub(crate) pressure: Vec<[f32; K]>,
    /// Their accelerations, with images, and minus the share of R times the pressure.
    pub(crate) pushed: Vec<[Vec4; K]>,
    /// c D a: what they add to the compression.
    pub(crate) product: Vec<[f32; K]>,
    /// What bodies do.
    pub(crate) carried: [Carried; K],
    partial: Vec<[f64; 2]>,
}

impl<const K: usize> Default for Applied<K> {
    fn default() -> Self {
        Self {
            pressure: Vec::new(),
            pushed: Vec::new(),
            product: Vec::new(),
            carried: [(); K].map(|()| Carried::default()),
            partial: Vec::new(),
        }
    }
}

impl<const K: usize> Applied<K> {
    pub(crate) fn bytes(&self) -> usize {
        K * (4 * (self.pressure.capacity() + self.product.capacity()) + 16 * self.pushed.capacity())
            + 16 * self.partial.capacity()
            + self.carried.iter().map(Carried::bytes).sum::<usize>()
    }
}

/// Σ_j (v_i − v_j) ⊗ g_ij: columns belong to the components of g.
#[inline]
pub(crate) fn differences(near: &Near<'_>, v: &[Vec4]) -> [Vec4; 3] {
    let own = v[near.i];
    let mut sum = [Vec4::ZERO; 3];
    for (j, g) in near.pairs() {
        let dv = own - v[j];
        sum[0] += g.x * dv;
        sum[1] += g.y * dv;
        sum[2] += g.z * dv;
    }
    sum
}

impl System<'_> {
    pub(crate) fn n(&self) -> usize {
        self.local.len()
    }

    /// Rates of compression of particle `near.i` in several fields, walls at rest, less R of their fourth components.
    #[inline]
    pub(crate) fn rates<const K: usize>(&self, near: &Near<'_>, v: &[[Vec4; K]]) -> [f32; K] {
        let own = v[near.i];
        let wall = self.touch[near.i].gradient.extend(0.0);
        let (gradients, wall) = if self.corrected {
            (near.own, self.local[near.i].correct(wall))
        } else {
            (near.pair, wall)
        };
        let sums: [Vec4; K] = near.sums(gradients, |j, g| {
            let other = v[j];
            std::array::from_fn(|k| (own[k] - other[k]) * g)
        });
        std::array::from_fn(|k| sums[k].element_sum() + own[k].dot(wall))
    }

    /// The same in one.
    #[inline]
    pub(crate) fn rate(&self, near: &Near<'_>, v: &[Vec4]) -> f32 {
        self.rates::<1>(near, v.as_chunks().0)[0]
    }

    /// What the motion of walls takes from [`Self::rate`].
    pub(crate) fn moving(&self, i: usize) -> f32 {
        let touch = &self.touch[i];
        let g = touch.gradient;
        if self.corrected && touch.moving != 0.0 {
            let along = g.dot(self.local[i].correct(g.extend(0.0)).truncate());
            touch.moving * along / g.length_squared().max(1e-20)
        } else {
            touch.moving
        }
    }

    /// Finds what `applied.pressure` does. Returns the sums over the particles of what `sums` says of each and its product.
    pub(crate) fn apply<const K: usize>(
        &self,
        applied: &mut Applied<K>,
        sums: impl Fn(usize, [f32; K]) -> [f64; 2] + Sync,
    ) -> [f64; 2] {
        self.accelerate(applied);
        let (pushed, carried) = (&applied.pushed, &applied.carried);
        let (product, partial) = (&mut applied.product, &mut applied.partial);
        self.neighbours.map_sum(product, partial, |near| {
            let rates = self.rates(&near, pushed);
            let product = std::array::from_fn(|k| self.gain * (rates[k] - carried[k].at(near.i)));
            (product, sums(near.i, product))
        })
    }

    /// Finds the accelerations of `applied.pressure`.
    pub(crate) fn accelerate<const K: usize>(&self, applied: &mut Applied<K>) {
        let n = self.n();
        self.mirrors.extend(&mut applied.pressure, n, |p, _| p);
        applied.pushed.resize(n + self.mirrors.len(), [Vec4::ZERO; K]);
        applied.product.resize(n, [0.0; K]);
        let p = &applied.pressure[..];
        self.neighbours.map(&mut applied.pushed[..n], |near| {
            let (own, local) = (p[near.i], &self.local[near.i]);
            let (gradients, sum) = if self.corrected {
                (near.other, local.correct(local.sum.extend(0.0)))
            } else {
                (near.pair, local.sum.extend(0.0))
            };
            let others = near.sums(gradients, |j, g| p[j].map(|p| p * g));
            let all = |k: usize| (-others[k] - own[k] * sum).with_w(-self.solution.firm * own[k]);
            std::array::from_fn(all)
        });
        self.mirrors
            .extend(&mut applied.pushed, n, |v, sign| v.map(|v| v * sign));
        for (k, carried) in applied.carried.iter_mut().enumerate() {
            self.carry(|i| p[i][k], carried);
        }
    }

    /// What bodies do under pressures.
    pub(crate) fn carry(&self, pressure: impl Fn(usize) -> f32, out: &mut Carried) {
        match self.floating {
            Some((floating, mass)) => floating.accelerate(pressure, mass, self.n(), out),
            None => out.clear(),
        }
    }

    /// Inverse of the diagonal but for the factor c, m².
    #[inline(always)]
    pub(crate) fn inverse(&self, i: usize) -> f32 {
        self.local[i].inverse[usize::from(!self.corrected)]
    }
}

/// Inverse of the diagonals, m², with L and without, from the sums of the squares of g and of L g and the sum of F; `firm` are
/// the shares of R, without L and with it, and `least` bounds the diagonals from below.
pub(crate) fn inverse_diagonal(
    [plain, corrected, beside]: [f32; 3],
    local: &Local,
    firm: [f32; 2],
    least: f32,
) -> [f32; 2] {
    let sum = local.correct(local.sum.extend(0.0));
    [
        1.0 / (corrected + sum.length_squared() + firm[1] * beside).max(least),
        1.0 / (plain + local.sum.length_squared() + firm[0] * beside).max(least),
    ]
}
