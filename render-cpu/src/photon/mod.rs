//! Photon mapping: light is followed from sun and sky through the water to where it falls, and the picture is seen by
//! the rays of [`whitted`], which read what fell where.
//!
//! | What | How |
//! |---|---|
//! | sun and sky | a stratified lattice of photons over the mapped floor, with room for light that comes in aslant |
//! | water | split once by Fresnel's share, then one of the two ways by chance |
//! | inside the water | Beer–Lambert; light scattered aside counts as absorbed |
//! | ground under water | a map of flux by cell, with the area of each cell that is under water |
//! | walls, objects | single photons, by their density about a point |
//! | matt surfaces | send light back into the water up to [`Settings::bounces`] times |
//!
//! A sun that is nearly a point cannot be met by paths from the eye; here every photon of it arrives. Flux is booked where
//! it enters and where it ends ([`Ledger`]). Photons are numbered, each draws from its own random stream, and what
//! they leave is added up in the order of their numbers: maps do not depend on threads.

mod floor;
mod knobs;
mod ledger;
mod maps;
mod source;
mod spots;
mod tracer;

pub use floor::FloorMap;
pub use ledger::Ledger;
pub use maps::Maps;

use crate::stage::Stage;
use crate::stage::pixel::pass_seed;
use crate::whitted::{self, Drawing};
use glam::UVec2;
use knobs::ROWS;
use maps::Order;
use meniscus_sim::frame::{Channels, Frame};
use meniscus_sim::knobs::{Knob, Turned, list, restore};
use meniscus_sim::render::{Image, PlanItem, RenderError, RenderReport, Renderer, View};
use meniscus_sim::{GridSpec, Scene};
use std::time::Instant;

/// Photons of each light for one sample a pixel.
const PHOTONS_A_SAMPLE: u64 = 1 << 18;
/// Most photons of each light for one picture.
const MOST_PHOTONS: u64 = 1 << 26;
/// Bytes of a cell of the map with its sums, and of a photon that is kept.
const BYTES_A_CELL: u64 = 12 + 4 + 4 + 12 + 24;

/// What is followed, and where it is gathered.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// Photons of each light; `None`, the default, for 2¹⁸ a sample of the picture.
    pub photons: Option<u64>,
    /// Whether sunlight is followed. Default true.
    pub sun: bool,
    /// Whether the sky's light is followed. Default true.
    pub sky: bool,
    /// How often matt surfaces under water send light back. `None`, the default: 6 in a basin. In open water, where
    /// that light comes from beyond any map, none is followed and the closed form for still water stands in.
    pub bounces: Option<u32>,
    /// Cells of the floor's map, centred on its samples; `None`, the default, for those of the frame.
    pub map: Option<GridSpec>,
    /// Distance in metres at which haze leaves 2 % of contrast; `None` for perfectly clear air. Default 150 km.
    pub visual_range: Option<f32>,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            photons: None,
            sun: true,
            sky: true,
            bounces: None,
            map: None,
            visual_range: Some(150_000.0),
        }
    }
}

impl Settings {
    /// Sunlight that arrives straight through the water, and nothing else: what maps of caustics show.
    pub fn caustics(photons: u64) -> Self {
        Self {
            photons: Some(photons),
            sky: false,
            bounces: Some(0),
            ..Self::default()
        }
    }
}

/// The `photon` renderer.
#[derive(Debug, Default)]
pub struct PhotonMapper {
    settings: Settings,
    stage: Stage,
}

impl PhotonMapper {
    /// Name on the command line.
    pub const NAME: &'static str = "photon";

    /// A renderer with these settings.
    pub fn new(settings: Settings) -> Self {
        Self {
            settings,
            stage: Stage::default(),
        }
    }

    /// The maps alone. Of the view they depend on `pass` and `samples`, and on whether the eye looks through a glass
    /// side of a basin.
    ///
    /// # Errors
    /// As [`render`](Renderer::render).
    pub fn maps(
        &mut self,
        scene: &Scene,
        frame: &Frame,
        view: &View,
        progress: &(dyn Fn(f32) -> bool + Sync),
    ) -> Result<Maps, RenderError> {
        let order = self.order(scene, view);
        let mut report = RenderReport::default();
        self.stage.with(scene, frame, view, &mut report, |set, _| {
            Maps::build(&set.world, &order, progress)
        })
    }

    fn order(&self, scene: &Scene, view: &View) -> Order {
        let settings = &self.settings;
        let photons = settings
            .photons
            .unwrap_or(PHOTONS_A_SAMPLE * u64::from(view.samples));
        Order {
            photons: photons.clamp(1, MOST_PHOTONS),
            seed: pass_seed(scene, view),
            sun: settings.sun,
            sky: settings.sky,
            bounces: settings.bounces,
            map: settings.map.unwrap_or(scene.grid),
        }
    }
}

impl Renderer for PhotonMapper {
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
        let mut items = whitted::plan::without_caustics(scene, size, self.settings.visual_range);
        let cells = self.settings.map.unwrap_or(scene.grid).len() as u64;
        let ground = scene.terrain.is_some();
        items.push(PlanItem {
            name: "light on the floor".to_owned(),
            active: ground,
            reason: if ground {
                "the scene has ground"
            } else {
                "the scene has no ground"
            }
            .to_owned(),
            bytes: if ground { BYTES_A_CELL * cells } else { 0 },
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
        let order = self.order(scene, view);
        let eye = whitted::Settings {
            visual_range: self.settings.visual_range,
            ..whitted::Settings::default()
        };
        let mut report = RenderReport::default();
        self.stage.with(scene, frame, view, &mut report, |set, report| {
            let start = Instant::now();
            let maps = Maps::build(&set.world, &order, &|share| progress(0.5 * share))?;
            report.rays += maps.rays;
            report.stages.push(("photons", start.elapsed().as_secs_f64()));
            let drawing = Drawing {
                settings: &eye,
                seed: order.seed,
                photons: Some(&maps),
            };
            drawing.draw(set, view, image, &|share| progress(0.5 + 0.5 * share), report)
        })?;
        Ok(report)
    }
}
