//! Triangle meshes of scene objects: primitives and what is loaded from glTF.

use glam::{Vec2, Vec3};

/// Triangles with one base colour, in the object's own axes, metres.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TriangleMesh {
    /// Vertex positions in metres.
    pub positions: Vec<Vec3>,
    /// Unit vertex normals; as many as positions.
    pub normals: Vec<Vec3>,
    /// Texture coordinates; empty, or as many as positions.
    pub texcoords: Vec<Vec2>,
    /// Vertex indices of each triangle, anticlockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
    /// Linear-light base colour, 0 to 1.
    pub base_color: Vec3,
}
