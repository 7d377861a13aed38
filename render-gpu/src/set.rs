//! A frame made ready for shaders, without a device: numbers for the uniform, values for the buffers.
//!
//! Shaders work in single precision. Everything is therefore moved to an anchor, the middle of the water's grid at its level
//! of rest, in double precision before it is rounded.

use crate::facts::{Facts, FieldShape};
use crate::hierarchy::{self, Rows};
use crate::layout::{FieldUniform, StageUniform};
use crate::settings::{Settings, Technique, Walk};
use crate::tessellate::{self, Triangle};
use crate::voxels::{Builder, Voxels};
use meniscus_sim::glam::{BVec2, DMat3, DVec2, DVec3, Vec2, Vec3};
use meniscus_sim::render::{RenderError, View};
use meniscus_sim::scene::description::Shape;
use meniscus_sim::stage::continuation::{continued, drawable, openness};
use meniscus_sim::stage::ground::Ground;
use meniscus_sim::stage::light::Light;
use meniscus_sim::stage::objects::standing;
use meniscus_sim::stage::sky::Sky;
use meniscus_sim::stage::surroundings::{self, Edges};
use meniscus_sim::stage::volume::Volume;
use meniscus_sim::stage::{Continuation, Lens};
use meniscus_sim::{Frame, Grid, GridSpec, Scene};

/// A length that is nothing beside the scene and much beside single-precision rounding: this times the scene's size.
const HAIR: f64 = 2e-6;

/// A heightfield with its continuation, heights above the anchor.
#[derive(Debug)]
pub(crate) struct Continued {
    grid: Grid<f32>,
    how: Continuation,
    /// The grid without its continuation.
    source: GridSpec,
}

