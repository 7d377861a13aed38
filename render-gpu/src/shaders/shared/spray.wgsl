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
    let inverse = safe_inverse(d);
    var stack: array<u32, 40>;
    var top = 1;
    stack[0] = 0u;
    while top > 0 {
        top -= 1;
        let node = stack[top];
        if !meets_box(o, inverse, bitcast<vec3f>(spray[node].xyz), bitcast<vec3f>(spray[node + 1u].xyz), limit) {
            continue;
        }
        let first = spray[node].w;
        let count = spray[node + 1u].w;
        if count == 0u {
            // Children stand behind their parent. Where a driver runs lanes that draw nothing and reads zeros for them, the
            // walk would go on for ever otherwise.
            if first > node && top < 38 {
                stack[top] = first;
                stack[top + 1] = first + 2u;
                top += 2;
            }
            continue;
        }
        for (var k = 0u; k < count; k++) {
            let ball = droplet(stage.spray_root + first + k);
            let p = o - ball.xyz;
            if dot(p, p) <= ball.w * ball.w {
                continue;
            }
            let t = cast_sphere(p, d, ball.w);
            if t < limit {
                limit = t;
                best = vec2f(t, f32(stage.spray_root + first + k));
            }
        }
    }
    return best;
}
