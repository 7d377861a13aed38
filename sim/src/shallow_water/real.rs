//! The two floating-point types of the kernels, behind the few operations that they need.

use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub};

/// `f32` for speed, `f64` for truth. Kernels written over it give the same bits in scalar and in vector form, because
/// every operation here is a correctly rounded one and nothing is contracted.
pub(crate) trait Real:
    Copy
    + Send
    + Sync
    + PartialOrd
    + std::fmt::Debug
    + Add<Output = Self>
    + AddAssign
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + 'static
{
    /// 0.
    const ZERO: Self;
    /// ½.
    const HALF: Self;
    /// ¼.
    const QUARTER: Self;
    /// 1.
    const ONE: Self;
    /// 2.
    const TWO: Self;
    /// 4.
    const FOUR: Self;
    /// A positive number so small that adding it changes no normal result; keeps 0/0 at 0.
    const TINY: Self;
    /// Bits of the significand, the hidden one included.
    const DIGITS: i32;
    /// Integers that order as the values that are not negative do: their maximum is one that may be taken in any order,
    /// which lets a loop over it vectorise.
    type Bits: Copy + Ord;

    /// The bits; smaller than those of 0 for negative values.
    fn bits(self) -> Self::Bits;
    /// From bits.
    fn of_bits(bits: Self::Bits) -> Self;

    /// The nearest value.
    fn from_f64(value: f64) -> Self;
    /// The same value, exactly.
    fn to_f64(self) -> f64;
    /// Square root.
    fn sqrt(self) -> Self;
    /// Absolute value.
    fn abs(self) -> Self;
    /// `x^(-1/3)` for normal positive `x`, to a few units in the last place, in vectorisable operations.
    fn inverse_cube_root(self) -> Self;

    /// The larger value, `other` where one is NaN: one instruction, unlike `f32::max`.
    #[inline(always)]
    fn larger(self, other: Self) -> Self {
        if self > other { self } else { other }
    }

    /// The smaller value, `other` where one is NaN.
    #[inline(always)]
    fn smaller(self, other: Self) -> Self {
        if self < other { self } else { other }
    }
}

macro_rules! real {
    ($t:ident, $bits:ident, $unsigned:ident, $digits:literal, $tiny:literal, $magic:literal, $iterations:literal) => {
        impl Real for $t {
            const ZERO: Self = 0.0;
            const HALF: Self = 0.5;
            const QUARTER: Self = 0.25;
            const ONE: Self = 1.0;
            const TWO: Self = 2.0;
            const FOUR: Self = 4.0;
            const TINY: Self = $tiny;
            const DIGITS: i32 = $digits;
            type Bits = $bits;

            #[inline(always)]
            fn bits(self) -> $bits {
                self.to_bits() as $bits
            }
            #[inline(always)]
            fn of_bits(bits: $bits) -> Self {
                Self::from_bits(bits as $unsigned)
            }
            #[inline(always)]
            fn from_f64(value: f64) -> Self {
                value as Self
            }
            #[inline(always)]
            fn to_f64(self) -> f64 {
                f64::from(self)
            }
            #[inline(always)]
            fn sqrt(self) -> Self {
                self.sqrt()
            }
            #[inline(always)]
            fn abs(self) -> Self {
                self.abs()
            }
            #[inline(always)]
            fn inverse_cube_root(self) -> Self {
                // The exponent divided by −3 gives a first guess within 4 %; Newton's step for y⁻³ = x squares the error.
                let mut y = $t::from_bits($magic - self.to_bits() / 3);
                for _ in 0..$iterations {
                    y = y * (4.0 - self * y * y * y) * (1.0 / 3.0);
                }
                y
            }
        }
    };
}

real!(f32, i32, u32, 24, 1e-30, 0x54a2_1d2a, 3);
real!(f64, i64, u64, 53, 1e-200, 0x553e_f0ff_289d_d796, 4);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn inverse_cube_roots_are_exact_to_rounding() {
        for k in -200..200 {
            let x = 1.37_f64.powi(k) * 1.1;
            let single = (x as f32).inverse_cube_root();
            let double = x.inverse_cube_root();
            assert!(
                (f64::from(single) * f64::from(x as f32).cbrt() - 1.0).abs() < 4e-7,
                "{x}"
            );
            assert!((double * x.cbrt() - 1.0).abs() < 1e-14, "{x}");
        }
    }

    #[test]
    fn larger_and_smaller_order_values() {
        assert_eq!((1.0_f32.larger(2.0), 1.0_f32.smaller(2.0)), (2.0, 1.0));
        assert_eq!((f64::NAN.larger(2.0), f64::NAN.smaller(2.0)), (2.0, 2.0));
    }
}
