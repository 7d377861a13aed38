//! A frame made ready for shaders, without a device: numbers for the uniform, values for the buffers.
//!
//! Shaders work in single precision. Everything is therefore moved to an anchor, the middle of the water's grid at its level
//! of rest, in double precision before it is rounded.

use crate::continued::Continued;
use crate::facts::Facts;
use crate::fixed::Fixed;
use crate::held::Order;
use crate::hierarchy::{self, Rows};
use crate::layout::StageUniform;
use crate::meshes::cut_meshes;
use crate::settings::{Settings, Technique};
use crate::uniform::uniform;
use crate::voxel_scene::VoxelPlan;
use meniscus_sim::glam::{DMat3, DVec2, DVec3, Vec2, Vec3};
use meniscus_sim::render::RenderError;
use meniscus_sim::scene::description::Shape;
use meniscus_sim::stage::Lens;
use meniscus_sim::stage::continuation::drawable;
use meniscus_sim::stage::objects::standing;
use meniscus_sim::stage::surroundings::{self, Edges};
use meniscus_sim::{Frame, Grid, Scene};

/// A length that is nothing beside the scene and much beside single-precision rounding: this times the scene's size.
const HAIR: f64 = 2e-6;

/// Lowest and highest x and z of what has no sides.
const UNBOUNDED: [f32; 4] = [-1e30, -1e30, 1e30, 1e30];

/// One frame seen from one place.
#[derive(Debug)]
pub(crate) struct Set {
    pub(crate) water: Continued,
    pub(crate) uniform: StageUniform,
    /// One record of six rows an object.
    pub(crate) records: Rows,
    pub(crate) spray: Option<Rows>,
    /// Triangles of the objects; none where rays find them.
    pub(crate) meshes: Rows,
    pub(crate) voxels: Option<VoxelPlan>,
    /// What the caller has drawn, a row a pixel.
    pub(crate) foreign: Option<Vec<[f32; 4]>>,
    pub(crate) facts: Facts,
}

impl Set {
    /// Checks frame and view and makes them ready.
    ///
    /// # Errors
    /// [`RenderError`].
    pub(crate) fn new(order: &Order<'_>, fixed: &Fixed, settings: &Settings) -> Result<Self, RenderError> {
        let Order {
            scene, frame, view, ..
        } = *order;
        let mut lens = Lens::new(view)?;
        frame.check_finite()?;
        let unsupported = |error: crate::facts::TooLarge| RenderError::Unsupported {
            what: error.to_string(),
            remedy: "choose fewer samples".to_owned(),
        };
        let mut facts = Facts::of_scene(scene, frame.spec(), view.size, settings)
            .map_err(unsupported)?
            .with_frame(frame);
        let foreign = order.foreign.map(|layer| layer.rows(view.size)).transpose()?;
        facts.foreign = foreign.is_some();
        let how = surroundings::water_continuation(scene);
        let heights = drawable(frame, fixed.ground_on_grid.as_ref(), how.periodic, None);
        let anchor = fixed.anchor;
        let water = Continued::new(&heights, how, anchor.y, None);
        let hair = HAIR * fixed.scale.max((lens.eye - anchor).length());
        let edges = Edges::new(scene, &heights, lens.eye);
        let in_plan = |p: DVec3| DVec2::new(p.x, p.z);
        let ground = fixed
            .ground
            .as_ref()
            .map_or(f64::NEG_INFINITY, |g| g.height(in_plan(lens.eye)) + anchor.y);
        if ground >= lens.eye.y {
            let eye = lens.eye;
            return Err(RenderError::View {
                what: format!(
                    "the camera at ({:.3}, {:.3}, {:.3}) m is inside the ground, which reaches up to {ground:.3} m there",
                    eye.x, eye.y, eye.z
                ),
                remedy: "raise it above the ground or move it",
            });
        }
        let level = water.height(in_plan(lens.eye)) + anchor.y;
        if (level - lens.eye.y).abs() < 4.0 * hair {
            lens.eye.y = level + 4.0 * hair;
        }
        let in_water = level > lens.eye.y && edges.within_glass(lens.eye);
        if facts.caustics.is_some()
            && !(fixed.light.beam.is_some() && caustics_matter(scene, fixed, &heights))
        {
            facts.caustics = None;
        }
        let spray = frame.droplets.as_ref().filter(|_| facts.spray).and_then(|d| {
            let centres: Vec<Vec3> = d
                .position
                .iter()
                .map(|p| (p.as_dvec3() - anchor).as_vec3())
                .collect();
            hierarchy::droplet_rows(&centres, &d.radius)
        });
        let records = records(scene, fixed, frame);
        let mut uniform = uniform(scene, fixed, &facts, &lens, view, settings);
        uniform.hair = hair as f32;
        uniform.medium = u32::from(in_water);
        uniform.spray_root = spray.as_ref().map_or(0, |(_, first)| *first);
        uniform.solid_count = (records.len() / 6) as u32;
        let relative = |p: Vec2| (p.as_dvec2() - in_plan(anchor)).as_vec2();
        if let Some(foam) = &frame.foam {
            uniform.foam_low = relative(foam.spec().origin).to_array();
            uniform.foam_spacing = foam.spec().spacing;
            uniform.foam_size = foam.spec().size.to_array();
        }
        if let Some(sizes) = facts.caustics {
            let spec = frame.spec();
            uniform.map_low = relative(spec.origin).to_array();
            uniform.map_size = sizes.map;
            // A square map over a grid that is not square covers the longer side.
            let cells = (Vec2::from(sizes.map.map(|n| n as f32)) - 1.0).max(Vec2::ONE);
            uniform.map_spacing = (spec.extent() / cells).max_element();
            uniform.photons = sizes.photons;
        }
        uniform.side_count = edges.sides.len().min(4) as u32;
        uniform.deck = (edges.deck - anchor.y) as f32;
        // Without a side there is no end.
        (uniform.walls, uniform.glass) = (UNBOUNDED, UNBOUNDED);
        for (out, side) in uniform.sides.iter_mut().zip(&edges.sides) {
            let at = (side.at - if side.axis == 0 { anchor.x } else { anchor.z }) as f32;
            *out = [
                side.axis as f32,
                at,
                side.outwards as f32,
                f32::from(u8::from(side.glass)),
            ];
            let ends = if side.glass {
                &mut uniform.glass
            } else {
                &mut uniform.walls
            };
            ends[usize::from(side.axis != 0) + if side.outwards > 0.0 { 2 } else { 0 }] = at;
        }
        facts.sides = edges.sides.iter().map(|s| s.glass).collect();
        let mut meshes = Rows::new();
        let mut voxels = None;
        if settings.technique == Technique::Heightfield {
            facts.mesh.objects.clear();
        } else {
            meshes = cut_meshes(scene, fixed, frame, &lens, settings, &mut facts);
            if settings.technique == Technique::DistanceField {
                voxels = Some(VoxelPlan::new(
                    scene,
                    fixed,
                    frame,
                    &edges,
                    &heights,
                    settings.voxels,
                ));
            }
        }
        uniform.fields[0] = water.uniform(&facts.fields[0], anchor, settings);
        if let Some(ground) = &fixed.ground {
            uniform.fields[1] = ground.uniform(&facts.fields[1], anchor, settings);
        }
        Ok(Self {
            water,
            uniform,
            records,
            spray: spray.map(|(rows, _)| rows),
            meshes,
            voxels,
            foreign,
            facts,
        })
    }
}

