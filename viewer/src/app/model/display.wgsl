// From linear radiance to display values: the steps of `ToneMap::display`, then the transfer curve of sRGB.

struct Map {
    into: mat3x3f,
    out_of: mat3x3f,
    // Gain, contrast, half and scale.
    curve: vec4f,
    size: vec2u,
}

@group(0) @binding(0) var<uniform> map: Map;
@group(0) @binding(1) var<storage, read> picture: array<vec4f>;

@vertex
fn corner(@builtin(vertex_index) k: u32) -> @builtin(position) vec4f {
    // One triangle that covers everything.
    let p = vec2f(f32((k << 1u) & 2u), f32(k & 2u));
    return vec4f(2.0 * p - 1.0, 0.0, 1.0);
}

@fragment
fn show(@builtin(position) at: vec4f) -> @location(0) vec4f {
    let radiance = picture[u32(at.y) * map.size.x + u32(at.x)].xyz;
    let gain = map.curve.x;
    let mixed = map.into * (max(radiance, vec3f(0.0)) * gain);
    let x = pow(clamp(mixed, vec3f(0.0), vec3f(1e6)), vec3f(map.curve.y));
    let y = map.curve.w * x / (x + map.curve.z);
    let linear = clamp(map.out_of * min(y, vec3f(1.0)), vec3f(0.0), vec3f(1.0));
    let low = 12.92 * linear;
    let high = 1.055 * pow(linear, vec3f(1.0 / 2.4)) - 0.055;
    return vec4f(select(high, low, linear <= vec3f(0.0031308)), 1.0);
}
