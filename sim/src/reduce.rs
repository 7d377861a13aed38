//! Deterministic parallel reductions: the only way that floating-point values are summed or compared across threads.
//!
//! The data is cut into chunks of a fixed length, each chunk is folded in order, and the partial results are folded
//! in order of the chunks. The result therefore does not depend on the number of threads, bit for bit.

use rayon::prelude::*;

/// Elements a chunk. Fixed: changing it changes results in the last bits.
pub const CHUNK: usize = 4096;

/// Folds `map` of every index in `0..len` with `fold`, deterministically and in parallel.
///
/// `identity` must be neutral for `fold` (0 for a sum, −∞ for a maximum).
pub fn reduce<T: Send + Sync + Copy>(
    len: usize,
    identity: T,
    map: impl Fn(usize) -> T + Sync,
    fold: impl Fn(T, T) -> T + Sync,
) -> T {
    let chunk = |c: usize| {
        let end = ((c + 1) * CHUNK).min(len);
        (c * CHUNK..end).fold(identity, |acc, k| fold(acc, map(k)))
    };
    let chunks = len.div_ceil(CHUNK);
    if chunks <= 1 {
        return chunk(0);
    }
    let partial: Vec<T> = (0..chunks).into_par_iter().map(chunk).collect();
    partial.into_iter().fold(identity, fold)
}

/// Folds one value a block of `0..count` with `fold`, deterministically and in parallel: for callers that sum whole
/// rows or tiles themselves, in order. `None` if `count` is 0.
pub fn fold_blocks<T: Send>(
    count: usize,
    block: impl Fn(usize) -> T + Sync + Send,
    fold: impl Fn(T, T) -> T,
) -> Option<T> {
    let partial: Vec<T> = (0..count).into_par_iter().map(block).collect();
    partial.into_iter().reduce(fold)
}

/// Sum in f64 of `map` over `0..len`.
pub fn sum(len: usize, map: impl Fn(usize) -> f64 + Sync) -> f64 {
    reduce(len, 0.0, map, |a, b| a + b)
}

/// Largest value of `map` over `0..len` with its index; NaN counts as larger than everything, so it is never missed.
/// The first of equal values wins. `None` if `len` is 0.
pub fn arg_max(len: usize, map: impl Fn(usize) -> f64 + Sync) -> Option<(usize, f64)> {
    if len == 0 {
        return None;
    }
    let rank = |v: f64| if v.is_nan() { f64::INFINITY } else { v };
    let best = reduce(
        len,
        (usize::MAX, f64::NEG_INFINITY),
        |k| (k, map(k)),
        |a, b| {
            if a.0 == usize::MAX || (b.0 != usize::MAX && rank(b.1) > rank(a.1)) {
                b
            } else {
                a
            }
        },
    );
    Some(best)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn in_pool<T: Send>(threads: usize, f: impl FnOnce() -> T + Send) -> T {
        rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap()
            .install(f)
    }

    #[test]
    fn sums_do_not_depend_on_threads() {
        let value = |k: usize| ((k as f64) * 0.37).sin() * 1e3;
        let one = in_pool(1, || sum(100_003, value));
        for threads in [2, 3, 7] {
            assert_eq!(one.to_bits(), in_pool(threads, || sum(100_003, value)).to_bits());
        }
        assert!((one - (0..100_003).map(value).sum::<f64>()).abs() < 1e-6);
    }

    #[test]
    fn blocks_are_folded_in_order() {
        let text = in_pool(3, || fold_blocks(40, |k| k.to_string(), |a, b| a + &b));
        assert_eq!(text, Some((0..40).map(|k| k.to_string()).collect()));
        assert_eq!(fold_blocks(0, |k| k, |a, _| a), None);
    }

    #[test]
    fn nan_is_never_missed_by_a_maximum() {
        let (k, v) = arg_max(50_000, |k| if k == 31_234 { f64::NAN } else { k as f64 }).unwrap();
        assert!(k == 31_234 && v.is_nan());
        assert_eq!(arg_max(0, |_| 0.0), None);
        assert_eq!(arg_max(3, |_| 1.0), Some((0, 1.0)));
    }
}
