//! Eight numbers side by side, with the same results on any machine.

use pulp::{Simd, f32x8, m32x8};
use std::ops::{Add, Mul, Range, Sub};

/// Numbers side by side. Fixed, so that sums are the same on any machine.
pub(crate) const LANES: usize = 8;

/// What computes with eight numbers at once: AVX2 where there is any, else eight times the same.
pub(crate) trait Machine: Simd<f32s = f32x8, m32s = m32x8> {
    /// A bit a lane, the first one lowest.
    fn bits(self, mask: m32x8) -> u32;

    /// Whole numbers towards 0, of what lies between 0 and 2³¹; something else of others.
    fn whole(self, values: f32x8) -> [i32; LANES];

    #[inline(always)]
    fn all(self, value: f32) -> Eight<Self> {
        Eight(self, self.splat_f32s(value))
    }

    #[inline(always)]
    fn eight(self, values: &[f32; LANES]) -> Eight<Self> {
        Eight(self, pulp::cast(*values))
    }
}

#[cfg(target_arch = "x86_64")]
impl Machine for pulp::x86::V3 {
    #[inline(always)]
    fn bits(self, mask: m32x8) -> u32 {
        self.avx._mm256_movemask_ps(pulp::cast(mask)) as u32
    }

    #[inline(always)]
    fn whole(self, values: f32x8) -> [i32; LANES] {
        pulp::cast(self.convert_f32x8_to_i32x8(values))
    }
}

impl Machine for pulp::Scalar256b {
    #[inline(always)]
    fn bits(self, mask: m32x8) -> u32 {
        let lanes: [u32; LANES] = pulp::cast(mask);
        (0..LANES).fold(0, |bits, k| bits | (lanes[k] & 1) << k)
    }

    #[inline(always)]
    fn whole(self, values: f32x8) -> [i32; LANES] {
        pulp::cast::<_, [f32; LANES]>(values).map(|v| v as i32)
    }
}

/// What of `list` is in `run`, by eight; the last ones go on beyond it, and so must the list.
#[inline(always)]
pub(crate) fn eights<'a>(list: &'a [f32], run: &Range<usize>) -> &'a [[f32; LANES]] {
    let end = run.start + run.len().next_multiple_of(LANES);
    list[run.start..end].as_chunks().0
}

/// The same, to be changed.
#[inline(always)]
pub(crate) fn eights_mut<'a>(list: &'a mut [f32], run: &Range<usize>) -> &'a mut [[f32; LANES]] {
    let end = run.start + run.len().next_multiple_of(LANES);
    list[run.start..end].as_chunks_mut().0
}

/// Eight numbers.
#[derive(Clone, Copy)]
pub(crate) struct Eight<M: Machine>(M, f32x8);

impl<M: Machine> Eight<M> {
    /// The larger ones.
    #[inline(always)]
    pub(crate) fn max(self, other: Self) -> Self {
        Self(self.0, self.0.max_f32s(self.1, other.1))
    }

    /// The smaller ones.
    #[inline(always)]
    pub(crate) fn min(self, other: Self) -> Self {
        Self(self.0, self.0.min_f32s(self.1, other.1))
    }

    #[inline(always)]
    pub(crate) fn sqrt(self) -> Self {
        Self(self.0, self.0.sqrt_f32s(self.1))
    }

    #[inline(always)]
    pub(crate) fn over(self, other: Self) -> Self {
        Self(self.0, self.0.div_f32s(self.1, other.1))
    }

    /// A bit for each that is less than the other one, the first lowest.
    #[inline(always)]
    pub(crate) fn less(self, other: Self) -> u32 {
        self.0.bits(self.0.less_than_f32s(self.1, other.1))
    }

    /// Whole numbers, of negative ones 0 and of those from 2³¹ on 2³¹ - 128.
    #[inline(always)]
    pub(crate) fn whole(self) -> [i32; LANES] {
        let (none, most) = (self.0.all(0.0), self.0.all(2_147_483_520.0));
        self.0.whole(self.max(none).min(most).1)
    }

    #[inline(always)]
    pub(crate) fn values(self) -> [f32; LANES] {
        pulp::cast(self.1)
    }

    #[inline(always)]
    pub(crate) fn sum(self) -> f32 {
        let [a, b, c, d, e, f, g, h] = self.values();
        ((a + e) + (c + g)) + ((b + f) + (d + h))
    }
}

impl<M: Machine> Add for Eight<M> {
    type Output = Self;

    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self(self.0, self.0.add_f32s(self.1, other.1))
    }
}

impl<M: Machine> Sub for Eight<M> {
    type Output = Self;

    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self(self.0, self.0.sub_f32s(self.1, other.1))
    }
}

impl<M: Machine> Mul for Eight<M> {
    type Output = Self;

    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        Self(self.0, self.0.mul_f32s(self.1, other.1))
    }
}

/// What is computed so.
pub(crate) trait Kernel {
    /// Must be inlined, as all it calls.
    fn run<M: Machine>(self, machine: M);
}

struct Call<K, M>(K, M);

#[cfg(target_arch = "x86_64")]
impl<K: Kernel, M: Machine> pulp::NullaryFnOnce for Call<K, M> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        self.0.run(self.1);
    }
}

/// Runs `kernel` on the best there is.
pub(crate) fn dispatch(kernel: impl Kernel) {
    #[cfg(target_arch = "x86_64")]
    if let Some(machine) = pulp::x86::V3::try_new() {
        return machine.vectorize(Call(kernel, machine));
    }
    kernel.run(pulp::Scalar256b);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rng::Rng;

    /// Everything that there is of eight numbers, of many.
    struct All<'a>(&'a mut Vec<u32>);

    impl Kernel for All<'_> {
        #[inline(always)]
        fn run<M: Machine>(self, m: M) {
            let mut rng = Rng::new(8, 0);
            for _ in 0..100 {
                let mut eight = || m.eight(&[0.0; LANES].map(|_: f32| 9.0 * rng.uniform_f32() - 3.0));
                let (a, b) = (eight(), eight());
                let root = (a * b).max(m.all(0.0)).sqrt();
                for values in [a + b, a - b, a.min(b), root, a.over(b)] {
                    self.0.extend(values.values().map(f32::to_bits));
                    self.0.push(values.sum().to_bits());
                }
                self.0.push(a.less(b));
                self.0.extend((a * m.all(1e9)).whole().map(i32::cast_unsigned));
            }
        }
    }

    #[test]
    fn all_machines_give_the_same_bits() {
        let (mut best, mut plain) = (Vec::new(), Vec::new());
        dispatch(All(&mut best));
        All(&mut plain).run(pulp::Scalar256b);
        assert_eq!(best, plain);
        assert!(best.contains(&2_147_483_520));
    }
}
