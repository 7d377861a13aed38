//! The ground-truth renderer of Meniscus.
//!
//! [`Whitted`] draws a [`Frame`](meniscus_sim::Frame) of a [`Scene`](meniscus_sim::Scene) by deterministic ray
//! tracing. Around it: [`camera`] makes views, [`sky`] is what the rays see when they leave, [`tonemap`] turns linear
//! radiance into display values, [`output`] writes pictures and animations, and [`renderers`] finds a renderer by name.

pub mod camera;
pub mod caster;
pub mod output;
pub mod renderers;
pub mod sky;
mod stage;
pub mod tonemap;
pub mod whitted;

pub use whitted::{Settings, Whitted};
