//! The window of `meniscus view`: its model without a window, and pictures of its panels. Any Vulkan driver serves;
//! `tests/run` installs one where there is none.
#![allow(clippy::unwrap_used)] // a test may panic

mod canvas;
mod clips;
mod device;
mod live;
mod pictures;
mod player;
mod support;
mod touch;
mod waiting;
