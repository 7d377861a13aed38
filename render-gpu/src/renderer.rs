//! The renderer: frames in, linear radiance out.

use crate::device::Gpu;
use crate::executor::{ExecuteError, Executor, Globals, Physical, Stopwatch, read_buffer};
use crate::facts::Facts;
use crate::graph::{GraphError, Plan, ResourceId};
use crate::set::{Fixed, Set};
use crate::settings::{Settings, Technique};
use crate::techniques::{self, Passes, names};
use crate::work::Cadence;
use meniscus_sim::glam::{UVec2, Vec3, Vec4};
use meniscus_sim::render::{Image, PlanItem, RenderError, RenderReport, Renderer, View};
use meniscus_sim::{Channels, Frame, Scene, stage};
use std::collections::HashMap;
use std::sync::Arc;
use std::time::Instant;

/// What the ray through the middle of one pixel met, as far as the technique knows.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MetPixel {
    /// Whether the first thing met is water.
    pub water: bool,
    /// Where the first thing met is, metres; `None` for the sky.
    pub position: Option<Vec3>,
    /// Where what is seen through the water is, metres; `None` if nothing is or the technique cannot tell.
    pub refracted: Option<Vec3>,
}

/// A buffer that grows when it must and otherwise stays.
#[derive(Debug, Default)]
struct Kept {
    buffer: Option<wgpu::Buffer>,
}

impl Kept {
    /// The buffer with room for `bytes`; whether it is another one than before. A buffer more than four times too
    /// large is given back.
    fn fit(
        &mut self,
        gpu: &Gpu,
        label: &'static str,
        bytes: u64,
        usage: wgpu::BufferUsages,
    ) -> (wgpu::Buffer, bool) {
        let bytes = bytes.max(16).next_multiple_of(16);
        if let Some(buffer) = self
            .buffer
            .as_ref()
            .filter(|b| b.size() >= bytes && b.size() <= 4 * bytes)
        {
            return (buffer.clone(), false);
        }
        let buffer = gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some(label),
            size: bytes,
            usage: usage | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        self.buffer = Some(buffer.clone());
        (buffer, true)
    }

    fn bytes(&self) -> u64 {
        self.buffer.as_ref().map_or(0, wgpu::Buffer::size)
    }
}

/// Everything that lives on one device.
#[derive(Debug)]
struct Held {
    gpu: Arc<Gpu>,
    executor: Executor,
    fixed: Option<Fixed>,
    uniform: Kept,
    heights: Kept,
    tables: Kept,
    solids: Kept,
    spray: Kept,
    foam: Kept,
    map: Kept,
    meshes: Kept,
    voxels: Kept,
    voxel_box: Kept,
    missing: Kept,
    counts: [u32; 4],
    map_size: Option<[u32; 2]>,
    picture: Kept,
    readable: Kept,
    sky: Option<(wgpu::Texture, wgpu::TextureView)>,
}

impl Held {
    fn open() -> Result<Self, RenderError> {
        let gpu = Gpu::open().map_err(|error| RenderError::Unsupported {
            what: error.to_string(),
            remedy: "use `whitted`, or see `meniscus renderers`".to_owned(),
        })?;
        Ok(Self::on(Arc::new(gpu)))
    }

    fn on(gpu: Arc<Gpu>) -> Self {
        Self {
            gpu,
            executor: Executor::default(),
            fixed: None,
            uniform: Kept::default(),
            heights: Kept::default(),
            tables: Kept::default(),
            solids: Kept::default(),
            spray: Kept::default(),
            foam: Kept::default(),
            map: Kept::default(),
            meshes: Kept::default(),
            voxels: Kept::default(),
            voxel_box: Kept::default(),
            missing: Kept::default(),
            counts: [0; 4],
            map_size: None,
            picture: Kept::default(),
            readable: Kept::default(),
            sky: None,
        }
    }
}

/// A picture on the device, its copy for reading, and what it cost.
struct Drawn {
    report: RenderReport,
    met: Option<[Vec<Vec4>; 2]>,
}

/// Draws water with one of the [`Technique`]s on a graphics adapter. The device is opened with the first picture.
#[derive(Debug)]
pub struct GpuRenderer {
    settings: Settings,
    held: Option<Held>,
}

