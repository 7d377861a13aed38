// Heights, slopes and rays of a heightfield that goes on beyond its grid (`sim/src/stage/continuation.rs`).

struct FieldHit {
    t: f32,
    normal: vec3f,
}

fn covers(f: u32, p: vec2f) -> bool {
    let low = stage.fields[f].low;
    let high = stage.fields[f].high;
    let periodic = stage.fields[f].periodic != vec2u(0u);
    return all(periodic | ((p >= low) & (p <= high)));
}

fn wrapped(f: u32, p: vec2f) -> vec2f {
    let low = stage.fields[f].low;
    let period = stage.fields[f].period;
    let q = p - period * floor((p - low) / period);
    return select(p, q, stage.fields[f].periodic != vec2u(0u));
}

fn bilinear(c: vec4f, at: vec2f) -> f32 {
    return mix(mix(c.x, c.y, at.x), mix(c.z, c.w, at.x), at.y);
}

struct Place {
    cell: vec2u,
    at: vec2f,
}

fn place_of(f: u32, p: vec2f) -> Place {
    let last = vec2f(stage.fields[f].size - 1u);
    let g = clamp((wrapped(f, p) - stage.fields[f].low) / stage.fields[f].spacing, vec2f(0.0), last);
    let cell = min(vec2u(g), stage.fields[f].size - 2u);
    return Place(cell, g - vec2f(cell));
}

fn field_height(f: u32, p: vec2f) -> f32 {
    if stage.fields[f].present == 0u {
        return -FAR;
    }
    if !covers(f, p) {
        return stage.fields[f].level;
    }
    let at = place_of(f, p);
    return bilinear(corners_of(f, at.cell), at.at);
}

// Slope of the very patch that rays meet.
fn facet_slope(f: u32, p: vec2f) -> vec2f {
    if !covers(f, p) {
        return vec2f(0.0);
    }
    let at = place_of(f, p);
    let c = corners_of(f, at.cell);
    return vec2f(mix(c.y - c.x, c.w - c.z, at.at.y), mix(c.z - c.x, c.w - c.y, at.at.x)) / stage.fields[f].spacing;
}

fn catmull_rom(t: f32) -> vec4f {
    let t2 = t * t;
    let t3 = t2 * t;
    return vec4f(
        -0.5 * t + t2 - 0.5 * t3,
        1.0 - 2.5 * t2 + 1.5 * t3,
        0.5 * t + 2.0 * t2 - 1.5 * t3,
        -0.5 * t2 + 0.5 * t3,
    );
}

fn neighbour(k: i32, n: i32, periodic: bool) -> i32 {
    let last = max(n - 1, 1);
    return select(clamp(k, 0, n - 1), (k % last + last) % last, periodic);
}

// Slope of the smooth surface, and in z the largest change of slope a metre.
fn field_slope(f: u32, p: vec2f) -> vec3f {
    if !covers(f, p) {
        return vec3f(0.0);
    }
    let g = (wrapped(f, p) - stage.fields[f].low) / stage.fields[f].spacing;
    let cell = vec2i(floor(g));
    let wx = catmull_rom(g.x - f32(cell.x));
    let wz = catmull_rom(g.y - f32(cell.y));
    let size = vec2i(stage.fields[f].size);
    let periodic = stage.fields[f].periodic != vec2u(0u);
    var slope = vec2f(0.0);
    var low = vec2f(FAR);
    var high = vec2f(-FAR);
    for (var b = 0; b < 4; b++) {
        let row = neighbour(cell.y + b - 1, size.y, periodic.y) * size.x;
        for (var a = 0; a < 4; a++) {
            let s = pair_at(stage.fields[f].slopes, u32(row + neighbour(cell.x + a - 1, size.x, periodic.x)));
            slope += s * (wx[a] * wz[b]);
            if (a == 1 || a == 2) && (b == 1 || b == 2) {
                low = min(low, s);
                high = max(high, s);
            }
        }
    }
    let turn = high - low;
    return vec3f(slope, max(turn.x, turn.y) / stage.fields[f].spacing);
}

fn field_normal(f: u32, p: vec2f) -> vec3f {
    let slope = field_slope(f, p);
    return normalize(vec3f(-slope.x, 1.0, -slope.y));
}

