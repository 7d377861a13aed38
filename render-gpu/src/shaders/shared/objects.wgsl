// Objects as triangles.

// Triangles of the objects, six rows each: three corners, three normals, in the object's own axes.
@group(0) @binding(13) var<storage, read> meshes: array<vec4u>;

fn object_vertex(k: u32) -> Vertex {
    let row_at = which.b + 6u * (k / 3u) + k % 3u;
    let record = 6u * which.a;
    let turn = mat3x3f(row(record + 2u), row(record + 3u), row(record + 4u));
    let p = bitcast<vec3f>(meshes[row_at].xyz);
    let n = bitcast<vec3f>(meshes[row_at + 3u].xyz);
    let color = bitcast<vec3f>(vec3u(solids[record + 2u].w, solids[record + 3u].w, solids[record + 4u].w));
    // The rows of body_from_world are the columns of its transpose.
    return Vertex(row(record) + turn * p, turn * n, color);
}

// By how much shadow rays start off the triangles: a hundredth of the object's size covers the sagitta of their edges.
fn object_lift() -> f32 {
    return 0.01 * bitcast<f32>(solids[6u * which.a + 1u].w);
}
