// A sky of one radiance (`sim/src/stage/sky.rs`).

fn sky_radiance(direction: vec3f, spread: f32) -> vec3f {
    return stage.sky_scale;
}

fn sky_irradiance(normal: vec3f) -> vec3f {
    return stage.sky_scale * (0.5 * PI * (1.0 + normal.y));
}
