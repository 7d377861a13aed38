//! The reflection of a horizon in waves, after Stuetzle, Warner & Mayer, *Reflection of a Horizon Image on the Surface of
//! Water*: water in a room of pictures over a floor, reflected picture and floor mixed.
//!
//! | What | How |
//! |---|---|
//! | water | exact hit on the bilinear patches of the frame; vertex normals blended in one of three ways ([`normals`]) |
//! | horizon | the sky's picture on four walls and above them, as it is seen from the middle of the water ([`room`]) |
//! | floor | the scene's ground, or a level one, in the light that comes through still water |
//! | mix | Fresnel's shares, or a fixed one as in the paper |
//! | waves before waves | rays are followed until their share is too small to see |
//!
//! What the paper lists as faults of its program does not arise: every direction meets a picture, so that waves that face
//! the eye reflect something; pictures have any size and are read between the middles of their pixels, so that the
//! backdrop does not shift; meshes and images have any shape; and rays pass over cells that they cannot meet by the
//! caster of the other renderers.

mod normals;
mod room;
mod tracer;

use crate::caster::Ray;
use crate::stage::pixel::Pixel;
use crate::stage::{Stage, tiles};
use crate::whitted;
use glam::{UVec2, Vec3};
use meniscus_sim::Scene;
use meniscus_sim::frame::{Channels, Frame};
use meniscus_sim::render::{Image, PlanItem, RenderError, RenderReport, Renderer, View};
use normals::Normals;
use room::Room;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Instant;
use tracer::Tracer;

/// The `horizon` renderer. What it does differently from scene to scene is said by the scene's table `[horizon]`.
#[derive(Debug, Default)]
pub struct HorizonRenderer {
    stage: Stage,
}

impl HorizonRenderer {
    /// Name on the command line.
    pub const NAME: &'static str = "horizon";
}

impl Renderer for HorizonRenderer {
    fn name(&self) -> &'static str {
        Self::NAME
    }

    fn needs(&self, scene: &Scene) -> Channels {
        // Foam and droplets are not part of it.
        crate::stage::needs(scene) - (Channels::FOAM | Channels::DROPLETS)
    }

    fn plan(&self, scene: &Scene, size: UVec2) -> Vec<PlanItem> {
        let mut items = whitted::plan::without_caustics(scene, size, None);
        let unknown = ["haze", "foam", "droplets", "scattering in the water"];
        items.retain(|item| !unknown.contains(&item.name.as_str()));
        items.push(PlanItem {
            name: "vertex normals".to_owned(),
            active: true,
            reason: "blended between the vertices of the mesh".to_owned(),
            bytes: 12 * scene.grid.len() as u64,
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
        let look = scene.description.horizon.clone().unwrap_or_default();
        let seed = scene.description.seed;
        let mut report = RenderReport::default();
        self.stage.with(scene, frame, view, &mut report, |set, report| {
            let start = Instant::now();
            let periodic = crate::stage::surroundings::water_continuation(scene).periodic;
            let normals = Normals::new(set.heights, look.normals, periodic);
            let room = Room::new(scene, &look, set.lens.eye);
            report
                .stages
                .push(("vertex normals", start.elapsed().as_secs_f64()));

            let start = Instant::now();
            let rays = AtomicU64::new(0);
            image.size = view.size;
            let samples = view.samples;
            let spread = (0.5 * set.lens.pixel_angle / f64::from(samples).sqrt()) as f32;
            tiles::render(
                view.size,
                progress,
                || Tracer::new(&set.world, &room, &normals, &look),
                |tracer, x, y| {
                    let mut sum = Vec3::ZERO;
                    let pixel = Pixel::new(seed, x, y, samples);
                    for k in 0..samples {
                        let (at, _) = pixel.sample(k);
                        let direction = set.lens.direction(f64::from(x) + at[0], f64::from(y) + at[1]);
                        let ray = Ray {
                            origin: set.lens.eye,
                            direction,
                        };
                        sum += tracer.radiance(&ray, set.medium, spread);
                    }
                    sum / samples as f32
                },
                |tracer| {
                    rays.fetch_add(tracer.rays, Ordering::Relaxed);
                },
                &mut image.pixels,
            )?;
            report.rays = rays.into_inner();
            report.stages.push(("rays", start.elapsed().as_secs_f64()));
            Ok(())
        })?;
        Ok(report)
    }
}