impl GpuRenderer {
    /// A renderer with these settings.
    pub fn new(settings: Settings) -> Self {
        Self { settings, held: None }
    }

    /// A renderer on a device that is open, which others may use too. If it is lost, one of its own is opened.
    pub fn on(settings: Settings, gpu: Arc<Gpu>) -> Self {
        Self {
            settings,
            held: Some(Held::on(gpu)),
        }
    }

    /// Draws as [`render`](Renderer::render) does and leaves the picture on the device: see [`Self::picture`].
    ///
    /// # Errors
    /// As [`render`](Renderer::render).
    pub fn render_resident(
        &mut self,
        scene: &Scene,
        frame: &Frame,
        view: &View,
        progress: &(dyn Fn(f32) -> bool + Sync),
    ) -> Result<RenderReport, RenderError> {
        Ok(self.draw(scene, frame, view, None, false, progress)?.report)
    }

    /// The picture that was drawn last and the device that it is on: linear radiance, four `f32` a pixel, row-major from the
    /// top left.
    pub fn picture(&self) -> Option<(&Arc<Gpu>, &wgpu::Buffer)> {
        let held = self.held.as_ref()?;
        Some((&held.gpu, held.picture.buffer.as_ref()?))
    }

    /// What it does.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// Other settings from the next picture on; what is held on the device is kept.
    pub fn set(&mut self, settings: Settings) {
        self.settings = settings;
    }

    /// Name of the adapter, once a picture was drawn.
    pub fn adapter(&self) -> Option<&crate::AdapterDescription> {
        self.held.as_ref().map(|h| &h.gpu.description)
    }

    /// Whether times of passes come from the device.
    pub fn is_timed(&self) -> bool {
        self.held.as_ref().is_some_and(|h| h.gpu.tick.is_some())
    }

    /// Pipelines made so far.
    pub fn pipelines(&self) -> usize {
        self.held.as_ref().map_or(0, |h| h.executor.pipelines.count())
    }

    /// Bytes of the buffers and textures held on the device.
    pub fn held_bytes(&self) -> u64 {
        self.held.as_ref().map_or(0, |h| {
            let kept = [
                &h.uniform,
                &h.heights,
                &h.tables,
                &h.solids,
                &h.spray,
                &h.foam,
                &h.map,
                &h.picture,
                &h.readable,
                &h.meshes,
                &h.voxels,
                &h.voxel_box,
                &h.missing,
            ];
            kept.into_iter().map(Kept::bytes).sum::<u64>() + h.executor.pool_bytes()
        })
    }

    /// Sunlight on the ground under the last picture, relative to flat water, a value a texel of the photon map, row-major;
    /// `None` if it had none.
    pub fn illumination(&mut self) -> Option<(UVec2, Vec<f32>)> {
        let held = self.held.as_mut()?;
        let size = UVec2::from(held.map_size?);
        let bytes = 4 * u64::from(size.x) * u64::from(size.y);
        let (readable, _) = held
            .readable
            .fit(&held.gpu, "readable", bytes, wgpu::BufferUsages::MAP_READ);
        let mut encoder = held.gpu.device.create_command_encoder(&Default::default());
        encoder.copy_buffer_to_buffer(held.map.buffer.as_ref()?, 0, &readable, 0, bytes);
        held.gpu.queue.submit([encoder.finish()]);
        let read = read_buffer(&held.gpu, &readable, bytes)?;
        let values = read.chunks_exact(4).map(bytemuck::pod_read_unaligned).collect();
        Some((size, values))
    }

    /// Look-ups of the last picture that rasterised techniques could not answer, over all its samples: beyond the picture's edge, where
    /// nothing was drawn, and marches that met nothing.
    pub fn missing(&self) -> [u32; 3] {
        self.held
            .as_ref()
            .map_or([0; 3], |h| [h.counts[0], h.counts[1], h.counts[2]])
    }

    /// Destroys the device, as a driver may do at any time; for tests of what follows.
    pub fn lose_device(&mut self) {
        if let Some(held) = &self.held {
            held.gpu.device.destroy();
            let _ = held.gpu.device.poll(wgpu::PollType::wait_indefinitely());
        }
    }

