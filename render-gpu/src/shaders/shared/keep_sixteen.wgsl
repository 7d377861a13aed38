// As `store_sixteen.wgsl`, for passes that write.

@group(0) @binding(11) var<storage, read_write> fields: array<u32>;

fn height_of(f: u32, units: vec2u) -> vec2f {
    let range = stage.fields[f].range;
    return range.x + vec2f(units) * ((range.y - range.x) / 65535.0);
}

fn stored(f: u32, i: u32, j: u32) -> f32 {
    let row = (stage.fields[f].size.x + 1u) / 2u;
    let word = fields[stage.fields[f].heights + j * row + i / 2u];
    return height_of(f, vec2u(extractBits(word, 16u * (i & 1u), 16u))).x;
}

fn keep_pair(offset: u32, k: u32, pair: vec2f) {
    fields[offset + k] = pack2x16float(pair);
}

fn stored_bounds(f: u32, offset: u32, k: u32) -> vec2f {
    let word = fields[offset + k];
    return height_of(f, vec2u(word & 0xffffu, word >> 16u));
}

// Outwards by half a unit, which no rounding of the heights exceeds.
fn keep_bounds(f: u32, offset: u32, k: u32, bounds: vec2f) {
    let range = stage.fields[f].range;
    let units = (bounds - range.x) * (65535.0 / max(range.y - range.x, 1e-30));
    let low = u32(clamp(floor(units.x - 0.5), 0.0, 65535.0));
    let high = u32(clamp(ceil(units.y + 0.5), 0.0, 65535.0));
    fields[offset + k] = low | (high << 16u);
}
