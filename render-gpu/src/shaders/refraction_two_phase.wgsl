// Liu, Han & Fei 2020, narrow phase: the scene around the pixel is taken as the plane of what the broad phase drew there;
// the true refracted ray is cut with it, and the cut mapped into apparent space gives the pixel to look up. The paper turns
// the camera ray by the full turn of the normal, which overshoots; here Snell's law gives the direction.

fn refraction(p: vec3f, d: vec3f, at: Interface) -> Seen {
    var place = to_picture(p);
    for (var n = 0; n < NARROW_STEPS; n++) {
        let there = textureLoad(far_place, texel_of(place), 0);
        if there.w == 0.0 {
            break;
        }
        let normal = textureLoad(far_normal, texel_of(place), 0).xyz;
        let slant = dot(normal, at.refracted);
        var t = dot(normal, there.xyz - p) / slant;
        if abs(slant) < 0.02 || t <= 0.0 {
            t = distance(there.xyz, p);
        }
        let target_place = p + t * at.refracted;
        let next = apparent(target_place);
        if dot(next - stage.eye, stage.forward) <= stage.near {
            break;
        }
        place = to_picture(next);
    }
    return seen_at(place);
}
