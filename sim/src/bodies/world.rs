//! The only file that names rapier3d, and with it another version of glam.
//!
//! Rapier integrates positions and resolves contacts; forces come from outside, gravity included. It computes in
//! single precision, so its origin is put into the middle of the scene's water.

use super::mass::Mass;
use super::state::State;
use crate::grid::Grid;
use crate::recording::codec;
use crate::scene::description::Shape;
use glam::{DQuat, DVec3};
use rapier3d::parry::utils::Array2;
use rapier3d::prelude::{
    ColliderBuilder, ColliderHandle, MassProperties, Matrix, PhysicsWorld, Pose, RigidBodyBuilder,
    RigidBodyHandle, Rotation, SharedShape, Vector,
};

/// Friction between bodies and ground.
const FRICTION: f32 = 0.5;
/// Planes that stand for a round wall: where they meet they are 0.2 % too far out.
#[cfg(feature = "sph")]
const SIDES: u32 = 48;
/// Share of the speed that is left after a collision.
const RESTITUTION: f32 = 0.1;
/// Fastest speed that rapier keeps, m/s.
const FASTEST: f32 = 1e4;
/// Largest state of the world as bytes.
const MAX_BYTES: usize = u32::MAX as usize;

/// How a body moves in the world.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    /// By forces.
    Free,
    /// As it is told.
    Led,
    /// Not at all.
    Fixed,
}

/// Bodies, ground and walls, and what keeps them apart.
pub(super) struct World {
    physics: PhysicsWorld,
    handles: Vec<RigidBodyHandle>,
    ground: Option<ColliderHandle>,
    origin: DVec3,
}

fn vector(v: DVec3) -> Vector {
    Vector::new(v.x as f32, v.y as f32, v.z as f32)
}

fn wide(v: Vector) -> DVec3 {
    DVec3::new(f64::from(v.x), f64::from(v.y), f64::from(v.z))
}

impl World {
    /// An empty world about `origin` whose smallest body is about `size` metres.
    pub(super) fn new(origin: DVec3, size: f64) -> Self {
        let mut physics = PhysicsWorld {
            gravity: Vector::ZERO,
            ..PhysicsWorld::default()
        };
        let unit = (size as f32).clamp(1e-4, 1e3);
        let parameters = &mut physics.integration_parameters;
        parameters.length_unit = unit;
        parameters.normalized_max_linear_velocity = FASTEST / unit;
        parameters.max_ccd_substeps = 4;
        Self {
            physics,
            handles: Vec::new(),
            ground: None,
            origin,
        }
    }

    /// Adds a body; its number is how many there were before.
    pub(super) fn add(&mut self, kind: Kind, state: &State, mass: &Mass, shape: &Shape, corners: &[DVec3]) {
        let builder = match kind {
            Kind::Free => RigidBodyBuilder::dynamic(),
            Kind::Led => RigidBodyBuilder::kinematic_position_based(),
            Kind::Fixed => RigidBodyBuilder::fixed(),
        };
        let i = mass.inertia;
        let column = |c: DVec3| Vector::new(c.x as f32, c.y as f32, c.z as f32);
        let inertia = Matrix::from_cols(column(i.x_axis), column(i.y_axis), column(i.z_axis));
        let body = builder
            .pose(self.pose_of(state, mass.centre))
            .linvel(vector(state.velocity))
            .angvel(vector(state.spin))
            .can_sleep(false)
            .ccd_enabled(kind == Kind::Free)
            .allow_fast_rotation(true)
            .additional_mass_properties(MassProperties::with_inertia_matrix(
                vector(mass.centre),
                mass.mass as f32,
                inertia,
            ));
        let collider = ColliderBuilder::new(form(shape, mass.centre, corners))
            .density(0.0)
            .friction(FRICTION)
            .restitution(RESTITUTION);
        let (handle, _) = self.physics.insert(body, collider);
        self.handles.push(handle);
    }

    /// Adds ground, sampled as a grid is.
    pub(super) fn add_ground(&mut self, ground: &Grid<f32>) {
        let spec = ground.spec();
        let extent = spec.extent();
        let middle = spec.origin.as_dvec2() + 0.5 * extent.as_dvec2();
        let at = DVec3::new(middle.x - self.origin.x, 0.0, middle.y - self.origin.z);
        let collider = ColliderBuilder::new(self.surface(ground))
            .translation(vector(at))
            .friction(FRICTION)
            .restitution(RESTITUTION);
        self.ground = Some(self.physics.insert_collider(collider, None));
    }

    /// What the ground collides as.
    fn surface(&self, ground: &Grid<f32>) -> SharedShape {
        let spec = ground.spec();
        let heights = Array2::from_fn(spec.height(), spec.width(), |j, i| {
            (f64::from(ground.as_slice()[j * spec.width() + i]) - self.origin.y) as f32
        });
        let extent = spec.extent();
        SharedShape::heightfield(heights, Vector::new(extent.x, 1.0, extent.y))
    }

    /// Puts ground of the same grid in the place of that which was added.
    pub(super) fn move_ground(&mut self, ground: &Grid<f32>) {
        let surface = self.surface(ground);
        if let Some(collider) = self
            .ground
            .and_then(|handle| self.physics.colliders.get_mut(handle))
        {
            collider.set_shape(surface);
        }
    }

