//! A linear predictor fitted to each band: the weighted sum of 24 neighbours that are already known.
//!
//! Water waves are smooth over a few samples, in all directions at once. Least squares finds the weights that leave the
//! least to store; they are kept with the band. Both directions evaluate the same floating-point expressions in the
//! same order (IEEE 754 single precision, no fused operations), so that a reader on any machine repeats the writer's
//! predictions bit for bit.
//!
//! A sample depends on its left neighbour, which makes a row sequential. [`sweep`] therefore works on [`LANES`] rows at
//! once, each [`SKEW`] columns behind the one above it: a wavefront of independent samples that fills a vector.

use std::cell::RefCell;

/// Neighbours a sample is predicted from: three to the left, then seven in each of the three rows above.
pub(super) const TAPS: usize = 24;
/// One weight a neighbour.
pub(super) type Weights = [f32; TAPS];

/// Rows above, and columns to either side, that the neighbours reach.
pub(super) const REACH: usize = 3;
/// Rows worked on together.
const LANES: usize = 8;
/// Columns between a row and the one above; the neighbour farthest to the right must be known.
const SKEW: usize = REACH + 1;
/// Numbers a time step in the work array: the rows above, then the lanes; padded to whole vectors.
const STRIDE: usize = 12;
/// Steps from the oldest neighbour to the present one.
const HISTORY: usize = REACH * SKEW + REACH;
const WINDOW: usize = (HISTORY + 1) * STRIDE;

/// Column and row of each neighbour relative to the sample. The left ones come last: they are known last, and the sum
/// is formed in this order.
pub(super) const OFFSETS: [(isize, isize); TAPS] = {
    let mut offsets = [(0, 0); TAPS];
    let mut k = 0;
    while k < 21 {
        offsets[k] = ((k % 7) as isize - 3, (k / 7) as isize - 3);
        k += 1;
    }
    while k < TAPS {
        offsets[k] = (k as isize - 24, 0);
        k += 1;
    }
    offsets
};

/// Where the lanes of each neighbour begin in the window that ends with the present step.
const PLACES: [usize; TAPS] = {
    let mut places = [0; TAPS];
    let mut k = 0;
    while k < TAPS {
        let (dx, dz) = OFFSETS[k];
        // Sample (row, column) is computed in step column + SKEW · row.
        let step = HISTORY as isize + dx + SKEW as isize * dz;
        places[k] = step as usize * STRIDE + (REACH as isize + dz) as usize;
        k += 1;
    }
    places
};

/// How the integers of a band stand for the numbers that are predicted.
pub(super) trait Domain: Copy + Sync {
    /// The number that an integer stands for.
    fn number(self, code: i32) -> f32;
    /// The integer nearest to a prediction.
    fn code(self, number: f32) -> i32;
}

/// Integers that keep the order of f32 and every bit of them.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ordered;

impl Domain for Ordered {
    fn number(self, code: i32) -> f32 {
        f32::from_bits(super::plane::ordered(code) as u32)
    }

    fn code(self, number: f32) -> i32 {
        super::plane::ordered(number.to_bits() as i32)
    }
}

/// Integers as they are.
#[derive(Clone, Copy, Debug)]
pub(super) struct Whole;

impl Domain for Whole {
    fn number(self, code: i32) -> f32 {
        code as f32
    }

    /// Rounds by adding 1.5 · 2²³, which leaves the integer in the low bits; beyond ±2²² the result is some other
    /// integer, the same on every machine.
    fn code(self, number: f32) -> i32 {
        const ROUND: f32 = 12_582_912.0;
        ((number + ROUND).to_bits() as i32).wrapping_sub(ROUND.to_bits() as i32)
    }
}

/// Whether a band of this shape can be predicted so.
pub(super) fn applies(count: usize, row: usize) -> bool {
    count >= 2048 && row > 2 * REACH && count / row > 2 * REACH
}

