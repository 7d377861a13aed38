// Objects: spheres, boxes and cylinders in closed form, models as triangles under a hierarchy of boxes.
//
// A record is six rows of `solids`: (centre, kind), (half lengths, bound), (first row of body_from_world, red),
// (second, green), (third, blue), (root of the hierarchy, first triangle, 0, 0). A node is two rows: (low, first),
// (high, count); without count, `first` is the first of two children that stand side by side. A triangle is TRIANGLE_ROWS: three
// corners, three normals, and what `looks.wgsl` says.

@group(0) @binding(4) var<storage, read> solids: array<vec4u>;

const SPHERE: u32 = 0u;
const BOX: u32 = 1u;
const CYLINDER: u32 = 2u;
const MODEL: u32 = 3u;

struct SolidHit {
    t: f32,
    normal: vec3f,
    shading: vec3f,
    color: vec3f,
}

// `triangle` is its row, 0 where there is none; `weights` are those of its second and third corner.
struct BodyHit {
    t: f32,
    normal: vec3f,
    shading: vec3f,
    triangle: u32,
    weights: vec2f,
}

fn body_hit(t: f32, normal: vec3f) -> BodyHit {
    return BodyHit(t, normal, normal, 0u, vec2f(0.0));
}

fn row(k: u32) -> vec3f {
    return bitcast<vec3f>(solids[k].xyz);
}

fn cast_box(o: vec3f, d: vec3f, half: vec3f) -> BodyHit {
    var near = -FAR;
    var far = FAR;
    var near_normal = vec3f(0.0);
    var far_normal = vec3f(0.0);
    for (var k = 0; k < 3; k++) {
        if d[k] == 0.0 {
            if abs(o[k]) > half[k] {
                return body_hit(FAR, vec3f(0.0));
            }
            continue;
        }
        let a = (-half[k] - o[k]) / d[k];
        let b = (half[k] - o[k]) / d[k];
        var axis = vec3f(0.0);
        axis[k] = sign(d[k]);
        if min(a, b) > near {
            near = min(a, b);
            near_normal = -axis;
        }
        if max(a, b) < far {
            far = max(a, b);
            far_normal = axis;
        }
    }
    if near > far || far < 0.0 {
        return body_hit(FAR, vec3f(0.0));
    }
    if near >= 0.0 {
        return body_hit(near, near_normal);
    }
    return body_hit(far, far_normal);
}

fn cast_cylinder(o: vec3f, d: vec3f, radius: f32, half: f32) -> BodyHit {
    var best = body_hit(FAR, vec3f(0.0));
    let a = dot(d.xz, d.xz);
    if a > 0.0 {
        let b = dot(o.xz, d.xz);
        let disc = b * b - a * (dot(o.xz, o.xz) - radius * radius);
        if disc >= 0.0 {
            for (var k = 0; k < 2; k++) {
                let t = (-b + select(-1.0, 1.0, k == 1) * sqrt(disc)) / a;
                let p = o + t * d;
                if abs(p.y) <= half && t >= 0.0 && t < best.t {
                    let n = vec3f(p.x, 0.0, p.z) / radius;
                    best = body_hit(t, n);
                }
            }
        }
    }
    if d.y != 0.0 {
        for (var k = 0; k < 2; k++) {
            let y = select(-half, half, k == 1);
            let t = (y - o.y) / d.y;
            let p = o + t * d;
            if dot(p.xz, p.xz) <= radius * radius && t >= 0.0 && t < best.t {
                let n = vec3f(0.0, sign(y), 0.0);
                best = body_hit(t, n);
            }
        }
    }
    return best;
}

