//! The ground-truth renderer of Meniscus.
