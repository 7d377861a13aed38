// What is seen where there is nothing.

@fragment
fn background(@builtin(position) place: vec4f) -> @location(0) vec4f {
    let d = view_direction(floor(place.xy) + stage.jitter);
    if stage.medium == AIR {
        return vec4f(escaped(d, stage.spread), 1.0);
    }
    return vec4f(scattered(depth_below(stage.eye), -d.y, FAR), 1.0);
}
