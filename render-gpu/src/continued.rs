//! Heightfields with what goes on beyond their grids, and their numbers as shaders read them.

use crate::facts::FieldShape;
use crate::layout::FieldUniform;
use crate::settings::{Heights, Settings, Walk};
use meniscus_sim::glam::{BVec2, DVec2, DVec3};
use meniscus_sim::stage::Continuation;
use meniscus_sim::stage::continuation::continued;
use meniscus_sim::{Grid, GridSpec};
use std::borrow::Cow;

/// A heightfield with its continuation, heights above the anchor.
#[derive(Debug)]
pub(crate) struct Continued {
    grid: Grid<f32>,
    how: Continuation,
    /// The grid without its continuation.
    source: GridSpec,
}

impl Continued {
    pub(crate) fn new(source: &Grid<f32>, how: Continuation, anchor: f64, reuse: Option<Grid<f32>>) -> Self {
        let spec = *source.spec();
        let mut lowered = source.clone();
        for h in lowered.as_mut_slice() {
            *h = (f64::from(*h) - anchor) as f32;
        }
        let how = Continuation {
            level: (f64::from(how.level) - anchor) as f32,
            ..how
        };
        Self {
            grid: continued(&lowered, &how, reuse),
            how,
            source: spec,
        }
    }

    /// The samples with their continuation.
    pub(crate) fn grid(&self) -> &Grid<f32> {
        &self.grid
    }

    /// Words for the buffer.
    pub(crate) fn words(&self, heights: Heights) -> Cow<'_, [u32]> {
        match heights {
            Heights::Single => Cow::Borrowed(bytemuck::cast_slice(self.grid.as_slice())),
            Heights::Sixteen => Cow::Owned(packed(&self.grid)),
        }
    }

    /// Height above the anchor at a place in the world.
    pub(crate) fn height(&self, p: DVec2) -> f64 {
        let spec = self.grid.spec();
        let low = spec.origin.as_dvec2();
        let spacing = f64::from(spec.spacing);
        let high = low + spacing * (spec.size.as_dvec2() - 1.0);
        let period = f64::from(self.source.spacing) * self.source.size.as_dvec2();
        let mut q = p;
        for k in 0..2 {
            if self.how.periodic.test(k) {
                q[k] = low[k] + (q[k] - low[k]).rem_euclid(period[k]);
            } else if q[k] < low[k] || q[k] > high[k] {
                return f64::from(self.how.level);
            }
        }
        f64::from(self.grid.sample(q.as_vec2()))
    }

    pub(crate) fn uniform(&self, shape: &FieldShape, anchor: DVec3, settings: &Settings) -> FieldUniform {
        let spec = self.grid.spec();
        let low = spec.origin.as_dvec2() - DVec2::new(anchor.x, anchor.z);
        let spacing = f64::from(spec.spacing);
        let extent = spacing * (spec.size.as_dvec2() - 1.0);
        let (least, most) = self.grid.range();
        let mut pyramid = [[0; 4]; 4];
        for (k, &offset) in shape.pyramid.iter().enumerate() {
            pyramid[k / 4][k % 4] = offset;
        }
        FieldUniform {
            low: low.as_vec2().to_array(),
            high: (low + extent).as_vec2().to_array(),
            period: (f64::from(self.source.spacing) * self.source.size.as_dvec2())
                .as_vec2()
                .to_array(),
            range: [least, most],
            size: shape.size,
            periodic: flags(self.how.periodic),
            spacing: spec.spacing,
            level: self.how.level,
            heights: shape.heights,
            slopes: shape.slopes,
            pyramid,
            levels: shape.levels,
            present: 1,
            safety: match settings.walk {
                Walk::Pyramid => 0.0,
                Walk::Safety => settings.safety_scale * safety_radius(&self.grid),
                Walk::SafetyMap => settings.safety_scale,
            },
            radii: shape.radii,
        }
    }
}

/// Two samples a word in 65,535ths of the range from the lowest to the highest; rows are whole words.
fn packed(grid: &Grid<f32>) -> Vec<u32> {
    let (low, high) = grid.range();
    let scale = if high > low { 65_535.0 / (high - low) } else { 0.0 };
    let units = |h: f32| ((h - low) * scale).round().clamp(0.0, 65_535.0) as u32;
    grid.as_slice()
        .chunks_exact(grid.spec().width())
        .flat_map(|row| {
            row.chunks(2)
                .map(|pair| units(pair[0]) | pair.get(1).map_or(0, |&h| units(h)) << 16)
        })
        .collect()
}

fn flags(v: BVec2) -> [u32; 2] {
    [u32::from(v.x), u32::from(v.y)]
}

/// Radius in metres within which a ray is taken to cross the surface at most once: a quarter of the mean distance between
/// changes of the sign of curvature along rows and columns, at least half the spacing. An estimate, as the paper's.
fn safety_radius(grid: &Grid<f32>) -> f32 {
    let (w, h) = (grid.spec().width(), grid.spec().height());
    let data = grid.as_slice();
    let (low, high) = grid.range();
    let noise = 1e-3 * (high - low);
    let (mut changes, mut steps) = (0_u64, 0_u64);
    let mut scan = |at: &dyn Fn(usize) -> f32, n: usize| {
        let mut sign = 0.0_f32;
        for k in 1..n.saturating_sub(1) {
            let c = at(k - 1) - 2.0 * at(k) + at(k + 1);
            if c.abs() > noise {
                changes += u64::from(sign * c < 0.0);
                sign = c;
            }
            steps += 1;
        }
    };
    for j in (0..h).step_by(4) {
        scan(&|i| data[j * w + i], w);
    }
    for i in (0..w).step_by(4) {
        scan(&|j| data[j * w + i], h);
    }
    let feature = steps as f32 / (changes as f32).max(1.0);
    grid.spec().spacing * (0.25 * feature).clamp(0.5, 0.25 * w.max(h) as f32)
}
