// Every formula on a table of arguments, for a test.

@group(0) @binding(10) var<storage, read> arguments: array<vec4f>;
@group(0) @binding(11) var<storage, read_write> values: array<vec4f>;

@compute @workgroup_size(64)
fn parity(@builtin(global_invocation_id) at: vec3u) {
    let a = arguments[2u * at.x];
    let b = arguments[2u * at.x + 1u];
    let up = vec3f(0.0, 1.0, 0.0);
    let refracted = optics_refract(a.xyz, up, a.w);
    let reflected = optics_reflect(a.xyz, up);
    let left = transmittance(WATER_ABSORPTION, b.z);
    let f0 = reflectance_at_normal(a.w);
    values[4u * at.x] = vec4f(fresnel(b.x, a.w), fresnel_schlick(b.x, f0), f0, henyey_greenstein(b.x, b.w));
    values[4u * at.x + 1u] = vec4f(refracted, reflected.x);
    values[4u * at.x + 2u] = vec4f(reflected.yz, left.xy);
    values[4u * at.x + 3u] = vec4f(left.z, WATER_INDEX, linear_of_srgb(vec3f(b.xy, 0.03)).xz);
}
