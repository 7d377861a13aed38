//! Deterministic ray tracing after Whitted 1980: at every water surface both the reflected and the refracted ray are
//! followed, weighted by Fresnel's equations.
//!
//! | What | How |
//! |---|---|
//! | water | exact hit on the bilinear patches of the frame; smooth normals by splines ([`surface`]) |
//! | interfaces | both rays to a depth of [`Settings::interface_depth`], then the likelier one; total reflection |
//! | inside the water | Beer–Lambert and light scattered once into the path ([`volume`]) |
//! | sun | shadow rays to points of its disc; its mirror image as a lobe that widens with the pixel ([`light`]) |
//! | ground | height map with fractal detail ([`ground`]), also below the water |
//! | beyond the domain | repeated, continued, or the walls of a basin ([`surroundings`]) |
//!
//! Sunlight through waves is summed on the ground ([`caustics`]); other light through waves, and sunlight on objects
//! under water, is taken as through flat water.

mod auxiliary;
mod caustics;
mod choppy;
mod droplets;
mod ground;
mod light;
mod objects;
mod plan;
mod shade;
mod surface;
mod surroundings;
mod tiles;
mod trace;
mod volume;
mod world;

pub use auxiliary::{Auxiliary, AuxiliaryPixel};

use crate::camera::Lens;
use crate::caster::{HeightfieldError, Ray};
use crate::sky::Sky;
use glam::{UVec2, Vec3};
use meniscus_sim::frame::{Channels, Frame};
use meniscus_sim::render::{Image, PlanItem, RenderError, RenderReport, Renderer, View};
use meniscus_sim::rng::Rng;
use meniscus_sim::scene::description::Shape;
use meniscus_sim::{Grid, Scene};
use objects::Model;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Instant;
use surface::Surface;
use trace::{Path, Tracer};
use world::{Medium, World, in_plan};

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
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            interface_depth: 3,
            cutoff: 2e-3,
            visual_range: Some(150_000.0),
            caustics: true,
            roughness: 0.0,
        }
    }
}

/// What depends on the scene alone and is kept from frame to frame.
#[derive(Debug)]
struct Fixed {
    fingerprint: u64,
    light: light::Light,
    volume: volume::Volume,
    look: ground::Ground,
    ground: Option<Surface>,
    ground_on_grid: Option<Grid<f32>>,
    openness: Option<Grid<f32>>,
    models: Vec<Option<Arc<Model>>>,
}

/// The `whitted` renderer.
#[derive(Debug, Default)]
pub struct Whitted {
    settings: Settings,
    fixed: Option<Fixed>,
    water: Option<Surface>,
    heights: Option<Grid<f32>>,
}

impl Whitted {
    /// Name on the command line.
    pub const NAME: &'static str = "whitted";

    /// A renderer with these settings.
    pub fn new(settings: Settings) -> Self {
        Self {
            settings,
            ..Self::default()
        }
    }

