//! Padded arrays of the state, and how heights become multiples of one quantum.

use super::real::Real;
use super::settings::Initial;

/// Rings of ghost cells around the domain.
pub(crate) const GHOSTS: usize = 3;

/// How a grid lies in padded storage.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Layout {
    /// Cells along X, without ghosts.
    pub(crate) nx: usize,
    /// Cells along Z, without ghosts.
    pub(crate) nz: usize,
    /// Values a padded row.
    pub(crate) stride: usize,
}

impl Layout {
    pub(crate) fn new(nx: usize, nz: usize) -> Self {
        // Rows that lie a power of two apart compete for the same lines of the cache.
        let mut stride = (nx + 2 * GHOSTS).next_multiple_of(16);
        if stride.is_multiple_of(256) {
            stride += 16;
        }
        Self { nx, nz, stride }
    }

    /// Values of a padded array.
    pub(crate) fn len(self) -> usize {
        (self.nz + 2 * GHOSTS) * self.stride
    }

    /// Index of cell `(i, j)` of the domain.
    pub(crate) fn at(self, i: usize, j: usize) -> usize {
        (j + GHOSTS) * self.stride + i + GHOSTS
    }

    /// The cells of row `j` of the domain.
    pub(crate) fn row(self, j: usize) -> std::ops::Range<usize> {
        let from = self.at(0, j);
        from..from + self.nx
    }

    /// The rows of the domain, ghost columns included.
    pub(crate) fn interior(self) -> std::ops::Range<usize> {
        GHOSTS * self.stride..(GHOSTS + self.nz) * self.stride
    }
}

/// Depth and momentum per area of every cell, in padded arrays.
#[derive(Clone, Debug)]
pub(crate) struct Fields<T> {
    /// Depth, m; multiples of the quantum.
    pub(crate) h: Vec<T>,
    /// Depth times velocity along X, m²/s.
    pub(crate) qx: Vec<T>,
    /// Depth times velocity along Z, m²/s.
    pub(crate) qz: Vec<T>,
}

impl<T: Real> Fields<T> {
    pub(crate) fn zeros(layout: Layout) -> Self {
        let zeros = || vec![T::ZERO; layout.len()];
        Self {
            h: zeros(),
            qx: zeros(),
            qz: zeros(),
        }
    }

    /// Without a single cell, for a place whose fields are in use.
    pub(crate) fn none() -> Self {
        Self {
            h: Vec::new(),
            qx: Vec::new(),
            qz: Vec::new(),
        }
    }
}

/// The unit of all depths, beds and mass fluxes, in metres: a power of two.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Quantum(f64);

impl Quantum {
    /// The finest quantum with which `depth` leaves two bits spare in `T`, so that halved differences stay exact.
    pub(crate) fn for_depth<T: Real>(depth: f64) -> Self {
        let exponent = depth.max(1e-30).log2().ceil() as i32;
        Self(2.0_f64.powi(exponent - (T::DIGITS - 2)))
    }

    /// The length of one quantum, m.
    pub(crate) fn length(self) -> f64 {
        self.0
    }

    /// From a stored length.
    pub(crate) fn from_length(length: f64) -> Self {
        Self(length)
    }

    /// The number that rounds to a multiple of the quantum when it is added and subtracted.
    pub(crate) fn rounder<T: Real>(self) -> T {
        T::from_f64(1.5 * 2.0_f64.powi(T::DIGITS - 1) * self.0)
    }

    /// Depth from which a coarser quantum is needed, m.
    pub(crate) fn depth_limit<T: Real>(self) -> f64 {
        2.0_f64.powi(T::DIGITS - 1) * self.0
    }

    /// `x` as a whole number of quanta, ties away from zero.
    pub(crate) fn count(self, x: f64) -> f64 {
        (x / self.0).round()
    }

    /// `x` rounded to a multiple of the quantum.
    pub(crate) fn round(self, x: f64) -> f64 {
        self.count(x) * self.0
    }
}

/// Beds and depths of an initial state, in padded arrays.
pub(crate) struct Quantised<T> {
    pub(crate) fields: Fields<T>,
    pub(crate) bed: Vec<T>,
    pub(crate) quantum: Quantum,
    /// Height above datum of bed 0, m.
    pub(crate) base: f64,
    /// Largest depth at the start, or the length that stands in for it where everything is dry, m.
    pub(crate) reference_depth: f64,
}

/// Rounds an initial state to multiples of a quantum about a base height; ghosts stay 0.
pub(crate) fn quantise<T: Real>(layout: Layout, initial: &Initial, spacing: f64) -> Quantised<T> {
    let depth = |k: usize| initial.elevation[k] - initial.ground[k];
    let (mut deepest, mut base) = (0.0_f64, initial.ground.first().copied().unwrap_or(0.0));
    for k in 0..initial.ground.len() {
        if depth(k) > deepest {
            (deepest, base) = (depth(k), initial.elevation[k]);
        }
    }
    // A dry domain has no depth of its own; water that arrives later coarsens the quantum as it needs.
    let reference_depth = if deepest > 0.0 { deepest } else { 1e-3 * spacing };
    let quantum = Quantum::for_depth::<T>(reference_depth);

    let mut fields = Fields::zeros(layout);
    let mut bed = vec![T::ZERO; layout.len()];
    for j in 0..layout.nz {
        for i in 0..layout.nx {
            let (k, at) = (j * layout.nx + i, layout.at(i, j));
            let z = T::from_f64(quantum.round(initial.ground[k] - base));
            let h = (quantum.round(initial.elevation[k] - base) - z.to_f64()).max(0.0);
            bed[at] = z;
            fields.h[at] = T::from_f64(h);
            if let Some(velocity) = &initial.velocity {
                fields.qx[at] = T::from_f64(h * velocity[k][0]);
                fields.qz[at] = T::from_f64(h * velocity[k][1]);
            }
        }
    }
    Quantised {
        fields,
        bed,
        quantum,
        base,
        reference_depth,
    }
}
