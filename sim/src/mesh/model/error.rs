//! What can be wrong with a model.

use super::{MAX_DEPTH, MAX_ELEMENTS};
use crate::scene::{Fault, ReadError, display_fault};
use std::path::{Path, PathBuf};

/// Why a model cannot be read.
#[derive(Debug)]
pub struct MeshError {
    /// The model's file.
    pub file: PathBuf,
    /// What is wrong with it.
    pub kind: MeshErrorKind,
}

/// What is wrong with a model.
#[derive(Debug)]
#[non_exhaustive]
pub enum MeshErrorKind {
    /// The file could not be read.
    Read(ReadError),
    /// It is not a valid glTF file.
    Invalid(String),
    /// It cannot be shown without an extension that is not known here.
    UnsupportedExtension(String),
    /// It uses something that is not known here.
    Unsupported(String),
    /// A buffer is not there.
    MissingBuffer {
        /// Number of the buffer.
        index: usize,
        /// Why.
        reason: String,
    },
    /// A texture is not there or no picture.
    Texture {
        /// Number of the image.
        index: usize,
        /// Why.
        reason: String,
    },
    /// Data reaches beyond its buffer.
    Truncated {
        /// Number of the accessor.
        accessor: usize,
        /// First byte after the data.
        needed: u64,
        /// Bytes of its view of the buffer.
        found: u64,
    },
    /// A triangle names a vertex that is not there.
    Index {
        /// The index.
        index: u32,
        /// Number of vertices.
        count: usize,
    },
    /// A coordinate is NaN or infinite, or beyond 10⁹ m after scaling.
    NotFinite {
        /// Name or number of the mesh.
        mesh: String,
        /// Number of the vertex.
        vertex: usize,
        /// Its position in the file.
        position: [f32; 3],
    },
    /// Nodes contain each other, or are nested too deeply.
    Hierarchy,
    /// Too many vertices or triangles.
    TooLarge,
    /// No triangle in the scene of the file.
    NoTriangles,
}

use MeshErrorKind as Kind;

impl Fault for MeshError {
    fn what(&self) -> String {
        match &self.kind {
            Kind::Read(e) => e.what(),
            Kind::Invalid(reason) => format!("this is not a valid glTF file: {reason}"),
            Kind::UnsupportedExtension(name) => format!("the model requires the extension `{name}`"),
            Kind::Unsupported(what) => format!("the model uses {what}"),
            Kind::MissingBuffer { index, reason } => format!("buffer {index} is missing: {reason}"),
            Kind::Texture { index, reason } => format!("texture image {index} is missing: {reason}"),
            Kind::Truncated {
                accessor,
                needed,
                found,
            } => {
                format!("accessor {accessor} needs {needed} bytes of its buffer view, which has {found}")
            }
            Kind::Index { index, count } => format!("a triangle names vertex {index} of {count}"),
            Kind::NotFinite {
                mesh,
                vertex,
                position,
            } => {
                format!("vertex {vertex} of mesh {mesh} is at {position:?}, which is no place within 1e9 m")
            }
            Kind::Hierarchy => format!("nodes contain each other or are nested more than {MAX_DEPTH} deep"),
            Kind::TooLarge => format!("the model has more than {MAX_ELEMENTS} vertices or triangles"),
            Kind::NoTriangles => "the model's scene has no triangle with an area".into(),
        }
    }

    fn remedy(&self) -> String {
        match &self.kind {
            Kind::Read(e) => e.remedy(),
            Kind::Invalid(_) | Kind::Truncated { .. } | Kind::Index { .. } => "export the model anew".into(),
            Kind::UnsupportedExtension(_) | Kind::Unsupported(_) => {
                "export it without, as plain triangles in full precision".into()
            }
            Kind::MissingBuffer { .. } => {
                "put the buffer beside the model, or save it as one .glb file".into()
            }
            Kind::Texture { .. } => {
                "put the picture (PNG or JPEG) beside the model, or save it all as one .glb file".into()
            }
            Kind::NotFinite { .. } => "repair the mesh, or check the model's scale".into(),
            Kind::Hierarchy | Kind::TooLarge => "simplify the model".into(),
            Kind::NoTriangles => "export at least one triangle mesh in the default scene".into(),
        }
    }

    fn file(&self) -> Option<&Path> {
        match self.kind {
            Kind::Read(_) => None,
            _ => Some(&self.file),
        }
    }

    fn read_error(&self) -> Option<&ReadError> {
        match &self.kind {
            Kind::Read(e) => Some(e),
            _ => None,
        }
    }
}

display_fault!(MeshError);