// First root in 0 to 1 of a (1 − s) + b s + k s (1 − s), which is not negative at 0; 2 if there is none.
fn patch_root(a: f32, b: f32, k: f32) -> f32 {
    if a <= 0.0 {
        return 0.0;
    }
    let linear = b - a + k;
    let disc = linear * linear + 4.0 * k * a;
    if b <= 0.0 {
        // One sign change. The stable one of the two forms of the root.
        let root = sqrt(max(disc, 0.0));
        if linear <= 0.0 {
            return clamp(2.0 * a / max(root - linear, 1e-37), 0.0, 1.0);
        }
        return clamp((linear + root) / max(2.0 * k, 1e-37), 0.0, 1.0);
    }
    // Both ends are above: only a hanging parabola dips below between.
    if k < 0.0 && linear < 0.0 && disc >= 0.0 && -linear < -2.0 * k {
        return clamp(2.0 * a / (sqrt(disc) - linear), 0.0, 1.0);
    }
    return 2.0;
}

fn exit_of(q: f32, v: f32, low: f32, high: f32) -> f32 {
    if v > 0.0 {
        return (high - q) / v;
    }
    if v < 0.0 {
        return (low - q) / v;
    }
    return FAR;
}

// The exact walk: a minimum-maximum pyramid over the patches. Returns t, or FAR. The ray is relative to the grid's tile.
fn walk_pyramid(f: u32, o: vec3f, d: vec3f, from_t: f32, to_t: f32) -> f32 {
    let spacing = stage.fields[f].spacing;
    let q = (o.xz - stage.fields[f].low) / spacing;
    let v = d.xz / spacing;
    let cells = vec2i(stage.fields[f].size) - 1;
    var t = from_t;
    var end = to_t;
    for (var k = 0; k < 2; k++) {
        if v[k] == 0.0 {
            if q[k] < 0.0 || q[k] > f32(cells[k]) {
                return FAR;
            }
        } else {
            let a = -q[k] / v[k];
            let b = (f32(cells[k]) - q[k]) / v[k];
            t = max(t, min(a, b));
            end = min(end, max(a, b));
        }
    }
    if !(t <= end) {
        return FAR;
    }
    var c = clamp(vec2i(floor(q + v * t)), vec2i(0), cells - 1);
    let begin = bilinear(corners_of(f, vec2u(c)), clamp(q + v * t - vec2f(c), vec2f(0.0), vec2f(1.0)));
    let side = select(-1.0, 1.0, o.y + d.y * t >= begin);
    let top = i32(stage.fields[f].levels);
    var level = min(top, 2);
    for (var n = 0; n < 8192; n++) {
        let block = 1 << u32(level);
        let low = (c >> vec2u(u32(level))) << vec2u(u32(level));
        let high = min(low + block, cells);
        let tx = exit_of(q.x, v.x, f32(low.x), f32(high.x));
        let tz = exit_of(q.y, v.y, f32(low.y), f32(high.y));
        let out = clamp(min(tx, tz), t, end);
        if level == 0 {
            let cell = vec2f(c);
            let ua = clamp(q + v * t - cell, vec2f(0.0), vec2f(1.0));
            let ub = clamp(q + v * out - cell, vec2f(0.0), vec2f(1.0));
            let h = corners_of(f, vec2u(c));
            let fa = side * (o.y + d.y * t - bilinear(h, ua));
            let fb = side * (o.y + d.y * out - bilinear(h, ub));
            let span = ub - ua;
            let k = side * (h.x - h.y - h.z + h.w) * span.x * span.y;
            let s = patch_root(fa, fb, k);
            if s <= 1.0 {
                return mix(t, out, s);
            }
        } else {
            let offset = stage.fields[f].pyramid[u32(level - 1) / 4u][u32(level - 1) % 4u];
            let across = (cells.x + block - 1) >> u32(level);
            let bounds = bounds_at(f, offset, u32((c.y >> u32(level)) * across + (c.x >> u32(level))));
            let ya = o.y + d.y * t;
            let yb = o.y + d.y * out;
            let near = select(max(ya, yb) >= bounds.x, min(ya, yb) <= bounds.y, side > 0.0);
            if near {
                level -= 1;
                continue;
            }
        }
        if out >= end {
            return FAR;
        }
        t = out;
        let over = vec2i(floor(q + v * t));
        if tx <= tz {
            c = vec2i(select(low.x - 1, high.x, v.x > 0.0), clamp(over.y, low.y, high.y - 1));
        } else {
            c = vec2i(clamp(over.x, low.x, high.x - 1), select(low.y - 1, high.y, v.y > 0.0));
        }
        if any(c < vec2i(0)) || any(c >= cells) {
            return FAR;
        }
        level = min(level + 1, top);
    }
    return FAR;
}

