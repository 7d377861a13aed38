//! The real-time renderer of Meniscus on wgpu.
//!
//! At this stage the crate finds and describes the adapters of the machine; it draws nothing yet. Without the
//! `wgpu` feature it is empty but for [`AdapterDescription`], so that a build that draws on the CPU alone does not
//! compile a graphics stack.

#[cfg(feature = "wgpu")]
pub mod adapters;

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
