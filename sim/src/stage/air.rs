//! What happens to light on its way through the air.

use super::light::Light;
use glam::Vec3;

/// Koschmieder: the extinction over the visual range leaves 2 % of contrast.
pub const KOSCHMIEDER: f32 = 3.912;
/// Extinction of haze for red, green, blue against the mean: air scatters blue most.
pub const HAZE_TINT: Vec3 = Vec3::new(0.75, 1.0, 1.4);

/// Share of light left after `length` metres of air with that visual range; `None` where haze does not show.
pub fn transmittance(visual_range: Option<f32>, length: f32) -> Option<Vec3> {
    let left = (HAZE_TINT * (-KOSCHMIEDER * length / visual_range?)).exp();
    (left.min_element() <= 0.9999).then_some(left)
}

/// Haze over a way through the air: what is lost is replaced by the colour of the horizon.
pub fn through(light: &Light, visual_range: Option<f32>, seen: Vec3, direction: Vec3, length: f32) -> Vec3 {
    match transmittance(visual_range, length) {
        Some(left) => seen * left + light.sky.haze(direction) * (1.0 - left),
        None => seen,
    }
}
