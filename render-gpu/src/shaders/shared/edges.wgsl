// Walls, deck and glass of a basin (`sim/src/stage/surroundings.rs`). A side is (axis, at, outwards, glass).

struct EdgeHit {
    t: f32,
    normal: vec3f,
}

fn side_normal(side: vec4f) -> vec3f {
    return select(vec3f(side.z, 0.0, 0.0), vec3f(0.0, 0.0, side.z), side.x > 1.0);
}

fn along_side(side: vec4f, p: vec3f) -> f32 {
    return select(p.x, p.z, side.x > 1.0);
}

fn beyond(side: vec4f, p: vec3f) -> f32 {
    return side.z * (along_side(side, p) - side.y);
}

// Whether a point is not beyond the glass by more than a hair.
fn within_glass(p: vec3f) -> bool {
    return all(p.xz >= stage.glass.xy - stage.hair) && all(p.xz <= stage.glass.zw + stage.hair);
}

// The same of all sides that end the water.
fn within_sides(p: vec3f) -> bool {
    return within_glass(p) && all(p.xz >= stage.walls.xy - stage.hair) && all(p.xz <= stage.walls.zw + stage.hair);
}

// The point, or the one a hair inside the walls that it is at. By side and not by box: lanes that draw nothing may read zeros, and a box
// of no size would send their rays the longest way (lavapipe: 40 times the time of a march through voxels).
fn inside_walls(p: vec3f) -> vec3f {
    var q = p;
    for (var k = 0u; k < stage.side_count; k++) {
        let side = stage.sides[k];
        if side.w == 0.0 {
            q -= max(beyond(side, q) + stage.hair, 0.0) * side_normal(side);
        }
    }
    return q;
}

fn cast_solid_edges(o: vec3f, d: vec3f, t_max: f32) -> EdgeHit {
    var best = EdgeHit(FAR, vec3f(0.0));
    var limit = t_max;
    for (var k = 0u; k < stage.side_count; k++) {
        let side = stage.sides[k];
        if side.w > 0.0 {
            continue;
        }
        let outwards = side.z * along_side(side, d);
        let start = beyond(side, o);
        if outwards > 0.0 && start <= 0.0 {
            let t = -start / outwards;
            if t <= limit && o.y + t * d.y <= stage.deck {
                limit = t;
                best = EdgeHit(t, -side_normal(side));
            }
        }
        if d.y < 0.0 && o.y >= stage.deck {
            let t = (stage.deck - o.y) / d.y;
            if t <= limit && beyond(side, o + t * d) >= 0.0 {
                limit = t;
                best = EdgeHit(t, vec3f(0.0, 1.0, 0.0));
            }
        }
    }
    return best;
}

fn cast_glass(o: vec3f, d: vec3f, t_max: f32) -> EdgeHit {
    var best = EdgeHit(FAR, vec3f(0.0));
    var limit = t_max;
    for (var k = 0u; k < stage.side_count; k++) {
        let side = stage.sides[k];
        if side.w <= 0.0 {
            continue;
        }
        let t = -beyond(side, o) / (side.z * along_side(side, d));
        if !(t >= 0.0 && t <= limit) {
            continue;
        }
        let p = o + t * d;
        var beside = false;
        for (var j = 0u; j < stage.side_count; j++) {
            beside = beside || (stage.sides[j].x != side.x && beyond(stage.sides[j], p) > 0.0);
        }
        if !beside && field_height(WATER_FIELD, p.xz) > p.y && field_height(GROUND_FIELD, p.xz) < p.y {
            limit = t;
            best = EdgeHit(t, side_normal(side));
        }
    }
    return best;
}
