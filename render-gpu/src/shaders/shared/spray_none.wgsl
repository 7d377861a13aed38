// A frame without droplets.

fn cast_spray(o: vec3f, d: vec3f, t_max: f32) -> vec2f {
    return vec2f(FAR, 0.0);
}

fn droplet(k: u32) -> vec4f {
    return vec4f(0.0);
}
