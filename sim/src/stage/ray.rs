//! A half-line.

use glam::DVec3;

/// A half-line in world coordinates, metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Where it starts.
    pub origin: DVec3,
    /// Where it goes. Need not be of unit length; distances `t` along the ray are in multiples of it.
    pub direction: DVec3,
}

impl Ray {
    /// The point at `t` along the ray.
    pub fn at(&self, t: f64) -> DVec3 {
        self.origin + self.direction * t
    }
}
