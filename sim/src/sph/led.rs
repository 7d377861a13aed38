//! Obstacles that the water does not move: they follow their scene, until a hand takes them.

use crate::frame::BodyPose;
use crate::scene::description::{Motion, Object};
use glam::{DVec3, Vec3};

/// Angular frequency of the critically damped spring between hand and obstacle, rad/s: as stiff as a hand on a body.
const SPRING: f64 = 10.0;

/// The objects of a scene, by their place in it, with the hands on them.
#[derive(Debug, Default)]
pub(super) struct Led {
    objects: Vec<Object>,
    hands: Vec<Option<Hand>>,
}

/// An obstacle that a hand holds, or has put down: its origin goes to `target`, its rotation stays.
#[derive(Clone, Debug)]
struct Hand {
    target: DVec3,
    /// Pose at `since` seconds.
    pose: BodyPose,
    since: f64,
}

impl Hand {
    /// Origin and velocity at `time`: with e the way from the target, e'' = −2ω e' − ω² e.
    fn at(&self, time: f64) -> [DVec3; 2] {
        let t = time - self.since;
        let away = self.pose.position.as_dvec3() - self.target;
        let velocity = self.pose.velocity.as_dvec3();
        let kick = velocity + SPRING * away;
        let fade = (-SPRING * t).exp();
        [
            self.target + fade * (away + t * kick),
            fade * (velocity - SPRING * t * kick),
        ]
    }
}

impl Led {
    pub(super) fn new(objects: Vec<Object>) -> Self {
        let hands = vec![None; objects.len()];
        Self { objects, hands }
    }

    /// Whether there are no objects, those that the water moves included.
    pub(super) fn is_empty(&self) -> bool {
        self.objects.is_empty()
    }

    /// Where object `k` is led to at `time` seconds, in the order of the scene; `None` for what the water moves.
    pub(super) fn poses_at(&self, time: f64) -> impl Iterator<Item = Option<BodyPose>> + '_ {
        let led = |k: usize| self.objects[k].motion != Motion::Free;
        (0..self.objects.len()).map(move |k| led(k).then(|| self.pose_at(k, time)))
    }

    /// Where object `k` is at `time` seconds as far as it is led; a body that floats is where it started.
    pub(super) fn pose_at(&self, k: usize, time: f64) -> BodyPose {
        match &self.hands[k] {
            None => self.objects[k].pose_at(time),
            Some(hand) => {
                let [position, velocity] = hand.at(time);
                BodyPose {
                    position: position.as_vec3(),
                    velocity: velocity.as_vec3(),
                    ..hand.pose
                }
            }
        }
    }

    /// The object of this name that the water does not move.
    pub(super) fn find(&self, name: &str) -> Option<usize> {
        let led = |o: &Object| o.name == name && o.motion != Motion::Free;
        self.objects.iter().position(led)
    }

    /// From `time` on a hand pulls the point `grip` (object axes) of object `k` to `target`. It turns no more, and what its scene
    /// had in mind for it is over.
    pub(super) fn drag(&mut self, k: usize, grip: Vec3, target: Vec3, time: f64) {
        let pose = BodyPose {
            angular_velocity: Vec3::ZERO,
            ..self.pose_at(k, time)
        };
        self.hands[k] = Some(Hand {
            target: (target - pose.rotation * grip).as_dvec3(),
            pose,
            since: time,
        });
    }

    /// The hand on object `k`, if there is one, lets go at `time`: the object comes to rest without turning back.
    pub(super) fn release(&mut self, k: usize, time: f64) {
        if let Some(hand) = &self.hands[k] {
            let [position, velocity] = hand.at(time);
            // The one target towards which a critically damped motion slows down all the way.
            let target = position + velocity / SPRING;
            self.drag(k, Vec3::ZERO, target.as_vec3(), time);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn post() -> Led {
        let object = Object {
            position: Vec3::new(1.0, 0.0, 2.0),
            ..toml::from_str("name = 'post'\nshape = { kind = 'sphere', radius = 0.1 }").unwrap()
        };
        Led::new(vec![object])
    }

    #[test]
    fn a_hand_pulls_without_a_jump_and_the_obstacle_stays_where_it_is_put() {
        let mut led = post();
        assert_eq!((led.find("post"), led.find("cat")), (Some(0), None));
        let grip = Vec3::new(0.0, 0.1, 0.0);
        led.drag(0, grip, Vec3::new(2.0, 0.1, 2.0), 0.5);
        // The steepest of a critically damped pull: ω e⁻¹ times the way, after 1/ω.
        let fastest = led.pose_at(0, 0.6).velocity.x;
        assert!((fastest - 10.0 / std::f32::consts::E).abs() < 1e-4, "{fastest}");
        let h = 1e-4_f64;
        for time in [0.5, 0.55, 0.7, 1.3] {
            let [a, b] = [time - h, time + h].map(|t| led.pose_at(0, t.max(0.5)));
            let rate = (b.position - a.position) / ((time + h) - (time - h).max(0.5)) as f32;
            let told = led.pose_at(0, time).velocity;
            assert!((rate - told).length() < 0.02, "{rate} against {told} at {time}");
        }
        // Let go in flight: neither a jump nor a way back.
        let before = led.pose_at(0, 0.6);
        led.release(0, 0.6);
        let after = led.pose_at(0, 0.6);
        assert!((before.position - after.position).length() < 1e-6);
        assert!((before.velocity - after.velocity).length() < 1e-4);
        let mut x = after.position.x;
        for k in 1..100 {
            let next = led.pose_at(0, 0.6 + 0.02 * f64::from(k)).position.x;
            assert!(next >= x, "back from {x} to {next}");
            x = next;
        }
        assert!((x - before.position.x - 0.1 * before.velocity.x).abs() < 1e-4);
    }
}
