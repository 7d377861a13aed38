// Objects as triangles.

// Triangles of the objects, TRIANGLE_ROWS each: three corners, three normals, in the object's own axes.
@group(0) @binding(13) var<storage, read> meshes: array<vec4u>;

fn object_vertex(k: u32) -> Vertex {
    let triangle = which.b + TRIANGLE_ROWS * (k / 3u);
    let corner = k % 3u;
    let record = 6u * which.a;
    let turn = mat3x3f(row(record + 2u), row(record + 3u), row(record + 4u));
    let p = bitcast<vec3f>(meshes[triangle + corner].xyz);
    let n = bitcast<vec3f>(meshes[triangle + corner + 3u].xyz);
    // The rows of body_from_world are the columns of its transpose.
    return of_object(row(record) + turn * p, turn * n, record_color(record), triangle, corner);
}

// By how much shadow rays start off the triangles: a hundredth of the object's size covers the sagitta of their edges.
fn object_lift() -> f32 {
    return 0.01 * bitcast<f32>(solids[6u * which.a + 1u].w);
}
