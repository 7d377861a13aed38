//! Rows, some columns at a time. Lengths that are known, and results in arrays of their own, are what lets a loop with many
//! inputs and outputs vectorise: the compiler need not ask which of them overlap.

/// Columns that are computed at a time.
pub(super) const CHUNK: usize = 64;
/// The same near the end of a row; the length of a padded row is a multiple of it.
pub(super) const FEW: usize = 16;

/// Calls `$step::<T, N>(first, …)` over the columns of a range, `N` at a time.
macro_rules! in_chunks {
    ($columns:expr, $step:ident($($argument:expr),* $(,)?)) => {{
        use $crate::shallow_water::chunks::{CHUNK, FEW};
        let std::ops::Range { start: mut at, end } = $columns;
        while at + CHUNK <= end {
            $step::<T, CHUNK>(at, $($argument),*);
            at += CHUNK;
        }
        while at + FEW <= end {
            $step::<T, FEW>(at, $($argument),*);
            at += FEW;
        }
        while at < end {
            $step::<T, 1>(at, $($argument),*);
            at += 1;
        }
    }};
}
pub(super) use in_chunks;

/// `N` values from `first`.
#[inline(always)]
pub(super) fn of<T, const N: usize>(x: &[T], first: usize) -> &[T; N] {
    let Some(chunk) = x[first..].first_chunk() else {
        unreachable!("the rows' slices hold what their lengths say");
    };
    chunk
}
