//! From the samples of a patch to those of a frame, which it tiles.

use super::patch::{Field, Patch, Work};
use crate::grid::GridSpec;
use glam::{DVec2, UVec2};
use rustfft::num_complex::Complex32;
use std::ops::{Add, Mul};

/// A sample of one field, or of two that share a transform.
pub(super) trait Sample:
    Copy + Default + Send + Sync + Add<Output = Self> + Mul<f32, Output = Self>
{
    /// What it is of.
    type Fields: Copy;

    /// The first `rows` rows of samples of a patch, each handed to `write` with its part of `out`.
    fn make<U: Send>(
        fields: Self::Fields,
        patch: &Patch,
        work: &mut Work,
        rows: usize,
        out: &mut [U],
        write: impl Fn(&[Self], &mut [U]) + Sync,
    );

    /// Where samples of a patch wait to be placed.
    fn plane(planes: &mut Planes) -> &mut Vec<Self>;
}

/// Samples of a patch that do not stand where the frame's do.
#[derive(Debug, Default)]
pub(super) struct Planes {
    one: Vec<f32>,
    two: Vec<Complex32>,
}

impl Planes {
    pub(super) fn bytes(&self) -> u64 {
        (4 * self.one.capacity() + 8 * self.two.capacity()) as u64
    }
}

impl Sample for f32 {
    type Fields = Field;

    fn make<U: Send>(
        field: Field,
        patch: &Patch,
        work: &mut Work,
        rows: usize,
        out: &mut [U],
        write: impl Fn(&[Self], &mut [U]) + Sync,
    ) {
        patch.one(field, work, rows, out, write);
    }

    fn plane(planes: &mut Planes) -> &mut Vec<Self> {
        &mut planes.one
    }
}

impl Sample for Complex32 {
    type Fields = (Field, Field);

    fn make<U: Send>(
        fields: (Field, Field),
        patch: &Patch,
        work: &mut Work,
        rows: usize,
        out: &mut [U],
        write: impl Fn(&[Self], &mut [U]) + Sync,
    ) {
        patch.two(fields, work, rows, out, write);
    }

    fn plane(planes: &mut Planes) -> &mut Vec<Self> {
        &mut planes.two
    }
}

/// Six neighbours along one axis and their weights.
#[derive(Clone, Copy, Debug)]
pub(super) struct Taps {
    /// First neighbour, in 0..n; the others follow, wrapped.
    first: usize,
    weights: [f32; 6],
}

/// Lagrange's polynomial through six samples at −2, …, 3, at `t` in [0, 1].
fn lagrange(t: f64) -> [f32; 6] {
    let node = |i: usize| i as f64 - 2.0;
    std::array::from_fn(|i| {
        let product: f64 = (0..6)
            .filter(|&j| j != i)
            .map(|j| (t - node(j)) / (node(i) - node(j)))
            .product();
        product as f32
    })
}

/// How a frame's samples are taken from a patch that begins where the frame begins and repeats for ever.
#[derive(Clone, Debug)]
pub(super) enum Placement {
    /// The samples stand on each other.
    Same {
        /// Samples of the patch.
        size: UVec2,
    },
    /// The patch is coarser; its waves are at least eight samples long, which six neighbours interpolate to 0.1 %.
    Between {
        size: UVec2,
        columns: Vec<Taps>,
        rows: Vec<Taps>,
    },
}

impl Placement {
    pub(super) fn same(size: UVec2) -> Self {
        Self::Same { size }
    }

    pub(super) fn between(size: UVec2, period: DVec2, frame: &GridSpec) -> Self {
        let taps = |k: usize, n: u32, period: f64| {
            let at = (k as f64 * f64::from(frame.spacing) * f64::from(n) / period).rem_euclid(f64::from(n));
            let cell = at.floor();
            Taps {
                first: (cell as usize + n as usize - 2) % n as usize,
                weights: lagrange(at - cell),
            }
        };
        Self::Between {
            size,
            columns: (0..frame.width()).map(|i| taps(i, size.x, period.x)).collect(),
            rows: (0..frame.height()).map(|j| taps(j, size.y, period.y)).collect(),
        }
    }

    /// Whether the samples of a frame of `width` by `height` are the first rows and columns of the patch as they stand.
    pub(super) fn is_direct(&self, width: usize, height: usize) -> bool {
        match self {
            Self::Same { size } => size.x as usize >= width && size.y as usize >= height,
            Self::Between { .. } => false,
        }
    }

    /// Adds row `j` of the frame to `out`. `work` is as long as it needs to be afterwards.
    pub(super) fn add<T: Sample>(&self, plane: &[T], j: usize, work: &mut Vec<T>, out: &mut [T]) {
        match self {
            Self::Same { size } => {
                let w = size.x as usize;
                let row = &plane[(j % size.y as usize) * w..][..w];
                for part in out.chunks_mut(w) {
                    for (out, value) in part.iter_mut().zip(row) {
                        *out = *out + *value;
                    }
                }
            }
            Self::Between { size, columns, rows } => {
                let (w, h) = (size.x as usize, size.y as usize);
                work.clear();
                work.resize(w, T::default());
                for (k, weight) in rows[j].weights.into_iter().enumerate() {
                    let row = &plane[((rows[j].first + k) % h) * w..][..w];
                    for (sum, value) in work.iter_mut().zip(row) {
                        *sum = *sum + *value * weight;
                    }
                }
                for (out, taps) in out.iter_mut().zip(columns) {
                    let mut sum = *out;
                    for (k, weight) in taps.weights.into_iter().enumerate() {
                        sum = sum + work[(taps.first + k) % w] * weight;
                    }
                    *out = sum;
                }
            }
        }
    }

    pub(super) fn bytes(&self) -> u64 {
        match self {
            Self::Same { .. } => 0,
            Self::Between { columns, rows, .. } => ((columns.len() + rows.len()) * size_of::<Taps>()) as u64,
        }
    }
}
