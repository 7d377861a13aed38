// Sunlight under water as through a flat surface.

fn beam_received(normal: vec3f, geometric: vec3f, p: vec2f) -> f32 {
    return dot(normal, stage.beam_direction);
}
