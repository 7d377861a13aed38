//! Triangle meshes from glTF 2.0 files (`.gltf` and `.glb`).

mod accessors;
mod buffers;
mod error;
mod reader;
#[cfg(test)]
mod tests;
mod textures;

pub use error::{MeshError, MeshErrorKind};

use super::TriangleMesh;
use crate::scene::read_file;
use accessors::Accessors;
use error::MeshErrorKind as Kind;
use glam::{Mat4, Vec3};
use reader::Reader;
use std::path::Path;

/// Largest file in bytes.
const MAX_BYTES: u64 = 1 << 30;
/// Most vertices and most triangles of a model; nodes that share a mesh count each time.
const MAX_ELEMENTS: usize = 1 << 26;
/// Deepest hierarchy of nodes.
const MAX_DEPTH: u32 = 64;

/// Reads every triangle of the model's default scene (its first scene if it names none, all root nodes if it has no
/// scene) into one mesh. `scale` is the length of a model unit in metres.
///
/// Vertices of primitives without normals are doubled so that their faces are flat, as glTF prescribes. The base
/// colour is that of the primitive with the most triangles, of a texture its mean. Skins, morph targets and all of materials
/// but base colours, their textures and a gloss (roughness below 1) are left out.
///
/// # Errors
/// [`MeshError`]
pub fn load_gltf(path: &Path, scale: f32) -> Result<TriangleMesh, MeshError> {
    let fail = |kind| MeshError {
        file: path.to_path_buf(),
        kind,
    };
    let bytes = read_file(path, MAX_BYTES).map_err(|e| fail(Kind::Read(e)))?;
    parse(&bytes, path.parent(), scale).map_err(fail)
}

/// As [`load_gltf`], from the bytes of a file; other files that it names are sought in `base`.
pub(crate) fn parse(bytes: &[u8], base: Option<&Path>, scale: f32) -> Result<TriangleMesh, Kind> {
    let invalid = |e: &dyn std::fmt::Display| {
        let text = e.to_string();
        Kind::Invalid(text.chars().take(200).collect())
    };
    // The reader of binary files subtracts the length of its header from the length in it unchecked.
    if bytes.starts_with(b"glTF") {
        let length = bytes
            .get(8..12)
            .map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]));
        if length.is_none_or(|l| l < 12) {
            return Err(Kind::Invalid("the binary header is cut off".into()));
        }
    }
    let gltf = gltf::Gltf::from_slice_without_validation(bytes).map_err(|e| invalid(&e))?;
    if let Some(name) = gltf.document.as_json().extensions_required.first() {
        return Err(Kind::UnsupportedExtension(name.chars().take(80).collect()));
    }
    if names_stray_accessor(gltf.document.as_json()) {
        return Err(Kind::Invalid(
            "a primitive names an accessor that is not there".into(),
        ));
    }
    let blob = gltf.blob;
    let document = gltf::Document::from_json(gltf.document.into_json()).map_err(|e| invalid(&e))?;
    let data = Accessors(buffers::read(&document, base, blob)?);
    let mut reader = Reader::new(data, document.nodes().len(), base);
    let scene = document.default_scene().or_else(|| document.scenes().next());
    let roots: Vec<_> = match scene {
        Some(scene) => scene.nodes().collect(),
        None => root_nodes(&document),
    };
    for node in roots {
        reader.node(&node, Mat4::from_scale(Vec3::splat(scale)), 0)?;
    }
    if reader.mesh.triangles.is_empty() {
        return Err(Kind::NoTriangles);
    }
    Ok(reader.finish())
}

/// Whether a primitive takes a vertex attribute from an accessor beyond the last. The crate's own validation looks into
/// it before it has checked that it is there.
fn names_stray_accessor(json: &gltf::json::Root) -> bool {
    let primitives = json.meshes.iter().flat_map(|mesh| &mesh.primitives);
    let mut accessors = primitives.flat_map(|primitive| primitive.attributes.values());
    accessors.any(|accessor| accessor.value() >= json.accessors.len())
}

/// Nodes that are nobody's children.
fn root_nodes(document: &gltf::Document) -> Vec<gltf::Node<'_>> {
    let mut is_child = vec![false; document.nodes().len()];
    for child in document.nodes().flat_map(|n| n.children()) {
        is_child[child.index()] = true;
    }
    document.nodes().filter(|n| !is_child[n.index()]).collect()
}
