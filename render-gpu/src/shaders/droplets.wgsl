// Droplets in front of what is drawn, each traced.

struct Drawn {
    @location(0) radiance: vec4f,
    @builtin(frag_depth) depth: f32,
}

@fragment
fn droplets(@builtin(position) place: vec4f) -> Drawn {
    let at = floor(place.xy) + stage.jitter;
    let d = view_direction(at);
    let ball = cast_spray(stage.eye, d, FAR);
    if ball.x >= FAR || stage.medium != AIR {
        discard;
    }
    return Drawn(target_value(trace(primary_path(at)).radiance), depth_of(stage.eye + ball.x * d));
}
