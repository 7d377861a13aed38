fn walk_field(f: u32, o: vec3f, d: vec3f, from_t: f32, to_t: f32) -> f32 {
    return walk_pyramid(f, o, d, from_t, to_t);
}
