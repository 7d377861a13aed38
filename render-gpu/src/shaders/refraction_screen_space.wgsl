// McGuire & Mara 2014: the refracted ray is followed over the picture, a pixel a step, until it is behind what is drawn.

const MOST_STEPS: i32 = 512;
const THICKNESS: f32 = 0.25;

fn refraction(p: vec3f, d: vec3f, at: Interface) -> Seen {
    let f = stage.fields[WATER_FIELD];
    var reach = 2.0 * max(f.high.x - f.low.x, f.high.y - f.low.y);
    // Not behind the eye.
    let speed = dot(at.refracted, stage.forward);
    let start = project(p).w;
    if speed < 0.0 {
        reach = min(reach, 0.99 * (start - stage.near) / -speed);
    }
    let end_w = start + reach * speed;
    let from_p = to_picture(p);
    let to_p = to_picture(p + reach * at.refracted);
    let span = to_p - from_p;
    let pixels = max(abs(span.x), abs(span.y));
    let steps = clamp(i32(ceil(pixels)), 1, MOST_STEPS);
    var last = from_p;
    for (var n = 1; n <= steps; n++) {
        let s = f32(n) / max(pixels, 1.0);
        if s > 1.0 {
            break;
        }
        let here = from_p + s * span;
        if !inside_picture(here) {
            break;
        }
        last = here;
        let w = 1.0 / mix(1.0 / start, 1.0 / end_w, s);
        let there = textureLoad(far_place, texel_of(here), 0);
        if there.w == 0.0 {
            continue;
        }
        let scene = dot(there.xyz - stage.eye, stage.forward);
        if w >= scene {
            let before = 1.0 / mix(1.0 / start, 1.0 / end_w, f32(n - 1) / max(pixels, 1.0));
            // Passed within a step, or within the thickness that everything is taken to have.
            if before <= scene || w - scene < THICKNESS * (w - start) {
                return seen_at(here);
            }
        }
    }
    atomicAdd(&missing[2], 1u);
    return seen_at(last);
}
