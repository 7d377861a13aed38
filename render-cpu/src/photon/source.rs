//! Where photons start: sun and sky, aimed at a rectangle around the mapped floor.

use crate::stage::light::Disc;
use crate::stage::world::World;
use glam::{DVec2, DVec3, Vec3};
use meniscus_sim::GridSpec;
use meniscus_sim::rng::Rng;
use std::f64::consts::{PI, TAU};

/// Largest tangent from the vertical that the rim of the rectangle makes room for.
const WIDEST: f64 = 3.0;
/// Largest margin of the rectangle, in extents of the map.
const MOST_MARGIN: f64 = 2.0;
/// Streams of the random generator: one for each photon of each source.
const SUN: u64 = 0x7375_6e00_0000_0000;
const SKY: u64 = 0x736b_7900_0000_0000;

/// Which light.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    Sun,
    Sky,
}

/// A light as photons: a lattice over a level rectangle, one photon at a random point of each of its meshes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Source {
    kind: Kind,
    seed: u64,
    /// Corner and extent of the rectangle at `level`, metres.
    low: DVec2,
    extent: DVec2,
    level: f64,
    /// Height above everything, from where photons come down.
    top: f64,
    columns: u64,
    rows: u64,
}

/// A photon as it starts.
#[derive(Clone, Copy, Debug)]
pub(super) struct Start {
    pub(super) origin: DVec3,
    pub(super) direction: DVec3,
    pub(super) flux: DVec3,
    pub(super) rng: Rng,
}

impl Source {
    /// About `photons` of them for the floor of `map`; `None` if that light does not shine.
    pub(super) fn new(
        kind: Kind,
        photons: u64,
        seed: u64,
        world: &World<'_>,
        map: &GridSpec,
    ) -> Option<Self> {
        let water = world.water.range();
        let level = 0.5 * (water.0 + water.1);
        // Tangents from the vertical, of light above and below the surface.
        let (above, below) = match kind {
            Kind::Sun => {
                let sun = world.light.sun.filter(|s| s.direction.y > 0.0)?;
                let sin = f64::from(sun.direction.y.acos() + sun.radius).min(0.5 * PI).sin();
                let bent = sin / f64::from(world.index.max(1.0));
                (tan_of(sin), tan_of(bent))
            }
            Kind::Sky => (WIDEST, tan_of(1.0 / f64::from(world.index.max(1.0)))),
        };
        let bend = f64::from(world.water.steepest()) * (1.0 - 1.0 / f64::from(world.index.max(1.0)));
        let depth = world.ground.map_or(0.0, |g| (level - g.range().0).max(0.0));
        let size = map.size.as_dvec2() * f64::from(map.spacing);
        let crest = 0.5 * (water.1 - water.0) * above.min(WIDEST);
        let most = MOST_MARGIN * size.max_element();
        let open = (crest + depth * (below + bend).min(WIDEST)).min(most);
        // What falls beyond a solid wall stays there; only what flies over a crest is aimed beyond it.
        let margin = |axis: usize, outwards: f64| {
            let walled = world
                .edges
                .sides
                .iter()
                .any(|s| s.axis == axis && s.outwards == outwards && !s.glass);
            if walled { crest.min(most) } else { open }
        };
        let before = DVec2::new(margin(0, -1.0), margin(2, -1.0));
        let behind = DVec2::new(margin(0, 1.0), margin(2, 1.0));
        let low = map.origin.as_dvec2() - 0.5 * f64::from(map.spacing) - before;
        let extent = size + before + behind;
        let mut top = water.1.max(world.edges.deck);
        if let Some(ground) = world.ground {
            top = top.max(ground.range().1);
        }
        for object in &world.objects {
            top = top.max(object.top());
        }
        let columns = (photons.max(1) as f64 * extent.x / extent.y)
            .sqrt()
            .ceil()
            .max(1.0) as u64;
        Some(Self {
            kind,
            seed,
            low,
            extent,
            level,
            top: top + 1e3 * world.hair,
            columns,
            rows: photons.div_ceil(columns).max(1),
        })
    }

    /// Photons that there are.
    pub(super) fn len(&self) -> u64 {
        self.columns * self.rows
    }

    /// Photons a square metre of the rectangle.
    pub(super) fn density(&self) -> f64 {
        self.len() as f64 / (self.extent.x * self.extent.y)
    }

    /// Photon number `k`; `None` if it would come from below the horizon.
    pub(super) fn start(&self, k: u64, world: &World<'_>) -> Option<Start> {
        let stream = match self.kind {
            Kind::Sun => SUN,
            Kind::Sky => SKY,
        };
        let mut rng = Rng::new(self.seed, stream + k);
        let cell = DVec2::new((k % self.columns) as f64, (k / self.columns) as f64);
        let jitter = DVec2::new(rng.uniform(), rng.uniform());
        let at = self.low + (cell + jitter) / DVec2::new(self.columns as f64, self.rows as f64) * self.extent;
        let each = self.extent.x * self.extent.y / self.len() as f64;
        let (towards, flux) = match self.kind {
            Kind::Sun => {
                let sun = world.light.sun?;
                let towards = sun.sample([rng.uniform_f32(), rng.uniform_f32()]);
                // The whole disc is as bright as its middle: what each point sends falls with its own height.
                (towards, sun.irradiance * towards.y)
            }
            Kind::Sky => {
                // Density cosθ/π over the upper hemisphere.
                let (square, turn) = (rng.uniform(), TAU * rng.uniform());
                let across = square.sqrt();
                let towards = DVec3::new(across * turn.cos(), (1.0 - square).sqrt(), across * turn.sin());
                let towards = towards.as_vec3();
                (
                    towards,
                    world.light.sky.radiance(towards, 0.0) * std::f32::consts::PI,
                )
            }
        };
        let direction = -towards.as_dvec3().normalize();
        if direction.y > -1e-4 || flux == Vec3::ZERO {
            return None;
        }
        let target = DVec3::new(at.x, self.level, at.y);
        Some(Start {
            origin: target + direction * ((self.top - self.level) / direction.y),
            direction,
            flux: flux.as_dvec3() * each,
            rng,
        })
    }
}

fn tan_of(sin: f64) -> f64 {
    sin / (1.0 - sin * sin).max(1e-6).sqrt()
}
