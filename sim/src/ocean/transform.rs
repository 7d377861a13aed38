//! Two-dimensional inverse transforms of a periodic patch. Two real fields ride one complex transform; a single field
//! takes the real one, at half the cost.
//!
//! Spectra are stored kx by kx with kz fastest. A row is filled and transformed along Z while it is in the cache; then
//! a block of rows of samples at a time are gathered from the columns, transformed along X and handed on while they are in the
//! cache: samples go where they are wanted without being stored in between.

use glam::UVec2;
use rayon::prelude::*;
use realfft::{ComplexToReal, RealFftPlanner};
use rustfft::num_complex::Complex32;
use rustfft::{Fft, FftPlanner};
use std::sync::Arc;

/// Plans and work space for one patch size, reused every frame.
pub struct Transform {
    width: usize,
    height: usize,
    along_x: Arc<dyn Fft<f32>>,
    along_z: Arc<dyn Fft<f32>>,
    real_x: Arc<dyn ComplexToReal<f32>>,
    spectrum: Vec<Complex32>,
    /// Samples of [`Self::alone`].
    samples: Vec<f32>,
}

impl std::fmt::Debug for Transform {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Transform")
            .field("width", &self.width)
            .field("height", &self.height)
            .finish()
    }
}

/// Rows transposed and transformed together.
const BLOCK: usize = 32;

/// Complex numbers of a cache line: columns that are gathered together, and what keeps rows of a block from falling onto
/// the same lines of a cache when their length is a power of two.
const LINE: usize = 8;

const ZERO: Complex32 = Complex32::new(0.0, 0.0);

/// Numbers `first..first + count` of each column (of `height` numbers, one after another in `columns`), as rows of
/// `stride` in `block`.
fn gather(
    columns: &[Complex32],
    height: usize,
    first: usize,
    count: usize,
    block: &mut [Complex32],
    stride: usize,
) {
    let wide = columns.len() / height;
    let whole = if count == BLOCK { wide - wide % LINE } else { 0 };
    for i in (0..whole).step_by(LINE) {
        let from: [&[Complex32; BLOCK]; LINE] = std::array::from_fn(|k| {
            let (part, _) = columns[(i + k) * height + first..].as_chunks();
            &part[0]
        });
        for (j, row) in block.chunks_mut(stride).enumerate().take(BLOCK) {
            for (to, from) in row[i..i + LINE].iter_mut().zip(from) {
                *to = from[j];
            }
        }
    }
    for i in whole..wide {
        for (row, value) in block
            .chunks_mut(stride)
            .zip(&columns[i * height + first..][..count])
        {
            row[i] = *value;
        }
    }
}

/// The first `rows` rows of what stands in `columns` of `height` numbers each, handed to `finish` with their part of `out`.
/// A block of rows stays in the cache from its transposition to its last use.
fn by_rows<S, U: Send>(
    columns: &[Complex32],
    height: usize,
    rows: usize,
    out: &mut [U],
    scratch: impl Fn() -> S + Sync + Send,
    finish: impl Fn(&mut S, &mut [Complex32], &mut [U]) + Sync + Send,
) {
    let wide = columns.len() / height;
    let stride = wide.next_multiple_of(LINE) + LINE;
    let length = out.len() / rows.max(1);
    if length == 0 {
        return;
    }
    out.par_chunks_mut(BLOCK * length).enumerate().for_each_init(
        || (vec![ZERO; BLOCK * stride], scratch()),
        |(block, scratch), (number, out)| {
            gather(columns, height, number * BLOCK, out.len() / length, block, stride);
            for (row, out) in block.chunks_mut(stride).zip(out.chunks_mut(length)) {
                finish(scratch, &mut row[..wide], out);
            }
        },
    );
}

impl Transform {
    /// Plans for a patch of `size` samples.
    pub fn new(size: UVec2) -> Self {
        let (width, height) = (size.x as usize, size.y as usize);
        let mut planner = FftPlanner::new();
        Self {
            width,
            height,
            along_x: planner.plan_fft_inverse(width),
            along_z: planner.plan_fft_inverse(height),
            real_x: RealFftPlanner::new().plan_fft_inverse(width),
            spectrum: Vec::new(),
            samples: Vec::new(),
        }
    }

