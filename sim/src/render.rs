//! The seam to the renderer crates: what a picture is and what a renderer does.

use crate::frame::{Channels, Frame, NonFiniteFrame};
use crate::knobs::{Knob, Turned};
use crate::scene::Scene;
use glam::{UVec2, Vec3};
use serde::Serialize;

/// A linear-light RGB picture, row-major from the top left. Tone mapping is the caller's.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Image {
    /// Width and height in pixels.
    pub size: UVec2,
    /// Linear radiance, RGB, one a pixel.
    pub pixels: Vec<Vec3>,
}

impl Image {
    /// Largest side of an image in pixels.
    pub const MAX_SIDE: u32 = 16_384;

    /// A black image.
    pub fn new(size: UVec2) -> Self {
        Self {
            size,
            pixels: vec![Vec3::ZERO; size.x as usize * size.y as usize],
        }
    }

    /// The pixel at column `x` and row `y` from the top.
    pub fn pixel(&self, x: u32, y: u32) -> Vec3 {
        self.pixels[y as usize * self.size.x as usize + x as usize]
    }
}

/// From where, at what size and with how many samples a frame is drawn.
#[derive(Clone, Debug, PartialEq)]
pub struct View {
    /// Eye position in metres.
    pub position: Vec3,
    /// Point looked at, metres; different from `position`.
    pub target: Vec3,
    /// Up direction, not parallel to the view.
    pub up: Vec3,
    /// Full vertical angle of view in radians, in (0, π).
    pub vertical_fov: f32,
    /// Image size in pixels, 1 to [`Image::MAX_SIDE`] a side.
    pub size: UVec2,
    /// Samples a pixel, at least 1.
    pub samples: u32,
    /// Number of the pass. A renderer with noise draws other random samples in every pass, so that the mean of several
    /// passes is a picture of as many more samples; others draw the same picture in each.
    pub pass: u32,
}

/// What a rendered picture cost.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct RenderReport {
    /// Rays cast (all kinds).
    pub rays: u64,
    /// Named stages with their seconds, in order: wall time on the processor, and for passes on a graphics adapter the
    /// adapter's own time, where it tells.
    pub stages: Vec<(&'static str, f64)>,
    /// The graphics adapter that drew, where one did.
    pub device: Option<String>,
}

/// Why a picture cannot be drawn.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RenderError {
    /// The frame holds NaN or infinity.
    #[error(transparent)]
    NonFinite(#[from] NonFiniteFrame),
    /// The view is impossible.
    #[error("view: {what}; {remedy}")]
    View {
        /// What is wrong, with its value.
        what: String,
        /// What would be right.
        remedy: &'static str,
    },
    /// Rendering was interrupted by the caller.
    #[error("rendering was interrupted")]
    Interrupted,
    /// This scene cannot be drawn by this renderer.
    #[error("{what}; {remedy}")]
    Unsupported {
        /// What cannot be drawn.
        what: String,
        /// What would be right.
        remedy: String,
    },
}

/// One thing that a renderer would run or keep for a scene, or why it does not (rule 3).
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PlanItem {
    /// Pass, buffer or acceleration structure.
    pub name: String,
    /// Whether it is there.
    pub active: bool,
    /// Why it is there or was left out.
    pub reason: String,
    /// Bytes that it holds (0 when left out).
    pub bytes: u64,
}

/// A method of turning frames into pictures.
pub trait Renderer: Send {
    /// Name as on the command line.
    fn name(&self) -> &'static str;

    /// The optional frame channels that drawing this scene makes use of.
    fn needs(&self, scene: &Scene) -> Channels;

    /// Whether pictures have random noise, so that the mean over [`View::pass`] comes nearer to what is drawn.
    fn is_random(&self) -> bool {
        false
    }

    /// What can be changed while it is looked at, as it is now.
    fn knobs(&self) -> Vec<Knob> {
        Vec::new()
    }

    /// Takes these knobs as they were turned and all others as they are by default, from the next picture on.
    fn turn(&mut self, _: &Turned) {}

    /// What drawing this scene at this size runs and keeps, and what is left out and why.
    fn plan(&self, scene: &Scene, size: UVec2) -> Vec<PlanItem>;

    /// Draws `frame` into `image` (resized to the view). `progress` is called now and then with the share done
    /// (0 to 1), from any thread; returning `false` interrupts.
    ///
    /// # Errors
    /// [`RenderError`]; the image is then unspecified.
    fn render(
        &mut self,
        scene: &Scene,
        frame: &Frame,
        view: &View,
        image: &mut Image,
        progress: &(dyn Fn(f32) -> bool + Sync),
    ) -> Result<RenderReport, RenderError>;
}