    /// Adds upright walls without end around a rectangle in X and Z.
    pub(super) fn add_walls(&mut self, min: [f64; 2], max: [f64; 2]) {
        for (normal, x, z) in [
            (Vector::X, min[0], 0.0),
            (-Vector::X, max[0], 0.0),
            (Vector::Z, 0.0, min[1]),
            (-Vector::Z, 0.0, max[1]),
        ] {
            let at = DVec3::new(
                if normal.x == 0.0 { 0.0 } else { x - self.origin.x },
                0.0,
                if normal.z == 0.0 { 0.0 } else { z - self.origin.z },
            );
            let collider = ColliderBuilder::new(SharedShape::halfspace(normal))
                .translation(vector(at))
                .friction(0.0)
                .restitution(RESTITUTION);
            self.physics.insert_collider(collider, None);
        }
    }

    /// Adds an upright wall without end around a circle in X and Z.
    #[cfg(feature = "sph")]
    pub(super) fn add_round_wall(&mut self, centre: [f64; 2], radius: f64) {
        for side in 0..SIDES {
            let (z, x) = (std::f64::consts::TAU * f64::from(side) / f64::from(SIDES)).sin_cos();
            let at = DVec3::new(centre[0] + radius * x, self.origin.y, centre[1] + radius * z) - self.origin;
            let collider = ColliderBuilder::new(SharedShape::halfspace(vector(DVec3::new(-x, 0.0, -z))))
                .translation(vector(at))
                .friction(0.0)
                .restitution(RESTITUTION);
            self.physics.insert_collider(collider, None);
        }
    }

    fn pose_of(&self, state: &State, centre: DVec3) -> Pose {
        let at = state.position - state.rotation * centre - self.origin;
        let q = state.rotation;
        let rotation = Rotation::from_xyzw(q.x as f32, q.y as f32, q.z as f32, q.w as f32);
        Pose::from_parts(vector(at), rotation.normalize())
    }

    /// State of body `k` whose centre of mass is `centre` in its own axes.
    pub(super) fn state(&self, k: usize, centre: DVec3) -> State {
        let body = &self.physics.bodies[self.handles[k]];
        let (at, q) = (wide(body.translation()), body.rotation());
        let rotation =
            DQuat::from_xyzw(f64::from(q.x), f64::from(q.y), f64::from(q.z), f64::from(q.w)).normalize();
        State {
            position: self.origin + at + rotation * centre,
            rotation,
            velocity: wide(body.linvel()),
            spin: wide(body.angvel()),
        }
    }

    /// Puts a free body where it is told.
    pub(super) fn place(&mut self, k: usize, state: &State, centre: DVec3) {
        let pose = self.pose_of(state, centre);
        let body = &mut self.physics.bodies[self.handles[k]];
        body.set_position(pose, true);
        body.set_linvel(vector(state.velocity), true);
        body.set_angvel(vector(state.spin), true);
    }

    /// Changes velocity and spin of a free body at once.
    pub(super) fn kick(&mut self, k: usize, velocity: DVec3, spin: DVec3) {
        let body = &mut self.physics.bodies[self.handles[k]];
        body.set_linvel(body.linvel() + vector(velocity), true);
        body.set_angvel(body.angvel() + vector(spin), true);
    }

    /// Force and torque about the centre of mass during the next step.
    pub(super) fn push(&mut self, k: usize, force: DVec3, torque: DVec3) {
        let body = &mut self.physics.bodies[self.handles[k]];
        body.reset_forces(true);
        body.reset_torques(true);
        body.add_force(vector(force), true);
        body.add_torque(vector(torque), true);
    }

    /// Where a led body is to be at the end of the next step.
    pub(super) fn lead(&mut self, k: usize, state: &State, centre: DVec3) {
        let pose = self.pose_of(state, centre);
        self.physics.bodies[self.handles[k]].set_next_kinematic_position(pose);
    }

    /// Moves everything by `dt` seconds.
    pub(super) fn step(&mut self, dt: f64) {
        let parameters = &mut self.physics.integration_parameters;
        parameters.dt = dt as f32;
        parameters.min_ccd_dt = 0.01 * dt as f32;
        self.physics.step();
    }

    /// Everything that further steps depend on.
    pub(super) fn save(&self) -> Result<Vec<u8>, String> {
        let mut out = Vec::new();
        codec::put(&self.physics, MAX_BYTES, &mut out)?;
        Ok(out)
    }

    /// Goes on from what [`Self::save`] gave of a world with the same bodies.
    pub(super) fn load(&mut self, bytes: &[u8]) -> Result<(), String> {
        let (physics, rest) = codec::take::<PhysicsWorld, MAX_BYTES>(bytes)?;
        let whole = rest.is_empty() && self.handles.iter().all(|&h| physics.bodies.get(h).is_some());
        if !whole {
            return Err("it holds other bodies".into());
        }
        self.physics = physics;
        Ok(())
    }
}

/// What a body collides as: its primitive, or the convex hull of its mesh.
fn form(shape: &Shape, centre: DVec3, corners: &[DVec3]) -> SharedShape {
    match *shape {
        Shape::Sphere { radius } => SharedShape::ball(radius),
        Shape::Box { size } => SharedShape::cuboid(0.5 * size.x, 0.5 * size.y, 0.5 * size.z),
        Shape::Cylinder { radius, height } => SharedShape::cylinder(0.5 * height, radius),
        Shape::Model { .. } => {
            let points: Vec<Vector> = corners.iter().map(|&p| vector(p + centre)).collect();
            SharedShape::convex_hull(&points).unwrap_or_else(|| {
                let reach = corners.iter().fold(0.0_f64, |r, p| r.max(p.length()));
                SharedShape::ball(reach as f32)
            })
        }
    }
}
