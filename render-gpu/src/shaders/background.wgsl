// What is seen where there is nothing.

@fragment
fn background(@builtin(position) place: vec4f) -> @location(0) vec4f {
    let d = view_direction(floor(place.xy) + stage.jitter);
    if stage.medium == AIR {
        return target_value(escaped(d, stage.spread));
    }
    return target_value(scattered(depth_below(stage.eye), -d.y, FAR));
}
