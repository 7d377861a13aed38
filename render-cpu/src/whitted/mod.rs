//! Deterministic ray tracing after Whitted 1980: at every water surface both the reflected and the refracted ray are
//! followed, weighted by Fresnel's equations.
//!
//! | What | How |
//! |---|---|
//! | water | exact hit on the bilinear patches of the frame; smooth normals by splines (`stage/surface.rs`) |
//! | interfaces | both rays to a depth of [`Settings::interface_depth`], then the likelier one; total reflection |
//! | inside the water | Beer–Lambert and light scattered once into the path (`stage/volume.rs`) |
//! | sun | shadow rays to points of its disc; its mirror image as a lobe that widens with the pixel (`stage/light.rs`) |
//! | ground | height map with fractal detail (`stage/ground.rs`), also below the water |
//! | beyond the domain | repeated, continued, or the walls of a basin (`stage/surroundings.rs`) |
//!
//! Sunlight through waves is summed on the ground ([`caustics`]); other light through waves, and sunlight on objects
//! under water, is taken as through flat water.

mod auxiliary;
mod caustics;
mod knobs;
pub(crate) mod plan;
mod shade;
mod trace;

pub use auxiliary::{Auxiliary, AuxiliaryPixel};

use crate::caster::Ray;
use crate::photon::Maps;
use crate::stage::pixel::Pixel;
use crate::stage::{Set, Stage, tiles};
use caustics::Caustics;
use glam::{UVec2, Vec3};
use knobs::ROWS;
use meniscus_sim::Scene;
use meniscus_sim::frame::{Channels, Frame};
use meniscus_sim::knobs::{Knob, Turned, list, restore};
use meniscus_sim::render::{Image, PlanItem, RenderError, RenderReport, Renderer, View};
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Instant;
use trace::{Path, Tracer};

/// What the renderer does, beyond what the scene says.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// Interfaces at which a ray is split into a reflected and a refracted one; 1 is the rule of Baboud & Décoret.
    /// Default 3.
    pub interface_depth: u32,
    /// A branch whose share of the pixel is smaller is left to the other branch. Default 0.002.
    pub cutoff: f32,
    /// Distance in metres at which haze leaves 2 % of contrast; `None` for perfectly clear air. Default 150 km, very clear air.
    pub visual_range: Option<f32>,
    /// Whether waves focus sunlight on the ground. Default true.
    pub caustics: bool,
    /// RMS slope of ripples finer than the surface's grid; widens the mirror image of sun and sky. Default 0.
    pub roughness: f32,
    /// Whether matt surfaces shine with their albedo instead of reflecting light, and nothing else shines: the optics of
    /// the water alone, for comparing renderers. Default false.
    pub glow: bool,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            interface_depth: 3,
            cutoff: 2e-3,
            visual_range: Some(150_000.0),
            caustics: true,
            roughness: 0.0,
            glow: false,
        }
    }
}

/// The `whitted` renderer.
#[derive(Debug, Default)]
pub struct Whitted {
    settings: Settings,
    stage: Stage,
}

impl Whitted {
    /// Name on the command line.
    pub const NAME: &'static str = "whitted";

    /// A renderer with these settings.
    pub fn new(settings: Settings) -> Self {
        Self {
            settings,
            stage: Stage::default(),
        }
    }
}

/// How a picture is traced: what [`Whitted`] and the photon mapper have in common.
pub(crate) struct Drawing<'a> {
    pub(crate) settings: &'a Settings,
    pub(crate) seed: u64,
    /// Light under water from photons, in place of that through still water and its caustics.
    pub(crate) photons: Option<&'a Maps>,
}

impl Drawing<'_> {
    /// Traces every pixel.
    ///
    /// # Errors
    /// [`RenderError::Interrupted`] if `progress` returned `false`.
    pub(crate) fn draw(
        &self,
        set: &Set<'_>,
        view: &View,
        image: &mut Image,
        progress: &(dyn Fn(f32) -> bool + Sync),
        report: &mut RenderReport,
    ) -> Result<(), RenderError> {
        let (settings, world) = (self.settings, &set.world);
        let start = Instant::now();
        let caustics = world
            .ground
            .filter(|_| settings.caustics && self.photons.is_none())
            .and_then(|ground| Caustics::build(set.heights, world.water, ground, world.light, world.index));
        report.stages.push(("caustics", start.elapsed().as_secs_f64()));
        let tracer = Tracer {
            world,
            settings,
            caustics: caustics.as_ref(),
            photons: self.photons,
            sun_point: [0.0; 2],
            rays: 0,
        };
        let start = Instant::now();
        let rays = AtomicU64::new(0);
        image.size = view.size;
        let (lens, samples) = (&set.lens, view.samples);
        let spread = (0.5 * lens.pixel_angle / f64::from(samples).sqrt()) as f32;
        tiles::render(
            view.size,
            progress,
            || tracer,
            |tracer, x, y| {
                let mut sum = Vec3::ZERO;
                let pixel = Pixel::new(self.seed, x, y, samples);
                for k in 0..samples {
                    let (at, sun_point) = pixel.sample(k);
                    tracer.sun_point = sun_point;
                    let direction = lens.direction(f64::from(x) + at[0], f64::from(y) + at[1]);
                    sum += tracer.radiance(Path {
                        ray: Ray {
                            origin: lens.eye,
                            direction,
                        },
                        medium: set.medium,
                        width: 0.0,
                        spread,
                        interfaces: 0,
                        weight: 1.0,
                    });
                }
                sum / samples as f32
            },
            |tracer| {
                rays.fetch_add(tracer.rays, Ordering::Relaxed);
            },
            &mut image.pixels,
        )?;
        report.rays += rays.into_inner();
        report.stages.push(("rays", start.elapsed().as_secs_f64()));
        Ok(())
    }
}

impl Renderer for Whitted {
    fn name(&self) -> &'static str {
        Self::NAME
    }

    fn needs(&self, scene: &Scene) -> Channels {
        crate::stage::needs(scene)
    }

    fn knobs(&self) -> Vec<Knob> {
        list(ROWS, &self.settings)
    }

    fn turn(&mut self, knobs: &Turned) {
        restore(ROWS, &mut self.settings, &Settings::default(), knobs);
    }

    fn plan(&self, scene: &Scene, size: UVec2) -> Vec<PlanItem> {
        plan::plan(scene, size, &self.settings)
    }

    fn render(
        &mut self,
        scene: &Scene,
        frame: &Frame,
        view: &View,
        image: &mut Image,
        progress: &(dyn Fn(f32) -> bool + Sync),
    ) -> Result<RenderReport, RenderError> {
        let mut report = RenderReport::default();
        let drawing = Drawing {
            settings: &self.settings,
            seed: scene.description.seed,
            photons: None,
        };
        self.stage.with(scene, frame, view, &mut report, |set, report| {
            drawing.draw(set, view, image, progress, report)
        })?;
        Ok(report)
    }
}
