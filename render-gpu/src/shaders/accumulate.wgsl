// Adds one sample of every pixel to the picture.

@group(0) @binding(10) var radiance: texture_2d<f32>;
@group(0) @binding(11) var<storage, read_write> picture: array<vec4f>;

@compute @workgroup_size(8, 8)
fn accumulate(@builtin(global_invocation_id) at: vec3u) {
    let size = vec2u(stage.size);
    if any(at.xy >= size) {
        return;
    }
    let k = at.y * size.x + at.x;
    picture[k] += stage.sample_share * textureLoad(radiance, at.xy, 0);
}
