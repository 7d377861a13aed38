//! Bodies from a scene's objects.

use super::body::{Body, Motion};
use super::displaced::{self, Displaced};
use super::error::BodyError;
use super::hull::Hull;
use super::mass::Mass;
use super::reference::Plane;
use super::six::Symmetric;
use super::state::State;
use super::water::Water;
use super::world::{Kind, World};
use super::{Bodies, Columns};
use crate::scene::Scene;
use crate::scene::description;
use glam::{DMat3, DVec2, DVec3};

/// Fastest start, m/s and rad/s.
const FASTEST: f64 = 1e3;
/// Share of its size by which a body may start in the ground: it is put on it by the first contacts.
const SUNK: f64 = 0.02;

impl Bodies {
    /// The bodies of a scene whose objects move (`motion.kind` is `free` or `path`); fixed objects are what they
    /// collide with. `None` if nothing moves: then nothing is allocated. Bodies stay in the domain, whatever its edges
    /// do to waves.
    ///
    /// # Errors
    /// [`BodyError`] if an object is no solid, or starts where it cannot be.
    pub fn from_scene(scene: &Scene, water: &dyn Water) -> Result<Option<Self>, BodyError> {
        let objects = &scene.description.objects;
        if objects.iter().all(|o| o.motion == description::Motion::Fixed) {
            return Ok(None);
        }
        let grid = scene.grid;
        let (low, extent) = (grid.origin.as_dvec2(), grid.extent().as_dvec2());
        let high = low + extent;
        let ground = scene.ground_on_grid();
        let mut bodies = Vec::with_capacity(objects.len());
        for (object, mesh) in objects.iter().zip(&scene.meshes) {
            let name = object.name.clone();
            let mass = Mass::of(mesh, f64::from(object.density)).map_err(|source| BodyError::Mass {
                name: name.clone(),
                source,
            })?;
            let (kind, motion) = match &object.motion {
                description::Motion::Free => (Kind::Free, Motion::Free),
                description::Motion::Path { .. } => (Kind::Led, Motion::Led(Box::new(object.clone()))),
                description::Motion::Fixed => (Kind::Fixed, Motion::Fixed),
            };
            let state = State::from_pose(&object.pose_at(0.0), mass.centre);
            let hull = Hull::new(mesh, mass.centre, water.resolution());
            if kind == Kind::Free {
                check(&name, object, &hull, &state, [low, high], ground.as_ref())?;
            }
            bodies.push(Body {
                name,
                kind,
                motion,
                size: mass.volume.cbrt(),
                mass,
                hull,
                state,
                grip: None,
                plane: None,
                rise: 0.0,
                wet: 0.0,
                added: Symmetric::default(),
                impulse: DVec3::ZERO,
                footprint: Vec::new(),
            });
        }
        let free = bodies.iter().filter(|b| b.kind == Kind::Free);
        let smallest = free.fold(f64::INFINITY, |s, b| s.min(b.size));
        let middle = 0.5 * (low + high);
        let origin = DVec3::new(middle.x, f64::from(scene.description.water.level), middle.y);
        let mut world = World::new(origin, if smallest.is_finite() { smallest } else { 1.0 });
        for (body, object) in bodies.iter().zip(objects) {
            world.add(
                body.kind,
                &body.state,
                &body.mass,
                &object.shape,
                &body.hull.corners,
            );
        }
        world.add_walls(low.to_array(), high.to_array());
        if let Some(ground) = ground.as_ref().filter(|_| grid.width() > 1 && grid.height() > 1) {
            world.add_ground(ground);
        }
        Ok(Some(Self {
            bodies,
            world,
            displaced: Displaced::default(),
            ground,
            bounds: [[low.x, high.x], [low.y, high.y]],
            smallest,
            clamps: 0,
        }))
    }

    /// The water that goes along with bodies that start in it moves with them already.
    pub(crate) fn wet_by(&mut self, water: &dyn Water) {
        for body in &mut self.bodies {
            if let Some(push) = body.pushed(water, 1.0) {
                (body.wet, body.added) = (push.wet, push.added);
            }
        }
    }

    /// Takes the water as it is to be level around the bodies that it holds: what they displace is counted as in its
    /// columns already, so that a float which starts in balance stays at rest.
    pub fn settle_in(&mut self, columns: &dyn Columns) {
        for body in &mut self.bodies {
            body.plane = Plane::around(&body.hull, &body.state, columns);
        }
        self.wet_by(columns);
        for body in &mut self.bodies {
            if let Some(plane) = &body.plane {
                body.footprint = displaced::heights(&body.hull, &body.state, plane, columns);
            }
        }
        self.displaced = Displaced::start(displaced::sum(self.bodies.iter().map(|b| &b.footprint)));
    }
}

/// Refuses a free body that starts where it cannot be.
fn check(
    name: &str,
    object: &description::Object,
    hull: &Hull,
    state: &State,
    [low, high]: [DVec2; 2],
    ground: Option<&crate::grid::Grid<f32>>,
) -> Result<(), BodyError> {
    let name = || name.to_string();
    for (what, value) in [
        ("velocity in m/s", object.velocity),
        ("spin in rad/s", object.spin),
    ] {
        let value = f64::from(value.length());
        if !(value <= FASTEST) {
            let limit = FASTEST;
            return Err(BodyError::Fast {
                name: name(),
                what,
                value,
                limit,
            });
        }
    }
    let rotation = DMat3::from_quat(state.rotation);
    let corners = || hull.corners.iter().map(|&p| state.position + rotation * p);
    let (min, max) = corners().fold((DVec3::MAX, DVec3::MIN), |(a, b), p| (a.min(p), b.max(p)));
    for (size, domain) in [(max.x - min.x, high.x - low.x), (max.z - min.z, high.y - low.y)] {
        if !(size <= domain) {
            let name = name();
            return Err(BodyError::TooLarge { name, size, domain });
        }
    }
    let at = DVec2::new(state.position.x, state.position.z);
    if at.cmplt(low).any() || at.cmpgt(high).any() {
        return Err(BodyError::Outside { name: name() });
    }
    if let Some(ground) = ground {
        let depth = corners()
            .map(|p| f64::from(ground.sample(DVec2::new(p.x, p.z).as_vec2())) - p.y)
            .fold(0.0, f64::max);
        if depth > SUNK * hull.reach {
            let name = name();
            return Err(BodyError::Buried { name, depth });
        }
    }
    Ok(())
}
