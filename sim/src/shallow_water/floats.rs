//! Bodies in shallow water: how they see the columns, and what they do to them.

#[cfg(feature = "bodies")]
pub(crate) use coupled::Floats;
#[cfg(not(feature = "bodies"))]
pub(crate) use left_out::Floats;

#[cfg(feature = "bodies")]
mod coupled {
    use super::super::exchange::Exchange;
    use crate::bodies::{
        Bodies, BodiesCheckpoint, BodyError, Column, Columns, MotionError, WATER_DENSITY, Water,
    };
    use crate::events::{Action, EventError};
    use crate::frame::BodyPose;
    use crate::grid::{Grid, GridSpec};
    use crate::scene::Scene;
    use glam::DVec3;

    /// Least weight of wet cells around a place for it to count as wet.
    const WET: f64 = 0.25;

    /// The bodies of a run, if its scene has any that move.
    #[derive(Default)]
    pub(crate) struct Floats(Option<Bodies>);

    impl Floats {
        /// The bodies of a scene, at rest in the present water if they start in balance.
        pub(crate) fn from_scene<E: Exchange + Sync>(
            scene: &Scene,
            core: &mut E,
            spec: &GridSpec,
        ) -> Result<Self, BodyError> {
            let columns = CoreColumns { core, spec };
            let mut bodies = Bodies::from_scene(scene, &columns)?;
            if let Some(bodies) = &mut bodies {
                bodies.settle_in(&columns);
            }
            Ok(Self(bodies))
        }

        pub(crate) fn get(&self) -> Option<&Bodies> {
            self.0.as_ref()
        }

        /// Longest sub-step of the water, s.
        pub(crate) fn largest_step(&self, spacing: f64) -> f64 {
            self.0.as_ref().map_or(f64::INFINITY, |b| b.largest_step(spacing))
        }

        /// Moves the bodies through a sub-step that the water has just made.
        pub(crate) fn follow<E: Exchange + Sync>(
            &mut self,
            core: &mut E,
            spec: &GridSpec,
            time: f64,
            dt: f64,
        ) -> Result<(), MotionError> {
            match &mut self.0 {
                Some(bodies) => bodies.advance_coupled(&mut CoreColumns { core, spec }, time, dt),
                None => Ok(()),
            }
        }

        /// See [`Bodies::move_ground`].
        pub(crate) fn move_ground(&mut self, ground: &Grid<f32>) {
            if let Some(bodies) = &mut self.0 {
                bodies.move_ground(ground);
            }
        }

        /// See [`Bodies::know_ground`].
        pub(crate) fn know_ground(&mut self, ground: &Grid<f32>) {
            if let Some(bodies) = &mut self.0 {
                bodies.know_ground(ground);
            }
        }

        /// Acts on a body; `None` if there are no bodies.
        pub(crate) fn apply(&mut self, action: &Action) -> Option<Result<(), EventError>> {
            self.0.as_mut().map(|bodies| bodies.apply(action))
        }

        pub(crate) fn poses(&self) -> Option<Vec<BodyPose>> {
            self.0.as_ref().map(Bodies::poses)
        }

        /// Mass of the water that stands in the columns in place of bodies, kg.
        pub(crate) fn displaced_mass(&self, cell_area: f64) -> f64 {
            WATER_DENSITY * self.0.as_ref().map_or(0.0, |b| b.displaced_volume(cell_area))
        }

        /// See [`Bodies::energy`].
        pub(crate) fn energy(&self, level: f64) -> f64 {
            self.0.as_ref().map_or(0.0, |b| b.energy(level))
        }

        pub(crate) fn clamps(&self) -> u64 {
            self.0.as_ref().map_or(0, Bodies::clamps)
        }

        pub(crate) fn bytes(&self) -> u64 {
            self.0.as_ref().map_or(0, Bodies::bytes)
        }

        pub(crate) fn checkpoint(&self) -> Option<BodiesCheckpoint> {
            self.0.as_ref().map(Bodies::checkpoint)
        }

        pub(crate) fn restore(
            &mut self,
            saved: Option<&BodiesCheckpoint>,
            time: f64,
        ) -> Result<(), BodyError> {
            match (&mut self.0, saved) {
                (None, None) => Ok(()),
                (Some(bodies), Some(saved)) => bodies.restore(saved, time),
                _ => Err(BodyError::Saved("it holds other bodies".into())),
            }
        }
    }

