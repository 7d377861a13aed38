// What the caller has drawn itself: radiance and distance from the eye, a value a pixel, as if it had been drawn before.

@group(0) @binding(14) var<storage, read> foreign: array<vec4f>;

struct Drawn {
    @location(0) radiance: vec4f,
    @builtin(frag_depth) depth: f32,
}

@fragment
fn foreign_layer(@builtin(position) place: vec4f) -> Drawn {
    let at = vec2u(place.xy);
    let it = foreign[at.y * u32(stage.size.x) + at.x];
    // A distance that is not finite is no distance.
    if !(it.w > 0.0 && it.w < 1e15) {
        discard;
    }
    let p = stage.eye + it.w * view_direction(floor(place.xy) + stage.jitter);
    return Drawn(target_value(it.rgb), depth_of(p));
}
