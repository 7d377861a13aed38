//! Counting sort.

/// Sorts by `keys`, which are less than `groups` and stay as they are: calls `place` with the number of each and its place in the
/// new order, those of equal keys in the order that they had. What has key g is then from `start[g]` to `start[g + 1]`.
pub(super) fn sort(keys: &[u32], groups: usize, start: &mut Vec<u32>, mut place: impl FnMut(usize, usize)) {
    // Counted two places on and summed, starts stand one place on; taking members up moves each to where it belongs.
    start.clear();
    start.resize(groups + 2, 0);
    for &key in keys {
        start[key as usize + 2] += 1;
    }
    let mut sum = 0;
    for start in start.iter_mut() {
        sum += *start;
        *start = sum;
    }
    for (k, &key) in keys.iter().enumerate() {
        let at = &mut start[key as usize + 1];
        place(k, *at as usize);
        *at += 1;
    }
}
