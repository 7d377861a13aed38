//! A vessel that is tilted by hand: in its own axes gravity turns.

use super::touch::Pointer;
use meniscus_sim::Scene;
use meniscus_sim::events::Action;
use meniscus_sim::glam::{DVec3, Vec3};
use meniscus_sim::scene::description::Solver;

/// Steepest tilt, radians.
const STEEPEST: f32 = 75.0 * std::f32::consts::PI / 180.0;

/// Least change that is told, relative to gravity.
const LEAST: f32 = 1e-3;

/// Gravity of the scene in m/s², if its vessel can be tilted.
pub fn gravity(scene: &Scene) -> Option<Vec3> {
    match &scene.description.solver {
        Solver::Sph(sph) => Some(sph.gravity).filter(|gravity| gravity.length() > 0.0),
        _ => None,
    }
}

/// A tilt in hand: the vessel leans as if the pointer held it above its foot.
#[derive(Clone, Debug)]
pub(super) struct Tilting {
    /// Gravity in the upright vessel, m/s².
    upright: Vec3,
    /// Gravity that was told last, m/s².
    told: Vec3,
    /// Where the vessel was taken, metres.
    grip: DVec3,
    /// Distance of that from the eye, metres.
    distance: f64,
    /// Its height above the foot, metres.
    height: f64,
    /// Unit vectors: to the right and up in the picture, and away from the eye on the level.
    axes: [DVec3; 3],
}

impl Tilting {
    /// Takes the vessel where the pointer meets `water`, or beside it.
    pub(super) fn begin(scene: &Scene, pointer: &Pointer, water: Option<Vec3>) -> Option<Self> {
        let upright = gravity(scene)?;
        let extent = scene.grid.extent();
        let middle = scene.grid.origin + 0.5 * extent;
        let near = water.unwrap_or(Vec3::new(middle.x, 0.0, middle.y)).as_dvec3();
        let distance = (near - pointer.eye).dot(pointer.direction).max(1e-6);
        // From straight above, any direction on the level is to the right.
        let right = pointer
            .direction
            .cross(DVec3::Y)
            .try_normalize()
            .unwrap_or(DVec3::X);
        let up = right.cross(pointer.direction);
        Some(Self {
            upright,
            told: upright,
            grip: pointer.eye + distance * pointer.direction,
            distance,
            height: 0.5 * f64::from(extent.min_element()),
            axes: [right, up, DVec3::Y.cross(right)],
        })
    }

    /// Leans the vessel to where the pointer is; `None` if it does so already.
    pub(super) fn follow(&mut self, pointer: &Pointer, strength: f32) -> Option<Action> {
        let moved = pointer.eye + self.distance * pointer.direction - self.grip;
        let [right, up, away] = self.axes;
        let lean = (moved.dot(right) * right + moved.dot(up) * away).as_vec3() / self.height as f32;
        let down = self.upright.normalize();
        let aside = lean - lean.dot(down) * down;
        let angle = (strength * aside.length()).atan().min(STEEPEST);
        let turned = angle.cos() * down + angle.sin() * aside.normalize_or_zero();
        let gravity = self.upright.length() * turned;
        let changed = (gravity - self.told).length() > LEAST * self.upright.length();
        changed.then(|| {
            self.told = gravity;
            Action::Tilt { gravity }
        })
    }

    /// Sets the vessel upright; `None` if it is.
    pub(super) fn end(self) -> Option<Action> {
        let gravity = self.upright;
        (self.told != gravity).then_some(Action::Tilt { gravity })
    }

    /// By how much it is tilted, degrees.
    pub(super) fn degrees(&self) -> f32 {
        self.told.angle_between(self.upright).to_degrees()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use meniscus_sim::glam::dvec3;
    use std::path::Path;

    fn glass() -> Scene {
        let text = "name = \"Glass\"\nduration = 1.0\n[domain]\nsize = [0.2, 0.2]\n[terrain]\nkind = \"flat\"\n\
                    height = -0.1\n[solver]\nkind = \"sph\"\nspacing = 0.02\n";
        Scene::from_toml(text, Path::new("scene.toml"), Path::new("."), &[]).unwrap()
    }

    fn pointer(direction: DVec3) -> Pointer {
        Pointer {
            eye: dvec3(0.1, 0.3, 0.6),
            direction: direction.normalize(),
            pressed: false,
            down: true,
            now: 0.0,
        }
    }

    /// To the right in the picture it leans to the right, upwards it leans away, and gravity only turns.
    #[test]
    fn the_vessel_leans_where_the_hand_goes_and_stands_upright_after() {
        let scene = glass();
        let begin = pointer(dvec3(0.0, -0.3, -0.5));
        let mut tilting = Tilting::begin(&scene, &begin, None).unwrap();
        assert_eq!(tilting.follow(&begin, 1.0), None);
        assert_eq!(tilting.clone().end(), None);
        let right = tilting.follow(&pointer(dvec3(0.05, -0.3, -0.5)), 1.0);
        let Some(Action::Tilt { gravity }) = right else {
            panic!("{right:?}")
        };
        assert!(
            gravity.x > 3.0 && gravity.z.abs() < 0.1 && gravity.y < 0.0,
            "{gravity}"
        );
        assert!((gravity.length() - 9.81).abs() < 1e-4, "{gravity}");
        // Half the width of the domain is its height: 0.05 m over 0.1 m.
        let degrees = tilting.degrees();
        assert!((degrees - 0.5_f32.atan().to_degrees()).abs() < 1.0, "{degrees}");
        let away = tilting.follow(&pointer(dvec3(0.0, -0.25, -0.5)), 1.0);
        let Some(Action::Tilt { gravity }) = away else {
            panic!("{away:?}")
        };
        assert!(gravity.z < -2.0 && gravity.x.abs() < 1e-3, "{gravity}");
        tilting.follow(&pointer(dvec3(9.0, -0.3, -0.5)), 5.0);
        assert!(tilting.degrees() <= 75.01, "{}", tilting.degrees());
        let upright = Vec3::new(0.0, -9.81, 0.0);
        assert_eq!(tilting.end(), Some(Action::Tilt { gravity: upright }));
    }

    #[test]
    fn from_straight_above_it_leans_as_from_anywhere() {
        let scene = glass();
        let mut tilting = Tilting::begin(&scene, &pointer(DVec3::NEG_Y), None).unwrap();
        let right = tilting.follow(&pointer(dvec3(0.2, -1.0, 0.0)), 1.0);
        let Some(Action::Tilt { gravity }) = right else {
            panic!("{right:?}")
        };
        assert!(gravity.x > 1.0 && gravity.z.abs() < 1e-3, "{gravity}");
        assert!(gravity.is_finite());
    }
}
