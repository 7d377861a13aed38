// The water's surface as triangles, and its glass sides. `which` is (kind, squares along X, along Z, tiles along a side).

struct Which {
    kind: u32,
    a: u32,
    b: u32,
    c: u32,
}

@group(0) @binding(12) var<uniform> which: Which;

const WATER_MESH: u32 = 0u;
const GLASS_MESH: u32 = 1u;

struct SurfaceCorner {
    @builtin(position) clip: vec4f,
    @location(0) position: vec3f,
}

fn corner_of_square(k: u32) -> vec2u {
    return vec2u((0x32u >> k) & 1u, (0x2cu >> k) & 1u);
}

@vertex
fn surface_vertex(@builtin(vertex_index) k: u32, @builtin(instance_index) tile: u32) -> SurfaceCorner {
    let f = stage.fields[WATER_FIELD];
    var p = vec3f(0.0);
    if which.kind == WATER_MESH {
        let n = vec2u(which.a, which.b);
        let square = k / 6u;
        let at = vec2u(square % (n.x + 2u), square / (n.x + 2u)) + corner_of_square(k % 6u);
        let last = n + 2u;
        let reach = 60.0 * max(f.high.x - f.low.x, f.high.y - f.low.y);
        let periodic = f.periodic != vec2u(0u);
        let g = vec2f(clamp(vec2i(at) - 1, vec2i(0), vec2i(n)));
        var q = f.low + g / vec2f(n) * (f.high - f.low);
        let y = sample_at(WATER_FIELD, u32(g.x), u32(g.y));
        let outer = select(vec2f(0.0), vec2f(reach), at == last) - select(vec2f(0.0), vec2f(reach), at == vec2u(0u));
        let side = which.c;
        let shift = vec2f(vec2i(vec2u(tile % side, tile / side)) - i32(side / 2u)) * f.period;
        q += select(outer, vec2f(0.0), periodic) + select(vec2f(0.0), shift, periodic);
        p = vec3f(q.x, y, q.y);
    } else {
        // From the ground, or below anything, up to the surface.
        let side = stage.sides[which.a];
        let n = which.b;
        let square = k / 6u;
        let at = vec2u(square, 0u) + corner_of_square(k % 6u);
        let s = f32(at.x) / f32(n);
        var q = vec2f(side.y, mix(f.low.y, f.high.y, s));
        if side.x > 1.0 {
            q = vec2f(mix(f.low.x, f.high.x, s), side.y);
        }
        let bed = max(field_height(GROUND_FIELD, q), -4.0 * max(f.high.x - f.low.x, f.high.y - f.low.y));
        p = vec3f(q.x, mix(bed, field_height(WATER_FIELD, q), f32(at.y)), q.y);
    }
    return SurfaceCorner(project(p), p);
}

struct Looked {
    hit_p: vec3f,
    d: vec3f,
    distance: f32,
    at: Interface,
    foam: f32,
}

// The interface at a fragment; foam is negative where there is no water. Triangles leave the patches that rays meet by a
// quarter of their twist; a ray that starts on the wrong side of its patch would see through it.
fn look(on_mesh: vec3f) -> Looked {
    var p = on_mesh;
    if which.kind == WATER_MESH {
        p.y = field_height(WATER_FIELD, p.xz);
    }
    // Triangles of deck and wall leave cracks between them: no water is behind those.
    let within = within_sides(p);
    if which.kind == WATER_MESH {
        // Rays that start on a wall would begin behind it by a rounding.
        p = inside_walls(p);
    }
    let to = p - stage.eye;
    let distance = length(to);
    let d = to / distance;
    let glass = which.kind == GLASS_MESH;
    var normal = vec3f(0.0, 1.0, 0.0);
    if glass {
        normal = side_normal(stage.sides[which.a]);
    } else {
        let slope = facet_slope(WATER_FIELD, p.xz);
        normal = normalize(vec3f(-slope.x, 1.0, -slope.y));
    }
    var foam = 0.0;
    if !glass {
        foam = foam_cover(p.xz);
    }
    if !within {
        foam = -1.0;
    }
    return Looked(p, d, distance, water_interface(d, p, normal, glass), foam);
}

// What is seen through the surface by ray `at.refracted` from `p`.
fn through_surface(look: Looked) -> vec3f {
    let seen = refraction(look.hit_p, look.d, look.at);
    if stage.medium == AIR {
        let depth = depth_below(look.hit_p);
        if !seen.found {
            return scattered(depth, -look.at.refracted.y, FAR);
        }
        let length = distance(look.hit_p, seen.place);
        if !ABSORPTION {
            return seen.radiance;
        }
        return seen.radiance * transmittance(stage.extinction, length) + scattered(depth, -look.at.refracted.y, length);
    }
    if !seen.found {
        return escaped(look.at.refracted, stage.spread);
    }
    let left = air_transmittance(distance(look.hit_p, seen.place));
    return seen.radiance * left + haze(look.at.refracted) * (1.0 - left);
}

@fragment
fn surface(in: SurfaceCorner) -> @location(0) vec4f {
    let it = look(in.position);
    if it.foam < 0.0 {
        discard;
    }
    let p = it.hit_p;
    let at = it.at;
    let width = stage.spread * it.distance;
    var radiance = vec3f(0.0);
    if it.foam < 1.0 {
        let turn = min(at.curvature * width, 0.5) + ROUGHNESS;
        let from_eye = Path(stage.eye, it.d, vec3f(1.0), stage.medium, 0.0, stage.spread, 0u, 1.0, false);
        var mirrored = branch(from_eye, at, p, at.reflected, stage.medium, width, stage.spread + 2.0 * turn, at.fresnel);
        var reflection = vec3f(0.0);
        if TRACED_REFLECTION {
            reflection = trace(mirrored).radiance;
        } else if stage.medium == AIR {
            reflection = escaped(at.reflected, mirrored.spread);
        } else {
            reflection = scattered(depth_below(p), -at.reflected.y, FAR);
        }
        if all(at.refracted == vec3f(0.0)) {
            radiance = reflection;
        } else {
            radiance = at.fresnel * reflection + (1.0 - at.fresnel) * through_surface(it);
        }
    }
    if it.foam > 0.0 {
        let up = at.shading * sign(at.shading.y);
        let matt = Matt(p, at.facing * sign(at.facing.y), up, vec3f(FOAM_ALBEDO), 1.0, stage.hair, false, AIR);
        radiance = mix(radiance, lit(matt), it.foam);
    }
    if stage.medium == AIR {
        let left = air_transmittance(it.distance);
        radiance = radiance * left + haze(it.d) * (1.0 - left);
    } else if ABSORPTION {
        radiance = radiance * transmittance(stage.extinction, it.distance)
            + scattered(depth_below(stage.eye), -it.d.y, it.distance);
    }
    return target_value(radiance);
}

struct Met {
    @location(0) first: vec4f,
    @location(1) refracted: vec4f,
}

// Where the technique takes the refracted ray to end.
@fragment
fn surface_met(in: SurfaceCorner) -> Met {
    let it = look(in.position);
    if it.foam < 0.0 {
        discard;
    }
    var met = Met(vec4f(it.hit_p, 1.0), vec4f(0.0, 0.0, 0.0, -1.0));
    if any(it.at.refracted != vec3f(0.0)) {
        let seen = refraction(it.hit_p, it.d, it.at);
        if seen.found {
            met.refracted = vec4f(seen.place, distance(it.hit_p, seen.place));
        }
    }
    return met;
}
