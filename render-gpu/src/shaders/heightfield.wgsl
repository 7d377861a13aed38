// Baboud & Décoret 2006: water and ground as two heightfields, traced together a pixel at a time. Depth is written, so
// that other geometry can be drawn before or after.

struct Drawn {
    @location(0) radiance: vec4f,
    @builtin(frag_depth) depth: f32,
}

@fragment
fn heightfield(@builtin(position) place: vec4f) -> Drawn {
    let at = floor(place.xy) + stage.jitter;
    let traced = trace(primary_path(at));
    let p = stage.eye + min(traced.distance, 1e15) * view_direction(at);
    return Drawn(vec4f(traced.radiance, 1.0), select(0.0, depth_of(p), traced.distance < FAR));
}