/// The weights that predict `codes`, rows of length `row`, with the least squared error; `None` where there are none
/// that can be relied on.
pub(super) fn fit(domain: impl Domain, codes: &[i32], row: usize) -> Option<Weights> {
    let mut normal = Normal::default();
    let rows = codes.len() / row;
    // Every 29th sample, shifted from row to row; enough equations for the weights of any but the smallest bands.
    let stride = (codes.len() / 4096).clamp(1, 29);
    for j in REACH..rows {
        for i in (REACH + j * 11 % stride..row - REACH).step_by(stride) {
            let at = j * row + i;
            let neighbour = |(dx, dz): (isize, isize)| {
                let index = at.wrapping_add_signed(dx + dz * row as isize);
                f64::from(domain.number(codes[index]))
            };
            normal.add(OFFSETS.map(neighbour), f64::from(domain.number(codes[at])));
        }
    }
    let weights = normal.solve()?.map(|w| w as f32);
    // No prediction may overflow: the sign of a NaN is not the same on every machine.
    let largest = codes.iter().fold(0.0_f32, |m, &c| m.max(domain.number(c).abs()));
    let gain: f32 = weights.iter().map(|w| w.abs()).sum();
    (gain * largest < f32::MAX / 4.0).then_some(weights)
}

/// Normal equations of the fit.
struct Normal {
    matrix: [[f64; TAPS]; TAPS],
    right: [f64; TAPS],
}

impl Default for Normal {
    fn default() -> Self {
        Self {
            matrix: [[0.0; TAPS]; TAPS],
            right: [0.0; TAPS],
        }
    }
}

impl Normal {
    fn add(&mut self, x: [f64; TAPS], y: f64) {
        for (k, row) in self.matrix.iter_mut().enumerate() {
            for (a, &b) in row[..=k].iter_mut().zip(&x) {
                *a += x[k] * b;
            }
            self.right[k] += x[k] * y;
        }
    }

    /// Solves by Cholesky's decomposition of the lower triangle.
    fn solve(mut self) -> Option<[f64; TAPS]> {
        let a = &mut self.matrix;
        let trace: f64 = (0..TAPS).map(|k| a[k][k]).sum();
        // A smooth surface makes the matrix nearly singular; this keeps the weights small at the cost of an error
        // in the prediction far below a unit in the last place.
        let ridge = 1e-14 * trace / TAPS as f64;
        for k in 0..TAPS {
            a[k][k] += ridge;
            for c in 0..=k {
                let sum: f64 = (0..c).map(|n| a[k][n] * a[c][n]).sum();
                let rest = a[k][c] - sum;
                a[k][c] = if c == k { rest.sqrt() } else { rest / a[c][c] };
            }
        }
        let mut x = self.right;
        for k in 0..TAPS {
            let sum: f64 = (0..k).map(|n| a[k][n] * x[n]).sum();
            x[k] = (x[k] - sum) / a[k][k];
        }
        for k in (0..TAPS).rev() {
            let sum: f64 = (k + 1..TAPS).map(|n| a[n][k] * x[n]).sum();
            x[k] = (x[k] - sum) / a[k][k];
        }
        // A pivot that is not positive has made everything after it NaN or infinite.
        x.iter().all(|w| w.abs() < 1e3).then_some(x)
    }
}

/// Replaces the numbers of a band, whose first [`REACH`] rows are left alone, by differences from the prediction.
pub(super) fn subtract(domain: impl Domain, weights: &Weights, codes: &mut [i32], row: usize) {
    sweep(domain, weights, codes, row, |code, expected| Swap {
        code,
        kept: code.wrapping_sub(expected),
    });
}

/// Inverse of [`subtract`].
pub(super) fn restore(domain: impl Domain, weights: &Weights, residuals: &mut [i32], row: usize) {
    sweep(domain, weights, residuals, row, |residual, expected| {
        let code = residual.wrapping_add(expected);
        Swap { code, kept: code }
    });
}

/// What a sample is, and what takes its place in the band.
struct Swap {
    code: i32,
    kept: i32,
}

thread_local! {
    /// The skewed numbers of the rows being worked on and the [`REACH`] rows above.
    static SKEWED: RefCell<Vec<f32>> = const { RefCell::new(Vec::new()) };
}

fn sweep<D: Domain>(
    domain: D,
    weights: &Weights,
    band: &mut [i32],
    row: usize,
    swap: impl Fn(i32, i32) -> Swap + Copy,
) {
    let head = REACH * row;
    if band.len() <= head {
        return;
    }
    SKEWED.with_borrow_mut(|skewed| {
        let mut front = Front::new(skewed, row);
        let (above, rest) = band.split_at_mut(head);
        front.start(domain, above);
        for group in rest.chunks_mut(LANES * row) {
            front.run(domain, weights, group, swap);
            front.turn();
        }
    });
}

/// The wavefront. Lane `REACH + r` is row `r` of the group; lanes below are the rows above it. Column `c` of lane `l`
/// stands in step `c + SKEW · l + REACH`, the last term making room for the columns left of the band.
struct Front<'a> {
    skewed: &'a mut Vec<f32>,
    row: usize,
}

