//! Exact solutions that studies compare with, in `f64` and independent of the methods under test.

mod linear;

pub(crate) use linear::{RidgePulse, radial_pulse, standing_wave};
