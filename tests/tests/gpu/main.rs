//! The renderer on wgpu against the ground truth, and what it must survive. Any Vulkan driver serves; `tests/run` installs
//! one where there is none.
#![allow(clippy::unwrap_used)] // a test may panic

mod caustics;
mod foreign;
mod frames;
mod looks;
mod pruning;
mod support;
mod truth;
