//! The renderer: frames in, linear radiance out.

use crate::device::Gpu;
use crate::fixed::Fixed;
use crate::foreign::Foreign;
use crate::graph::Plan;
use crate::held::{Drawn, Held, Order, Read, Wanted};
use crate::settings::{Settings, Technique};
use crate::techniques::{Passes, names};
use crate::uniform::NEAR;
use meniscus_sim::glam::{UVec2, Vec3, Vec4};
use meniscus_sim::knobs::{Knob, Turned};
use meniscus_sim::render::{Image, PlanItem, RenderError, RenderReport, Renderer, View};
use meniscus_sim::stage::Lens;
use meniscus_sim::{Channels, Frame, Scene, stage};
use std::sync::Arc;

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
        let order = Order {
            scene,
            frame,
            view,
            foreign: None,
            wanted: Wanted::Resident,
            progress,
        };
        Ok(self.draw(&order)?.report)
    }

    /// The picture that was drawn last and the device that it is on: linear radiance, four `f32` a pixel, row-major from the
    /// top left.
    pub fn picture(&self) -> Option<(&Arc<Gpu>, &wgpu::Buffer)> {
        let held = self.held.as_ref()?;
        Some((&held.gpu, held.uploaded.buffers.get(names::PICTURE)?))
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
        self.held
            .as_ref()
            .map_or(0, |h| h.uploaded.buffers.bytes() + h.executor.pool_bytes())
    }

    /// Voxel fields built so far: one for all frames in which nothing that they show has moved.
    pub fn voxel_fields(&self) -> u64 {
        self.held.as_ref().map_or(0, |h| h.uploaded.voxel_fields)
    }

    /// Sunlight on the ground under the last picture, relative to flat water, a value a texel of the photon map, row-major;
    /// `None` if it had none.
    pub fn illumination(&mut self) -> Option<(UVec2, Vec<f32>)> {
        let held = self.held.as_mut()?;
        let size = UVec2::from(held.uploaded.map_size?);
        let bytes = 4 * u64::from(size.x) * u64::from(size.y);
        let read = held.read_held(names::MAP, bytes)?;
        let values = read.chunks_exact(4).map(bytemuck::pod_read_unaligned).collect();
        Some((size, values))
    }

    /// Look-ups that rasterised techniques could not answer when they last drew, over all samples: beyond the picture's edge, where
    /// nothing was drawn, and marches that met nothing. Read from the device when asked.
    pub fn missing(&mut self) -> [u32; 3] {
        let read = self.held.as_mut().and_then(|h| h.read_held(names::MISSING, 16));
        read.map_or([0; 3], |counts| bytemuck::pod_read_unaligned(&counts[..12]))
    }

    /// Destroys the device, as a driver may do at any time; for tests of what follows.
    pub fn lose_device(&mut self) {
        if let Some(held) = &self.held {
            held.gpu.device.destroy();
            let _ = held.gpu.device.poll(wgpu::PollType::wait_indefinitely());
        }
    }

    /// Draws with what the caller has drawn from the same view: whichever is nearer is seen.
    ///
    /// # Errors
    /// As [`render`](Renderer::render), and if the layer's size is not that of the view.
    pub fn render_with(
        &mut self,
        scene: &Scene,
        frame: &Frame,
        view: &View,
        foreign: &Foreign,
        image: &mut Image,
    ) -> Result<RenderReport, RenderError> {
        self.draw_picture(scene, frame, view, Some(foreign), image, &|_| true)
    }

    /// Metres from the eye to what each pixel shows first, along the ray through its middle; infinite for the sky. With it callers
    /// draw their own geometry into the picture.
    ///
    /// # Errors
    /// As [`render`](Renderer::render).
    pub fn distances(&mut self, scene: &Scene, frame: &Frame, view: &View) -> Result<Vec<f32>, RenderError> {
        let lens = Lens::new(view)?;
        let near = stage::surroundings::scale(scene) * NEAR;
        let Read::Depth(depths) = self.look(scene, frame, view, Wanted::Depth)? else {
            return Ok(Vec::new());
        };
        let pixel = |k: usize| UVec2::new(k as u32 % view.size.x, k as u32 / view.size.x);
        let along = |k: usize, depth: f32| {
            let at = (pixel(k).as_dvec2() + 0.5) / view.size.as_dvec2();
            let towards = lens.forward + (2.0 * at.x - 1.0) * lens.right + (1.0 - 2.0 * at.y) * lens.up;
            (near / f64::from(depth) * towards.length() / towards.dot(lens.forward)) as f32
        };
        let values = depths.iter().enumerate();
        Ok(values
            .map(|(k, &d)| if d > 0.0 { along(k, d) } else { f32::INFINITY })
            .collect())
    }

    /// What each pixel's ray met, in the places that this technique takes it to be; the measure by which techniques are
    /// scored.
    ///
    /// # Errors
    /// As [`render`](Renderer::render).
    pub fn met(&mut self, scene: &Scene, frame: &Frame, view: &View) -> Result<Vec<MetPixel>, RenderError> {
        let Read::Places([first, refracted]) = self.look(scene, frame, view, Wanted::Places)? else {
            return Ok(Vec::new());
        };
        let anchor = self
            .held
            .as_ref()
            .and_then(|h| h.fixed.as_ref())
            .map(Fixed::anchor);
        let anchor = anchor.unwrap_or_default();
        let world = |p: Vec4| (p.truncate().as_dvec3() + anchor).as_vec3();
        let both = first.into_iter().zip(refracted);
        Ok(both
            .map(|(f, r)| MetPixel {
                water: f.w == 1.0,
                position: (f.w > 0.0).then(|| world(f)),
                refracted: (r.w >= 0.0).then(|| world(r)),
            })
            .collect())
    }

    /// Something else than a picture, through the middle of each pixel.
    fn look(
        &mut self,
        scene: &Scene,
        frame: &Frame,
        view: &View,
        wanted: Wanted,
    ) -> Result<Read, RenderError> {
        let view = View {
            samples: 1,
            ..view.clone()
        };
        let order = Order {
            scene,
            frame,
            view: &view,
            foreign: None,
            wanted,
            progress: &|_| true,
        };
        Ok(self.draw(&order)?.read)
    }

    fn draw_picture(
        &mut self,
        scene: &Scene,
        frame: &Frame,
        view: &View,
        foreign: Option<&Foreign>,
        image: &mut Image,
        progress: &(dyn Fn(f32) -> bool + Sync),
    ) -> Result<RenderReport, RenderError> {
        let drawn = self.draw(&Order {
            scene,
            frame,
            view,
            foreign,
            wanted: Wanted::Picture,
            progress,
        })?;
        if let Read::Picture(pixels) = drawn.read {
            image.size = view.size;
            image.pixels = pixels;
        }
        Ok(drawn.report)
    }

    /// Draws, and once more on a new device if the old one is lost.
    fn draw(&mut self, order: &Order<'_>) -> Result<Drawn, RenderError> {
        for attempt in 0..2 {
            if self.held.as_ref().is_some_and(|h| h.gpu.lost().is_some()) {
                tracing::warn!("the graphics device was lost; a new one is opened");
                self.held = None;
            }
            let mut held = match self.held.take() {
                Some(held) => held,
                None => Held::open()?,
            };
            let drawn = held.draw(order, &self.settings);
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

impl Renderer for GpuRenderer {
    fn name(&self) -> &'static str {
        self.settings.technique.name()
    }

    fn needs(&self, scene: &Scene) -> Channels {
        stage::needs(scene)
    }

    fn knobs(&self) -> Vec<Knob> {
        self.settings.knobs()
    }

    fn turn(&mut self, turned: &Turned) {
        self.settings.restore(turned);
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
        self.draw_picture(scene, frame, view, None, image, progress)
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
