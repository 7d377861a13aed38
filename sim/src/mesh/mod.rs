//! Triangle meshes of scene objects: primitives and what is loaded from glTF.

#[cfg(test)]
mod closed;
mod model;
mod primitives;
mod texture;

pub use model::{MeshError, MeshErrorKind, load_gltf};
pub use texture::{Material, Shine, Texture, Wrap};

use glam::{Vec2, Vec3};

/// Triangles with their colours, in the object's own axes, metres.
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
    /// Linear-light base colour, 0 to 1; of a mesh with materials a mean of theirs.
    pub base_color: Vec3,
    /// What parts of the mesh look like; empty where all of it has the base colour.
    pub materials: Vec<Material>,
    /// Number of the material of each triangle; empty where there are none.
    pub material_of: Vec<u16>,
}

/// Base colour of primitives and of models that have none.
pub const DEFAULT_COLOR: Vec3 = Vec3::splat(0.5);

/// Why a mesh cannot be used.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum InvalidMesh {
    /// It has no triangle.
    #[error("the mesh has no triangle")]
    Empty,
    /// Not as many normals or texture coordinates as positions.
    #[error("the mesh has {positions} positions, but {found} {what}")]
    Length {
        /// Number of positions.
        positions: usize,
        /// Which list has another length.
        what: &'static str,
        /// Its length.
        found: usize,
    },
    /// Triangles and their materials do not belong together, or a texture has another size than it says.
    #[error("the mesh's materials or their textures are not whole")]
    Materials,
    /// A triangle names a vertex that is not there.
    #[error("triangle {triangle} names vertex {index}, the mesh has {count}")]
    Index {
        /// Number of the triangle.
        triangle: usize,
        /// The index.
        index: u32,
        /// Number of vertices.
        count: usize,
    },
    /// A value is NaN or infinite.
    #[error("vertex {vertex} has a {what} that is not finite")]
    NotFinite {
        /// Number of the vertex.
        vertex: usize,
        /// Position, normal or texture coordinate.
        what: &'static str,
    },
}

impl TriangleMesh {
    /// Checks what the fields promise, for meshes that were read from a file.
    ///
    /// # Errors
    /// [`InvalidMesh`]
    pub fn validate(&self) -> Result<(), InvalidMesh> {
        let count = self.positions.len();
        if self.triangles.is_empty() {
            return Err(InvalidMesh::Empty);
        }
        if self.normals.len() != count {
            return Err(InvalidMesh::Length {
                positions: count,
                what: "normals",
                found: self.normals.len(),
            });
        }
        if !self.texcoords.is_empty() && self.texcoords.len() != count {
            let found = self.texcoords.len();
            return Err(InvalidMesh::Length {
                positions: count,
                what: "texture coordinates",
                found,
            });
        }
        for (triangle, t) in self.triangles.iter().enumerate() {
            if let Some(&index) = t.iter().find(|&&k| k as usize >= count) {
                return Err(InvalidMesh::Index {
                    triangle,
                    index,
                    count,
                });
            }
        }
        let none = self.materials.is_empty() && self.material_of.is_empty();
        let named = |k: &u16| usize::from(*k) < self.materials.len();
        let each = self.material_of.len() == self.triangles.len() && self.material_of.iter().all(named);
        let whole = |m: &Material| {
            m.texture.as_ref().is_none_or(|t| {
                let texels = u64::from(t.size.x) * u64::from(t.size.y);
                texels > 0 && texels == t.texels.len() as u64 && !self.texcoords.is_empty()
            })
        };
        if !(none || each && self.materials.iter().all(whole)) {
            return Err(InvalidMesh::Materials);
        }
        let bad = |what, at: Option<usize>| {
            at.map_or(Ok(()), |vertex| Err(InvalidMesh::NotFinite { vertex, what }))
        };
        bad("position", self.positions.iter().position(|p| !p.is_finite()))?;
        bad("normal", self.normals.iter().position(|n| !n.is_finite()))?;
        bad(
            "texture coordinate",
            self.texcoords.iter().position(|t| !t.is_finite()),
        )
    }
}
