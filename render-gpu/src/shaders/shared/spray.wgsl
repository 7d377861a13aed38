// Droplets: spheres under a hierarchy of boxes. A node is two rows, (low, first) and (high, count); a droplet is one,
// (centre, radius).

@group(0) @binding(5) var<storage, read> spray: array<vec4u>;

fn droplet(k: u32) -> vec4f {
    return bitcast<vec4f>(spray[k]);
}

// The first droplet from outside: its t, and the bits of its row.
fn cast_spray(o: vec3f, d: vec3f, t_max: f32) -> vec2f {
    var best = vec2f(FAR, 0.0);
    var limit = t_max;
    let inverse = 1.0 / select(d, vec3f(1e-20), abs(d) < vec3f(1e-20));
    var stack: array<u32, 40>;
    var top = 1;
    stack[0] = 0u;
    while top > 0 {
        top -= 1;
        let node = stack[top];
        let a = (bitcast<vec3f>(spray[node].xyz) - o) * inverse;
        let b = (bitcast<vec3f>(spray[node + 1u].xyz) - o) * inverse;
        let near = min(a, b);
        let far = max(a, b);
        if max(max(near.x, near.y), max(near.z, 0.0)) > min(min(far.x, far.y), min(far.z, limit)) {
            continue;
        }
        let first = spray[node].w;
        let count = spray[node + 1u].w;
        if count == 0u {
            if top < 38 {
                stack[top] = first;
                stack[top + 1] = first + 2u;
                top += 2;
            }
            continue;
        }
        for (var k = 0u; k < count; k++) {
            let ball = droplet(stage.spray_root + first + k);
            let p = o - ball.xyz;
            let along = dot(p, d);
            let q = p - along * d;
            let disc = ball.w * ball.w - dot(q, q);
            if dot(p, p) <= ball.w * ball.w || disc < 0.0 {
                continue;
            }
            let t = -along - sqrt(disc);
            if t >= 0.0 && t < limit {
                limit = t;
                best = vec2f(t, f32(stage.spray_root + first + k));
            }
        }
    }
    return best;
}
