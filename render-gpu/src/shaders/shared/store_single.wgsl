// Heights, slopes, radii and bounds in single precision.

@group(0) @binding(1) var<storage, read> heights: array<f32>;

fn sample_at(f: u32, i: u32, j: u32) -> f32 {
    return heights[stage.fields[f].heights + j * stage.fields[f].size.x + i];
}

// The four samples around cell (i, j): (i, j), (i+1, j), (i, j+1), (i+1, j+1).
fn corners_of(f: u32, cell: vec2u) -> vec4f {
    let k = stage.fields[f].heights + cell.y * stage.fields[f].size.x + cell.x;
    let w = stage.fields[f].size.x;
    return vec4f(heights[k], heights[k + 1u], heights[k + w], heights[k + w + 1u]);
}

// Pair `k` of those that start at word `offset`.
fn pair_at(offset: u32, k: u32) -> vec2f {
    return vec2f(heights[offset + 2u * k], heights[offset + 2u * k + 1u]);
}

// Lowest and highest of block `k` of a level that starts at word `offset`.
fn bounds_at(f: u32, offset: u32, k: u32) -> vec2f {
    return pair_at(offset, k);
}
