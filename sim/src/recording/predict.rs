//! Predictors: what is stored is the difference between a number and what its neighbours let expect.
//!
//! All work on 32-bit integers with wrapping arithmetic, so that they are exact for any input.

/// Nothing is expected.
pub(super) const NONE: u8 = 0;
/// The plane through the left, the upper and the upper left neighbour.
pub(super) const GRADIENT: u8 = 1;
/// A weighted sum of neighbours; the weights precede the data. See [`super::fitted`].
pub(super) const FITTED: u8 = 2;

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

/// Bins of the estimate: as many as pco uses.
const BINS: usize = 16;
/// Numbers that the estimate looks at.
const SAMPLE: usize = 1024;

/// Estimate of the bits that pco takes for each of `numbers`, from a sample of them.
///
/// Like pco it cuts the sorted numbers into bins of equal count; a number costs its bin's share and its offset in it.
pub(super) fn estimated_bits(numbers: &[i32], sample: &mut Vec<i32>) -> f64 {
    sample.clear();
    // Odd, so that it does not look at few columns only.
    sample.extend(numbers.iter().step_by((numbers.len() / SAMPLE) | 1));
    sample.sort_unstable();
    let total = sample.len() as f64;
    let (mut bits, mut same) = (0.0, 0.0);
    let mut bins = sample.chunks(sample.len().div_ceil(BINS).max(1)).peekable();
    while let Some(bin) = bins.next() {
        let (low, high) = (bin[0], bin[bin.len() - 1]);
        let width = high.wrapping_sub(low) as u32;
        same += bin.len() as f64;
        // Bins that hold the same single number are one bin.
        if width == 0 && bins.peek().is_some_and(|next| next[next.len() - 1] == low) {
            continue;
        }
        bits += same * (f64::from(32 - width.leading_zeros()) + (total / same).log2());
        same = 0.0;
    }
    bits / total.max(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rng::Rng;

    #[test]
    fn gradient_is_undone_for_any_shape() {
        let mut rng = Rng::new(1, 1);
        for (count, row) in [(1, 1), (7, 7), (7, 1), (60, 12), (61, 12), (1000, 999)] {
            let codes: Vec<i32> = (0..count).map(|_| rng.next_u64() as i32).collect();
            let mut residuals = Vec::new();
            gradient_residuals(&codes, row, &mut residuals);
            restore_gradient(&mut residuals, row);
            assert_eq!(residuals, codes);
        }
    }

    #[test]
    fn a_plane_leaves_nothing_to_store() {
        let codes: Vec<i32> = (0..200).map(|k| 7 * (k % 20) - 3 * (k / 20)).collect();
        let mut residuals = Vec::new();
        gradient_residuals(&codes, 20, &mut residuals);
        assert!(
            residuals
                .iter()
                .enumerate()
                .all(|(k, &r)| (k < 20 || k % 20 == 0) || r == 0)
        );
    }

    #[test]
    fn the_estimate_follows_the_spread() {
        let mut rng = Rng::new(1, 2);
        let mut sample = Vec::new();
        for bits in [0, 4, 12, 24] {
            let numbers: Vec<i32> = (0..50_000)
                .map(|_| (rng.next_u64() & ((1 << bits) - 1)) as i32)
                .collect();
            let estimate = estimated_bits(&numbers, &mut sample);
            // Uniform numbers cost their width; a bin may be half a bit too wide.
            assert!((estimate - f64::from(bits)).abs() < 1.0, "{bits}: {estimate}");
        }
        assert_eq!(estimated_bits(&[], &mut sample), 0.0);
    }
}