impl<'a> Front<'a> {
    fn new(skewed: &'a mut Vec<f32>, row: usize) -> Self {
        let steps = row + 2 * REACH + SKEW * (LANES + REACH) + HISTORY;
        skewed.clear();
        skewed.resize(steps * STRIDE, 0.0);
        Self { skewed, row }
    }

    fn place(column: usize, lane: usize) -> usize {
        (column + SKEW * lane + REACH) * STRIDE + lane
    }

    /// Puts the first rows of the band above the first group.
    fn start(&mut self, domain: impl Domain, above: &[i32]) {
        for (lane, line) in above.chunks(self.row).enumerate() {
            for (column, &code) in line.iter().enumerate() {
                self.skewed[Self::place(column, lane)] = domain.number(code);
            }
            self.left_edge(lane, lane.saturating_sub(1));
            self.right_edge(lane);
        }
    }

    /// Left of the band stands the first sample of the row above.
    fn left_edge(&mut self, lane: usize, above: usize) {
        let value = self.skewed[Self::place(0, above)];
        for k in 1..=REACH {
            self.skewed[Self::place(0, lane) - k * STRIDE] = value;
        }
    }

    /// Right of the band the last sample of the row goes on.
    fn right_edge(&mut self, lane: usize) {
        let last = Self::place(self.row - 1, lane);
        let value = self.skewed[last];
        for k in 1..=REACH {
            self.skewed[last + k * STRIDE] = value;
        }
    }

    /// Works through the rows of a group.
    fn run<D: Domain>(
        &mut self,
        domain: D,
        weights: &Weights,
        group: &mut [i32],
        swap: impl Fn(i32, i32) -> Swap,
    ) {
        let row = self.row;
        // The last row of an array may be cut short, where its rows are longer than a band.
        let (rows, tail) = (group.len().div_ceil(row), group.len() % row);
        let width = |r: usize| if tail > 0 && r + 1 == rows { tail } else { row };
        // In these steps every lane is inside its row and none begins or ends it.
        let inner = if rows == LANES && tail == 0 {
            SKEW * (REACH + LANES - 1) + 1..row + SKEW * REACH - 1
        } else {
            0..0
        };
        for step in SKEW * REACH..row + SKEW * (REACH + rows - 1) {
            let expected = self.predict(weights, step);
            let present = (step + REACH) * STRIDE + REACH;
            if inner.contains(&step) {
                let mut numbers = [0.0; LANES];
                for (r, number) in numbers.iter_mut().enumerate() {
                    let at = r * row + step - SKEW * (REACH + r);
                    let swapped = swap(group[at], domain.code(expected[r]));
                    group[at] = swapped.kept;
                    *number = domain.number(swapped.code);
                }
                self.skewed[present..present + LANES].copy_from_slice(&numbers);
                continue;
            }
            for r in 0..rows {
                let lane = REACH + r;
                let Some(column) = step.checked_sub(SKEW * lane).filter(|&c| c < width(r)) else {
                    continue;
                };
                let mut expected = expected[r];
                if column == 0 {
                    self.left_edge(lane, lane - 1);
                    expected = self.predict(weights, step)[r];
                }
                let at = r * row + column;
                let swapped = swap(group[at], domain.code(expected));
                group[at] = swapped.kept;
                self.skewed[present + r] = domain.number(swapped.code);
                if column + 1 == row {
                    self.right_edge(lane);
                }
            }
        }
    }

    /// The weighted sums of all lanes for a step.
    #[inline(always)]
    fn predict(&self, weights: &Weights, step: usize) -> [f32; LANES] {
        let mut sum = [0.0; LANES];
        let start = (step + REACH - HISTORY) * STRIDE;
        // A window of constant length: the places in it need no further checks.
        let Some(window) = self.skewed.get(start..).and_then(|s| s.first_chunk::<WINDOW>()) else {
            return sum;
        };
        for (place, weight) in PLACES.iter().zip(weights) {
            for (sum, x) in sum.iter_mut().zip(&window[*place..*place + LANES]) {
                *sum += weight * x;
            }
        }
        sum
    }

