// Everything opaque as triangles: vertices are made from their number. `which` is (kind, a, b, c).

struct Which {
    kind: u32,
    a: u32,
    b: u32,
    c: u32,
}

@group(0) @binding(12) var<uniform> which: Which;
const GROUND_MESH: u32 = 0u;
const WALL_MESH: u32 = 1u;
const DECK_MESH: u32 = 2u;
const OBJECT_MESH: u32 = 3u;

// Corner `k` (0 to 5) of a square's two triangles.
fn square_corner(k: u32) -> vec2u {
    return vec2u((0x32u >> k) & 1u, (0x2cu >> k) & 1u);
}

// Along `n` pieces of the range with one more at each end that goes to the horizon.
fn stretched(k: u32, n: u32, low: f32, high: f32, reach: f32) -> f32 {
    if k == 0u {
        return low - reach;
    }
    if k == n + 2u {
        return high + reach;
    }
    return mix(low, high, f32(k - 1u) / f32(n));
}

fn horizon_reach() -> f32 {
    let f = stage.fields[WATER_FIELD];
    return 60.0 * max(f.high.x - f.low.x, f.high.y - f.low.y);
}

fn ground_vertex(k: u32) -> Vertex {
    let n = vec2u(which.a, which.b);
    let square = k / 6u;
    let at = vec2u(square % (n.x + 2u), square / (n.x + 2u)) + square_corner(k % 6u);
    let f = stage.fields[GROUND_FIELD];
    let p = vec2f(
        stretched(at.x, n.x, f.low.x, f.high.x, horizon_reach()),
        stretched(at.y, n.y, f.low.y, f.high.y, horizon_reach()),
    );
    return plain(vec3f(p.x, field_height(GROUND_FIELD, p), p.y), vec3f(0.0, 1.0, 0.0), vec3f(0.0));
}

fn lowest() -> f32 {
    if stage.fields[GROUND_FIELD].present != 0u {
        return stage.fields[GROUND_FIELD].range.x;
    }
    let f = stage.fields[WATER_FIELD];
    return -4.0 * max(f.high.x - f.low.x, f.high.y - f.low.y);
}

fn wall_vertex(k: u32) -> Vertex {
    let side = stage.sides[which.a];
    let n = which.b;
    let square = k / 6u;
    let at = vec2f(vec2u(square % n, square / n) + square_corner(k % 6u)) / f32(n);
    let f = stage.fields[WATER_FIELD];
    let y = mix(lowest(), stage.deck, at.y);
    let normal = -side_normal(side);
    if side.x > 1.0 {
        return plain(vec3f(mix(f.low.x, f.high.x, at.x), y, side.y), normal, stage.steep);
    }
    return plain(vec3f(side.y, y, mix(f.low.y, f.high.y, at.x)), normal, stage.steep);
}

fn deck_vertex(k: u32) -> Vertex {
    let side = stage.sides[which.a];
    let n = which.b;
    let square = k / 6u;
    let at = vec2f(vec2u(square % n, square / n) + square_corner(k % 6u)) / f32(n);
    let f = stage.fields[WATER_FIELD];
    let reach = horizon_reach();
    let out = side.y + side.z * reach * at.y * at.y * at.y;
    // Finer towards the basin: odd powers of the place along the side.
    let s = 2.0 * at.x - 1.0;
    let across = s * s * s;
    let up = vec3f(0.0, 1.0, 0.0);
    if side.x > 1.0 {
        let half = 0.5 * (f.high.x - f.low.x);
        return plain(vec3f(0.5 * (f.low.x + f.high.x) + s * half + across * reach, stage.deck, out), up, stage.steep);
    }
    let half = 0.5 * (f.high.y - f.low.y);
    return plain(vec3f(out, stage.deck, 0.5 * (f.low.y + f.high.y) + s * half + across * reach), up, stage.steep);
}

fn vertex_of(k: u32) -> Vertex {
    switch which.kind {
        case GROUND_MESH: { return ground_vertex(k); }
        case WALL_MESH: { return wall_vertex(k); }
        case DECK_MESH: { return deck_vertex(k); }
        default: { return object_vertex(k); }
    }
}

// The place of a fragment. Points of walls lie beyond the water's grid by a rounding, where its level of rest would stand for waves.
fn fragment_place(p: vec3f) -> vec3f {
    if which.kind == WALL_MESH {
        return inside_walls(p);
    }
    return p;
}

fn is_in_water(p: vec3f) -> bool {
    return field_height(WATER_FIELD, p.xz) > p.y && within_glass(p);
}

// The matt surface at a fragment. `face` is the normal of its triangle.
fn fragment_matt(p: vec3f, normal: vec3f, color: vec3f, face: vec3f, d: vec3f, width: f32, medium: u32) -> Matt {
    if which.kind == GROUND_MESH {
        let slope = facet_slope(GROUND_FIELD, p.xz);
        return ground_matt(p, normalize(vec3f(-slope.x, 1.0, -slope.y)), d, width, medium);
    }
    let away = select(1.0, -1.0, dot(face, d) > 0.0);
    let smooth_normal = normalize(normal);
    let turned = smooth_normal * select(-1.0, 1.0, dot(smooth_normal, away * face) >= 0.0);
    // Triangles lie a little inside the round thing whose shadow is cast.
    let lift = select(stage.hair, object_lift(), which.kind == OBJECT_MESH);
    return Matt(p, away * face, turned, color, 1.0, lift, false, medium);
}
