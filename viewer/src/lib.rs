//! The `meniscus` command as a library, so that tests can drive it.

pub mod cli;
pub mod study;
