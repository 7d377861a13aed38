// Light in air and under water (`sim/src/stage/{light,air,volume}.rs`).

// What a target holds: half precision ends at 65504, which the sun's disc exceeds.
fn target_value(radiance: vec3f) -> vec4f {
    return vec4f(select(radiance, min(radiance, vec3f(6e4)), MULTISAMPLED), 1.0);
}

fn azimuth(direction: vec3f) -> f32 {
    return atan2(direction.x, -direction.z);
}

// The haze table stands at the start of the tables.
fn haze(direction: vec3f) -> vec3f {
    let steps = u32(HORIZON_STEPS);
    let x = fract(azimuth(direction) / TAU) * f32(steps);
    let k = u32(x) % steps;
    return mix(table3(3u * k), table3(3u * ((k + 1u) % steps)), fract(x));
}

// Share of light that the air leaves; 1 where haze does not show.
fn air_transmittance(length: f32) -> vec3f {
    if stage.visual_range <= 0.0 {
        return vec3f(1.0);
    }
    let left = exp(HAZE_TINT * (-KOSCHMIEDER * length / stage.visual_range));
    return select(vec3f(1.0), left, min(left.x, min(left.y, left.z)) <= 0.9999);
}

fn sun_disc(direction: vec3f, spread: f32) -> vec3f {
    if stage.has_sun == 0u {
        return vec3f(0.0);
    }
    let variance = 0.25 * (stage.sun_radius * stage.sun_radius + spread * spread);
    let apart = direction - stage.sun_direction;
    let x = 0.5 * dot(apart, apart) / variance;
    if x > 30.0 {
        return vec3f(0.0);
    }
    return stage.sun_irradiance * (exp(-x) / (2.0 * PI * variance));
}

fn towards_sun() -> vec3f {
    let n = stage.sun_direction;
    let radius = stage.sun_radius * sqrt(stage.sun_point.x);
    let angle = TAU * stage.sun_point.y;
    let s = select(-1.0, 1.0, n.z >= 0.0);
    let a = -1.0 / (s + n.z);
    let b = n.x * n.y * a;
    let x = vec3f(1.0 + s * n.x * n.x * a, s * b, -s * n.x);
    let y = vec3f(b, s + n.y * n.y * a, -n.y);
    return normalize(n + radius * (cos(angle) * x + sin(angle) * y));
}

fn escaped(direction: vec3f, spread: f32) -> vec3f {
    return sky_radiance(direction, spread) + sun_disc(direction, spread);
}

fn ambient(normal: vec3f) -> vec3f {
    return sky_irradiance(normal) + stage.from_below * (0.5 * PI * (1.0 - normal.y));
}

fn saturating(rate: f32, distance: f32) -> f32 {
    let x = rate * distance;
    if abs(x) < 1e-2 {
        return select(0.0, distance * (1.0 - 0.5 * x * (1.0 - x / 3.0)), distance < FAR);
    }
    return (1.0 - exp(-x)) / rate;
}

fn scattered_from(irradiance: vec3f, k: vec3f, depth: f32, sinking: f32, distance: f32) -> vec3f {
    let rate = stage.extinction + k * sinking;
    let integral = vec3f(
        saturating(rate.x, distance),
        saturating(rate.y, distance),
        saturating(rate.z, distance),
    );
    return irradiance * exp(-k * depth) * integral;
}

// Radiance scattered into a path under water that starts at `below` and sinks by `sinking` a metre.
fn scattered(below: f32, sinking: f32, distance: f32) -> vec3f {
    let depth = max(below, 0.0);
    let least = select(0.0, -depth / max(distance, 1e-6), distance < FAR);
    let sinks = max(sinking, least);
    let sum = scattered_from(stage.source_sun, stage.rate_sun, depth, sinks, distance)
        + scattered_from(stage.source_sky, stage.rate_sky, depth, sinks, distance);
    return sum * stage.scattering / (4.0 * PI);
}
