//! A frame made ready for rays: what every renderer of this crate draws from.
//!
//! [`Stage`] keeps what depends on the scene alone from frame to frame and rebuilds the rest; [`world::World`] answers
//! what a ray meets.

pub(crate) mod droplets;
pub(crate) mod interface;
pub(crate) mod matt;
pub(crate) mod objects;
pub(crate) mod pixel;
pub(crate) mod surface;
pub(crate) mod tiles;
pub(crate) mod world;

pub(crate) use meniscus_sim::stage::{
    air, continuation, fingerprint, ground, light, needs, surroundings, volume,
};

use crate::camera::Lens;
use crate::caster::HeightfieldError;
use crate::sky::Sky;
use meniscus_sim::frame::Frame;
use meniscus_sim::render::{RenderError, RenderReport, View};
use meniscus_sim::scene::description::Shape;
use meniscus_sim::{Grid, Scene};
use objects::Model;
use std::sync::Arc;
use std::time::Instant;
use surface::Surface;
use world::{Medium, World, in_plan};

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

/// What is kept from frame to frame.
#[derive(Debug, Default)]
pub(crate) struct Stage {
    fixed: Option<Fixed>,
    water: Option<Surface>,
    heights: Option<Grid<f32>>,
}

/// One frame seen from one place.
pub(crate) struct Set<'a> {
    pub(crate) world: World<'a>,
    pub(crate) lens: Lens,
    /// What the eye is in.
    pub(crate) medium: Medium,
    /// Heights of the water on the scene's grid as they are drawn, metres.
    pub(crate) heights: &'a Grid<f32>,
}

impl Stage {
    /// Runs `draw` with the frame ready for rays, and notes in `report` what that took.
    ///
    /// # Errors
    /// [`RenderError`] if the view or the frame cannot be drawn, and what `draw` returns.
    pub(crate) fn with<R>(
        &mut self,
        scene: &Scene,
        frame: &Frame,
        view: &View,
        report: &mut RenderReport,
        draw: impl FnOnce(&Set<'_>, &mut RenderReport) -> Result<R, RenderError>,
    ) -> Result<R, RenderError> {
        let mut lens = Lens::new(view)?;
        frame.check_finite()?;
        let start = Instant::now();
        let scene = &*scene.at(frame.time);
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
        let heights = continuation::drawable(
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
        let objects = objects::place(scene, frame, &fixed.models);
        let spray = frame.droplets.as_ref().and_then(droplets::Spray::build);
        let edges = surroundings::Edges::new(scene, &heights, lens.eye);
        report.stages.push(("frame", start.elapsed().as_secs_f64()));

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
            light: &fixed.light,
            volume: &fixed.volume,
            index: scene.description.water.index,
            hair,
        };
        let medium = place_camera(&world, &mut lens)?;
        let set = Set {
            world,
            lens,
            medium,
            heights: &heights,
        };
        let result = draw(&set, report);
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
            openness: scene
                .terrain
                .as_ref()
                .filter(|_| relief)
                .map(continuation::openness),
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

#[cfg(test)]
pub(crate) mod tests_support {
    use meniscus_sim::scene::description::*;
    use meniscus_sim::{GridSpec, Scene};

    /// The least that a scene can say.
    pub(crate) fn description() -> Description {
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
            beds: Vec::new(),
            boundary: Boundary::default(),
            layers: Vec::new(),
            detail: None,
            horizon: None,
            objects: Vec::new(),
            light: Light::default(),
            cameras: Vec::new(),
            events: Vec::new(),
            recording: Recording::default(),
        }
    }

    pub(crate) fn scene(description: Description) -> Scene {
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
            uplifts: Vec::new(),
        }
    }
}
