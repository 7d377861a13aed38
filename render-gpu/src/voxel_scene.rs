//! What a scene puts into the voxel field, and whether the field that is held still stands for it.

use crate::fixed::Fixed;
use crate::voxels::{Builder, Voxels};
use meniscus_sim::glam::{DMat3, DQuat, DVec2, DVec3, Vec3};
use meniscus_sim::stage::objects::standing;
use meniscus_sim::stage::surroundings::Edges;
use meniscus_sim::{Frame, Grid, Scene};

/// All that a field depends on: fields of equal plans are equal.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct VoxelPlan {
    fingerprint: u64,
    count: u32,
    low: Vec3,
    high: Vec3,
    deck: f32,
    /// Walls: axis, and place along it from the anchor.
    walls: Vec<(usize, f32)>,
    objects: Vec<Option<(DVec3, DQuat)>>,
}

impl VoxelPlan {
    /// The box reaches from the lowest ground to above water and objects, in steps that waves seldom change.
    pub(crate) fn new(
        scene: &Scene,
        fixed: &Fixed,
        frame: &Frame,
        edges: &Edges,
        heights: &Grid<f32>,
        count: u32,
    ) -> Self {
        let anchor = fixed.anchor;
        let spec = heights.spec();
        let low = (spec.origin.as_dvec2() - DVec2::new(anchor.x, anchor.z)).as_vec2();
        let extent = spec.extent();
        let step = 0.25 * extent.max_element();
        let crest = (f64::from(heights.range().1) - anchor.y) as f32;
        let top = step * ((crest / step - 0.5).ceil() + 1.0);
        let bottom = match &fixed.ground {
            Some(ground) => ground.grid().range().0.max(-2.0 * extent.max_element()),
            None => -extent.max_element(),
        };
        // A voxel of margin, so that the floor and the walls lie inside.
        let margin = 1.5 * extent.max_element() / count as f32;
        let walls = edges.sides.iter().filter(|s| !s.glass).map(|side| {
            let at = (side.at - if side.axis == 0 { anchor.x } else { anchor.z }) as f32;
            (side.axis, at)
        });
        let high = Vec3::new(low.x + extent.x, top, low.y + extent.y) + margin;
        // Raised walls are seen up to the box's end at most.
        let deck = ((edges.deck - anchor.y) as f32).min(high.y);
        Self {
            fingerprint: fixed.fingerprint,
            count,
            low: Vec3::new(low.x, bottom, low.y) - margin,
            high,
            deck,
            walls: walls.collect(),
            objects: (0..fixed.triangles.len())
                .map(|k| standing(scene, frame, k).map(|at| (at.position, at.rotation)))
                .collect(),
        }
    }

    /// Distances to everything opaque in the domain.
    pub(crate) fn build(&self, fixed: &Fixed) -> Voxels {
        let (first, last, anchor) = (self.low, self.high, fixed.anchor);
        let plan = DVec2::new(anchor.x, anchor.z);
        let mut builder = Builder::new(first, last, self.count);
        let grain = builder.grain();
        if let Some(ground) = &fixed.ground {
            let steps = ((last - first) / grain).ceil();
            for j in 0..=steps.z as u32 {
                for i in 0..=steps.x as u32 {
                    let p = first + Vec3::new(i as f32, 0.0, j as f32) * grain;
                    let height = |dx: f32| {
                        ground.height(DVec2::new(f64::from(p.x + dx), f64::from(p.z)) + plan) as f32
                    };
                    let (here, next) = (height(0.0), height(grain));
                    // Steep ground is filled in between.
                    let rise = ((next - here).abs() / grain).ceil().clamp(1.0, 64.0) as u32;
                    for k in 0..rise {
                        let y = here + (next - here) * k as f32 / rise as f32;
                        builder.point(Vec3::new(p.x, y, p.z), 0);
                    }
                }
            }
        }
        for &(axis, at) in &self.walls {
            let (from, to) = if axis == 0 {
                (first.z, last.z)
            } else {
                (first.x, last.x)
            };
            let corner = |s: f32, y: f32| {
                if axis == 0 {
                    Vec3::new(at, y, s)
                } else {
                    Vec3::new(s, y, at)
                }
            };
            let high = self.deck;
            builder.triangle(
                [corner(from, first.y), corner(to, first.y), corner(from, high)],
                1,
            );
            builder.triangle([corner(to, high), corner(to, first.y), corner(from, high)], 1);
        }
        for (k, (triangles, at)) in fixed.triangles.iter().zip(&self.objects).enumerate() {
            let Some((position, rotation)) = *at else {
                continue;
            };
            let turn = DMat3::from_quat(rotation);
            let place = |p: Vec3| (turn * p.as_dvec3() + position - anchor).as_vec3();
            builder.object(triangles, place, 2 + k as u32);
        }
        builder.finish()
    }
}
