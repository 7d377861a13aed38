// What parts of models look like (`sim/src/mesh/texture.rs`): base colours, and pictures of them.
//
// The fourth words of a triangle's six rows are texture coordinates, u of its corners beside the corners, v beside the normals; a seventh
// row has the row of its material, or 0 where the colour is the object's. A material is (red, green, blue, row of the first texel),
// (width, height, border along u, along v) without width if it has no picture; then texels in sRGB, eight bits a colour, four a row.

const TRIANGLE_ROWS: u32 = 7u;
const MIRROR: u32 = 1u;
const CLAMP: u32 = 2u;

// Number of a texel that may lie beyond the border.
fn texel_place(k: i32, size: u32, border: u32) -> u32 {
    let n = max(i32(size), 1);
    if border == CLAMP {
        return u32(clamp(k, 0, n - 1));
    }
    let period = select(n, 2 * n, border == MIRROR);
    let inside = (k % period + period) % period;
    return u32(select(inside, period - 1 - inside, inside >= n));
}

fn texel(material: u32, at: vec2i) -> vec3f {
    let shape = solids[material + 1u];
    let k = texel_place(at.y, shape.y, shape.w) * shape.x + texel_place(at.x, shape.x, shape.z);
    let word = solids[solids[material].w + k / 4u][k % 4u];
    return linear_of_srgb(unpack4x8unorm(word).rgb);
}

// Bilinear between the middles of texels.
fn material_color(material: u32, at: vec2f) -> vec3f {
    let color = row(material);
    let size = solids[material + 1u].xy;
    if size.x == 0u {
        return color;
    }
    let p = at * vec2f(size) - 0.5;
    let cell = vec2i(floor(p));
    let f = p - floor(p);
    let top = mix(texel(material, cell), texel(material, cell + vec2i(1, 0)), f.x);
    let bottom = mix(texel(material, cell + vec2i(0, 1)), texel(material, cell + vec2i(1, 1)), f.x);
    return color * mix(top, bottom, f.y);
}

// Texture coordinates of a corner, 0 to 2, of a triangle that rays meet.
fn coordinates(triangle: u32, corner: u32) -> vec2f {
    return bitcast<vec2f>(vec2u(solids[triangle + corner].w, solids[triangle + corner + 3u].w));
}

// Colour where a ray meets an object: in `triangle`, which is 0 if it has none, at the weights of its second and third corner.
fn hit_color(record: u32, triangle: u32, weights: vec2f) -> vec3f {
    if triangle == 0u {
        return record_color(record);
    }
    let material = solids[triangle + 6u].x;
    if material == 0u {
        return record_color(record);
    }
    let at = (1.0 - weights.x - weights.y) * coordinates(triangle, 0u) + weights.x * coordinates(triangle, 1u)
        + weights.y * coordinates(triangle, 2u);
    return material_color(material, at);
}
