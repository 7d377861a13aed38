//! Particles by bins of columns and, in each bin, by layers from the top down.

use super::cells::bounds;
use super::counting;
use super::fluid::Fluid;
use crate::grid::GridSpec;
use glam::{Vec2, Vec4};
use std::ops::Range;

/// Layers of bins that there may be for each particle, beside [`FEWEST`]; beyond it layers grow instead.
const LAYERS_A_PARTICLE: usize = 8;
const FEWEST: usize = 1 << 16;

/// A counting sort by bin, then by layer, which keeps its buffers. Within a layer particles stand in any order, the same for any
/// number of threads.
#[derive(Debug)]
pub(super) struct Bins {
    /// Bins along X and Z.
    size: [usize; 2],
    /// Bins a metre, and the coordinates of the origin among them.
    scale: Vec2,
    offset: Vec2,
    /// Least thickness of a layer, m.
    thinnest: f32,
    /// Height of the highest particle, and layers a metre below it.
    top: f32,
    inverse: f32,
    layers: usize,
    /// First particle of each layer of each bin, and their number at the end.
    start: Vec<u32>,
    key: Vec<u32>,
    sorted: Vec<Vec4>,
}

impl Bins {
    /// Bins of so many `columns` of `spec`, in layers of that thickness if there is room for so many.
    pub(super) fn new(spec: GridSpec, columns: [usize; 2], thickness: f32) -> Self {
        // A sample stands in the middle of what counts to it.
        let count = Vec2::new(columns[0] as f32, columns[1] as f32);
        let scale = 1.0 / (spec.spacing * count);
        Self {
            scale,
            offset: 0.5 / count - scale * spec.origin,
            size: [
                spec.width().div_ceil(columns[0]),
                spec.height().div_ceil(columns[1]),
            ],
            thinnest: thickness,
            top: 0.0,
            inverse: 0.0,
            layers: 1,
            start: Vec::new(),
            key: Vec::new(),
            sorted: Vec::new(),
        }
    }

    /// Coordinates of the bin that holds `p`; what is outside counts to the nearest one.
    #[inline(always)]
    fn at(&self, p: Vec2) -> [usize; 2] {
        let g = self.scale * p + self.offset;
        // Conversion saturates at 0.
        [
            (g.x as usize).min(self.size[0] - 1),
            (g.y as usize).min(self.size[1] - 1),
        ]
    }

    /// Sorts the particles of `fluid`.
    pub(super) fn sort(&mut self, fluid: &Fluid) {
        let positions = fluid.positions();
        let (low, high) = bounds(positions);
        self.top = high.y;
        let bins = self.size[0] * self.size[1];
        let most = ((LAYERS_A_PARTICLE * positions.len() + FEWEST) / bins).max(1);
        let range = high.y - low.y;
        let thickness = self.thinnest.max(range / most as f32);
        self.inverse = 1.0 / thickness;
        self.layers = ((range * self.inverse) as usize + 1).min(most);
        self.key.resize(positions.len(), 0);
        let mut key = std::mem::take(&mut self.key);
        pulp::Arch::new().dispatch(Keys {
            of: self,
            positions,
            out: &mut key,
        });
        self.key = key;
        self.sorted.resize(positions.len(), Vec4::ZERO);
        let sorted = &mut self.sorted;
        counting::sort(&self.key, bins * self.layers, &mut self.start, |k, at| {
            sorted[at] = positions[k];
        });
    }

    /// Layer at height `y`: 0 is the highest.
    #[inline(always)]
    pub(super) fn layer(&self, y: f32) -> usize {
        // Conversion saturates at 0.
        (((self.top - y) * self.inverse) as usize).min(self.layers - 1)
    }

    /// Height below which the particles of a layer are.
    #[inline(always)]
    pub(super) fn ceiling(&self, layer: usize) -> f32 {
        self.top - layer as f32 / self.inverse
    }

    /// Calls `f` with the bins that may hold particles between two corners: the number of each one's first layer, and its
    /// particles.
    #[inline(always)]
    pub(super) fn between(&self, low: Vec2, high: Vec2, mut f: impl FnMut(usize, Range<usize>)) {
        let ([x0, z0], [x1, z1]) = (self.at(low), self.at(high));
        for z in z0..=z1 {
            for x in x0..=x1 {
                let first = (z * self.size[0] + x) * self.layers;
                f(first, self.begin(first)..self.begin(first + self.layers));
            }
        }
    }

    /// Place of the first particle of a layer, counted from the first layer of the first bin.
    #[inline(always)]
    pub(super) fn begin(&self, layer: usize) -> usize {
        self.start[layer] as usize
    }

    /// The particles, bin by bin and layer by layer.
    #[inline(always)]
    pub(super) fn particles(&self) -> &[Vec4] {
        &self.sorted
    }

    pub(super) fn bytes(&self) -> usize {
        4 * (self.start.capacity() + self.key.capacity()) + 16 * self.sorted.capacity()
    }
}

/// Where particles belong: the number of a layer of a bin.
struct Keys<'a> {
    of: &'a Bins,
    positions: &'a [Vec4],
    out: &'a mut [u32],
}

impl pulp::WithSimd for Keys<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) {
        let Bins {
            scale,
            offset,
            size,
            top,
            inverse,
            layers,
            ..
        } = *self.of;
        let (across, along, layers) = (size[0] as u32, size[1] as u32, layers as u32);
        for (key, p) in self.out.iter_mut().zip(self.positions) {
            let (x, z) = (scale.x * p.x + offset.x, scale.y * p.z + offset.y);
            let (x, z) = ((x as u32).min(across - 1), (z as u32).min(along - 1));
            let layer = (((top - p.y) * inverse) as u32).min(layers - 1);
            *key = (z * across + x) * layers + layer;
        }
    }
}