/// Whether waves move sunlight by more than a fraction of a sample: slope times depth times the share of refraction.
fn caustics_matter(scene: &Scene, fixed: &Fixed, heights: &Grid<f32>) -> bool {
    const NEGLIGIBLE: f32 = 0.05;
    let spec = heights.spec();
    let data = heights.as_slice();
    let w = spec.width();
    let bend = 1.0 - 1.0 / scene.description.water.index.max(1.0);
    let Some(ground) = &fixed.ground else { return false };
    (0..spec.height() - 1).step_by(2).any(|j| {
        (0..w - 1).step_by(2).any(|i| {
            let k = j * w + i;
            let rise = (data[k + 1] - data[k]).abs().max((data[k + w] - data[k]).abs());
            if rise == 0.0 {
                return false;
            }
            let bed = (ground.height(spec.position(i, j).as_dvec2()) + fixed.anchor.y) as f32;
            let depth = data[k] - bed;
            depth > 0.0 && rise / spec.spacing * depth * bend > NEGLIGIBLE * spec.spacing
        })
    })
}

/// Records of the objects at the poses of the frame; see `shaders/shared/solids.wgsl`.
fn records(scene: &Scene, fixed: &Fixed, frame: &Frame) -> Rows {
    let mut rows = Rows::new();
    for (k, object) in scene.description.objects.iter().enumerate() {
        let (kind, half, bound, model) = match object.shape {
            Shape::Sphere { radius } => (0, Vec3::splat(radius), radius, (0, 0)),
            Shape::Box { size } => (1, 0.5 * size, 0.5 * size.length(), (0, 0)),
            Shape::Cylinder { radius, height } => {
                let half = Vec3::new(radius, 0.5 * height, radius);
                (2, half, radius.hypot(0.5 * height), (0, 0))
            }
            Shape::Model { .. } => match fixed.model_of.get(k).copied().flatten() {
                Some((root, first, radius)) => (3, Vec3::ZERO, radius, (root, first)),
                // A record without extent: records keep the numbers of their objects.
                None => (0, Vec3::ZERO, -1.0, (0, 0)),
            },
        };
        let Some(at) = standing(scene, frame, k) else {
            continue;
        };
        let bound = if bound.is_finite() { bound } else { -1.0 };
        let centre = (at.position - fixed.anchor).as_vec3();
        let turn = DMat3::from_quat(at.rotation).transpose();
        let row = |v: Vec3, word: u32| [v.x.to_bits(), v.y.to_bits(), v.z.to_bits(), word];
        rows.push(row(centre, kind));
        rows.push(row(half, bound.to_bits()));
        for axis in 0..3 {
            rows.push(row(turn.row(axis).as_vec3(), at.color[axis].to_bits()));
        }
        rows.push([model.0, model.1, 0, 0]);
    }
    rows
}