    /// The columns of a scheme as bodies see them: smoothed over 3 × 3 cells with the same quadratic B-splines by which
    /// a hull's volume is spread over them, so that the work of a body on the water is what the water's pressure takes
    /// from the body.
    struct CoreColumns<'a, E> {
        core: &'a mut E,
        spec: &'a GridSpec,
    }

    impl<E: Exchange> CoreColumns<'_, E> {
        /// Hands each cell around a place to `each`, with its weight.
        fn around(&self, x: f64, z: f64, mut each: impl FnMut(usize, usize, f64)) {
            let spacing = f64::from(self.spec.spacing);
            let origin = self.spec.origin.as_dvec2();
            let rows = crate::bodies::spread((z - origin.y) / spacing, 0, self.spec.height() - 1);
            let columns = crate::bodies::spread((x - origin.x) / spacing, 0, self.spec.width() - 1);
            for (j, v) in rows {
                for (i, u) in columns {
                    each(i, j, u * v);
                }
            }
        }
    }

    impl<E: Exchange + Sync> Water for CoreColumns<'_, E> {
        fn column(&self, x: f64, z: f64) -> Column {
            let dry = self.core.dry();
            let (mut wet, mut surface, mut bed) = (0.0, 0.0, 0.0);
            self.around(x, z, |i, j, weight| {
                let (h, z) = (self.core.depth(i, j), self.core.bed(i, j));
                bed += weight * z;
                if h > dry {
                    wet += weight;
                    surface += weight * (z + h);
                }
            });
            let surface = if wet >= WET { surface / wet } else { bed };
            Column { surface, bed }
        }

        fn velocity(&self, at: DVec3) -> DVec3 {
            let (mut h, mut qx, mut qz) = (0.0, 0.0, 0.0);
            self.around(at.x, at.z, |i, j, weight| {
                let [x, z] = self.core.discharge(i, j);
                h += weight * self.core.depth(i, j);
                qx += weight * x;
                qz += weight * z;
            });
            if h > self.core.dry() {
                DVec3::new(qx / h, 0.0, qz / h)
            } else {
                DVec3::ZERO
            }
        }

        fn resolution(&self) -> f64 {
            f64::from(self.spec.spacing)
        }

        fn radiates(&self) -> bool {
            true
        }
    }

    impl<E: Exchange + Sync> Columns for CoreColumns<'_, E> {
        fn spec(&self) -> GridSpec {
            *self.spec
        }

        fn add_depth(&mut self, i: usize, j: usize, height: f64) -> f64 {
            let added = self.core.add_depth(i, j, height);
            if added < 0.0 && self.core.depth(i, j) <= self.core.dry() {
                // A column without water holds no momentum.
                let left = self.core.discharge(i, j);
                self.core.add_discharge(i, j, left.map(|q| -q));
            }
            added
        }

        fn add_discharge(&mut self, i: usize, j: usize, discharge: [f64; 2]) {
            if self.core.depth(i, j) > self.core.dry() {
                self.core.add_discharge(i, j, discharge);
            }
        }
    }
}

/// What is left of bodies in a build without them.
#[cfg(not(feature = "bodies"))]
mod left_out {
    use super::super::exchange::Exchange;
    use crate::events::{Action, EventError};
    use crate::frame::BodyPose;
    use crate::grid::{Grid, GridSpec};
    use std::convert::Infallible;

    #[derive(Default)]
    pub(crate) struct Floats;

    impl Floats {
        pub(crate) fn largest_step(&self, _: f64) -> f64 {
            f64::INFINITY
        }
        pub(crate) fn follow<E: Exchange + Sync>(
            &mut self,
            _: &mut E,
            _: &GridSpec,
            _: f64,
            _: f64,
        ) -> Result<(), Infallible> {
            Ok(())
        }
        pub(crate) fn move_ground(&mut self, _: &Grid<f32>) {}
        pub(crate) fn apply(&mut self, _: &Action) -> Option<Result<(), EventError>> {
            None
        }
        pub(crate) fn poses(&self) -> Option<Vec<BodyPose>> {
            None
        }
        pub(crate) fn displaced_mass(&self, _: f64) -> f64 {
            0.0
        }
        pub(crate) fn energy(&self, _: f64) -> f64 {
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