    /// Runs `draw` with the frame ready for rays.
    fn with_world<R>(
        &mut self,
        scene: &Scene,
        frame: &Frame,
        view: &View,
        report: &mut RenderReport,
        draw: impl FnOnce(&World<'_>, &Lens, Medium, &Settings, &mut RenderReport) -> Result<R, RenderError>,
    ) -> Result<R, RenderError> {
        let lens = Lens::new(view)?;
        frame.check_finite()?;
        let start = Instant::now();
        let fingerprint = fingerprint(scene);
        if self.fixed.as_ref().is_none_or(|f| f.fingerprint != fingerprint) {
            self.fixed = Some(Fixed::build(scene, fingerprint)?);
        }
        let Some(fixed) = &self.fixed else {
            return Err(RenderError::Interrupted);
        };
        report.stages.push(("scene", start.elapsed().as_secs_f64()));

        let start = Instant::now();
        let how = surroundings::water_continuation(scene);
        let heights = surface::drawable(
            frame,
            fixed.ground_on_grid.as_ref(),
            how.periodic,
            self.heights.take(),
        );
        match &mut self.water {
            Some(water) => water.rebuild(&heights, how).map_err(unsupported)?,
            none => *none = Some(Surface::build(&heights, how).map_err(unsupported)?),
        }
        let Some(water) = &self.water else {
            return Err(RenderError::Interrupted);
        };
        let caustics = match &fixed.ground {
            Some(ground) if self.settings.caustics => caustics::Caustics::build(
                &heights,
                water,
                ground,
                &fixed.light,
                scene.description.water.index,
            ),
            _ => None,
        };
        let objects = objects::place(scene, frame, &fixed.models);
        let spray = frame.droplets.as_ref().and_then(droplets::Spray::build);
        let edges = surroundings::Edges::new(scene, &heights, lens.eye);
        report.stages.push(("frame", start.elapsed().as_secs_f64()));

        let mut lens = lens;
        let hair = 1e-9 * surroundings::scale(scene).max(lens.eye.length());
        let world = World {
            water,
            ground: fixed.ground.as_ref(),
            openness: fixed.openness.as_ref(),
            look: &fixed.look,
            edges: &edges,
            objects,
            spray,
            foam: frame.foam.as_ref(),
            caustics: caustics.as_ref(),
            light: &fixed.light,
            volume: &fixed.volume,
            index: scene.description.water.index,
            hair,
        };
        let medium = place_camera(&world, &mut lens)?;
        let result = draw(&world, &lens, medium, &self.settings, report);
        self.heights = Some(heights);
        result
    }
}

/// Moves an eye that is exactly on the surface a hair off it, and refuses one inside the ground.
fn place_camera(world: &World<'_>, lens: &mut Lens) -> Result<Medium, RenderError> {
    let eye = lens.eye;
    let ground = world.ground_height(eye);
    if ground >= eye.y {
        return Err(RenderError::View {
            what: format!(
                "the camera at ({:.3}, {:.3}, {:.3}) m is inside the ground, which reaches up to {ground:.3} m there",
                eye.x, eye.y, eye.z
            ),
            remedy: "raise it above the ground or move it",
        });
    }
    if world.depth(eye).abs() < 4.0 * world.hair {
        lens.eye.y = world.water.height(in_plan(eye)) + 4.0 * world.hair;
    }
    Ok(world.medium(lens.eye))
}

impl Renderer for Whitted {
    fn name(&self) -> &'static str {
        Self::NAME
    }

