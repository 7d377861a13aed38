// Nothing but what rays meet.

fn in_front(at: vec2i, met: Traced) -> vec3f {
    return met.radiance;
}
