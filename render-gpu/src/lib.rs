//! The real-time renderer of Meniscus on wgpu.
//!
//! [`GpuRenderer`] draws a frame by one of the [`Technique`]s. A technique is a list of passes ([`graph`], [`work`],
//! [`techniques`]) chosen by what the scene and the frame have ([`facts`]): what nothing in the picture depends on gets no
//! pipeline and no memory. Shaders are put together from pieces ([`shader`]) behind constants that come from Rust, and
//! read one layout ([`layout`]).
//!
//! Without the `wgpu` feature the crate plans ([`graph`]) but draws nothing, so that a build that draws on the CPU alone
//! does not compile a graphics stack.

pub mod graph;
pub mod layout;

#[cfg(feature = "wgpu")]
pub mod adapters;
#[cfg(feature = "wgpu")]
mod buffers;
#[cfg(feature = "wgpu")]
mod continued;
#[cfg(feature = "wgpu")]
pub mod device;
#[cfg(feature = "wgpu")]
mod executor;
#[cfg(feature = "wgpu")]
pub mod facts;
#[cfg(feature = "wgpu")]
mod fixed;
#[cfg(feature = "wgpu")]
mod foreign;
#[cfg(feature = "wgpu")]
mod held;
#[cfg(feature = "wgpu")]
mod hierarchy;
#[cfg(feature = "wgpu")]
mod knobs;
#[cfg(feature = "wgpu")]
mod limits;
#[cfg(feature = "wgpu")]
mod looks;
#[cfg(feature = "wgpu")]
mod meshes;
#[cfg(all(test, feature = "wgpu"))]
mod parity;
#[cfg(feature = "wgpu")]
mod pipelines;
#[cfg(feature = "wgpu")]
mod planned;
#[cfg(feature = "wgpu")]
mod renderer;
#[cfg(feature = "wgpu")]
mod set;
#[cfg(feature = "wgpu")]
mod settings;
#[cfg(feature = "wgpu")]
pub mod shader;
#[cfg(feature = "wgpu")]
pub mod techniques;
#[cfg(feature = "wgpu")]
mod tessellate;
#[cfg(feature = "wgpu")]
mod uniform;
#[cfg(feature = "wgpu")]
mod upload;
#[cfg(feature = "wgpu")]
mod voxel_scene;
#[cfg(feature = "wgpu")]
mod voxels;
#[cfg(feature = "wgpu")]
pub mod work;

#[cfg(feature = "wgpu")]
pub use foreign::Foreign;
#[cfg(feature = "wgpu")]
pub use renderer::{GpuRenderer, MetPixel, pass_names};
#[cfg(feature = "wgpu")]
pub use settings::{Heights, PhotonMap, Settings, Technique, Walk};
#[cfg(feature = "wgpu")]
pub use shader::Switches;

/// What is known of a graphics adapter.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct AdapterDescription {
    /// Name as the driver reports it.
    pub name: String,
    /// Kind: `discrete GPU`, `integrated GPU`, `virtual GPU`, `software` or `other`.
    pub kind: &'static str,
    /// Graphics interface: `vulkan`, `metal`, `dx12`, …
    pub backend: String,
    /// Driver name and version.
    pub driver: String,
}
