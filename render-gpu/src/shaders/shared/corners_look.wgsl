// What triangles hand from their corners to their fragments, where models have materials (`looks.wgsl`).

struct Vertex {
    position: vec3f,
    normal: vec3f,
    color: vec3f,
    coordinates: vec2f,
    material: u32,
}

struct Corner {
    @builtin(position) clip: vec4f,
    @location(0) position: vec3f,
    @location(1) normal: vec3f,
    @location(2) color: vec3f,
    @location(3) coordinates: vec2f,
    @location(4) @interpolate(flat) material: u32,
}

fn plain(position: vec3f, normal: vec3f, color: vec3f) -> Vertex {
    return Vertex(position, normal, color, vec2f(0.0), 0u);
}

// Corner 0 to 2 of the triangle of `meshes` that begins at row `triangle`.
fn of_object(position: vec3f, normal: vec3f, color: vec3f, triangle: u32, corner: u32) -> Vertex {
    let at = vec2u(meshes[triangle + corner].w, meshes[triangle + corner + 3u].w);
    return Vertex(position, normal, color, bitcast<vec2f>(at), meshes[triangle + 6u].x);
}

fn corner_at(clip: vec4f, v: Vertex) -> Corner {
    return Corner(clip, v.position, v.normal, v.color, v.coordinates, v.material);
}

fn corner_color(in: Corner) -> vec3f {
    if in.material == 0u {
        return in.color;
    }
    return material_color(in.material, in.coordinates);
}
