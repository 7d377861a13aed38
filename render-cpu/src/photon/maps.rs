//! Sending photons out and gathering what they leave behind.

use super::floor::FloorMap;
use super::ledger::Ledger;
use super::source::{Kind, Source};
use super::spots::{Spot, Spots};
use super::tracer::Tracer;
use crate::stage::matt::Matt;
use crate::stage::world::{World, in_plan};
use glam::{DVec3, Vec3};
use meniscus_sim::GridSpec;
use meniscus_sim::render::RenderError;
use rayon::prelude::*;

/// Photons that one task follows.
const CHUNK: u64 = 2048;
/// How often light is sent back in a basin.
const IN_BASINS: u32 = 6;
/// Tasks whose photons are kept before they are added up.
const TASKS: u64 = 32;

/// Light on everything that can be lit through water.
#[derive(Clone, Debug)]
pub struct Maps {
    /// On the ground under water, where the scene has ground.
    pub floor: Option<FloorMap>,
    /// Where the light went.
    pub ledger: Ledger,
    /// Photons sent out.
    pub photons: u64,
    /// Rays cast.
    pub rays: u64,
    spots: Spots,
    /// Whether light that matt surfaces send back was followed.
    sent_back: bool,
    /// Refractive index, squared: from irradiance to basic irradiance.
    index_squared: f32,
}

/// What to send out.
#[derive(Clone, Copy, Debug)]
pub(super) struct Order {
    pub(super) photons: u64,
    pub(super) seed: u64,
    pub(super) sun: bool,
    pub(super) sky: bool,
    pub(super) bounces: Option<u32>,
    pub(super) map: GridSpec,
}

impl Maps {
    /// Follows photons from sun and sky.
    ///
    /// # Errors
    /// [`RenderError::Interrupted`] if `progress` returned `false`.
    pub(super) fn build(
        world: &World<'_>,
        order: &Order,
        progress: &(dyn Fn(f32) -> bool + Sync),
    ) -> Result<Self, RenderError> {
        let mut floor = world.ground.map(|_| FloorMap::new(order.map, world));
        // In a basin light goes to and fro between walls. In open water it comes from far beyond any map: the closed
        // form for still water is nearer to it than photons that were never sent.
        let closed = world.edges.sides.iter().filter(|s| !s.glass).count() == 4;
        let bounces = order.bounces.unwrap_or(if closed { IN_BASINS } else { 0 });
        let mut maps = Self {
            sent_back: bounces > 0,
            floor: None,
            ledger: Ledger::default(),
            photons: 0,
            rays: 0,
            spots: Spots::default(),
            index_squared: world.index * world.index,
        };
        let mut sums = vec![DVec3::ZERO; floor.as_ref().map_or(0, |f| f.spec().len())];
        let mut spots: Vec<Spot> = Vec::new();
        let kinds = [(order.sun, Kind::Sun), (order.sky, Kind::Sky)];
        let sources: Vec<Source> = kinds
            .into_iter()
            .filter(|(on, _)| *on)
            .filter_map(|(_, kind)| Source::new(kind, order.photons, order.seed, world, &order.map))
            .collect();
        let total: u64 = sources.iter().map(Source::len).sum();
        for source in &sources {
            let chunks = source.len().div_ceil(CHUNK);
            for first in (0..chunks).step_by(TASKS as usize) {
                if !progress(maps.photons as f32 / total.max(1) as f32) {
                    return Err(RenderError::Interrupted);
                }
                let tracers: Vec<Tracer<'_>> = (first..(first + TASKS).min(chunks))
                    .into_par_iter()
                    .map(|chunk| {
                        let mut tracer = Tracer {
                            world,
                            floor: floor.as_ref(),
                            bounces,
                            ledger: Ledger::default(),
                            fallen: Vec::new(),
                            spots: Vec::new(),
                            rays: 0,
                        };
                        for k in chunk * CHUNK..((chunk + 1) * CHUNK).min(source.len()) {
                            if let Some(start) = source.start(k, world) {
                                tracer.send(start);
                            }
                        }
                        tracer
                    })
                    .collect();
                // In the order of the photons, whichever thread followed them.
                for tracer in tracers {
                    maps.ledger.add(&tracer.ledger);
                    maps.rays += tracer.rays;
                    for (cell, flux) in tracer.fallen {
                        sums[cell as usize] += flux;
                    }
                    spots.extend(tracer.spots);
                }
                maps.photons += ((first + TASKS) * CHUNK).min(source.len()) - first * CHUNK;
            }
        }
        if let Some(floor) = &mut floor {
            floor.fill(&sums);
        }
        maps.floor = floor;
        if let Some(source) = sources.first() {
            // On average this many photons within the radius: their share of noise falls as the radius shrinks.
            let within = (0.03 * (source.len() as f64).sqrt()).max(16.0);
            let radius = (within / (std::f64::consts::PI * source.density())).sqrt();
            maps.spots = Spots::new(spots, radius);
        }
        Ok(maps)
    }

    /// Whether light that matt surfaces send back into the water is in the maps.
    pub(crate) fn sent_back(&self) -> bool {
        self.sent_back
    }

    /// Basic irradiance of a matt surface under water; `None` where only the light through still water is known.
    pub(crate) fn below(&self, matt: &Matt) -> Option<Vec3> {
        let irradiance = if matt.caustics {
            self.floor.as_ref()?.at(in_plan(matt.position).as_vec2())?
        } else {
            self.spots.irradiance(matt.position, matt.geometric.as_vec3())
        };
        Some(irradiance / self.index_squared)
    }

    /// Irradiance that waves reflect onto a matt surface in air.
    pub(crate) fn above(&self, matt: &Matt) -> Vec3 {
        if matt.caustics {
            Vec3::ZERO
        } else {
            self.spots.irradiance(matt.position, matt.geometric.as_vec3())
        }
    }
}