    /// What each pixel's ray met, in the places that this technique takes it to be; the measure by which techniques are
    /// scored. `None` if the technique cannot tell.
    ///
    /// # Errors
    /// As [`render`](Renderer::render).
    pub fn met(
        &mut self,
        scene: &Scene,
        frame: &Frame,
        view: &View,
    ) -> Result<Option<Vec<MetPixel>>, RenderError> {
        let view = View {
            samples: 1,
            ..view.clone()
        };
        let drawn = self.draw(scene, frame, &view, None, true, &|_| true)?;
        let Some(anchor) = self
            .held
            .as_ref()
            .and_then(|h| h.fixed.as_ref())
            .map(Fixed::anchor)
        else {
            return Ok(None);
        };
        let world = |p: Vec4| (p.truncate().as_dvec3() + anchor).as_vec3();
        Ok(drawn.met.map(|[first, refracted]| {
            first
                .into_iter()
                .zip(refracted)
                .map(|(f, r)| MetPixel {
                    water: f.w == 1.0,
                    position: (f.w > 0.0).then(|| world(f)),
                    refracted: (r.w >= 0.0).then(|| world(r)),
                })
                .collect()
        }))
    }

    /// Draws, and once more on a new device if the old one is lost; into `image`, or to stay on the device.
    fn draw(
        &mut self,
        scene: &Scene,
        frame: &Frame,
        view: &View,
        mut image: Option<&mut Image>,
        want_met: bool,
        progress: &(dyn Fn(f32) -> bool + Sync),
    ) -> Result<Drawn, RenderError> {
        for attempt in 0..2 {
            if self.held.as_ref().is_some_and(|h| h.gpu.lost().is_some()) {
                tracing::warn!("the graphics device was lost; a new one is opened");
                self.held = None;
            }
            let mut held = match self.held.take() {
                Some(held) => held,
                None => Held::open()?,
            };
            let image = image.as_deref_mut();
            let drawn = held.draw(scene, frame, view, &self.settings, image, want_met, progress);
            let lost = held.gpu.lost();
            self.held = Some(held);
            match (drawn, lost) {
                (Err(_), Some(_)) if attempt == 0 => {}
                (Err(RenderError::Unsupported { .. }), Some(why)) => {
                    return Err(RenderError::Unsupported {
                        what: format!("the graphics device was lost twice in a row: {why}"),
                        remedy: "draw again, or use `whitted`".to_owned(),
                    });
                }
                (drawn, _) => return drawn,
            }
        }
        Err(RenderError::Interrupted)
    }
}

fn failed(what: impl std::fmt::Display) -> RenderError {
    RenderError::Unsupported {
        what: format!("the graphics device failed: {what}"),
        remedy: "use `whitted`, or another adapter (environment variable MENISCUS_ADAPTER)".to_owned(),
    }
}

impl From<ExecuteError> for RenderError {
    fn from(error: ExecuteError) -> Self {
        failed(error)
    }
}

impl From<GraphError> for RenderError {
    fn from(error: GraphError) -> Self {
        failed(error)
    }
}

/// Refuses what the adapter cannot hold.
fn check_limits(gpu: &Gpu, facts: &Facts) -> Result<(), RenderError> {
    let limits = gpu.limits();
    let name = &gpu.description.name;
    let side = facts.size[0].max(facts.size[1]);
    if side > limits.max_texture_dimension_2d {
        return Err(RenderError::Unsupported {
            what: format!(
                "an image of {} x {} pixels: adapter `{name}` holds textures of at most {} a side",
                facts.size[0], facts.size[1], limits.max_texture_dimension_2d
            ),
            remedy: "choose a smaller image, or use `whitted`".to_owned(),
        });
    }
    let most = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
    let pixels = u64::from(facts.size[0]) * u64::from(facts.size[1]);
    for (what, bytes, remedy) in [
        (
            "the heights of water and ground",
            4 * facts.height_values(),
            "choose a coarser spacing",
        ),
        (
            "the objects",
            16 * u64::from(facts.solid_rows),
            "choose models of fewer triangles",
        ),
        ("the image", 16 * pixels, "choose a smaller image"),
    ] {
        if bytes > most {
            return Err(RenderError::Unsupported {
                what: format!("{what} take {bytes} bytes: adapter `{name}` holds buffers of at most {most}"),
                remedy: format!("{remedy}, or use `whitted`"),
            });
        }
    }
    if let Some([w, h]) = facts
        .sky
        .filter(|s| s[0].max(s[1]) > limits.max_texture_dimension_2d)
    {
        return Err(RenderError::Unsupported {
            what: format!(
                "a sky of {w} x {h} pixels: adapter `{name}` holds textures of at most {} a side",
                limits.max_texture_dimension_2d
            ),
            remedy: "choose a smaller picture, or use `whitted`".to_owned(),
        });
    }
    Ok(())
}

