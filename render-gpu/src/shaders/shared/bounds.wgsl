// Rays against spheres and the boxes of hierarchies.

fn cast_sphere(o: vec3f, d: vec3f, radius: f32) -> f32 {
    let b = dot(o, d);
    let q = o - b * d;
    let disc = radius * radius - dot(q, q);
    if disc < 0.0 {
        return FAR;
    }
    let root = sqrt(disc);
    if -b - root >= 0.0 {
        return -b - root;
    }
    return select(FAR, -b + root, -b + root >= 0.0);
}

fn meets_box(o: vec3f, inverse: vec3f, low: vec3f, high: vec3f, t_max: f32) -> bool {
    let a = (low - o) * inverse;
    let b = (high - o) * inverse;
    let near = min(a, b);
    let far = max(a, b);
    let enter = max(max(near.x, near.y), max(near.z, 0.0));
    let leave = min(min(far.x, far.y), min(far.z, t_max));
    return enter <= leave * 1.00001 + 1e-12;
}

fn safe_inverse(d: vec3f) -> vec3f {
    return 1.0 / select(d, vec3f(1e-20), abs(d) < vec3f(1e-20));
}
