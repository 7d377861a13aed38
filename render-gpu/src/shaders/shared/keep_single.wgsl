// As `store_single.wgsl`, for passes that write.

@group(0) @binding(11) var<storage, read_write> fields: array<f32>;

fn stored(f: u32, i: u32, j: u32) -> f32 {
    return fields[stage.fields[f].heights + j * stage.fields[f].size.x + i];
}

fn keep_pair(offset: u32, k: u32, pair: vec2f) {
    fields[offset + 2u * k] = pair.x;
    fields[offset + 2u * k + 1u] = pair.y;
}

fn stored_bounds(f: u32, offset: u32, k: u32) -> vec2f {
    return vec2f(fields[offset + 2u * k], fields[offset + 2u * k + 1u]);
}

fn keep_bounds(f: u32, offset: u32, k: u32, bounds: vec2f) {
    keep_pair(offset, k, bounds);
}