    fn needs(&self, scene: &Scene) -> Channels {
        let mut set = Channels::DISPLACEMENT | Channels::FOAM | Channels::DROPLETS;
        if !scene.description.objects.is_empty() {
            set |= Channels::BODIES;
        }
        set
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
        let seed = scene.description.seed;
        self.with_world(
            scene,
            frame,
            view,
            &mut report,
            |world, lens, medium, settings, report| {
                let start = Instant::now();
                let rays = AtomicU64::new(0);
                image.size = view.size;
                let samples = view.samples;
                let spread = (0.5 * lens.pixel_angle / f64::from(samples).sqrt()) as f32;
                tiles::render(
                    view.size,
                    progress,
                    || Tracer {
                        world,
                        settings,
                        sun_point: [0.0; 2],
                        rays: 0,
                    },
                    |tracer, x, y| {
                        let mut sum = Vec3::ZERO;
                        let pixel = Pixel::new(seed, x, y, samples);
                        for k in 0..samples {
                            let (at, sun_point) = pixel.sample(k);
                            tracer.sun_point = sun_point;
                            let direction = lens.direction(f64::from(x) + at[0], f64::from(y) + at[1]);
                            sum += tracer.radiance(Path {
                                ray: Ray {
                                    origin: lens.eye,
                                    direction,
                                },
                                medium,
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
                report.rays = rays.into_inner();
                report.stages.push(("rays", start.elapsed().as_secs_f64()));
                Ok(())
            },
        )?;
        Ok(report)
    }
}

/// The sample points of one pixel.
struct Pixel {
    samples: u32,
    shift: [f64; 4],
}

impl Pixel {
    /// Stream of the random generator that shifts draw from.
    const STREAM: u64 = 0x0070_6978_656c;

    fn new(seed: u64, x: u32, y: u32, samples: u32) -> Self {
        let mut rng = Rng::new(seed, Self::STREAM ^ (u64::from(y) << 32 | u64::from(x)) << 8);
        let shift = if samples == 1 {
            [0.5, 0.5, 0.0, 0.0]
        } else {
            std::array::from_fn(|_| rng.uniform())
        };
        Self { samples, shift }
    }

    /// Point `k` of the pixel and of the sun's disc, both in the unit square: a Hammersley set and another one in the
    /// other bit order, shifted by a random amount that is the pixel's own. One sample goes through the middle.
    fn sample(&self, k: u32) -> ([f64; 2], [f32; 2]) {
        if self.samples == 1 {
            return ([0.5, 0.5], [0.0, 0.0]);
        }
        let n = f64::from(self.samples);
        let wrap = |v: f64| v - v.floor();
        let inverse = f64::from(k.reverse_bits()) / 4_294_967_296.0;
        let golden = f64::from(k) * 0.754_877_666_246_692_8;
        let silver = f64::from(k) * 0.569_840_290_998_053_3;
        (
            [
                wrap((f64::from(k) + 0.5) / n + self.shift[0]),
                wrap(inverse + self.shift[1]),
            ],
            [
                wrap(golden + self.shift[2]) as f32,
                wrap(silver + self.shift[3]) as f32,
            ],
        )
    }
}

impl Fixed {
    fn build(scene: &Scene, fingerprint: u64) -> Result<Self, RenderError> {
        let description = &scene.description;
        let light = light::Light::new(description, Sky::new(scene));
        let volume = volume::Volume::new(&description.water, &light);
        let relief = scene.terrain.as_ref().is_some_and(|t| {
            let (low, high) = t.range();
            low < high
        });
        let ground = match &scene.terrain {
            Some(terrain) => {
                let how = surroundings::ground_continuation(terrain, description.water.level);
                Some(Surface::build(terrain, how).map_err(unsupported)?)
            }
            None => None,
        };
        let spacing = scene
            .terrain
            .as_ref()
            .map_or(1.0, |t| f64::from(t.spec().spacing));
        let models = description
            .objects
            .iter()
            .enumerate()
            .map(|(k, object)| match object.shape {
                Shape::Model { .. } => scene.meshes.get(k).and_then(Model::build).map(Arc::new),
                _ => None,
            })
            .collect();
        Ok(Self {
            fingerprint,
            look: ground::Ground::new(scene, spacing, relief),
            openness: scene.terrain.as_ref().filter(|_| relief).map(surface::openness),
            ground,
            ground_on_grid: scene.ground_on_grid(),
            light,
            volume,
            models,
        })
    }
}

fn unsupported(error: HeightfieldError) -> RenderError {
    RenderError::Unsupported {
        what: error.to_string(),
        remedy: "give finite heights".to_owned(),
    }
}

/// Changes when anything does that [`Fixed`] is built from.
fn fingerprint(scene: &Scene) -> u64 {
    use std::hash::{DefaultHasher, Hash, Hasher};
    let mut hasher = DefaultHasher::new();
    format!("{:?}{:?}", scene.description, scene.grid).hash(&mut hasher);
    if let Some(terrain) = &scene.terrain {
        format!("{:?}", terrain.spec()).hash(&mut hasher);
        for v in terrain.as_slice() {
            hasher.write_u32(v.to_bits());
        }
    }
    if let Some(sky) = &scene.sky {
        for p in &sky.pixels {
            for v in p.to_array() {
                hasher.write_u32(v.to_bits());
            }
        }
    }
    for mesh in &scene.meshes {
        for p in mesh.positions.iter().chain(&mesh.normals) {
            for v in p.to_array() {
                hasher.write_u32(v.to_bits());
            }
        }
        mesh.triangles.hash(&mut hasher);
    }
    hasher.finish()
}

#[cfg(test)]
mod tests_support {
    use meniscus_sim::scene::description::*;
    use meniscus_sim::{GridSpec, Scene};

    /// The least that a scene can say.
    pub(super) fn description() -> Description {
        Description {
            name: "test".to_owned(),
            seed: 0,
            duration: 1.0,
            domain: Domain::default(),
            water: Water::default(),
            terrain: None,
            ground: GroundLook::default(),
            solver: Solver::Procedural(Procedural {
                spacing: 1.0,
                depth: None,
                waves: Vec::new(),
            }),
            boundary: Boundary::default(),
            objects: Vec::new(),
            light: Light::default(),
            cameras: Vec::new(),
            events: Vec::new(),
            recording: Recording::default(),
        }
    }

    pub(super) fn scene(description: Description) -> Scene {
        let grid = GridSpec {
            origin: glam::Vec2::ZERO,
            spacing: 1.0,
            size: glam::UVec2::splat(2),
        };
        Scene {
            description,
            grid,
            terrain: None,
            meshes: Vec::new(),
            sky: None,
            initial_elevation: None,
        }
    }
}
