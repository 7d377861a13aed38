// What the far pass drew, and how many pixels were asked for that it could not draw.

@group(0) @binding(14) var far_radiance: texture_2d<f32>;
@group(0) @binding(15) var far_place: texture_2d<f32>;
@group(0) @binding(16) var far_normal: texture_2d<f32>;
// Pixels looked up beyond the picture's edge, and pixels without any data.
@group(0) @binding(17) var<storage, read_write> missing: array<atomic<u32>, 4>;

struct Seen {
    radiance: vec3f,
    place: vec3f,
    found: bool,
}

fn inside_picture(at: vec2f) -> bool {
    return all(at >= vec2f(0.0)) && all(at < stage.size);
}

fn texel_of(at: vec2f) -> vec2i {
    return clamp(vec2i(floor(at)), vec2i(0), vec2i(stage.size) - 1);
}

// What is drawn at a point of the picture, between the texels that belong to the thing at its middle.
fn blended(at: vec2f, place: vec3f) -> Seen {
    let q = clamp(at, vec2f(0.5), stage.size - 0.5) - 0.5;
    let base = floor(q);
    let f = q - base;
    var radiance = vec3f(0.0);
    var where_seen = vec3f(0.0);
    var weight = 0.0;
    let reach = distance(place, stage.eye);
    for (var k = 0; k < 4; k++) {
        let step = vec2i(k & 1, k >> 1u);
        let texel = clamp(vec2i(base) + step, vec2i(0), vec2i(stage.size) - 1);
        let there = textureLoad(far_place, texel, 0);
        let w2 = mix(1.0 - f, f, vec2f(step));
        // Neighbours that are much nearer or farther belong to something else.
        let alike = there.w > 0.0 && abs(distance(there.xyz, stage.eye) - reach) < 0.05 * reach;
        let w = select(0.0, w2.x * w2.y, alike);
        radiance += w * textureLoad(far_radiance, texel, 0).rgb;
        where_seen += w * there.xyz;
        weight += w;
    }
    if weight > 0.0 {
        return Seen(radiance / weight, where_seen / weight, true);
    }
    return Seen(textureLoad(far_radiance, texel_of(at), 0).rgb, place, true);
}

fn seen_at(at: vec2f) -> Seen {
    if !inside_picture(at) {
        atomicAdd(&missing[0], 1u);
    }
    let place = textureLoad(far_place, texel_of(at), 0);
    if place.w == 0.0 {
        atomicAdd(&missing[1], 1u);
        return Seen(vec3f(0.0), vec3f(0.0), false);
    }
    return blended(at, place.xyz);
}
