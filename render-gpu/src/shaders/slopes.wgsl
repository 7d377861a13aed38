// Slope at every sample: fourth-order differences, lower at the ends of a row that does not repeat.

fn difference(g: vec4f, k: i32, n: i32, periodic: bool) -> f32 {
    if n < 2 {
        return 0.0;
    }
    if periodic || (k >= 2 && k + 2 < n) {
        return (8.0 * (g.z - g.y) - (g.w - g.x)) / 12.0;
    }
    return select(1.0, 0.5, k >= 1 && k + 1 < n) * (g.z - g.y);
}

@compute @workgroup_size(8, 8)
fn slopes(@builtin(global_invocation_id) at: vec3u) {
    let f = which.field;
    let size = vec2i(stage.fields[f].size);
    let p = vec2i(at.xy);
    if any(p >= size) {
        return;
    }
    let periodic = stage.fields[f].periodic != vec2u(0u);
    var x: vec4f;
    var z: vec4f;
    for (var k = 0; k < 4; k++) {
        let d = select(k - 2, k - 1, k >= 2);
        x[k] = value(p.x + d, p.y, size, periodic);
        z[k] = value(p.x, p.y + d, size, periodic);
    }
    let scale = 1.0 / stage.fields[f].spacing;
    let slope = scale * vec2f(difference(x, p.x, size.x, periodic.x), difference(z, p.y, size.y, periodic.y));
    keep_pair(stage.fields[f].slopes, u32(p.y * size.x + p.x), slope);
}
