// The offset of games: what is behind the surface, looked up a little to the side by the tilt of the normal. Strength is
// that of refraction at normal incidence by water as deep as what is found straight behind.

fn refraction(p: vec3f, d: vec3f, at: Interface) -> Seen {
    let straight = to_picture(p);
    let behind = textureLoad(far_place, texel_of(straight), 0);
    if behind.w == 0.0 {
        return seen_at(straight);
    }
    let depth = distance(p, behind.xyz);
    let bend = 1.0 - 1.0 / stage.index;
    let tilt = vec3f(at.shading.x, 0.0, at.shading.z);
    let moved = to_picture(behind.xyz - bend * depth * tilt);
    // What stands in front of the water must not bleed into it.
    let there = textureLoad(far_place, texel_of(moved), 0);
    if !inside_picture(moved) || there.w == 0.0 || distance(there.xyz, stage.eye) < distance(p, stage.eye) {
        return seen_at(straight);
    }
    return seen_at(moved);
}
