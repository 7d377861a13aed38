// A scene without objects.

fn object_vertex(k: u32) -> Vertex {
    return plain(vec3f(0.0), vec3f(0.0, 1.0, 0.0), vec3f(0.0));
}

fn object_lift() -> f32 {
    return 0.0;
}
