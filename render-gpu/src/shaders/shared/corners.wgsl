// What triangles hand from their corners to their fragments, where things have one colour each.

struct Vertex {
    position: vec3f,
    normal: vec3f,
    color: vec3f,
}

struct Corner {
    @builtin(position) clip: vec4f,
    @location(0) position: vec3f,
    @location(1) normal: vec3f,
    @location(2) color: vec3f,
}

fn plain(position: vec3f, normal: vec3f, color: vec3f) -> Vertex {
    return Vertex(position, normal, color);
}

// Corner 0 to 2 of the triangle of `meshes` that begins at row `triangle`.
fn of_object(position: vec3f, normal: vec3f, color: vec3f, triangle: u32, corner: u32) -> Vertex {
    return plain(position, normal, color);
}

fn corner_at(clip: vec4f, v: Vertex) -> Corner {
    return Corner(clip, v.position, v.normal, v.color);
}

fn corner_color(in: Corner) -> vec3f {
    return in.color;
}
