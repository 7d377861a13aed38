// Heights and bounds in 16 bits of the field's range, two a word; slopes and radii in half precision.

@group(0) @binding(1) var<storage, read> heights: array<u32>;

fn height_of(f: u32, units: vec2u) -> vec2f {
    let range = stage.fields[f].range;
    return range.x + vec2f(units) * ((range.y - range.x) / 65535.0);
}

fn sample_at(f: u32, i: u32, j: u32) -> f32 {
    let row = (stage.fields[f].size.x + 1u) / 2u;
    let word = heights[stage.fields[f].heights + j * row + i / 2u];
    return height_of(f, vec2u(extractBits(word, 16u * (i & 1u), 16u))).x;
}

// The four samples around cell (i, j): (i, j), (i+1, j), (i, j+1), (i+1, j+1).
fn corners_of(f: u32, cell: vec2u) -> vec4f {
    let row = (stage.fields[f].size.x + 1u) / 2u;
    let k = stage.fields[f].heights + cell.y * row + cell.x / 2u;
    var words = vec2u(heights[k], heights[k + row]);
    var units = vec4u(words & vec2u(0xffffu), words >> vec2u(16u)).xzyw;
    if (cell.x & 1u) == 1u {
        units = vec4u(words >> vec2u(16u), vec2u(heights[k + 1u], heights[k + row + 1u]) & vec2u(0xffffu)).xzyw;
    }
    return vec4f(height_of(f, units.xy), height_of(f, units.zw));
}

// Pair `k` of those that start at word `offset`.
fn pair_at(offset: u32, k: u32) -> vec2f {
    return unpack2x16float(heights[offset + k]);
}

// Lowest and highest of block `k` of a level that starts at word `offset`.
fn bounds_at(f: u32, offset: u32, k: u32) -> vec2f {
    let word = heights[offset + k];
    return height_of(f, vec2u(word & 0xffffu, word >> 16u));
}
