// Safety radii (Baboud & Décoret 2006, 4.1): within how many samples of a texel a ray that starts above (below) it crosses the
// surface no more than once. The worst such ray starts on the surface; it leaves again where the slope at which the
// surface is seen from there falls (rises) with distance.

const REACH: i32 = 16;
const DIRECTIONS: i32 = 16;

fn smooth_value(p: vec2f, size: vec2i, periodic: vec2<bool>) -> f32 {
    let cell = vec2i(floor(p));
    let f = p - floor(p);
    let a = mix(value(cell.x, cell.y, size, periodic), value(cell.x + 1, cell.y, size, periodic), f.x);
    let b = mix(value(cell.x, cell.y + 1, size, periodic), value(cell.x + 1, cell.y + 1, size, periodic), f.x);
    return mix(a, b, f.y);
}

@compute @workgroup_size(8, 8)
fn radii(@builtin(global_invocation_id) at: vec3u) {
    let f = which.field;
    let size = vec2i(stage.fields[f].size);
    let p = vec2i(at.xy);
    if any(p >= size) {
        return;
    }
    let periodic = stage.fields[f].periodic != vec2u(0u);
    let here = value(p.x, p.y, size, periodic);
    // Slopes a sample; what rounding makes of a plane is no bend.
    let hair = 1e-5 * stage.fields[f].spacing;
    var above = REACH;
    var below = REACH;
    for (var k = 0; k < DIRECTIONS; k++) {
        let angle = TAU * f32(k) / f32(DIRECTIONS);
        let along = vec2f(cos(angle), sin(angle));
        var last = smooth_value(vec2f(p) + along, size, periodic) - here;
        for (var n = 2; n <= max(above, below); n++) {
            let slope = (smooth_value(vec2f(p) + f32(n) * along, size, periodic) - here) / f32(n);
            if slope < last - hair {
                above = min(above, n - 1);
            } else if slope > last + hair {
                below = min(below, n - 1);
            }
            last = slope;
        }
    }
    keep_pair(stage.fields[f].radii, u32(p.y * size.x + p.x), vec2f(vec2i(above, below)));
}