    /// Bytes of the work space.
    pub fn bytes(&self) -> u64 {
        (self.spectrum.capacity() * size_of::<Complex32>() + self.samples.capacity() * size_of::<f32>())
            as u64
    }

    /// Room for a spectrum: a real field needs half of what two fields need.
    fn make_room(&mut self, numbers: usize) {
        let more = numbers.saturating_sub(self.spectrum.len());
        self.spectrum.reserve_exact(more);
        self.spectrum.extend(std::iter::repeat_n(ZERO, more));
    }

    /// Transforms one real field. `fill(m, row)` writes row `m` (kx = m) of its half spectrum for `m < active`; rows beyond
    /// are zero. The first `rows` rows of samples, x fastest, go to `write` with their part of `out`.
    pub fn real<U: Send>(
        &mut self,
        active: usize,
        fill: impl Fn(usize, &mut [Complex32]) + Sync,
        rows: usize,
        out: &mut [U],
        write: impl Fn(&[f32], &mut [U]) + Sync,
    ) {
        let (height, half) = (self.height, self.width / 2 + 1);
        self.make_room(half * height);
        let spectrum = &mut self.spectrum[..half * height];
        let plan = &self.along_z;
        spectrum.par_chunks_mut(height).enumerate().for_each_init(
            || vec![ZERO; plan.get_inplace_scratch_len()],
            |scratch, (m, row)| {
                if m < active {
                    fill(m, row);
                    plan.process_with_scratch(row, scratch);
                } else {
                    row.fill(ZERO);
                }
            },
        );
        real_rows(&self.real_x, spectrum, height, rows, out, write);
    }

    /// Transforms two real fields at once: the real parts of the samples are the first, the imaginary parts the second.
    /// `fill(m, first, second)` writes row `m` of both half spectra for `m < active`. The first `rows` rows of samples, x
    /// fastest, go to `write` with their part of `out`.
    pub fn pair<U: Send>(
        &mut self,
        active: usize,
        fill: impl Fn(usize, &mut [Complex32], &mut [Complex32]) + Sync,
        rows: usize,
        out: &mut [U],
        write: impl Fn(&[Complex32], &mut [U]) + Sync,
    ) {
        let (width, height, half) = (self.width, self.height, self.width / 2 + 1);
        self.make_room((width * height).max(half * height));
        let active = active.min(half);
        let (lower, upper) = self.spectrum[..width * height].split_at_mut(half * height);
        let both = width - half;
        let plan = &self.along_z;
        let work = || {
            (
                vec![ZERO; height],
                vec![ZERO; height],
                vec![ZERO; plan.get_inplace_scratch_len()],
            )
        };
        {
            let (mut a, mut b, mut scratch) = work();
            // Row 0 is its own mirror image; the Nyquist row of an even width is zero.
            fill(0, &mut a, &mut b);
            vectorised(|| direct(&mut lower[..height], &a, &b));
            plan.process_with_scratch(&mut lower[..height], &mut scratch);
            lower[(both + 1) * height..].fill(ZERO);
        }
        lower[height..(both + 1) * height]
            .par_chunks_mut(height)
            .zip(upper.par_chunks_mut(height).rev())
            .enumerate()
            .for_each_init(work, |(a, b, scratch), (index, (row, mirror))| {
                let m = index + 1;
                if m >= active {
                    row.fill(ZERO);
                    mirror.fill(ZERO);
                    return;
                }
                fill(m, a, b);
                vectorised(|| {
                    direct(row, a, b);
                    mirrored(mirror, a, b);
                });
                plan.process_with_scratch(row, scratch);
                plan.process_with_scratch(mirror, scratch);
            });
        complex_rows(
            &self.along_x,
            &self.spectrum[..width * height],
            height,
            rows,
            out,
            write,
        );
    }

