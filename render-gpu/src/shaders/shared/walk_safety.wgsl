// Baboud & Décoret's walk: steps of the safety radius, within which a ray is taken to cross the surface at most once,
// then a binary search.

const HALVINGS: i32 = 18;

fn above_field(f: u32, o: vec3f, d: vec3f, t: f32) -> f32 {
    let last = vec2f(stage.fields[f].size - 1u);
    let g = clamp((o.xz + t * d.xz - stage.fields[f].low) / stage.fields[f].spacing, vec2f(0.0), last);
    let cell = min(vec2u(g), stage.fields[f].size - 2u);
    return o.y + d.y * t - bilinear(corners_of(f, cell), g - vec2f(cell));
}

fn walk_field(f: u32, o: vec3f, d: vec3f, from_t: f32, to_t: f32) -> f32 {
    let across = max(length(d.xz), 1e-6);
    // A steep ray crosses the slab before it leaves the radius; it is still looked at twice.
    let longest = max(0.5 * (to_t - from_t), 1e-9);
    let above = above_field(f, o, d, from_t) >= 0.0;
    let side = select(-1.0, 1.0, above);
    var low = from_t;
    for (var n = 0; n < 4096; n++) {
        if low >= to_t {
            break;
        }
        let step = min(safe_radius(f, o.xz + low * d.xz, above) / across, longest);
        var high = min(low + step, to_t);
        if side * above_field(f, o, d, high) < 0.0 {
            for (var k = 0; k < HALVINGS; k++) {
                let middle = 0.5 * (low + high);
                if side * above_field(f, o, d, middle) < 0.0 {
                    high = middle;
                } else {
                    low = middle;
                }
            }
            return high;
        }
        low = high;
    }
    return FAR;
}