/// Where sample `k` of `n` lies in the pixel and on the sun's disc, both in the unit square; one goes through the middle.
fn sample_point(k: u32, n: u32) -> ([f32; 2], [f32; 2]) {
    if n == 1 {
        return ([0.5; 2], [0.0; 2]);
    }
    let unit = |v: f64| (v - v.floor()) as f32;
    let k64 = f64::from(k);
    (
        [
            unit((k64 + 0.5) / f64::from(n)),
            unit(f64::from(k.reverse_bits()) / 4_294_967_296.0 + 0.5 / f64::from(n)),
        ],
        [
            unit(k64 * 0.754_877_666_246_692_8),
            unit(k64 * 0.569_840_290_998_053_3),
        ],
    )
}

impl Held {
    #[allow(clippy::too_many_arguments)]
    fn draw(
        &mut self,
        scene: &Scene,
        frame: &Frame,
        view: &View,
        settings: &Settings,
        image: Option<&mut Image>,
        want_met: bool,
        progress: &(dyn Fn(f32) -> bool + Sync),
    ) -> Result<Drawn, RenderError> {
        let mut report = RenderReport {
            device: Some(self.gpu.description.name.clone()),
            ..RenderReport::default()
        };
        let start = Instant::now();
        let fingerprint = stage::fingerprint(scene);
        let new_scene = self.fixed.as_ref().is_none_or(|f| f.fingerprint != fingerprint);
        if new_scene {
            self.fixed = Some(Fixed::new(scene, fingerprint));
            self.sky = None;
        }
        let Some(fixed) = self.fixed.take() else {
            return Err(RenderError::Interrupted);
        };
        report.stages.push(("scene", start.elapsed().as_secs_f64()));
        let result = self.draw_set(
            scene, &fixed, new_scene, frame, view, settings, image, want_met, progress, report,
        );
        self.fixed = Some(fixed);
        if result.is_err() {
            // What is on the device may be half of a scene.
            self.fixed = None;
        }
        result
    }

    #[allow(clippy::too_many_arguments)]
    fn draw_set(
        &mut self,
        scene: &Scene,
        fixed: &Fixed,
        new_scene: bool,
        frame: &Frame,
        view: &View,
        settings: &Settings,
        image: Option<&mut Image>,
        want_met: bool,
        progress: &(dyn Fn(f32) -> bool + Sync),
        mut report: RenderReport,
    ) -> Result<Drawn, RenderError> {
        let start = Instant::now();
        let set = Set::new(scene, fixed, frame, view, settings)?;
        check_limits(&self.gpu, &set.facts)?;
        let passes = techniques::passes(&set.facts, settings);
        let mut wanted = vec![passes.picture];
        let met = passes.met.filter(|_| want_met);
        if let Some(met) = met {
            wanted = met.to_vec();
        }
        let plan = passes.graph.plan(&wanted)?;
        report.stages.push(("frame", start.elapsed().as_secs_f64()));
        if !progress(0.0) {
            return Err(RenderError::Interrupted);
        }

        let start = Instant::now();
        let (globals, new_heights) = self.upload(fixed, &set, frame, new_scene);
        let physical = self.executor.prepare(&self.gpu, &plan);
        report.stages.push(("upload", start.elapsed().as_secs_f64()));

        let start = Instant::now();
        let mut times = Vec::new();
        let mut stopwatch = Stopwatch::new(&self.gpu, plan.passes.len());
        for k in 0..view.samples {
            let (jitter, sun_point) = sample_point(k, view.samples);
            let uniform = crate::layout::StageUniform {
                jitter,
                sun_point,
                sample_share: 1.0 / view.samples as f32,
                ..set.uniform
            };
            if let Some(Physical::Buffer(buffer)) = globals.get("stage") {
                self.gpu
                    .queue
                    .write_buffer(buffer, 0, bytemuck::bytes_of(&uniform));
            }
            let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
            for name in [names::PICTURE, names::MISSING] {
                if let (0, Some(Physical::Buffer(buffer))) = (k, globals.get(name)) {
                    encoder.clear_buffer(buffer, 0, None);
                }
            }
            let due = |cadence| match cadence {
                Cadence::Scene => k == 0 && (new_scene || new_heights),
                Cadence::Frame => k == 0,
                Cadence::Sample => true,
            };
            self.executor.record(
                &self.gpu,
                &passes.graph,
                &plan,
                &physical,
                &globals,
                &settings.switches,
                due,
                &mut encoder,
                stopwatch.as_mut(),
            )?;
            self.gpu.queue.submit([encoder.finish()]);
            if let Some(stopwatch) = &mut stopwatch {
                stopwatch.read(&self.gpu, &mut times);
            }
            if let Some(why) = self.gpu.take_error() {
                return Err(failed(why));
            }
            if !progress((k + 1) as f32 / view.samples as f32) {
                return Err(RenderError::Interrupted);
            }
        }
        let met = match (met, image) {
            (Some(met), _) => Some(self.read_met(&physical, met, view.size)?),
            (None, Some(image)) => {
                self.read_picture(view.size, image)?;
                None
            }
            (None, None) => {
                // Its time counts also where it is not read.
                let _ = self.gpu.device.poll(wgpu::PollType::wait_indefinitely());
                None
            }
        };
        report.rays = u64::from(view.size.x) * u64::from(view.size.y) * u64::from(view.samples);
        report.stages.push(("device", start.elapsed().as_secs_f64()));
        report.stages.append(&mut times);
        if let Some(why) = self.gpu.take_error() {
            return Err(failed(why));
        }
        Ok(Drawn { report, met })
    }

