//! The ground-truth renderer of Meniscus.

pub mod caster;