// The level plane outside the grid.
fn plane_hit(f: u32, o: vec3f, d: vec3f, t_max: f32) -> f32 {
    let t = (stage.fields[f].level - o.y) / d.y;
    if !(t >= 0.0 && t <= t_max) {
        return FAR;
    }
    let p = o.xz + t * d.xz;
    let inside = (stage.fields[f].periodic != vec2u(0u)) | ((p > stage.fields[f].low) & (p < stage.fields[f].high));
    return select(t, FAR, all(inside));
}

// First meeting with the surface, from either side; t is FAR where there is none.
fn field_cast(f: u32, o: vec3f, d: vec3f, t_max: f32) -> FieldHit {
    var hit = FieldHit(FAR, vec3f(0.0, 1.0, 0.0));
    if stage.fields[f].present == 0u {
        return hit;
    }
    let range = stage.fields[f].range;
    let low = stage.fields[f].low;
    let high = stage.fields[f].high;
    let period = stage.fields[f].period;
    let periodic = stage.fields[f].periodic != vec2u(0u);
    var t = 0.0;
    var end = t_max;
    if d.y == 0.0 {
        if o.y < range.x || o.y > range.y {
            end = -1.0;
        }
    } else {
        let a = (range.x - o.y) / d.y;
        let b = (range.y - o.y) / d.y;
        t = max(t, min(a, b));
        end = min(end, max(a, b));
    }
    for (var k = 0; k < 2; k++) {
        let dk = select(d.x, d.z, k == 1);
        let ok = select(o.x, o.z, k == 1);
        if !periodic[k] && dk != 0.0 {
            let a = (low[k] - ok) / dk;
            let b = (high[k] - ok) / dk;
            t = max(t, min(a, b));
            end = min(end, max(a, b));
        }
    }
    // A hair of the slab is given away on both sides, so that a ray along its border is not lost to rounding.
    let hair = stage.hair + 2e-6 * abs(t);
    if t <= end + hair {
        t = max(t - hair, 0.0);
        end = min(end + hair, t_max);
        var tile = select(vec2f(0.0), floor((o.xz + t * d.xz - low) / period), periodic);
        for (var n = 0; n < MAX_TILES; n++) {
            let border = low + (tile + select(vec2f(0.0), vec2f(1.0), d.xz > vec2f(0.0))) * period;
            let leave = select(vec2f(FAR), (border - o.xz) / d.xz, periodic & (d.xz != vec2f(0.0)));
            let next = min(min(leave.x, leave.y), end);
            let shift = tile * period;
            let origin = o - vec3f(shift.x, 0.0, shift.y);
            let found = walk_field(f, origin, d, t, min(next + hair, end));
            if found < FAR {
                let p = origin.xz + found * d.xz;
                let slope = facet_slope(f, clamp(p, low, select(high, low + period, periodic)));
                return FieldHit(found, normalize(vec3f(-slope.x, 1.0, -slope.y)));
            }
            if next >= end {
                break;
            }
            if leave.x <= leave.y {
                tile.x += sign(d.x);
            } else {
                tile.y += sign(d.z);
            }
            t = max(next, t);
            if n + 1 == MAX_TILES {
                // So far away and so flat: the mean plane.
                let s = (stage.fields[f].level - o.y) / d.y;
                hit.t = clamp(s, t, end);
                return hit;
            }
        }
    }
    if !all(periodic) {
        hit.t = plane_hit(f, o, d, t_max);
    }
    return hit;
}