    /// Brings a frame to the device; whether the buffer of heights is another one than before.
    fn upload(&mut self, fixed: &Fixed, set: &Set, frame: &Frame, new_scene: bool) -> (Globals, bool) {
        use wgpu::BufferUsages as Usage;
        let gpu = &self.gpu;
        let mut globals = Globals::new();
        let facts = &set.facts;
        let storage = Usage::STORAGE;
        let (uniform, _) = self.uniform.fit(
            gpu,
            "stage",
            size_of::<crate::layout::StageUniform>() as u64,
            Usage::UNIFORM,
        );
        globals.insert("stage", Physical::Buffer(uniform));
        let (heights, new_heights) = self
            .heights
            .fit(gpu, "heights", 4 * facts.height_values(), storage);
        let place = |shape: &crate::facts::FieldShape| 4 * u64::from(shape.heights);
        if let Some(ground) = fixed.ground.as_ref().filter(|_| new_scene || new_heights) {
            let at = place(&facts.fields[1]);
            gpu.queue
                .write_buffer(&heights, at, bytemuck::cast_slice(ground.heights()));
        }
        let at = place(&facts.fields[0]);
        gpu.queue
            .write_buffer(&heights, at, bytemuck::cast_slice(set.water.heights()));
        // The passes that add slopes and pyramids know the same buffer by another name.
        globals.insert("fields", Physical::Buffer(heights.clone()));
        globals.insert(names::HEIGHTS, Physical::Buffer(heights));
        let (tables, new_tables) = self
            .tables
            .fit(gpu, "tables", 4 * fixed.tables.len() as u64, storage);
        if new_scene || new_tables {
            gpu.queue
                .write_buffer(&tables, 0, bytemuck::cast_slice(&fixed.tables));
        }
        globals.insert(names::TABLES, Physical::Buffer(tables));
        if facts.objects > 0 {
            let rows = (set.records.len() + fixed.models.len()).max(1);
            // Records of objects that are left out leave room before the models, whose rows are counted from all of them.
            let base = 6 * u64::from(facts.objects);
            let (solids, new) = self.solids.fit(gpu, "solids", 16 * (base + rows as u64), storage);
            gpu.queue
                .write_buffer(&solids, 0, bytemuck::cast_slice(&set.records));
            if (new_scene || new) && !fixed.models.is_empty() {
                gpu.queue
                    .write_buffer(&solids, 16 * base, bytemuck::cast_slice(&fixed.models));
            }
            globals.insert(names::SOLIDS, Physical::Buffer(solids));
        }
        if let Some(rows) = &set.spray {
            let (spray, _) = self.spray.fit(gpu, "spray", 16 * rows.len() as u64, storage);
            gpu.queue.write_buffer(&spray, 0, bytemuck::cast_slice(rows));
            globals.insert("spray", Physical::Buffer(spray));
        }
        if let Some(foam_grid) = frame.foam.as_ref().filter(|_| facts.foam > 0) {
            let (foam, _) = self.foam.fit(gpu, "foam", 4 * u64::from(facts.foam), storage);
            gpu.queue
                .write_buffer(&foam, 0, bytemuck::cast_slice(foam_grid.as_slice()));
            globals.insert("foam", Physical::Buffer(foam));
        }
        self.map_size = facts.caustics.map(|sizes| sizes.map);
        if let Some(sizes) = facts.caustics {
            let bytes = 4 * u64::from(sizes.map[0]) * u64::from(sizes.map[1]);
            let (map, _) = self
                .map
                .fit(gpu, "light on the ground", bytes, storage | Usage::COPY_SRC);
            globals.insert(names::MAP, Physical::Buffer(map));
        }
        if !set.meshes.is_empty() {
            let (meshes, _) = self
                .meshes
                .fit(gpu, "meshes", 16 * set.meshes.len() as u64, storage);
            gpu.queue
                .write_buffer(&meshes, 0, bytemuck::cast_slice(&set.meshes));
            globals.insert(names::MESHES, Physical::Buffer(meshes));
        }
        if let Some(field) = &set.voxels {
            let (voxels, _) = self
                .voxels
                .fit(gpu, "voxels", 8 * field.values.len() as u64, storage);
            gpu.queue
                .write_buffer(&voxels, 0, bytemuck::cast_slice(&field.values));
            globals.insert(names::VOXELS, Physical::Buffer(voxels));
            let (place, _) = self.voxel_box.fit(gpu, "voxel box", 32, Usage::UNIFORM);
            gpu.queue
                .write_buffer(&place, 0, bytemuck::bytes_of(&field.place));
            globals.insert("voxel_box", Physical::Buffer(place));
        }
        let (missing, _) = self.missing.fit(gpu, "missing", 16, storage | Usage::COPY_SRC);
        globals.insert(names::MISSING, Physical::Buffer(missing));
        let pixels = u64::from(facts.size[0]) * u64::from(facts.size[1]);
        let (picture, _) = self
            .picture
            .fit(gpu, "picture", 16 * pixels, storage | Usage::COPY_SRC);
        globals.insert(names::PICTURE, Physical::Buffer(picture));
        if facts.sky.is_some() {
            let (_, view) = self.sky.get_or_insert_with(|| sky_texture(gpu, fixed));
            globals.insert(names::SKY, Physical::Texture(view.clone()));
        }
        (globals, new_heights)
    }

