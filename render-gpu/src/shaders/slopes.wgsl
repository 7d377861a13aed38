// Slope at every sample: fourth-order differences, lower at the ends of a row that does not repeat.

struct Which {
    field: u32,
    level: u32,
    unused0: u32,
    unused1: u32,
}

@group(0) @binding(10) var<uniform> which: Which;
@group(0) @binding(11) var<storage, read_write> fields: array<f32>;

fn value(i: i32, j: i32, size: vec2i, periodic: vec2<bool>) -> f32 {
    let f = which.field;
    let a = wrap(i, size.x, periodic.x);
    let b = wrap(j, size.y, periodic.y);
    return fields[stage.fields[f].heights + u32(b * size.x + a)];
}

fn wrap(k: i32, n: i32, periodic: bool) -> i32 {
    let last = max(n - 1, 1);
    return select(clamp(k, 0, n - 1), (k % last + last) % last, periodic);
}

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
    let out = stage.fields[f].slopes + 2u * u32(p.y * size.x + p.x);
    let scale = 1.0 / stage.fields[f].spacing;
    fields[out] = scale * difference(x, p.x, size.x, periodic.x);
    fields[out + 1u] = scale * difference(z, p.y, size.y, periodic.y);
}
