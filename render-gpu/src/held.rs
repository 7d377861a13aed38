//! All that lives on one device, and how it draws.

use crate::device::Gpu;
use crate::executor::{ExecuteError, Executor, Globals, Physical, Stopwatch, read_buffer};
use crate::fixed::Fixed;
use crate::foreign::Foreign;
use crate::graph::{GraphError, Plan, ResourceId};
use crate::layout::StageUniform;
use crate::limits::check_limits;
use crate::set::Set;
use crate::settings::Settings;
use crate::techniques::{self, Passes, names};
use crate::upload::Uploaded;
use crate::work::Cadence;
use meniscus_sim::glam::{UVec2, Vec3, Vec4};
use meniscus_sim::render::{RenderError, RenderReport, View};
use meniscus_sim::{Frame, Scene, stage};
use std::collections::HashMap;
use std::sync::Arc;
use std::time::Instant;

/// What is wanted of a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Wanted {
    Picture,
    /// The same, left on the device.
    Resident,
    /// First and refracted place of every pixel.
    Places,
    /// Reversed depth of every pixel.
    Depth,
}

/// One frame to be drawn.
#[derive(Clone, Copy)]
pub(crate) struct Order<'a> {
    pub(crate) scene: &'a Scene,
    pub(crate) frame: &'a Frame,
    pub(crate) view: &'a View,
    pub(crate) foreign: Option<&'a Foreign>,
    pub(crate) wanted: Wanted,
    pub(crate) progress: &'a (dyn Fn(f32) -> bool + Sync),
}

/// What came of it.
pub(crate) struct Drawn {
    pub(crate) report: RenderReport,
    pub(crate) read: Read,
}

/// What was wanted.
pub(crate) enum Read {
    Picture(Vec<Vec3>),
    Resident,
    Places([Vec<Vec4>; 2]),
    Depth(Vec<f32>),
}

/// See the module.
#[derive(Debug)]
pub(crate) struct Held {
    pub(crate) gpu: Arc<Gpu>,
    pub(crate) executor: Executor,
    pub(crate) fixed: Option<Fixed>,
    pub(crate) uploaded: Uploaded,
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

/// Passes with what is to be kept to the end.
struct Planned {
    passes: Passes,
    plan: Plan,
    settings: Settings,
}

impl Held {
    pub(crate) fn open() -> Result<Self, RenderError> {
        let gpu = Gpu::open().map_err(|error| RenderError::Unsupported {
            what: error.to_string(),
            remedy: "use `whitted`, or see `meniscus renderers`".to_owned(),
        })?;
        Ok(Self::on(Arc::new(gpu)))
    }

    /// On a device that is open.
    pub(crate) fn on(gpu: Arc<Gpu>) -> Self {
        Self {
            gpu,
            executor: Executor::default(),
            fixed: None,
            uploaded: Uploaded::default(),
        }
    }

    pub(crate) fn draw(&mut self, order: &Order<'_>, settings: &Settings) -> Result<Drawn, RenderError> {
        let mut report = RenderReport {
            device: Some(self.gpu.description.name.clone()),
            ..RenderReport::default()
        };
        let start = Instant::now();
        let scene = order.scene.at(order.frame.time);
        let order = &Order {
            scene: &scene,
            ..*order
        };
        let fingerprint = stage::fingerprint(&scene);
        let known = self.fixed.take().filter(|f| f.fingerprint == fingerprint);
        let new_scene = known.is_none();
        let fixed = known.unwrap_or_else(|| Fixed::new(&scene, fingerprint));
        report.stages.push(("scene", start.elapsed().as_secs_f64()));
        let read = self.draw_scene(order, &fixed, new_scene, settings, &mut report)?;
        // Not after an error: what is on the device may then be half of a scene.
        self.fixed = Some(fixed);
        Ok(Drawn { report, read })
    }

    fn draw_scene(
        &mut self,
        order: &Order<'_>,
        fixed: &Fixed,
        new_scene: bool,
        settings: &Settings,
        report: &mut RenderReport,
    ) -> Result<Read, RenderError> {
        let view = order.view;
        let start = Instant::now();
        let set = Set::new(order, fixed, settings)?;
        check_limits(&self.gpu, &set.facts)?;
        let mut settings = *settings;
        // Samples of one pixel have no one place.
        settings.switches.multisampled &= matches!(order.wanted, Wanted::Picture | Wanted::Resident);
        let passes = techniques::passes(&set.facts, &settings);
        let plan = passes.graph.plan(&match order.wanted {
            Wanted::Picture | Wanted::Resident => vec![passes.picture],
            Wanted::Places => passes.met.to_vec(),
            Wanted::Depth => vec![passes.depth],
        })?;
        let planned = Planned {
            passes,
            plan,
            settings,
        };
        report.stages.push(("frame", start.elapsed().as_secs_f64()));
        if !(order.progress)(0.0) {
            return Err(RenderError::Interrupted);
        }

        let start = Instant::now();
        let (globals, new_ground) =
            self.uploaded
                .bring(&self.gpu, fixed, &set, order.frame, settings.walk, new_scene);
        let physical = self.executor.prepare(&self.gpu, &planned.plan);
        report.stages.push(("upload", start.elapsed().as_secs_f64()));

        let start = Instant::now();
        let mut times = Vec::new();
        self.run(
            order,
            &planned,
            &set.uniform,
            &globals,
            &physical,
            new_ground,
            &mut times,
        )?;
        let texture = |id| match physical.get(&id) {
            Some(Physical::Texture(view)) => Ok(view.texture()),
            _ => Err(failed("what was wanted was not drawn")),
        };
        let passes = &planned.passes;
        let read = match order.wanted {
            Wanted::Picture => Read::Picture(self.read_picture(view.size)?),
            Wanted::Resident => {
                // Its time counts also where it is not read.
                let _ = self.gpu.device.poll(wgpu::PollType::wait_indefinitely());
                Read::Resident
            }
            Wanted::Places => {
                let [first, refracted] = passes.met;
                let places = |held: &mut Self, id| {
                    let texels = held.read_texture(texture(id)?, view.size, 16)?;
                    Ok::<_, RenderError>(texels.chunks_exact(16).map(four).collect())
                };
                Read::Places([places(self, first)?, places(self, refracted)?])
            }
            Wanted::Depth => {
                let texels = self.read_texture(texture(passes.depth)?, view.size, 4)?;
                Read::Depth(texels.chunks_exact(4).map(bytemuck::pod_read_unaligned).collect())
            }
        };
        report.rays = u64::from(view.size.x) * u64::from(view.size.y) * u64::from(view.samples);
        report.stages.push(("device", start.elapsed().as_secs_f64()));
        report.stages.append(&mut times);
        match self.gpu.take_error() {
            Some(why) => Err(failed(why)),
            None => Ok(read),
        }
    }

