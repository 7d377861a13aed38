// Scatters photons into the map, as whole numbers, whose sum does not depend on the order.

@group(0) @binding(10) var<storage, read> photons: array<vec4f>;
@group(0) @binding(11) var<storage, read_write> sums: array<atomic<u32>>;

const ONE: f32 = 65536.0;

@compute @workgroup_size(64)
fn scatter(@builtin(global_invocation_id) at: vec3u) {
    if at.x >= stage.photons.x * stage.photons.y {
        return;
    }
    let photon = photons[at.x];
    if photon.w == 0.0 {
        return;
    }
    let cell = floor(photon.xy);
    let f = photon.xy - cell;
    for (var k = 0; k < 4; k++) {
        let step = vec2i(k & 1, k >> 1u);
        let p = vec2i(cell) + step;
        if any(p < vec2i(0)) || any(p >= vec2i(stage.map_size)) {
            continue;
        }
        let w = mix(1.0 - f, f, vec2f(step));
        let units = u32(clamp(photon.z * w.x * w.y * ONE + 0.5, 0.0, 64.0 * ONE));
        atomicAdd(&sums[u32(p.y) * stage.map_size.x + u32(p.x)], units);
    }
}