    /// Runs so many real and complex transforms over whatever stands in the work space and writes each one's samples to a
    /// place of its own: what their fields cost at least.
    pub fn alone(&mut self, real: usize, complex: usize) {
        let (width, height, half) = (self.width, self.height, self.width / 2 + 1);
        self.make_room((width * height).max(half * height));
        self.samples.resize((real + 2 * complex) * width * height, 0.0);
        let along_z = &self.along_z;
        let columns = |spectrum: &mut [Complex32]| {
            spectrum.par_chunks_mut(height).for_each_init(
                || vec![ZERO; along_z.get_inplace_scratch_len()],
                |scratch, row| along_z.process_with_scratch(row, scratch),
            );
        };
        let (first, second) = self.samples.split_at_mut(2 * complex * width * height);
        for samples in first.chunks_mut(2 * width * height) {
            let spectrum = &mut self.spectrum[..width * height];
            columns(spectrum);
            complex_rows(&self.along_x, spectrum, height, height, samples, |row, out| {
                for (out, value) in out.as_chunks_mut().0.iter_mut().zip(row) {
                    *out = [value.re, value.im];
                }
            });
        }
        for samples in second.chunks_mut(width * height) {
            let spectrum = &mut self.spectrum[..half * height];
            columns(spectrum);
            real_rows(&self.real_x, spectrum, height, height, samples, |row, out| {
                out.copy_from_slice(row);
            });
        }
    }
}

/// Runs a loop with the widest vectors of the machine.
#[inline(always)]
pub(super) fn vectorised<R>(f: impl FnOnce() -> R) -> R {
    pulp::Arch::new().dispatch(f)
}

/// Â + iB̂, the spectrum of two real fields as one complex one.
#[inline(always)]
fn direct(row: &mut [Complex32], a: &[Complex32], b: &[Complex32]) {
    for ((c, a), b) in row.iter_mut().zip(a).zip(b) {
        *c = Complex32::new(a.re - b.im, a.im + b.re);
    }
}

/// The same at −k, where Â(−k) = conj Â(k): conj Â(k) + i conj B̂(k).
#[inline(always)]
fn mirrored(row: &mut [Complex32], a: &[Complex32], b: &[Complex32]) {
    let turned = |a: &Complex32, b: &Complex32| Complex32::new(a.re + b.im, b.re - a.im);
    row[0] = turned(&a[0], &b[0]);
    for ((c, a), b) in row[1..].iter_mut().rev().zip(&a[1..]).zip(&b[1..]) {
        *c = turned(a, b);
    }
}

/// Transforms along X to real rows.
fn real_rows<U: Send>(
    plan: &Arc<dyn ComplexToReal<f32>>,
    columns: &[Complex32],
    height: usize,
    rows: usize,
    out: &mut [U],
    write: impl Fn(&[f32], &mut [U]) + Sync,
) {
    let scratch = || (plan.make_scratch_vec(), plan.make_output_vec());
    by_rows(
        columns,
        height,
        rows,
        out,
        scratch,
        |(scratch, samples), row, out| {
            // What the real transform demands and exact arithmetic would give.
            row[0].im = 0.0;
            if samples.len().is_multiple_of(2)
                && let Some(last) = row.last_mut()
            {
                last.im = 0.0;
            }
            // The lengths are those of the plan, which is all that this can complain about.
            let done = plan.process_with_scratch(row, samples, scratch);
            debug_assert!(done.is_ok());
            write(samples, out);
        },
    );
}

/// Transforms along X to complex rows.
fn complex_rows<U: Send>(
    plan: &Arc<dyn Fft<f32>>,
    columns: &[Complex32],
    height: usize,
    rows: usize,
    out: &mut [U],
    write: impl Fn(&[Complex32], &mut [U]) + Sync,
) {
    let scratch = || vec![ZERO; plan.get_inplace_scratch_len()];
    by_rows(columns, height, rows, out, scratch, |scratch, row, out| {
        plan.process_with_scratch(row, scratch);
        write(row, out);
    });
}
