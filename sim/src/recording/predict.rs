//! Predictors: what is stored is the difference between a number and what its neighbours let expect.
//!
//! All work on 32-bit integers with wrapping arithmetic, so that they are exact for any input.

/// How a band is predicted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Predictor {
    /// Nothing is expected.
    None,
    /// The plane through the left, the upper and the upper left neighbour.
    Gradient,
}

impl Predictor {
    /// As stored.
    pub(super) fn code(self) -> u8 {
        match self {
            Self::None => 0,
            Self::Gradient => 1,
        }
    }

    /// From what is stored.
    pub(super) fn from_code(code: u8) -> Option<Self> {
        match code {
            0 => Some(Self::None),
            1 => Some(Self::Gradient),
            _ => None,
        }
    }
}

/// Differences of `codes` from `left + above − above left`, rows of length `row`; beyond the first row and column
/// stands 0, except that the first row expects its left neighbour and the first column the sample above.
pub(super) fn gradient_residuals(codes: &[i32], row: usize, out: &mut Vec<i32>) {
    out.clear();
    out.reserve(codes.len());
    let mut above: &[i32] = &[];
    for line in codes.chunks(row) {
        let mut last = 0_i32;
        if above.is_empty() {
            out.extend(
                line.iter()
                    .map(|&c| c.wrapping_sub(std::mem::replace(&mut last, c))),
            );
        } else {
            out.extend(line.iter().zip(above).map(|(&c, &a)| {
                let down = c.wrapping_sub(a);
                down.wrapping_sub(std::mem::replace(&mut last, down))
            }));
        }
        above = line;
    }
}

/// Turns differences back into the numbers, in place.
pub(super) fn restore_gradient(values: &mut [i32], row: usize) {
    let mut above: &[i32] = &[];
    for line in values.chunks_mut(row) {
        let mut sum = 0_i32;
        for v in line.iter_mut() {
            sum = sum.wrapping_add(*v);
            *v = sum;
        }
        for (v, &a) in line.iter_mut().zip(above) {
            *v = v.wrapping_add(a);
        }
        above = line;
    }
}

/// Estimate of the bits that `residuals` take, from a part of them.
pub(super) fn estimated_bits(residuals: &[i32]) -> u64 {
    residuals
        .chunks(256)
        .step_by(4)
        .flatten()
        .map(|&r| u64::from(32 - (r ^ (r >> 31)).leading_zeros()))
        .sum()
}