    /// Makes the last rows of the group those above the next one.
    fn turn(&mut self) {
        for lane in 0..REACH {
            let (from, to) = (Self::place(0, lane + LANES), Self::place(0, lane));
            for k in 0..self.row + 2 * REACH {
                self.skewed[to - REACH * STRIDE + k * STRIDE] =
                    self.skewed[from - REACH * STRIDE + k * STRIDE];
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rng::Rng;

    /// The prediction as `docs/recording-format.md` puts it, sample by sample.
    fn naive(domain: impl Domain, weights: &Weights, codes: &[i32], row: usize) -> Vec<i32> {
        let x = |j: usize, i: isize| {
            let line = |j: usize| &codes[j * row..codes.len().min((j + 1) * row)];
            let code = match i {
                i if i < 0 => line(j.saturating_sub(1))[0],
                i => line(j)[(i as usize).min(row - 1)],
            };
            domain.number(code)
        };
        let mut out = codes.to_vec();
        for at in REACH * row..codes.len() {
            let (j, i) = (at / row, at % row);
            let mut p = 0.0;
            for (weight, (dx, dz)) in weights.iter().zip(OFFSETS) {
                p += weight * x(j.wrapping_add_signed(dz), i as isize + dx);
            }
            out[at] = codes[at].wrapping_sub(domain.code(p));
        }
        out
    }

    fn surface(count: usize, row: usize) -> Vec<f32> {
        let wave = |k: usize| {
            let (i, j) = ((k % row) as f32, (k / row) as f32);
            (0.21 * i + 0.1 * j).sin() + 0.3 * (0.4 * j - 0.2 * i).cos()
        };
        (0..count).map(wave).collect()
    }

    #[test]
    fn the_wavefront_is_the_prediction_sample_by_sample() {
        let mut rng = Rng::new(3, 3);
        let weights = [(); TAPS].map(|()| rng.normal() as f32);
        // Rows shorter and longer than the wavefront, groups that are not whole, a last row that is not whole.
        for (row, count) in [
            (7, 7 * 300),
            (8, 8 * 11),
            (27, 27 * 9),
            (29, 29 * 20),
            (40, 40 * 19 + 13),
            (200, 3217),
            (64, 64 * 4),
            (50, 150),
        ] {
            let values = surface(count, row);
            let ordered: Vec<i32> = values
                .iter()
                .map(|v| super::super::plane::ordered(v.to_bits() as i32))
                .collect();
            let mut residuals = ordered.clone();
            subtract(Ordered, &weights, &mut residuals, row);
            assert_eq!(
                residuals,
                naive(Ordered, &weights, &ordered, row),
                "{row} {count}"
            );
            restore(Ordered, &weights, &mut residuals, row);
            assert_eq!(residuals, ordered, "{row} {count}");

            let whole: Vec<i32> = values.iter().map(|v| (v * 1e4) as i32).collect();
            let mut residuals = whole.clone();
            subtract(Whole, &weights, &mut residuals, row);
            assert_eq!(residuals, naive(Whole, &weights, &whole, row), "{row} {count}");
            restore(Whole, &weights, &mut residuals, row);
            assert_eq!(residuals, whole, "{row} {count}");
        }
    }

    #[test]
    fn smooth_surfaces_are_predicted_to_the_rounding() {
        let row = 90;
        let codes: Vec<i32> = surface(90 * 80, row)
            .iter()
            .map(|v| (v * 5e3).round() as i32)
            .collect();
        let weights = fit(Whole, &codes, row).unwrap();
        let mut residuals = codes.clone();
        subtract(Whole, &weights, &mut residuals, row);
        let inner = |k: &usize| k / row >= REACH && (REACH..row - REACH).contains(&(k % row));
        let largest = (0..codes.len()).filter(inner).map(|k| residuals[k].abs()).max();
        // Neighbours are rounded by up to half a unit each.
        assert!(largest.unwrap() <= 4, "{largest:?}");
    }

    #[test]
    fn what_cannot_be_fitted_has_no_weights() {
        assert_eq!(fit(Whole, &[0; 4000], 50), None);
        let huge = (0..4000).map(|k| {
            super::super::plane::ordered(f32::to_bits(if k % 3 == 0 { 3e38 } else { -3e38 }) as i32)
        });
        assert_eq!(fit(Ordered, &huge.collect::<Vec<_>>(), 50), None);
    }

    #[test]
    fn weights_of_a_hostile_file_do_no_harm() {
        let codes: Vec<i32> = (0..4000).map(|k: i32| k.wrapping_mul(1_000_003)).collect();
        for weight in [f32::NAN, f32::INFINITY, f32::MAX, -f32::MAX, 1e-45] {
            let mut residuals = codes.clone();
            restore(Whole, &[weight; TAPS], &mut residuals, 50);
            restore(Ordered, &[weight; TAPS], &mut residuals, 50);
        }
    }
}