impl Continued {
    fn new(source: &Grid<f32>, how: Continuation, anchor: f64, reuse: Option<Grid<f32>>) -> Self {
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

    /// Values for the buffer.
    pub(crate) fn heights(&self) -> &[f32] {
        self.grid.as_slice()
    }

    /// Height above the anchor at a place in the world.
    fn height(&self, p: DVec2) -> f64 {
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

    fn uniform(&self, shape: &FieldShape, anchor: DVec3, walk: Walk) -> FieldUniform {
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
            safety: if walk == Walk::Safety {
                safety_radius(&self.grid)
            } else {
                0.0
            },
            unused: 0,
        }
    }
}

fn flags(v: BVec2) -> [u32; 2] {
    [u32::from(v.x), u32::from(v.y)]
}

/// Radius in metres within which a ray is taken to cross the surface at most once: a quarter of the mean distance between
/// changes of the sign of curvature along rows and columns, at least half the spacing. An estimate, as the paper's.
pub(crate) fn safety_radius(grid: &Grid<f32>) -> f32 {
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

/// What depends on the scene alone.
#[derive(Debug)]
pub(crate) struct Fixed {
    pub(crate) fingerprint: u64,
    pub(crate) light: Light,
    volume: Volume,
    look: Ground,
    pub(crate) ground: Option<Continued>,
    ground_on_grid: Option<Grid<f32>>,
    pub(crate) tables: Vec<f32>,
    table_irradiance: u32,
    table_noise: u32,
    table_open: u32,
    open: Option<GridSpec>,
    /// Hierarchies and triangles of models behind the records, and root, first triangle and radius of each object.
    pub(crate) models: Rows,
    model_of: Vec<Option<(u32, u32, f32)>>,
    /// Triangles of every object in its own axes.
    triangles: Vec<Vec<Triangle>>,
    anchor: DVec3,
    scale: f64,
}

impl Fixed {
    pub(crate) fn new(scene: &Scene, fingerprint: u64) -> Self {
        let d = &scene.description;
        let light = Light::new(d, Sky::new(scene));
        let volume = Volume::new(&d.water, &light);
        let relief = scene.terrain.as_ref().is_some_and(|t| {
            let (low, high) = t.range();
            low < high
        });
        let spacing = scene
            .terrain
            .as_ref()
            .map_or(1.0, |t| f64::from(t.spec().spacing));
        let look = Ground::new(scene, spacing, relief);
        let middle = scene.grid.origin.as_dvec2() + 0.5 * scene.grid.extent().as_dvec2();
        let anchor = DVec3::new(middle.x, f64::from(d.water.level), middle.y);
        let ground = scene.terrain.as_ref().map(|terrain| {
            let how = surroundings::ground_continuation(terrain, d.water.level);
            Continued::new(terrain, how, anchor.y, None)
        });
        let parts = light.sky.parts();
        let flat = |values: &[Vec3]| values.iter().flat_map(|v| v.to_array()).collect::<Vec<f32>>();
        let mut tables = flat(parts.horizon);
        let table_irradiance = tables.len() as u32;
        tables.extend(flat(parts.irradiance));
        let mut table_noise = 0;
        if let Some(lattice) = look.lattice() {
            table_noise = tables.len() as u32;
            tables.extend(lattice);
        }
        let (mut table_open, mut open) = (0, None);
        if let Some(terrain) = scene.terrain.as_ref().filter(|_| relief) {
            table_open = tables.len() as u32;
            tables.extend(openness(terrain).as_slice());
            open = Some(*terrain.spec());
        }
        let base = 6 * d.objects.len() as u32;
        let mut models = Rows::new();
        let model_of = d
            .objects
            .iter()
            .enumerate()
            .map(|(k, object)| {
                if !matches!(object.shape, Shape::Model { .. }) {
                    return None;
                }
                let root = base + models.len() as u32;
                let (rows, first, radius) = hierarchy::mesh_rows(scene.meshes.get(k)?, root)?;
                models.extend(rows);
                Some((root, first, radius))
            })
            .collect();
        Self {
            fingerprint,
            volume,
            look,
            ground,
            ground_on_grid: scene.ground_on_grid(),
            tables,
            table_irradiance,
            table_noise,
            table_open,
            open,
            models,
            model_of,
            triangles: scene.meshes.iter().map(tessellate::triangles_of).collect(),
            anchor,
            scale: surroundings::scale(scene),
            light,
        }
    }

    /// Places are relative to it, metres.
    pub(crate) fn anchor(&self) -> DVec3 {
        self.anchor
    }
}

/// One frame seen from one place.
#[derive(Debug)]
pub(crate) struct Set {
    pub(crate) water: Continued,
    pub(crate) uniform: StageUniform,
    /// One record of six rows an object.
    pub(crate) records: Rows,
    pub(crate) spray: Option<Rows>,
    /// Triangles of the objects, six rows each; none where rays find them.
    pub(crate) meshes: Rows,
    pub(crate) voxels: Option<Voxels>,
    pub(crate) facts: Facts,
}

impl Set {
    /// Checks frame and view and makes them ready.
    ///
    /// # Errors
    /// [`RenderError`].
    pub(crate) fn new(
        scene: &Scene,
        fixed: &Fixed,
        frame: &Frame,
        view: &View,
        settings: &Settings,
    ) -> Result<Self, RenderError> {
        let mut lens = Lens::new(view)?;
        frame.check_finite()?;
        let unsupported = |error: crate::facts::TooLarge| RenderError::Unsupported {
            what: error.to_string(),
            remedy: "choose fewer samples".to_owned(),
        };
        let mut facts = Facts::of_scene(scene, frame.spec(), view.size, settings)
            .map_err(unsupported)?
            .with_frame(frame);
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
        for (out, side) in uniform.sides.iter_mut().zip(&edges.sides) {
            let at = side.at - if side.axis == 0 { anchor.x } else { anchor.z };
            *out = [
                side.axis as f32,
                at as f32,
                side.outwards as f32,
                f32::from(u8::from(side.glass)),
            ];
        }
        facts.sides = edges.sides.iter().map(|s| s.glass).collect();
        let mut meshes = Rows::new();
        let mut voxels = None;
        if settings.technique == Technique::Heightfield {
            facts.mesh.objects.clear();
        } else {
            meshes = cut_meshes(scene, fixed, frame, &lens, settings, &mut facts);
            if settings.technique == Technique::DistanceField {
                voxels = Some(voxel_field(
                    scene,
                    fixed,
                    frame,
                    &edges,
                    &heights,
                    settings.voxels,
                ));
            }
        }
        uniform.fields[0] = water.uniform(&facts.fields[0], anchor, settings.walk);
        if let Some(ground) = &fixed.ground {
            uniform.fields[1] = ground.uniform(&facts.fields[1], anchor, settings.walk);
        }
        Ok(Self {
            water,
            uniform,
            records,
            spray: spray.map(|(rows, _)| rows),
            meshes,
            voxels,
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

/// How finely things must be cut for `settings.tessellation`, and the objects' triangles cut so. A straight edge of length L at
/// distance D is off by about L²/(8 D) after refraction.
fn cut_meshes(
    scene: &Scene,
    fixed: &Fixed,
    frame: &Frame,
    lens: &Lens,
    settings: &Settings,
    facts: &mut Facts,
) -> Rows {
    let bound = f64::from(settings.tessellation.max(0.01));
    let longest = |distance: f64| distance * (8.0 * bound * lens.pixel_angle).sqrt();
    let above = (lens.eye.y - fixed.anchor.y).abs().max(1e-3 * fixed.scale);
    // Powers of two: a moving eye then asks for few different meshes.
    let pieces = |extent: f64, most: u32| {
        let n = (extent / longest(above).max(1e-9))
            .ceil()
            .clamp(8.0, f64::from(most)) as u32;
        n.next_power_of_two().min(most)
    };
    if let Some(ground) = &fixed.ground {
        let spec = ground.grid.spec();
        let relief = {
            let (low, high) = ground.grid.range();
            low < high
        };
        let extent = f64::from(spec.spacing) * (spec.size.as_dvec2() - 1.0);
        for (k, out) in facts.mesh.ground.iter_mut().enumerate() {
            let cells = spec.size[k] - 1;
            let needed = pieces(extent[k], 512);
            // Ground with relief keeps its samples, up to a limit.
            *out = if relief {
                needed.max(cells.min(1024))
            } else {
                needed
            };
        }
    }
    facts.mesh.wall = pieces(scene.grid.extent().as_dvec2().max_element(), 64);
    let mut rows = Rows::new();
    facts.mesh.objects.clear();
    for (k, triangles) in fixed.triangles.iter().enumerate() {
        let Some(at) = standing(scene, frame, k) else {
            continue;
        };
        let reach = triangles
            .iter()
            .flat_map(|(p, _)| p)
            .map(|p| p.length())
            .fold(0.0, f32::max);
        let distance = ((at.position - lens.eye).length() - f64::from(reach)).max(0.05 * fixed.scale);
        let mut cut = tessellate::refined(triangles.clone(), longest(distance) as f32);
        round(&mut cut, &scene.description.objects[k].shape);
        let position = at.position - fixed.anchor;
        if position.y.abs() <= f64::from(reach) {
            cut = tessellate::split(&cut, DMat3::from_quat(at.rotation), position);
        }
        if cut.is_empty() {
            continue;
        }
        facts
            .mesh
            .objects
            .push([k as u32, rows.len() as u32, cut.len() as u32]);
        let row = |v: &Vec3| [v.x.to_bits(), v.y.to_bits(), v.z.to_bits(), 0];
        rows.extend(cut.iter().flat_map(|(p, n)| p.iter().chain(n).map(row)));
    }
    rows
}

/// Moves the corners of cut triangles out to the sphere or cylinder that they were cut from.
fn round(triangles: &mut [Triangle], shape: &Shape) {
    for (corners, normals) in triangles {
        for (p, n) in corners.iter_mut().zip(normals) {
            match *shape {
                Shape::Sphere { radius } => {
                    *n = p.normalize_or(*n);
                    *p = radius * *n;
                }
                Shape::Cylinder { radius, .. } if n.y.abs() < 0.5 => {
                    let out = Vec2::new(p.x, p.z).normalize_or(Vec2::X);
                    *n = Vec3::new(out.x, 0.0, out.y);
                    (p.x, p.z) = (radius * out.x, radius * out.y);
                }
                _ => {}
            }
        }
    }
}

/// Distances to everything opaque in the domain, from the lowest ground to above the water and the objects.
fn voxel_field(
    scene: &Scene,
    fixed: &Fixed,
    frame: &Frame,
    edges: &Edges,
    heights: &Grid<f32>,
    count: u32,
) -> Voxels {
    let anchor = fixed.anchor;
    let spec = heights.spec();
    let plan = DVec2::new(anchor.x, anchor.z);
    let low = (spec.origin.as_dvec2() - plan).as_vec2();
    let extent = spec.extent();
    let top = (f64::from(heights.range().1) - anchor.y) as f32 + 0.25 * extent.max_element();
    let bottom = match &fixed.ground {
        Some(ground) => ground.grid.range().0.max(-2.0 * extent.max_element()),
        None => -extent.max_element(),
    };
    // A voxel of margin, so that the floor and the walls lie inside.
    let margin = 1.5 * extent.max_element() / count as f32;
    let first = Vec3::new(low.x, bottom, low.y) - margin;
    let last = Vec3::new(low.x + extent.x, top, low.y + extent.y) + margin;
    let mut builder = Builder::new(first, last, count);
    let grain = builder.grain();
    if let Some(ground) = &fixed.ground {
        let steps = ((last - first) / grain).ceil();
        for j in 0..=steps.z as u32 {
            for i in 0..=steps.x as u32 {
                let p = first + Vec3::new(i as f32, 0.0, j as f32) * grain;
                let height =
                    |dx: f32| ground.height(DVec2::new(f64::from(p.x + dx), f64::from(p.z)) + plan) as f32;
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
    let deck = (edges.deck - anchor.y) as f32;
    for side in edges.sides.iter().filter(|s| !s.glass) {
        let at = (side.at - if side.axis == 0 { anchor.x } else { anchor.z }) as f32;
        let (from, to) = if side.axis == 0 {
            (first.z, last.z)
        } else {
            (first.x, last.x)
        };
        let corner = |s: f32, y: f32| {
            if side.axis == 0 {
                Vec3::new(at, y, s)
            } else {
                Vec3::new(s, y, at)
            }
        };
        let high = deck.min(last.y);
        builder.triangle(
            [corner(from, first.y), corner(to, first.y), corner(from, high)],
            1,
        );
        builder.triangle([corner(to, high), corner(to, first.y), corner(from, high)], 1);
    }
    for (k, triangles) in fixed.triangles.iter().enumerate() {
        let Some(at) = standing(scene, frame, k) else {
            continue;
        };
        let turn = DMat3::from_quat(at.rotation);
        let place = |p: Vec3| (turn * p.as_dvec3() + at.position - anchor).as_vec3();
        builder.object(triangles, place, 2 + k as u32);
    }
    builder.finish()
}

fn uniform(
    scene: &Scene,
    fixed: &Fixed,
    facts: &Facts,
    lens: &Lens,
    view: &View,
    settings: &Settings,
) -> StageUniform {
    let (light, volume, look, anchor) = (&fixed.light, &fixed.volume, &fixed.look, fixed.anchor);
    let parts = light.sky.parts();
    let three = |v: DVec3| v.as_vec3().to_array();
    let sun = light.sun;
    let beam = light.beam;
    let plan = DVec2::new(anchor.x, anchor.z);
    let checker = look.checker;
    let shift = if checker > 0.0 {
        (plan / (2.0 * checker) - (plan / (2.0 * checker)).floor()) * 2.0 * checker
    } else {
        DVec2::ZERO
    };
    let least = volume.extinction.min_element();
    let cutoff = settings.absorption_cutoff;
    StageUniform {
        eye: three(lens.eye - anchor),
        forward: three(lens.forward),
        pixel_angle: lens.pixel_angle as f32,
        right: three(lens.right),
        up: three(lens.up),
        index: scene.description.water.index,
        size: view.size.as_vec2().to_array(),
        jitter: [0.5, 0.5],
        sun_direction: sun.map_or([0.0, 1.0, 0.0], |s| s.direction.to_array()),
        sun_radius: sun.map_or(0.0, |s| s.radius),
        sun_irradiance: sun.map_or([0.0; 3], |s| s.irradiance.to_array()),
        has_sun: u32::from(sun.is_some()),
        beam_direction: beam.map_or([0.0, 1.0, 0.0], |b| b.direction.to_array()),
        has_beam: u32::from(beam.is_some()),
        beam_irradiance: beam.map_or([0.0; 3], |b| b.irradiance.to_array()),
        entering: light.entering,
        from_below: light.from_below.to_array(),
        visual_range: settings.visual_range.unwrap_or(0.0),
        extinction: volume.extinction.to_array(),
        // Baboud & Décoret's (6), −ln ε over the least extinction.
        cutoff_distance: if cutoff > 0.0 && least > 0.0 {
            -cutoff.min(1.0).ln() / least
        } else {
            1e30
        },
        scattering: volume.scattering().to_array(),
        spread: (0.5 * lens.pixel_angle / f64::from(view.samples).sqrt()) as f32,
        source_sun: volume.sources[0].0.to_array(),
        near: (1e-4 * fixed.scale) as f32,
        rate_sun: volume.sources[0].1.to_array(),
        sky_rows: parts.levels.first().map_or(1.0, |l| l.height as f32),
        source_sky: volume.sources[1].0.to_array(),
        sky_levels: parts.levels.len() as f32,
        rate_sky: volume.sources[1].1.to_array(),
        sky_rotation: parts.rotation,
        sky_scale: parts.scale.to_array(),
        sky_table: fixed.table_irradiance,
        level_sky: (light.entering * light.sky.irradiance(Vec3::Y)).to_array(),
        albedo: look.albedo.to_array(),
        checker: checker as f32,
        steep: look.steep.to_array(),
        look_spacing: look.spacing as f32,
        shore: look.shore.to_array(),
        noise: if facts.noise { fixed.table_noise } else { 0 },
        look_shift: plan.as_vec2().to_array(),
        checker_shift: shift.as_vec2().to_array(),
        open_low: fixed
            .open
            .map_or([0.0; 2], |s| (s.origin.as_dvec2() - plan).as_vec2().to_array()),
        open_size: fixed.open.map_or([0; 2], |s| s.size.to_array()),
        open_spacing: fixed.open.map_or(1.0, |s| s.spacing),
        open: fixed.table_open,
        sample_share: 1.0,
        ..StageUniform::default()
    }
}
