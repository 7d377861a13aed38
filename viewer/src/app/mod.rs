//! The window of `meniscus view`.
//!
//! [`model`] plays, runs, draws and compares without knowing what a window is; [`viewer`] and [`panels`] show it with egui
//! and hand over what hands do; [`window`] is the frame around them. The thread of the window never decodes, solves or
//! draws water: it shows what the threads of the model made last.

pub mod model;
mod panels;
mod style;
mod timing;
pub mod viewer;
pub mod window;
