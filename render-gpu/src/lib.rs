//! The real-time renderer of Meniscus on wgpu.