fn cast_model(o: vec3f, d: vec3f, root: u32, first: u32, t_max: f32) -> BodyHit {
    var best = body_hit(t_max, vec3f(0.0));
    var found = FAR;
    var face = vec3f(0.0);
    var which = 0u;
    let inverse = safe_inverse(d);
    var stack: array<u32, 40>;
    var top = 1;
    stack[0] = root;
    while top > 0 {
        top -= 1;
        let node = stack[top];
        if !meets_box(o, inverse, row(node), row(node + 1u), best.t) {
            continue;
        }
        let start = solids[node].w;
        let count = solids[node + 1u].w;
        if count == 0u {
            // Children stand behind their parent. Where a driver runs lanes that draw nothing and reads zeros for them, the
            // walk would go on for ever otherwise.
            if start > node && top < 38 {
                stack[top] = start;
                stack[top + 1] = start + 2u;
                top += 2;
            }
            continue;
        }
        for (var k = 0u; k < count; k++) {
            let triangle = first + TRIANGLE_ROWS * (start + k);
            let a = row(triangle) - o;
            let b = row(triangle + 1u) - o;
            let c = row(triangle + 2u) - o;
            let u = dot(cross(c, b), d);
            let v = dot(cross(a, c), d);
            let w = dot(cross(b, a), d);
            if !((u >= 0.0 && v >= 0.0 && w >= 0.0) || (u <= 0.0 && v <= 0.0 && w <= 0.0)) {
                continue;
            }
            let n = cross(b - a, c - a);
            let along = dot(n, d);
            let t = dot(n, a) / along;
            if along != 0.0 && t >= 0.0 && t < best.t {
                best.t = t;
                found = t;
                face = n;
                which = triangle;
            }
        }
    }
    if found >= FAR {
        best.t = FAR;
        return best;
    }
    let at = o + found * d;
    let a = row(which);
    let area = dot(face, face);
    let w1 = dot(cross(at - a, row(which + 2u) - a), face) / area;
    let w2 = dot(cross(row(which + 1u) - a, at - a), face) / area;
    best.triangle = which;
    best.weights = vec2f(w1, w2);
    best.normal = normalize(face);
    let smooth_normal = (1.0 - w1 - w2) * row(which + 3u) + w1 * row(which + 4u) + w2 * row(which + 5u);
    best.shading = select(best.normal, normalize(smooth_normal), dot(smooth_normal, smooth_normal) > 1e-12);
    return best;
}

fn cast_solids(o: vec3f, d: vec3f, t_max: f32) -> SolidHit {
    var best = SolidHit(FAR, vec3f(0.0), vec3f(0.0), vec3f(0.0));
    var nearest = 0u;
    var triangle = 0u;
    var weights = vec2f(0.0);
    var limit = t_max;
    for (var k = 0u; k < stage.solid_count; k++) {
        let record = 6u * k;
        let to = row(record) - o;
        let reach = bitcast<f32>(solids[record + 1u].w) * 1.00001;
        let along = dot(to, d);
        let across = to - along * d;
        if dot(across, across) > reach * reach || along < -reach || along - reach > limit {
            continue;
        }
        let turn = transpose(mat3x3f(row(record + 2u), row(record + 3u), row(record + 4u)));
        let origin = turn * -to;
        let direction = turn * d;
        let half = row(record + 1u);
        var hit = body_hit(FAR, vec3f(0.0));
        switch solids[record].w {
            case SPHERE: {
                hit.t = cast_sphere(origin, direction, half.x);
                hit.normal = (origin + hit.t * direction) / half.x;
                hit.shading = hit.normal;
            }
            case BOX: {
                hit = cast_box(origin, direction, half);
            }
            case CYLINDER: {
                hit = cast_cylinder(origin, direction, half.x, half.y);
            }
            default: {
                hit = cast_model(origin, direction, solids[record + 5u].x, solids[record + 5u].y, limit);
            }
        }
        if hit.t <= limit {
            limit = hit.t;
            let back = transpose(turn);
            best = SolidHit(hit.t, back * hit.normal, back * hit.shading, vec3f(0.0));
            nearest = record;
            triangle = hit.triangle;
            weights = hit.weights;
        }
    }
    if best.t < FAR {
        best.color = hit_color(nearest, triangle, weights);
    }
    return best;
}

fn record_color(record: u32) -> vec3f {
    return bitcast<vec3f>(vec3u(solids[record + 2u].w, solids[record + 3u].w, solids[record + 4u].w));
}

fn solid_color(k: u32) -> vec3f {
    return record_color(6u * k);
}
