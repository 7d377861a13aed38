// Edges of the traced picture, smoothed: a pixel that differs from a neighbour gets four more rays (Whitted 1980), at the places of
// four-fold MSAA. What differs is seen in the picture itself: outlines, the waterline, and what waves tear apart below it.

@group(0) @binding(10) var traced: texture_2d<f32>;

// Least difference, as a share of both together: 5 % of brightness.
const CONTRAST: f32 = 0.025;

fn differs(a: vec3f, at: vec2i) -> bool {
    let b = textureLoad(traced, clamp(at, vec2i(0), vec2i(stage.size) - 1), 0).rgb;
    return any(abs(a - b) > CONTRAST * (a + b));
}

@fragment
fn heightfield_edges(@builtin(position) place: vec4f) -> @location(0) vec4f {
    let at = vec2i(place.xy);
    var sum = textureLoad(traced, at, 0).rgb;
    let right = vec2i(1, 0);
    let down = vec2i(0, 1);
    if !(differs(sum, at + right) || differs(sum, at - right) || differs(sum, at + down) || differs(sum, at - down)) {
        return vec4f(sum, 1.0);
    }
    var offset = vec2f(0.125, 0.375);
    for (var k = 0; k < 4; k++) {
        sum += in_front(at, trace(primary_path(vec2f(at) + stage.jitter + offset)));
        offset = vec2f(-offset.y, offset.x);
    }
    return vec4f(sum / 5.0, 1.0);
}