    fn read_picture(&mut self, size: UVec2, image: &mut Image) -> Result<(), RenderError> {
        let bytes = 16 * u64::from(size.x) * u64::from(size.y);
        let whole = bytes + 16;
        let (readable, _) = self
            .readable
            .fit(&self.gpu, "readable", whole, wgpu::BufferUsages::MAP_READ);
        let (Some(picture), Some(missing)) = (&self.picture.buffer, &self.missing.buffer) else {
            return Err(failed("no picture"));
        };
        let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
        encoder.copy_buffer_to_buffer(picture, 0, &readable, 0, bytes);
        encoder.copy_buffer_to_buffer(missing, 0, &readable, bytes, 16);
        self.gpu.queue.submit([encoder.finish()]);
        let read =
            read_buffer(&self.gpu, &readable, whole).ok_or_else(|| failed("the picture cannot be read"))?;
        let (read, counts) = read.split_at(bytes as usize);
        self.counts = bytemuck::pod_read_unaligned(counts);
        image.size = size;
        image.pixels.clear();
        image.pixels.extend(
            read.chunks_exact(16)
                .map(bytemuck::pod_read_unaligned::<[f32; 4]>)
                .map(|[r, g, b, _]| Vec3::new(r, g, b)),
        );
        Ok(())
    }

