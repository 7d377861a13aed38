//! Every optical constant and formula of the project, once.
//!
//! WGSL gets the constants and functions as a generated prelude under the same names; a parity test evaluates both
//! on one table. Directions are unit vectors and point the way the light or the ray travels.

use glam::Vec3;

/// Linear light of an sRGB value, both 0 to 1 (IEC 61966-2-1).
pub fn linear_of_srgb(c: f32) -> f32 {
    if c <= 0.040_45 {
        c / 12.92
    } else {
        ((c + 0.055) / 1.055).powf(2.4)
    }
}

/// Refractive index of fresh water at 20 °C for 589 nm (Hale & Querry 1973), the default of scenes.
pub const WATER_INDEX: f32 = 1.333;

/// Absorption coefficients of clear water for red, green, blue (about 640, 540, 450 nm) in 1/m
/// (Pope & Fry 1997, rounded).
pub const WATER_ABSORPTION: Vec3 = Vec3::new(0.31, 0.047, 0.0092);

/// Scattering coefficients of clear coastal water for red, green, blue in 1/m: the small end of Petzold's 1972
/// measurements, wavelength dependence dropped.
pub const WATER_SCATTERING: Vec3 = Vec3::new(0.010, 0.012, 0.014);

/// Density of water in kg/m³.
pub const WATER_DENSITY: f64 = 1000.0;

/// Angular radius of the solar disc in radians (mean, 0.2665°).
pub const SUN_ANGULAR_RADIUS: f32 = 4.652e-3;

/// Reflectance at normal incidence between media of relative index `n` (Fresnel): ((n − 1)/(n + 1))².
pub fn reflectance_at_normal(n: f32) -> f32 {
    let r = (n - 1.0) / (n + 1.0);
    r * r
}

/// Unpolarised Fresnel reflectance of a dielectric interface.
///
/// `cos_i` is the cosine of the angle of incidence (0 to 1), `eta` the index of the side of incidence over the index
/// of the far side. Total internal reflection gives exactly 1.
pub fn fresnel(cos_i: f32, eta: f32) -> f32 {
    let cos_i = cos_i.clamp(0.0, 1.0);
    let sin2_t = eta * eta * (1.0 - cos_i * cos_i);
    if sin2_t >= 1.0 {
        return 1.0;
    }
    let cos_t = (1.0 - sin2_t).sqrt();
    let s = (eta * cos_i - cos_t) / (eta * cos_i + cos_t);
    let p = (cos_i - eta * cos_t) / (cos_i + eta * cos_t);
    0.5 * (s * s + p * p)
}

/// Schlick's 1994 approximation of [`fresnel`] from air, F0 + (1 − F0)(1 − cosθ)⁵. Ojeda & Susín's (5) omits the power.
pub fn fresnel_schlick(cos_i: f32, f0: f32) -> f32 {
    let m = 1.0 - cos_i.clamp(0.0, 1.0);
    let m2 = m * m;
    f0 + (1.0 - f0) * m2 * m2 * m
}

/// Mirror direction of `direction` at a surface of unit `normal`.
pub fn reflect(direction: Vec3, normal: Vec3) -> Vec3 {
    direction - 2.0 * direction.dot(normal) * normal
}

/// Refracted direction by Snell's law, or `None` at total internal reflection.
///
/// `normal` must face the incoming ray (`direction · normal <= 0`); `eta` is the index of the side of incidence over
/// that of the far side.
pub fn refract(direction: Vec3, normal: Vec3, eta: f32) -> Option<Vec3> {
    let cos_i = -direction.dot(normal);
    let k = 1.0 - eta * eta * (1.0 - cos_i * cos_i);
    if k < 0.0 {
        return None;
    }
    Some((eta * direction + (eta * cos_i - k.sqrt()) * normal).normalize())
}

/// Share of light left after `distance` metres in a medium of `attenuation` per metre (Beer–Lambert), per colour.
pub fn transmittance(attenuation: Vec3, distance: f32) -> Vec3 {
    (-attenuation * distance).exp()
}

/// Phase function of Henyey & Greenstein 1941, per steradian; `g` in (−1, 1) is the mean cosine of scattering.
pub fn henyey_greenstein(cos_theta: f32, g: f32) -> f32 {
    let d = 1.0 + g * g - 2.0 * g * cos_theta;
    (1.0 - g * g) / (4.0 * std::f32::consts::PI * d * d.sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normal_incidence_and_grazing_have_their_closed_forms() {
        let f0 = reflectance_at_normal(WATER_INDEX);
        assert!((f0 - 0.020_373).abs() < 1e-5);
        assert!((fresnel(1.0, 1.0 / WATER_INDEX) - f0).abs() < 1e-7);
        assert!((fresnel(1.0, WATER_INDEX) - f0).abs() < 1e-7);
        assert!((fresnel(0.0, 1.0 / WATER_INDEX) - 1.0).abs() < 1e-6);
        assert_eq!(fresnel_schlick(1.0, f0), f0);
        assert_eq!(fresnel_schlick(0.0, f0), 1.0);
    }

    #[test]
    fn fresnel_is_the_same_along_a_path_and_back() {
        for k in 1..=100 {
            let cos_i = k as f32 / 100.0;
            let sin_t = (1.0 - cos_i * cos_i).sqrt() / WATER_INDEX;
            let cos_t = (1.0 - sin_t * sin_t).sqrt();
            let down = fresnel(cos_i, 1.0 / WATER_INDEX);
            let up = fresnel(cos_t, WATER_INDEX);
            // The slope of F is about 6 at grazing incidence and cos_t is only known to one rounding over cos_i.
            assert!((down - up).abs() < 1e-6 / cos_i, "{cos_i}: {down} {up}");
        }
    }

    #[test]
    fn refraction_obeys_snell_and_stays_in_plane() {
        let normal = Vec3::new(0.2, 0.9, -0.1).normalize();
        let direction = Vec3::new(0.5, -0.8, 0.3).normalize();
        let t = refract(direction, normal, 1.0 / WATER_INDEX).unwrap();
        let sin_i = direction.cross(normal).length();
        let sin_t = t.cross(normal).length();
        assert!((sin_i - WATER_INDEX * sin_t).abs() < 1e-6);
        assert!(direction.cross(normal).dot(t).abs() < 1e-6);
        assert!((t.length() - 1.0).abs() < 1e-6);
    }

    #[test]
    fn the_critical_angle_separates_refraction_from_total_reflection() {
        let critical = (1.0 / WATER_INDEX).asin();
        let ray = |angle: f32| Vec3::new(angle.sin(), -angle.cos(), 0.0);
        assert!(refract(ray(critical - 1e-3), Vec3::Y, WATER_INDEX).is_some());
        assert!(refract(ray(critical + 1e-3), Vec3::Y, WATER_INDEX).is_none());
        assert_eq!(fresnel((critical + 1e-3).cos(), WATER_INDEX), 1.0);
    }

    #[test]
    fn attenuation_multiplies_along_a_path_and_phase_function_integrates_to_one() {
        let a = WATER_ABSORPTION;
        let parts = transmittance(a, 1.5) * transmittance(a, 2.5);
        assert!((parts - transmittance(a, 4.0)).abs().max_element() < 1e-6);
        let n = 20_000;
        let total: f32 = (0..n)
            .map(|k| henyey_greenstein(-1.0 + 2.0 * (k as f32 + 0.5) / n as f32, 0.7) * 2.0 / n as f32)
            .sum::<f32>()
            * std::f32::consts::TAU;
        assert!((total - 1.0).abs() < 1e-3, "{total}");
    }
}
