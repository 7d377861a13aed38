//! An ocean as the sum of many linear waves with random phases (Tessendorf 2001; Horvath 2015), in SI units.
//!
//! These are the parts from dispersion to fields; no scene can ask for an ocean yet.

pub mod dispersion;
pub mod lattice;
pub mod patch;
pub mod sea;
pub mod spectrum;
pub mod spreading;
pub mod transform;
