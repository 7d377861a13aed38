//! The ground-truth renderer of Meniscus.
//!
//! [`Whitted`] draws a [`Frame`](meniscus_sim::Frame) of a [`Scene`](meniscus_sim::Scene) by deterministic ray
//! tracing, [`PathTracer`] by random paths without bias, [`PhotonMapper`] from maps of light that was followed through
//! the water; [`HorizonRenderer`] shows the water in a room of pictures. Around them: [`camera`] makes views, [`sky`] is what the rays see when they leave, [`tonemap`] turns linear
//! radiance into display values, [`output`] writes pictures and animations, and [`renderers`] finds a renderer by name.

pub mod camera;
pub mod caster;
pub mod horizon;
pub mod metrics;
pub mod output;
pub mod path;
pub mod photon;
pub mod renderers;
mod stage;
pub mod tonemap;
pub mod whitted;

pub use horizon::HorizonRenderer;
pub use meniscus_sim::stage::sky;
pub use path::PathTracer;
pub use photon::PhotonMapper;
pub use whitted::{Settings, Whitted};
