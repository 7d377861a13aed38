// Rodgman & Chen 2006: the refracted ray marches through a voxel field of distances to the nearest surface. A voxel holds
// the distance in metres and what is nearest (0 ground, 1 wall, 2 and more objects).

@group(0) @binding(14) var<storage, read> voxels: array<vec2u>;
@group(0) @binding(15) var<uniform> voxel_box: VoxelBox;
@group(0) @binding(17) var<storage, read_write> missing: array<atomic<u32>, 4>;

struct VoxelBox {
    low: vec3f,
    count: u32,
    step: vec3f,
    unused: u32,
}

struct Seen {
    radiance: vec3f,
    place: vec3f,
    found: bool,
}

fn voxel(p: vec3i) -> vec2u {
    let n = i32(voxel_box.count);
    let q = clamp(p, vec3i(0), vec3i(n - 1));
    return voxels[u32((q.y * n + q.z) * n + q.x)];
}

fn distance_at(p: vec3f) -> f32 {
    let g = (p - voxel_box.low) / voxel_box.step - 0.5;
    let base = floor(g);
    let f = g - base;
    var sum = 0.0;
    for (var k = 0; k < 8; k++) {
        let step = vec3i(k & 1, (k >> 1u) & 1, k >> 2u);
        let w = mix(1.0 - f, f, vec3f(step));
        sum += w.x * w.y * w.z * bitcast<f32>(voxel(vec3i(base) + step).x);
    }
    return sum;
}

fn refraction(p: vec3f, d: vec3f, at: Interface) -> Seen {
    let finest = min(voxel_box.step.x, min(voxel_box.step.y, voxel_box.step.z));
    let coarsest = max(voxel_box.step.x, max(voxel_box.step.y, voxel_box.step.z));
    let high = voxel_box.low + f32(voxel_box.count) * voxel_box.step;
    var t = finest;
    for (var n = 0; n < 512; n++) {
        let q = p + t * at.refracted;
        if any(q < voxel_box.low - voxel_box.step) || any(q > high + voxel_box.step) {
            break;
        }
        let reach = distance_at(q);
        // Distances without a sign, interpolated between voxels, stay up to half a voxel away from zero.
        if reach < 0.55 * coarsest {
            // From a voxel before it: on along the ray to the plane that the distance and its gradient there describe.
            let before = q - min(coarsest, t) * at.refracted;
            let towards = max(-dot(gradient_at(before), at.refracted), 0.15);
            return shaded(before + at.refracted * (distance_at(before) / towards), at.refracted);
        }
        t += max(reach - 0.25 * finest, 0.25 * finest);
    }
    atomicAdd(&missing[2], 1u);
    return Seen(vec3f(0.0), vec3f(0.0), false);
}

fn gradient_at(q: vec3f) -> vec3f {
    let h = voxel_box.step;
    let gradient = vec3f(
        distance_at(q + vec3f(h.x, 0.0, 0.0)) - distance_at(q - vec3f(h.x, 0.0, 0.0)),
        distance_at(q + vec3f(0.0, h.y, 0.0)) - distance_at(q - vec3f(0.0, h.y, 0.0)),
        distance_at(q + vec3f(0.0, 0.0, h.z)) - distance_at(q - vec3f(0.0, 0.0, h.z)),
    ) / h;
    return normalize(gradient + vec3f(0.0, 1e-6, 0.0));
}

fn shaded(q: vec3f, d: vec3f) -> Seen {
    let h = voxel_box.step;
    // Where distances still grow away from the surface; they have no sign, so the side is that of the ray.
    var normal = gradient_at(q - length(h) * d);
    normal *= select(1.0, -1.0, dot(normal, d) > 0.0);
    let what = voxel(vec3i(floor((q - voxel_box.low) / voxel_box.step))).y;
    let medium = select(AIR, WATER, stage.medium == AIR);
    // Off the surface by what the voxels cannot resolve, or it would stand in its own shadow.
    let lift = 1.5 * max(h.x, max(h.y, h.z));
    var matt = Matt(q, normal, normal, stage.steep, 1.0, lift, false, medium);
    if what == 0u {
        matt = ground_matt(q, field_normal(GROUND_FIELD, q.xz), d, 0.0, medium);
        matt.lift = lift;
    } else if what >= 2u {
        matt.albedo = solid_color(what - 2u);
    }
    return Seen(lit(matt), q, true);
}