    /// Runs the passes, once for every sample.
    #[allow(clippy::too_many_arguments)]
    fn run(
        &mut self,
        order: &Order<'_>,
        planned: &Planned,
        uniform: &StageUniform,
        globals: &Globals,
        physical: &HashMap<ResourceId, Physical>,
        new_ground: bool,
        times: &mut Vec<(&'static str, f64)>,
    ) -> Result<(), RenderError> {
        let samples = order.view.samples;
        let mut stopwatch = Stopwatch::new(&self.gpu, planned.plan.passes.len());
        for k in 0..samples {
            let (jitter, sun_point) = sample_point(k, samples);
            let uniform = StageUniform {
                jitter,
                sun_point,
                sample_share: 1.0 / samples as f32,
                ..*uniform
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
                Cadence::Scene => k == 0 && new_ground,
                Cadence::Frame => k == 0,
                Cadence::Sample => true,
            };
            self.executor.record(
                &self.gpu,
                &planned.passes.graph,
                &planned.plan,
                physical,
                globals,
                &planned.settings.switches,
                due,
                &mut encoder,
                stopwatch.as_mut(),
            )?;
            self.gpu.queue.submit([encoder.finish()]);
            if let Some(stopwatch) = &mut stopwatch {
                stopwatch.read(&self.gpu, times);
            }
            if let Some(why) = self.gpu.take_error() {
                return Err(failed(why));
            }
            if !(order.progress)((k + 1) as f32 / samples as f32) {
                return Err(RenderError::Interrupted);
            }
        }
        Ok(())
    }

    fn readable(&mut self, bytes: u64) -> wgpu::Buffer {
        let usage = wgpu::BufferUsages::MAP_READ;
        self.uploaded.buffers.fit(&self.gpu, "readable", bytes, usage).0
    }

    /// The first bytes of a buffer that is held; `None` if it is not, or the device was lost.
    pub(crate) fn read_held(&mut self, name: &'static str, bytes: u64) -> Option<Vec<u8>> {
        let readable = self.readable(bytes);
        let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
        let buffer = self.uploaded.buffers.get(name)?;
        encoder.copy_buffer_to_buffer(buffer, 0, &readable, 0, bytes);
        self.gpu.queue.submit([encoder.finish()]);
        read_buffer(&self.gpu, &readable, bytes)
    }

    fn read_picture(&mut self, size: UVec2) -> Result<Vec<Vec3>, RenderError> {
        let bytes = 16 * u64::from(size.x) * u64::from(size.y);
        let read = self
            .read_held(names::PICTURE, bytes)
            .ok_or_else(|| failed("the picture cannot be read"))?;
        Ok(read.chunks_exact(16).map(|p| four(p).truncate()).collect())
    }

    /// The texels of a texture, of `texel` bytes each.
    fn read_texture(
        &mut self,
        texture: &wgpu::Texture,
        size: UVec2,
        texel: u32,
    ) -> Result<Vec<u8>, RenderError> {
        // Rows in a buffer stand at multiples of 256 bytes.
        let (line, row) = (texel * size.x, (texel * size.x).next_multiple_of(256));
        let bytes = u64::from(row) * u64::from(size.y);
        let readable = self.readable(bytes);
        let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
        encoder.copy_texture_to_buffer(
            texture.as_image_copy(),
            wgpu::TexelCopyBufferInfo {
                buffer: &readable,
                layout: wgpu::TexelCopyBufferLayout {
                    offset: 0,
                    bytes_per_row: Some(row),
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
            read_buffer(&self.gpu, &readable, bytes).ok_or_else(|| failed("a texture cannot be read"))?;
        Ok(read
            .chunks_exact(row as usize)
            .flat_map(|r| &r[..line as usize])
            .copied()
            .collect())
    }
}

fn four(bytes: &[u8]) -> Vec4 {
    Vec4::from(bytemuck::pod_read_unaligned::<[f32; 4]>(bytes))
}
