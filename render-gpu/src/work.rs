//! What the passes of this crate do, as data.

use crate::graph::ResourceId;
use crate::shader::Piece;

/// When a pass runs again.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cadence {
    /// When the scene changes.
    Scene,
    /// Once a frame.
    Frame,
    /// For every sample of a pixel.
    Sample,
}

/// Groups of a compute shader, and the numbers that it reads as `which`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Dispatch {
    /// Workgroups.
    pub groups: [u32; 3],
    /// What `which` holds.
    pub which: [u32; 4],
}

/// Vertices to draw, and the numbers that the shader reads as `which`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DrawCall {
    /// Vertices.
    pub vertices: u32,
    /// Instances.
    pub instances: u32,
    /// What `which` holds.
    pub which: [u32; 4],
}

/// A texture that is drawn into.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Attachment {
    /// The texture.
    pub id: ResourceId,
    /// Whether it starts at zero.
    pub clear: bool,
    /// Where the mean of its samples goes after the pass.
    pub resolve: Option<ResourceId>,
}

impl Attachment {
    /// A texture that starts at zero.
    pub const fn fresh(id: ResourceId) -> Self {
        Self {
            id,
            clear: true,
            resolve: None,
        }
    }

    /// A texture that keeps what it has.
    pub const fn onto(id: ResourceId) -> Self {
        Self {
            id,
            clear: false,
            resolve: None,
        }
    }
}

/// What a pass does.
#[derive(Clone, Debug)]
pub enum Action {
    /// Runs a compute shader.
    Compute {
        /// Entry point.
        entry: &'static str,
        /// One after the other.
        dispatches: Vec<Dispatch>,
    },
    /// Draws triangles.
    Draw {
        /// Entry point of the vertex stage.
        vertex: &'static str,
        /// Entry point of the fragment stage.
        fragment: &'static str,
        /// Textures drawn into.
        colors: Vec<Attachment>,
        /// Depth, of which the nearer (larger) wins.
        depth: Option<Attachment>,
        /// One after the other.
        draws: Vec<DrawCall>,
    },
}

/// A pass's work.
#[derive(Clone, Debug)]
pub struct Work {
    /// Its shader.
    pub pieces: Vec<Piece>,
    /// What it does.
    pub action: Action,
    /// Resources of the graph by the name of the shader's variable.
    pub bind: Vec<(&'static str, ResourceId)>,
    /// Buffers that start at zero.
    pub zero: Vec<ResourceId>,
    /// When it runs.
    pub cadence: Cadence,
}
