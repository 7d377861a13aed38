//! wave_equation
