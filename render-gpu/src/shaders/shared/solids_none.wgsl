// A scene without objects.

struct SolidHit {
    t: f32,
    normal: vec3f,
    shading: vec3f,
    color: vec3f,
}

fn cast_solids(o: vec3f, d: vec3f, t_max: f32) -> SolidHit {
    return SolidHit(FAR, vec3f(0.0), vec3f(0.0), vec3f(0.0));
}

fn solid_color(k: u32) -> vec3f {
    return vec3f(0.0);
}
