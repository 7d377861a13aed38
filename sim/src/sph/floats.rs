//! The bodies of a scene in water of particles: the water pushes them, rapier keeps them apart.

#[cfg(feature = "bodies")]
pub(super) use coupled::Floats;
#[cfg(not(feature = "bodies"))]
pub(super) use left_out::Floats;

#[cfg(feature = "bodies")]
mod coupled {
    use super::super::boundary::Outline;
    use super::super::floating::Float;
    use super::super::fluid::Fluid;
    use crate::bodies::{Bodies, MotionError, StillWater};
    use crate::events::{Action, EventError};
    use crate::frame::BodyPose;
    use crate::scene::Scene;
    use crate::scene::description::Motion;
    use crate::solvers::BuildError;
    use glam::{DVec3, Vec3};

    /// The bodies of a run, if its scene has free ones.
    #[derive(Default)]
    pub(crate) struct Floats(Option<Bodies>);

    impl Floats {
        pub(crate) fn from_scene(scene: &Scene, outline: Outline) -> Result<Self, BuildError> {
            let objects = &scene.description.objects;
            if objects.iter().all(|o| o.motion != Motion::Free) {
                return Ok(Self::default());
            }
            // Hulls are not asked for anything: the particles push.
            let water = StillWater {
                level: f64::from(scene.description.water.level),
                bed: f64::NEG_INFINITY,
            };
            let bodies = Bodies::from_scene(scene, &water).map_err(|e| BuildError::Bodies(e.to_string()))?;
            Ok(Self(bodies.map(|mut bodies| {
                if outline == Outline::Round {
                    let (low, extent) = (scene.grid.origin.as_dvec2(), scene.grid.extent().as_dvec2());
                    bodies.keep_within((low + 0.5 * extent).to_array(), 0.5 * extent.min_element());
                }
                bodies
            })))
        }

        /// Tells the water what it moves in the next `h` seconds, hands having pulled.
        pub(crate) fn begin(&self, fluid: &mut Fluid, h: f64) {
            let Some(bodies) = &self.0 else {
                return;
            };
            fluid.set_floats(bodies.driven(h).map(|body| Float {
                obstacle: body.object,
                mass: body.mass,
                inertia: body.inertia,
                centre: body.centre,
                velocity: body.velocity,
                spin: body.spin,
            }));
        }

        /// Moves the bodies through the step of `h` seconds from `time` that the water has just made. Objects that are not
        /// free stand where `led` says at its end.
        pub(crate) fn follow(
            &mut self,
            fluid: &mut Fluid,
            led: impl Fn(usize) -> BodyPose,
            time: f64,
            h: f64,
        ) -> Result<(), MotionError> {
            let Some(bodies) = &mut self.0 else {
                return Ok(());
            };
            let motions = fluid.floats().iter().map(|f| [f.velocity, f.spin]);
            bodies.drive(motions, led, time, h)?;
            self.place(fluid);
            Ok(())
        }

        /// Puts the obstacles of free bodies where these are.
        pub(crate) fn place(&self, fluid: &mut Fluid) {
            let Some(bodies) = &self.0 else {
                return;
            };
            let poses = bodies.poses();
            for body in bodies.driven(0.0) {
                if let Some(obstacle) = fluid.boundary_mut().obstacles.get_mut(body.object) {
                    obstacle.pose = poses[body.object];
                }
            }
        }

        /// Acts on a body; `None` if there is none.
        pub(crate) fn apply(&mut self, action: &Action) -> Option<Result<(), EventError>> {
            self.0.as_mut().map(|bodies| bodies.apply(action))
        }

        /// Momentum along X and Z, kg m/s.
        pub(crate) fn momentum(&self) -> [f64; 2] {
            let [x, _, z] = self.0.as_ref().map_or([0.0; 3], Bodies::momentum);
            [x, z]
        }

        /// Kinetic and potential energy in J, the latter relative to `rest`.
        pub(crate) fn energy(&self, gravity: Vec3, rest: DVec3) -> f64 {
            let energy = |b: &Bodies| b.mechanical_energy(gravity.as_dvec3(), rest);
            self.0.as_ref().map_or(0.0, energy)
        }

        /// How often a body had to be brought back.
        pub(crate) fn clamps(&self) -> u64 {
            self.0.as_ref().map_or(0, Bodies::clamps)
        }

        pub(crate) fn bytes(&self) -> u64 {
            self.0.as_ref().map_or(0, Bodies::bytes)
        }
    }
}

/// What is left of bodies in a build without them.
#[cfg(not(feature = "bodies"))]
mod left_out {
    use super::super::boundary::Outline;
    use super::super::fluid::Fluid;
    use crate::events::{Action, EventError};
    use crate::frame::BodyPose;
    use crate::scene::Scene;
    use crate::scene::description::Motion;
    use crate::solvers::BuildError;
    use glam::{DVec3, Vec3};
    use std::convert::Infallible;

    #[derive(Default)]
    pub(crate) struct Floats;

    impl Floats {
        pub(crate) fn from_scene(scene: &Scene, _: Outline) -> Result<Self, BuildError> {
            let objects = &scene.description.objects;
            match objects.iter().find(|o| o.motion == Motion::Free) {
                None => Ok(Self),
                Some(body) => Err(BuildError::impossible(
                    format!("object `{}`: motion", body.name),
                    "floating bodies are not compiled in",
                    "build with the Cargo feature `bodies`, or use motion kind \"fixed\" or \"path\"",
                )),
            }
        }
        pub(crate) fn begin(&self, _: &mut Fluid, _: f64) {}
        pub(crate) fn follow(
            &mut self,
            _: &mut Fluid,
            _: impl Fn(usize) -> BodyPose,
            _: f64,
            _: f64,
        ) -> Result<(), Infallible> {
            Ok(())
        }
        pub(crate) fn place(&self, _: &mut Fluid) {}
        pub(crate) fn apply(&mut self, _: &Action) -> Option<Result<(), EventError>> {
            None
        }
        pub(crate) fn momentum(&self) -> [f64; 2] {
            [0.0; 2]
        }
        pub(crate) fn energy(&self, _: Vec3, _: DVec3) -> f64 {
            0.0
        }
        pub(crate) fn clamps(&self) -> u64 {
            0
        }
        pub(crate) fn bytes(&self) -> u64 {
            0
        }
    }
}
