//! Views of a scene: the cameras that it names, or one that sees the whole domain.

use glam::{DVec2, DVec3, UVec2, Vec3, dvec3};
use meniscus_sim::Scene;
use meniscus_sim::render::{Image, View};
use meniscus_sim::scene::description::Camera;
pub(crate) use meniscus_sim::stage::Lens;

/// Why no view can be made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CameraError {
    /// The scene has no camera of that name.
    #[error("the scene has no camera `{name}`; {known}")]
    Unknown {
        /// The name asked for.
        name: String,
        /// Which names there are.
        known: String,
    },
    /// The image size is impossible.
    #[error("image of {0} x {1} pixels; each side must be 1 to {max}", max = Image::MAX_SIDE)]
    Size(u32, u32),
    /// No sample a pixel.
    #[error("0 samples a pixel; ask for at least 1")]
    Samples,
}

/// The name under which the automatic camera can be asked for.
pub const AUTOMATIC: &str = "auto";

/// The view of the camera called `name`; without a name the scene's first camera, and where the scene has none one
/// that sees the whole domain. The name `auto` always gives the latter.
///
/// # Errors
/// [`CameraError`]: the name is unknown (the message lists the known ones), or size or samples are out of range.
pub fn view(scene: &Scene, name: Option<&str>, size: UVec2, samples: u32) -> Result<View, CameraError> {
    if size.min_element() == 0 || size.max_element() > Image::MAX_SIDE {
        return Err(CameraError::Size(size.x, size.y));
    }
    if samples == 0 {
        return Err(CameraError::Samples);
    }
    Ok(match find(scene, name)? {
        Some(camera) => View {
            position: camera.position,
            target: camera.target,
            up: up_for(camera.target - camera.position),
            vertical_fov: camera.fov.to_radians(),
            size,
            samples,
            pass: 0,
        },
        None => automatic(scene, size, samples),
    })
}

/// Exposure in stops of the camera that [`view`] would use; 0 for the automatic one.
///
/// # Errors
/// [`CameraError::Unknown`].
pub fn exposure(scene: &Scene, name: Option<&str>) -> Result<f32, CameraError> {
    Ok(find(scene, name)?.map_or(0.0, |camera| camera.exposure))
}

fn find<'a>(scene: &'a Scene, name: Option<&str>) -> Result<Option<&'a Camera>, CameraError> {
    let cameras = &scene.description.cameras;
    match name {
        None => Ok(cameras.first()),
        Some(name) => match cameras.iter().find(|c| c.name == name) {
            Some(camera) => Ok(Some(camera)),
            None if name == AUTOMATIC => Ok(None),
            None => {
                let names: Vec<String> = cameras
                    .iter()
                    .map(|c| format!("`{}`", c.name))
                    .chain([format!("`{AUTOMATIC}`")])
                    .collect();
                Err(CameraError::Unknown {
                    name: name.to_owned(),
                    known: format!("there are {}", names.join(", ")),
                })
            }
        },
    }
}

/// World up, or north where the view is vertical.
fn up_for(direction: Vec3) -> Vec3 {
    let d = direction.normalize_or_zero();
    if d.x.hypot(d.z) < 1e-3 {
        Vec3::NEG_Z
    } else {
        Vec3::Y
    }
}

/// A view of the whole domain from the south-east, 24° above the horizon, as near as the frame allows.
fn automatic(scene: &Scene, size: UVec2, samples: u32) -> View {
    let spec = scene.grid;
    let (lo, extent) = (
        spec.origin.as_dvec2(),
        spec.extent().max(glam::Vec2::splat(spec.spacing)).as_dvec2(),
    );
    let level = f64::from(scene.description.water.level);
    // The whole domain at the level of the water, and the ground's heights where there is ground.
    let (mut low, mut high) = (level, level);
    let corners = |y: f64| {
        [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)].map(|(u, v)| (lo + DVec2::new(u, v) * extent, y))
    };
    if let Some(ground) = scene.ground_on_grid() {
        let (a, b) = ground.range();
        low = low.min(f64::from(a)).max(level - 0.5 * extent.max_element());
        high = high.max(f64::from(b));
    }
    let centre = lo + 0.5 * extent;
    let target = dvec3(centre.x, 0.5 * (low + high), centre.y);
    let fov = 40.0_f64.to_radians();
    let (azimuth, elevation) = (32.0_f64.to_radians(), 24.0_f64.to_radians());
    let back = dvec3(
        azimuth.sin() * elevation.cos(),
        elevation.sin(),
        azimuth.cos() * elevation.cos(),
    );
    let right = DVec3::Y.cross(back).normalize();
    let up = back.cross(right);
    let tan_y = (0.5 * fov).tan();
    let tan_x = tan_y * f64::from(size.x) / f64::from(size.y);
    let mut distance = 0.0_f64;
    for (p, y) in corners(low).into_iter().chain(corners(high)) {
        let q = dvec3(p.x, y, p.y) - target;
        let depth = q.dot(back);
        distance = distance
            .max(depth + q.dot(right).abs() / tan_x)
            .max(depth + q.dot(up).abs() / tan_y);
    }
    let mut eye = target + back * (1.02 * distance);
    if let Some(terrain) = &scene.terrain {
        // Never inside a hill.
        let ground = f64::from(terrain.sample(glam::vec2(eye.x as f32, eye.z as f32)));
        eye.y = eye.y.max(ground + 0.02 * extent.max_element());
    }
    View {
        position: eye.as_vec3(),
        target: target.as_vec3(),
        up: Vec3::Y,
        vertical_fov: fov as f32,
        size,
        samples,
        pass: 0,
    }
}
