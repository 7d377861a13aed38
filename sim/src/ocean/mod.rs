//! An ocean as the sum of many linear waves with random phases (Tessendorf 2001; Horvath 2015), in SI units.

pub mod dispersion;
pub mod lattice;
pub mod patch;
pub mod sea;
pub mod spectrum;
pub mod spreading;
pub mod transform;
