// Where points seem to stand, for a test.

@group(0) @binding(10) var<storage, read> arguments: array<vec4f>;
@group(0) @binding(11) var<storage, read_write> values: array<vec4f>;

@compute @workgroup_size(64)
fn parity_apparent(@builtin(global_invocation_id) at: vec3u) {
    values[at.x] = vec4f(apparent(arguments[at.x].xyz), 0.0);
}
