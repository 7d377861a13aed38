// Samples of the field that a pass is about.

struct Which {
    field: u32,
    level: u32,
    unused0: u32,
    unused1: u32,
}

@group(0) @binding(10) var<uniform> which: Which;

fn wrap(k: i32, n: i32, periodic: bool) -> i32 {
    let last = max(n - 1, 1);
    return select(clamp(k, 0, n - 1), (k % last + last) % last, periodic);
}

fn value(i: i32, j: i32, size: vec2i, periodic: vec2<bool>) -> f32 {
    return stored(which.field, u32(wrap(i, size.x, periodic.x)), u32(wrap(j, size.y, periodic.y)));
}
