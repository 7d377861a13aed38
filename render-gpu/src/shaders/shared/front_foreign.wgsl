// What the caller has drawn (`foreign.wgsl`), where it is nearer than what a ray meets.

@group(0) @binding(14) var<storage, read> foreign: array<vec4f>;

fn in_front(at: vec2i, met: Traced) -> vec3f {
    let it = foreign[u32(at.y) * u32(stage.size.x) + u32(at.x)];
    return select(met.radiance, target_value(it.rgb).rgb, it.w > 0.0 && it.w < met.distance);
}
