//! A camera that orbits, pans, zooms and flies.

use meniscus_render_cpu::camera::{self, AUTOMATIC};
use meniscus_sim::Scene;
use meniscus_sim::glam::{DVec3, UVec2, Vec2, Vec3, vec2};
use meniscus_sim::render::View;
use meniscus_sim::stage::Lens;

/// Steepest view, radians: short of straight up or down, where "up" would have no direction.
const STEEPEST: f32 = 1.5533;

/// A named place to look from.
#[derive(Clone, Debug, PartialEq)]
pub struct Bookmark {
    /// Its name.
    pub name: String,
    /// The place.
    pub camera: Camera,
    /// Exposure in stops.
    pub exposure: f32,
}

/// See the module.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// Point that is looked at, metres.
    pub target: Vec3,
    /// Direction from the target to the eye about +Y, radians; 0 looks from +Z.
    pub yaw: f32,
    /// Height of the eye above the target as an angle, radians.
    pub pitch: f32,
    /// From the eye to the target, metres.
    pub distance: f32,
    /// Full vertical angle of view, radians.
    pub fov: f32,
}

impl Camera {
    /// The camera that a view has.
    pub fn of(view: &View) -> Self {
        let back = view.position - view.target;
        let distance = back.length().max(1e-3);
        Self {
            target: view.target,
            yaw: back.x.atan2(back.z),
            pitch: (back.y / distance)
                .clamp(-1.0, 1.0)
                .asin()
                .clamp(-STEEPEST, STEEPEST),
            distance,
            fov: view.vertical_fov,
        }
    }

    /// The scene's cameras by name, and last the one that sees the whole domain.
    pub fn bookmarks(scene: &Scene, size: UVec2) -> Vec<Bookmark> {
        let named = scene.description.cameras.iter().map(|c| c.name.as_str());
        let mark = |name: &str| {
            Some(Bookmark {
                name: name.to_owned(),
                camera: Self::of(&camera::view(scene, Some(name), size, 1).ok()?),
                exposure: camera::exposure(scene, Some(name)).ok()?,
            })
        };
        named.chain([AUTOMATIC]).filter_map(mark).collect()
    }

    /// Direction from the target to the eye, a unit vector.
    fn back(&self) -> Vec3 {
        let (sin, cos) = self.pitch.sin_cos();
        Vec3::new(cos * self.yaw.sin(), sin, cos * self.yaw.cos())
    }

    /// Where the eye is, metres.
    pub fn position(&self) -> Vec3 {
        self.target + self.distance * self.back()
    }

    /// The view of that size.
    pub fn view(&self, size: UVec2, samples: u32) -> View {
        View {
            position: self.position(),
            target: self.target,
            up: Vec3::Y,
            vertical_fov: self.fov,
            size,
            samples,
            pass: 0,
        }
    }

    /// Unit vectors to the right and up in the picture.
    fn axes(&self) -> (Vec3, Vec3) {
        let right = Vec3::Y.cross(self.back()).normalize_or(Vec3::X);
        (right, self.back().cross(right))
    }

    /// Turns about the target by a motion of the pointer in units of the picture's height.
    pub fn orbit(&mut self, by: Vec2) {
        self.yaw = (self.yaw - 3.0 * by.x).rem_euclid(std::f32::consts::TAU);
        self.pitch = (self.pitch + 3.0 * by.y).clamp(-STEEPEST, STEEPEST);
    }

    /// Moves along the picture by a motion of the pointer in units of the picture's height: what is at the target's
    /// distance stays under the pointer.
    pub fn pan(&mut self, by: Vec2) {
        let (right, up) = self.axes();
        let scale = 2.0 * self.distance * (0.5 * self.fov).tan();
        self.target += scale * (up * by.y - right * by.x);
    }

    /// Goes nearer by a factor.
    pub fn zoom(&mut self, factor: f32) {
        self.distance = (self.distance / factor.clamp(0.1, 10.0)).clamp(1e-3, 1e6);
    }

    /// Moves the eye and the target forwards, to the right and up, in units of the distance.
    pub fn fly(&mut self, by: Vec3) {
        let (right, _) = self.axes();
        let forward = -self.back();
        self.target += self.distance * (by.x * right + by.y * Vec3::Y + by.z * forward);
    }

    /// Where a point of the world is seen in a picture of that shape (width over height), as for [`Self::ray`]; `None`
    /// behind the eye.
    pub fn project(&self, point: Vec3, aspect: f32) -> Option<Vec2> {
        let (right, up) = self.axes();
        let to = point - self.position();
        let depth = -to.dot(self.back());
        let half = (0.5 * self.fov).tan();
        let off = vec2(to.dot(right) / aspect, -to.dot(up)) / (depth * half);
        (depth > 0.0).then(|| vec2(0.5, 0.5) + 0.5 * off)
    }

    /// Eye and unit direction of the ray through a place in the picture, (0, 0) at its top left and (1, 1) at its bottom right.
    pub fn ray(&self, place: Vec2, size: UVec2) -> Option<(DVec3, DVec3)> {
        let lens = Lens::new(&self.view(size, 1)).ok()?;
        let pixel = place * vec2(size.x as f32, size.y as f32);
        Some((lens.eye, lens.direction(f64::from(pixel.x), f64::from(pixel.y))))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn near(a: Vec3, b: Vec3) -> bool {
        (a - b).length() < 1e-4 * (1.0 + b.length())
    }

    fn camera() -> Camera {
        Camera::of(&View {
            position: Vec3::new(3.0, 4.0, 5.0),
            target: Vec3::new(1.0, 0.5, -1.0),
            up: Vec3::Y,
            vertical_fov: 0.8,
            size: UVec2::new(400, 300),
            samples: 1,
            pass: 0,
        })
    }

    #[test]
    fn a_view_comes_back() {
        assert!(near(camera().position(), Vec3::new(3.0, 4.0, 5.0)));
        assert!(near(
            camera().view(UVec2::ONE, 1).target,
            Vec3::new(1.0, 0.5, -1.0)
        ));
    }

    #[test]
    fn orbits_keep_their_distance_and_never_tip_over() {
        let mut c = camera();
        let before = c.distance;
        for k in 0..100 {
            c.orbit(vec2(0.1, if k < 50 { 0.2 } else { -0.3 }));
            assert!(c.pitch.abs() < std::f32::consts::FRAC_PI_2);
            assert!(Lens::new(&c.view(UVec2::new(4, 3), 1)).is_ok());
            assert!((c.position().distance(c.target) - before).abs() < 1e-4 * before);
        }
    }

    #[test]
    fn what_is_panned_stays_under_the_pointer() {
        let size = UVec2::new(400, 300);
        let mut c = camera();
        let held = c.target.as_dvec3();
        c.pan(vec2(0.2, -0.1));
        // In units of the height, from the centre.
        let place = vec2(0.5 + 0.2 * 300.0 / 400.0, 0.5 - 0.1);
        let (eye, direction) = c.ray(place, size).unwrap();
        let off = (held - eye) - (held - eye).dot(direction) * direction;
        assert!(off.length() < 1e-3, "{}", off.length());
        let seen = c.project(held.as_vec3(), 400.0 / 300.0).unwrap();
        assert!((seen - place).length() < 1e-4, "{seen} for {place}");
    }
}
