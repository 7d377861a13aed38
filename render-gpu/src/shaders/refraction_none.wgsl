// No refraction: what is behind the surface is seen where it is.

fn refraction(p: vec3f, d: vec3f, at: Interface) -> Seen {
    return seen_at(to_picture(p));
}
