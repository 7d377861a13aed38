// Sunlight that waves gather on the ground, relative to flat water (`render-cpu/src/whitted/caustics.rs`).

@group(0) @binding(7) var<storage, read> illumination_map: array<f32>;

fn map_share(p: vec2f) -> f32 {
    let g = (p - stage.map_low) / stage.map_spacing;
    let last = vec2f(stage.map_size - 1u);
    if any(g < vec2f(0.0)) || any(g > last) {
        return 1.0;
    }
    let cell = min(vec2u(g), stage.map_size - 2u);
    let k = cell.y * stage.map_size.x + cell.x;
    let w = stage.map_size.x;
    let c = vec4f(illumination_map[k], illumination_map[k + 1u], illumination_map[k + w], illumination_map[k + w + 1u]);
    return bilinear(c, g - vec2f(cell));
}

fn beam_received(normal: vec3f, geometric: vec3f, p: vec2f) -> f32 {
    let b = stage.beam_direction;
    let level = b.y * geometric.y / max(dot(geometric, b), 0.1 * b.y);
    return max(dot(normal, b), 0.0) * map_share(p) * level;
}
