//! Simulate, record, render, export and compare water surfaces.
fn main() {}
