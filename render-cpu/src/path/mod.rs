//! Path tracing: the mean over random paths of light, without bias.
//!
//! | What | How |
//! |---|---|
//! | water | one of reflection and refraction, chosen by Fresnel's share, as often as a path meets it |
//! | sun on things in air | a shadow ray to a random point of its disc |
//! | sun through waves | every way that it can take is solved for ([`manifold`]); other ways by chance |
//! | sky | rays that leave, and directions chosen by its light ([`dome`]), weighted by the balance heuristic |
//! | water body | absorption on every way; the first way through water also scatters once (isotropic by the similarity relation) |
//! | models with a gloss | GGX over a matt base, chosen and looked at from both sides ([`scatter`]) |
//! | droplets | reflection and refraction inside and out, as often as it takes |
//! | air | the haze of [`whitted`](crate::whitted) |
//!
//! It draws the same stage as `whitted`, so that what differs is the light alone. Light is traced in basic radiance (see
//! the stage's light): interfaces pass it on without the factor n².

mod dome;
mod knobs;
mod manifold;
mod scatter;
mod tracer;

use crate::caster::Ray;
use crate::stage::Stage;
use crate::stage::pixel::{Pixel, pass_seed};
use crate::stage::tiles;
use dome::Dome;
use glam::{UVec2, Vec3};
use knobs::ROWS;
use meniscus_sim::Scene;
use meniscus_sim::frame::{Channels, Frame};
use meniscus_sim::knobs::{Knob, Turned, list, restore};
use meniscus_sim::render::{Image, PlanItem, RenderError, RenderReport, Renderer, View};
use meniscus_sim::rng::Rng;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Instant;
use tracer::{Start, Tracer};

/// How sunlight is found that reaches things under water through waves.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum SunThroughWaves {
    /// Solved for: hardly any noise.
    #[default]
    Solved,
    /// Left to rays that happen to meet the sun: nothing assumed, and noise for as good as ever unless the sun is large.
    Chance,
}

/// What the renderer does, beyond what the scene says.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// Bounces after which a path is given up; what is lost by that is far below rounding, since paths end by
    /// chance long before. Default 256.
    pub most_bounces: u32,
    /// Distance in metres at which haze leaves 2 % of contrast; `None` for perfectly clear air. Default 150 km, as `whitted`.
    pub visual_range: Option<f32>,
    /// Default [`SunThroughWaves::Solved`].
    pub sun_through_waves: SunThroughWaves,
    /// Whether directions to the sky are also chosen by its light. Default true; without, the same mean with more noise.
    pub aim_at_sky: bool,
    /// Whether matt surfaces shine with their albedo instead of reflecting light, and nothing else shines: the
    /// optics of the water alone, for comparing renderers. Default false.
    pub glow: bool,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            most_bounces: 256,
            visual_range: Some(150_000.0),
            sun_through_waves: SunThroughWaves::Solved,
            aim_at_sky: true,
            glow: false,
        }
    }
}

/// The `path` renderer.
#[derive(Debug, Default)]
pub struct PathTracer {
    settings: Settings,
    stage: Stage,
}

impl PathTracer {
    /// Name on the command line.
    pub const NAME: &'static str = "path";

    /// A renderer with these settings.
    pub fn new(settings: Settings) -> Self {
        Self {
            settings,
            stage: Stage::default(),
        }
    }
}

/// Stream of the random generator that paths draw from, apart from that of the pixels' own points.
const STREAM: u64 = 0x7061_7468;

impl Renderer for PathTracer {
    fn name(&self) -> &'static str {
        Self::NAME
    }

    fn is_random(&self) -> bool {
        true
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
        let mut items = crate::whitted::plan::without_caustics(scene, size, self.settings.visual_range);
        let sun = crate::sky::Sky::new(scene).sun().is_some();
        items.push(PlanItem {
            name: "sun solved for through waves".to_owned(),
            active: sun && self.settings.sun_through_waves == SunThroughWaves::Solved,
            reason: if sun {
                "the scene has a sun"
            } else {
                "the scene has no sun"
            }
            .to_owned(),
            bytes: 0,
        });
        items
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
        let seed = pass_seed(scene, view);
        let settings = &self.settings;
        self.stage.with(scene, frame, view, &mut report, |set, report| {
            let start = Instant::now();
            let world = &set.world;
            let dome = settings.aim_at_sky.then(|| Dome::new(&world.light.sky));
            let manifold = world
                .light
                .sun
                .filter(|_| settings.sun_through_waves == SunThroughWaves::Solved)
                .and_then(|sun| manifold::reach(world.water, sun.direction, world.index))
                .map(|reach| manifold::Manifold { world, reach });
            report.stages.push(("light", start.elapsed().as_secs_f64()));

            let start = Instant::now();
            let rays = AtomicU64::new(0);
            image.size = view.size;
            let samples = view.samples;
            let spread = (0.5 * set.lens.pixel_angle / f64::from(samples).sqrt()) as f32;
            tiles::render(
                view.size,
                progress,
                || 0_u64,
                |count, x, y| {
                    let mut sum = Vec3::ZERO;
                    let pixel = Pixel::new(seed, x, y, samples);
                    for k in 0..samples {
                        let (at, _) = pixel.sample(k);
                        let number = u64::from(y) << 32 | u64::from(x);
                        let mut tracer = Tracer {
                            world,
                            settings,
                            dome: dome.as_ref(),
                            manifold,
                            rng: Rng::new(
                                seed ^ number.wrapping_mul(0x9e37_79b9_7f4a_7c15),
                                STREAM + u64::from(k),
                            ),
                            rays: 0,
                        };
                        let direction = set.lens.direction(f64::from(x) + at[0], f64::from(y) + at[1]);
                        sum += tracer.radiance(&Start {
                            ray: Ray {
                                origin: set.lens.eye,
                                direction,
                            },
                            medium: set.medium,
                            spread,
                        });
                        *count += tracer.rays;
                    }
                    sum / samples as f32
                },
                |count| {
                    rays.fetch_add(count, Ordering::Relaxed);
                },
                &mut image.pixels,
            )?;
            report.rays = rays.into_inner();
            report.stages.push(("paths", start.elapsed().as_secs_f64()));
            Ok(())
        })?;
        Ok(report)
    }
}
