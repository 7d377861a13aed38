// Sunlight that enters the water, patch by patch: where it lands on the ground and how much it is, relative to flat
// water (Baboud & Décoret 2006, 4.3; `render-cpu/src/whitted/caustics.rs`). A photon is (x, z, share, 0).

@group(0) @binding(10) var<storage, read_write> photons: array<vec4f>;

const STEPS: i32 = 4;

fn hash(v: u32) -> u32 {
    var x = v * 747796405u + 2891336453u;
    x = ((x >> ((x >> 28u) + 4u)) ^ x) * 277803737u;
    return (x >> 22u) ^ x;
}

@compute @workgroup_size(8, 8)
fn emit(@builtin(global_invocation_id) at: vec3u) {
    let count = stage.photons;
    if any(at.xy >= count) {
        return;
    }
    let k = at.y * count.x + at.x;
    photons[k] = vec4f(0.0);
    var offset = vec2f(0.5);
    if PHOTON_JITTER {
        offset = vec2f(f32(hash(2u * k) >> 8u), f32(hash(2u * k + 1u) >> 8u)) / 16777216.0;
    }
    let extent = vec2f(stage.map_size - 1u) * stage.map_spacing;
    let from_p = stage.map_low + (vec2f(at.xy) + offset) / vec2f(count) * extent;
    let height = field_height(WATER_FIELD, from_p);
    if field_height(GROUND_FIELD, from_p) >= height {
        return;
    }
    let normal = field_normal(WATER_FIELD, from_p);
    let cos = dot(normal, stage.sun_direction);
    if cos <= 0.0 {
        return;
    }
    let down = optics_refract(-stage.sun_direction, normal, 1.0 / stage.index);
    if down.y > -1e-3 {
        return;
    }
    let flat_share = (1.0 - fresnel(stage.sun_direction.y, 1.0 / stage.index)) * stage.sun_direction.y;
    let share = (1.0 - fresnel(cos, 1.0 / stage.index)) * cos / normal.y / flat_share;
    let across = down.xz / -down.y;
    var landed = from_p;
    for (var n = 0; n < STEPS; n++) {
        landed = from_p + across * max(height - field_height(GROUND_FIELD, landed), 0.0);
    }
    photons[k] = vec4f((landed - stage.map_low) / stage.map_spacing, share, 1.0);
}
