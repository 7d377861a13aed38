// What the ray through a pixel's middle meets, and what its refracted ray meets: (place, length), for scores.

struct Met {
    @location(0) first: vec4f,
    @location(1) refracted: vec4f,
}

@fragment
fn heightfield_aux(@builtin(position) place: vec4f) -> Met {
    let d = view_direction(floor(place.xy) + 0.5);
    let hit = cast_ray(stage.eye, d, FAR, true, stage.medium == AIR);
    let p = stage.eye + hit.t * d;
    // Kind in w: 0 nothing, 1 water, 2 anything else.
    let water = hit.kind == SURFACE || hit.kind == GLASS;
    var met = Met(vec4f(p, select(select(2.0, 1.0, water), 0.0, hit.kind == NOTHING)), vec4f(0.0, 0.0, 0.0, -1.0));
    if !water {
        return met;
    }
    let at = water_interface(d, p, hit.normal, hit.kind == GLASS);
    if all(at.refracted == vec3f(0.0)) {
        return met;
    }
    let origin = p - stage.hair * at.facing;
    let next = cast_ray(origin, at.refracted, FAR, true, at.from_water);
    if next.kind != NOTHING {
        met.refracted = vec4f(origin + next.t * at.refracted, next.t);
    }
    return met;
}