    fn read_met(
        &mut self,
        physical: &HashMap<ResourceId, Physical>,
        met: [ResourceId; 2],
        size: UVec2,
    ) -> Result<[Vec<Vec4>; 2], RenderError> {
        let mut out = [Vec::new(), Vec::new()];
        // Rows in a buffer stand at multiples of 256 bytes.
        let row = (16 * u64::from(size.x)).next_multiple_of(256);
        let bytes = row * u64::from(size.y);
        for (id, out) in met.into_iter().zip(&mut out) {
            let Some(Physical::Texture(view)) = physical.get(&id) else {
                return Err(failed("no places were drawn"));
            };
            let (readable, _) = self
                .readable
                .fit(&self.gpu, "readable", bytes, wgpu::BufferUsages::MAP_READ);
            let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
            encoder.copy_texture_to_buffer(
                view.texture().as_image_copy(),
                wgpu::TexelCopyBufferInfo {
                    buffer: &readable,
                    layout: wgpu::TexelCopyBufferLayout {
                        offset: 0,
                        bytes_per_row: u32::try_from(row).ok(),
                        rows_per_image: None,
                    },
                },
                wgpu::Extent3d {
                    width: size.x,
                    height: size.y,
                    depth_or_array_layers: 1,
                },
            );
            self.gpu.queue.submit([encoder.finish()]);
            let read =
                read_buffer(&self.gpu, &readable, bytes).ok_or_else(|| failed("places cannot be read"))?;
            out.extend(read.chunks_exact(row as usize).flat_map(|line| {
                line[..16 * size.x as usize]
                    .chunks_exact(16)
                    .map(|p| Vec4::from(bytemuck::pod_read_unaligned::<[f32; 4]>(p)))
            }));
        }
        Ok(out)
    }
}

/// The sky's picture and its halvings in half precision.
fn sky_texture(gpu: &Gpu, fixed: &Fixed) -> (wgpu::Texture, wgpu::TextureView) {
    let levels = fixed.light.sky.parts().levels;
    let (width, height) = levels
        .first()
        .map_or((1, 1), |l| (l.width as u32, l.height as u32));
    let texture = gpu.device.create_texture(&wgpu::TextureDescriptor {
        label: Some("sky"),
        size: wgpu::Extent3d {
            width,
            height,
            depth_or_array_layers: 1,
        },
        mip_level_count: levels.len().max(1) as u32,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: wgpu::TextureFormat::Rgba16Float,
        usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
        view_formats: &[],
    });
    for (k, level) in levels.iter().enumerate() {
        let texels: Vec<[half::f16; 4]> = level
            .pixels
            .iter()
            .map(|p| [p.x, p.y, p.z, 1.0].map(half::f16::from_f32))
            .collect();
        let bits: Vec<u16> = texels.iter().flatten().map(|v| v.to_bits()).collect();
        gpu.queue.write_texture(
            wgpu::TexelCopyTextureInfo {
                mip_level: k as u32,
                ..texture.as_image_copy()
            },
            bytemuck::cast_slice(&bits),
            wgpu::TexelCopyBufferLayout {
                offset: 0,
                bytes_per_row: Some(8 * level.width as u32),
                rows_per_image: None,
            },
            wgpu::Extent3d {
                width: level.width as u32,
                height: level.height as u32,
                depth_or_array_layers: 1,
            },
        );
    }
    let view = texture.create_view(&Default::default());
    (texture, view)
}

impl Renderer for GpuRenderer {
    fn name(&self) -> &'static str {
        self.settings.technique.name()
    }

    fn needs(&self, scene: &Scene) -> Channels {
        stage::needs(scene)
    }

    fn plan(&self, scene: &Scene, size: UVec2) -> Vec<PlanItem> {
        crate::planned::items(scene, size, &self.settings)
    }

    fn render(
        &mut self,
        scene: &Scene,
        frame: &Frame,
        view: &View,
        image: &mut Image,
        progress: &(dyn Fn(f32) -> bool + Sync),
    ) -> Result<RenderReport, RenderError> {
        Ok(self
            .draw(scene, frame, view, Some(image), false, progress)?
            .report)
    }
}

/// A renderer with the defaults of a technique.
impl From<Technique> for GpuRenderer {
    fn from(technique: Technique) -> Self {
        Self::new(Settings::new(technique))
    }
}

/// The passes that a plan keeps, by name.
pub fn pass_names(passes: &Passes, plan: &Plan) -> Vec<&'static str> {
    plan.passes
        .iter()
        .map(|&k| passes.graph.passes()[k].name)
        .collect()
}
