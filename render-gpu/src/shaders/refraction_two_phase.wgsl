// Liu, Han & Fei 2020, narrow phase: the scene around the pixel is taken as the plane of what the broad phase drew there;
// the true refracted ray is cut with it, and the cut mapped into apparent space gives the pixel to look up. The paper turns
// the camera ray by the full turn of the normal, which overshoots; here Snell's law gives the direction.

// From under water most rays end on the sky or close to the rim of Snell's window, where nothing is drawn beside a thing.
const MARCH: i32 = 16;

// The pixel at which the broad phase shows point `q` of the other side; `otherwise` if that is behind the eye.
fn shown_at(q: vec3f, otherwise: vec2f) -> vec2f {
    let a = apparent(q);
    if dot(a - stage.eye, stage.forward) <= stage.near {
        return otherwise;
    }
    return to_picture(a);
}

// A ray that the planes do not bring to anything: along it in steps that grow, as far as anything of the scene stands, until it
// passes behind what is drawn.
fn marched(p: vec3f, d: vec3f, otherwise: vec2f) -> vec2f {
    let f = stage.fields[WATER_FIELD];
    let reach = 2.0 * length(f.high - f.low);
    let growth = pow(200.0, 1.0 / f32(MARCH));
    var before = 0.0;
    var t = reach / 200.0;
    for (var n = 0; n <= MARCH; n++) {
        let place = shown_at(p + t * d, otherwise);
        let there = textureLoad(far_place, texel_of(place), 0);
        if there.w > 0.0 && inside_picture(place) {
            let along = dot(there.xyz - p, d);
            let across = distance(there.xyz, p + along * d);
            // Passed within this step, and not by more than steps are apart.
            if along > 0.0 && along <= t && across < 0.5 * (t - before) {
                return shown_at(p + along * d, place);
            }
        }
        before = t;
        t *= growth;
    }
    return otherwise;
}

fn refraction(p: vec3f, d: vec3f, at: Interface) -> Seen {
    var place = to_picture(p);
    for (var n = 0; n < NARROW_STEPS; n++) {
        let there = textureLoad(far_place, texel_of(place), 0);
        // Without anything there the ray goes on for ever.
        var t = 1e3 * length(p - stage.eye);
        if there.w > 0.0 {
            let normal = textureLoad(far_normal, texel_of(place), 0).xyz;
            let slant = dot(normal, at.refracted);
            t = dot(normal, there.xyz - p) / slant;
            if abs(slant) < 0.02 || t <= 0.0 {
                t = distance(there.xyz, p);
            }
        }
        place = shown_at(p + t * at.refracted, place);
    }
    if NARROW_STEPS > 0 && stage.medium == WATER && textureLoad(far_place, texel_of(place), 0).w == 0.0 {
        place = marched(p, at.refracted, place);
    }
    return seen_at(place);
}
