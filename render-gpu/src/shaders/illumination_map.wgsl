// From sums to relative light. Near the rim light would also come from beyond the grid: there the map gives way to flat
// water, over as much as the beam is shifted.

@group(0) @binding(10) var<storage, read> sums: array<u32>;
@group(0) @binding(11) var<storage, read_write> map: array<f32>;

@compute @workgroup_size(8, 8)
fn normalise(@builtin(global_invocation_id) at: vec3u) {
    let size = stage.map_size;
    if any(at.xy >= size) {
        return;
    }
    let k = at.y * size.x + at.x;
    // Photons a cell of the map.
    let density = f32(stage.photons.x) * f32(stage.photons.y) / f32((size.x - 1u) * (size.y - 1u));
    let value = f32(sums[k]) / (65536.0 * density);
    let p = stage.map_low + vec2f(at.xy) * stage.map_spacing;
    let depth = max(field_height(WATER_FIELD, p) - field_height(GROUND_FIELD, p), 0.0);
    let across = abs(stage.beam_direction.xz) / max(stage.beam_direction.y, 1e-3) + 0.1;
    let margin = across * depth / stage.map_spacing + 1.0;
    let inside = min(vec2f(at.xy), vec2f(size - 1u - at.xy)) / margin;
    let t = clamp(min(inside.x, inside.y) - 1.0, 0.0, 1.0);
    map[k] = 1.0 + (value - 1.0) * t * t * (3.0 - 2.0 * t);
}
