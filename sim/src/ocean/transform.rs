//! Two-dimensional inverse transforms of a periodic patch. Two real fields ride one complex transform; a single field
//! takes the real one, at half the cost.
//!
//! Spectra are stored kx by kx with kz fastest. A row is filled and transformed along Z while it is in the cache, then
//! all rows are transposed and transformed along X, which leaves the samples row by row with x fastest.

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
    turned: Vec<Complex32>,
}

impl std::fmt::Debug for Transform {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Transform")
            .field("width", &self.width)
            .field("height", &self.height)
            .finish()
    }
}

/// Rows transposed or transformed together: 16 complex numbers are two cache lines.
const BLOCK: usize = 16;

const ZERO: Complex32 = Complex32::new(0.0, 0.0);

/// `to[j · rows + i] = from[i · columns + j]` for the first `rows` rows of `columns`.
fn transpose(from: &[Complex32], to: &mut [Complex32], rows: usize, columns: usize) {
    to.par_chunks_mut(BLOCK * rows)
        .enumerate()
        .for_each(|(block, to)| {
            let first = block * BLOCK;
            let count = to.len() / rows;
            for i0 in (0..rows).step_by(BLOCK) {
                for i in i0..(i0 + BLOCK).min(rows) {
                    let source = &from[i * columns + first..i * columns + first + count];
                    for (j, value) in source.iter().enumerate() {
                        to[j * rows + i] = *value;
                    }
                }
            }
        });
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
            turned: Vec::new(),
        }
    }

    /// Bytes of the work space.
    pub fn bytes(&self) -> u64 {
        ((self.spectrum.capacity() + self.turned.capacity()) * size_of::<Complex32>()) as u64
    }

    /// Transforms one real field into `out`, row-major with x fastest. `fill(m, row)` writes row `m` (kx = m) of its half
    /// spectrum for `m < active`; rows beyond are zero.
    pub fn real(&mut self, active: usize, fill: impl Fn(usize, &mut [Complex32]) + Sync, out: &mut Vec<f32>) {
        let (width, height, half) = (self.width, self.height, self.width / 2 + 1);
        self.spectrum.resize((width * height).max(half * height), ZERO);
        self.turned.resize(width.max(half) * height, ZERO);
        out.resize(width * height, 0.0);
        let plan = &self.along_z;
        self.spectrum[..half * height]
            .par_chunks_mut(height)
            .enumerate()
            .for_each_init(
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
        transpose(
            &self.spectrum[..half * height],
            &mut self.turned[..half * height],
            half,
            height,
        );
        let plan = &self.real_x;
        out.par_chunks_mut(width * BLOCK)
            .zip(self.turned[..half * height].par_chunks_mut(half * BLOCK))
            .for_each_init(
                || plan.make_scratch_vec(),
                |scratch, (out, rows)| {
                    for (out, row) in out.chunks_mut(width).zip(rows.chunks_mut(half)) {
                        // What the real transform demands and exact arithmetic would give.
                        row[0].im = 0.0;
                        if width.is_multiple_of(2) {
                            row[half - 1].im = 0.0;
                        }
                        // The lengths are those of the plan, which is all that this can complain about.
                        let done = plan.process_with_scratch(row, out, scratch);
                        debug_assert!(done.is_ok());
                    }
                },
            );
    }

    /// Transforms two real fields at once: the real parts of `out` are the first, the imaginary parts the second.
    /// `fill(m, first, second)` writes row `m` of both half spectra for `m < active`.
    pub fn pair(
        &mut self,
        active: usize,
        fill: impl Fn(usize, &mut [Complex32], &mut [Complex32]) + Sync,
        out: &mut Vec<Complex32>,
    ) {
        let (width, height, half) = (self.width, self.height, self.width / 2 + 1);
        self.spectrum.resize(width * height, ZERO);
        out.resize(width * height, ZERO);
        let active = active.min(half);
        // C = Â + iB̂ on the half plane; on the other half, where Â(−k) = conj Â(k), C(−k) = conj Â(k) + i conj B̂(k).
        let (lower, upper) = self.spectrum[..width * height].split_at_mut(half * height);
        let both = width - half;
        let direct = |row: &mut [Complex32], a: &[Complex32], b: &[Complex32]| {
            for ((c, a), b) in row.iter_mut().zip(a).zip(b) {
                *c = Complex32::new(a.re - b.im, a.im + b.re);
            }
        };
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
            direct(&mut lower[..height], &a, &b);
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
                direct(row, a, b);
                mirror[0] = Complex32::new(a[0].re + b[0].im, b[0].re - a[0].im);
                for ((c, a), b) in mirror[1..].iter_mut().rev().zip(&a[1..]).zip(&b[1..]) {
                    *c = Complex32::new(a.re + b.im, b.re - a.im);
                }
                plan.process_with_scratch(row, scratch);
                plan.process_with_scratch(mirror, scratch);
            });
        transpose(&self.spectrum[..width * height], out, width, height);
        let plan = &self.along_x;
        out.par_chunks_mut(width * BLOCK).for_each_init(
            || vec![ZERO; plan.get_inplace_scratch_len()],
            |scratch, rows| plan.process_with_scratch(rows, scratch),
        );
    }

    /// Runs so many real and complex transforms over whatever stands in the work space: what their fields cost at least.
    pub fn alone(&mut self, real: usize, complex: usize) {
        let (width, height, half) = (self.width, self.height, self.width / 2 + 1);
        self.spectrum.resize((width * height).max(half * height), ZERO);
        self.turned.resize(width.max(half) * height, ZERO);
        let along_z = &self.along_z;
        let columns = |spectrum: &mut [Complex32]| {
            spectrum.par_chunks_mut(BLOCK * height).for_each_init(
                || vec![ZERO; along_z.get_inplace_scratch_len()],
                |scratch, rows| along_z.process_with_scratch(rows, scratch),
            );
        };
        for _ in 0..complex {
            columns(&mut self.spectrum[..width * height]);
            transpose(
                &self.spectrum[..width * height],
                &mut self.turned[..width * height],
                width,
                height,
            );
            let plan = &self.along_x;
            self.turned[..width * height]
                .par_chunks_mut(BLOCK * width)
                .for_each_init(
                    || vec![ZERO; plan.get_inplace_scratch_len()],
                    |scratch, rows| plan.process_with_scratch(rows, scratch),
                );
        }
        for _ in 0..real {
            columns(&mut self.spectrum[..half * height]);
            transpose(
                &self.spectrum[..half * height],
                &mut self.turned[..half * height],
                half,
                height,
            );
            let plan = &self.real_x;
            self.turned[..half * height]
                .par_chunks_mut(half * BLOCK)
                .for_each_init(
                    || (plan.make_scratch_vec(), vec![0.0; width]),
                    |(scratch, out), rows| {
                        for row in rows.chunks_mut(half) {
                            // What stands there may have imaginary ends, about which alone this can complain.
                            let _ = plan.process_with_scratch(row, out, scratch);
                        }
                    },
                );
        }
    }
}
