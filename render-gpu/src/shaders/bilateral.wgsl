// The edge-preserving filter of the illumination map (Tomasi & Manduchi 1998): weights fall with distance and with the
// difference of light. Each pair of texels exchanges light by one symmetric weight, so none is lost.

@group(0) @binding(10) var<storage, read> map: array<f32>;
@group(0) @binding(11) var<storage, read_write> filtered: array<f32>;

const RADIUS: i32 = 2;
const SIGMA_PLACE: f32 = 1.0;
const SIGMA_LIGHT: f32 = 0.35;
// The sum of the weights of place within the radius, but for the middle.
const WHOLE: f32 = 5.1687;

@compute @workgroup_size(8, 8)
fn bilateral(@builtin(global_invocation_id) at: vec3u) {
    let size = vec2i(stage.map_size);
    let p = vec2i(at.xy);
    if any(p >= size) {
        return;
    }
    let here = map[p.y * size.x + p.x];
    var change = 0.0;
    for (var b = -RADIUS; b <= RADIUS; b++) {
        for (var a = -RADIUS; a <= RADIUS; a++) {
            let q = p + vec2i(a, b);
            if any(q < vec2i(0)) || any(q >= size) || (a == 0 && b == 0) {
                continue;
            }
            let there = map[q.y * size.x + q.x];
            // Relative to the brighter of the two: noise of few photons goes with the light itself.
            let apart = (there - here) / (SIGMA_LIGHT * max(max(there, here), 0.25));
            let w = exp(-0.5 * f32(a * a + b * b) / (SIGMA_PLACE * SIGMA_PLACE) - 0.5 * apart * apart);
            change += w * (there - here);
        }
    }
    filtered[p.y * size.x + p.x] = here + change / (1.0 + WHOLE);
}
