//! The `meniscus` command as a library, so that tests can drive it.

#[cfg(feature = "view")]
pub mod app;
pub mod cli;
pub mod study;
