// The formulas of `sim/src/optics.rs` under the same names; its constants come before, generated.

fn linear_of_srgb(c: vec3f) -> vec3f {
    return select(pow((c + 0.055) / 1.055, vec3f(2.4)), c / 12.92, c <= vec3f(0.04045));
}

fn reflectance_at_normal(n: f32) -> f32 {
    let r = (n - 1.0) / (n + 1.0);
    return r * r;
}

fn fresnel(cos_incident: f32, eta: f32) -> f32 {
    let cos_i = clamp(cos_incident, 0.0, 1.0);
    let sin2_t = eta * eta * (1.0 - cos_i * cos_i);
    if sin2_t >= 1.0 {
        return 1.0;
    }
    let cos_t = sqrt(1.0 - sin2_t);
    let s = (eta * cos_i - cos_t) / (eta * cos_i + cos_t);
    let p = (cos_i - eta * cos_t) / (cos_i + eta * cos_t);
    return 0.5 * (s * s + p * p);
}

fn fresnel_schlick(cos_i: f32, f0: f32) -> f32 {
    let m = 1.0 - clamp(cos_i, 0.0, 1.0);
    let m2 = m * m;
    return f0 + (1.0 - f0) * m2 * m2 * m;
}

// WGSL has built-in functions of the plain names.
fn optics_reflect(direction: vec3f, normal: vec3f) -> vec3f {
    return direction - 2.0 * dot(direction, normal) * normal;
}

// Zero at total reflection.
fn optics_refract(direction: vec3f, normal: vec3f, eta: f32) -> vec3f {
    let cos_i = -dot(direction, normal);
    let k = 1.0 - eta * eta * (1.0 - cos_i * cos_i);
    if k < 0.0 {
        return vec3f(0.0);
    }
    return normalize(eta * direction + (eta * cos_i - sqrt(k)) * normal);
}

fn transmittance(attenuation: vec3f, distance: f32) -> vec3f {
    return exp(-attenuation * distance);
}

fn henyey_greenstein(cos_theta: f32, g: f32) -> f32 {
    let d = 1.0 + g * g - 2.0 * g * cos_theta;
    return (1.0 - g * g) / (4.0 * PI * d * sqrt(d));
}
