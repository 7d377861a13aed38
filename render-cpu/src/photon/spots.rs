//! Light on everything that is not the ground: where single photons fell, and how dense they are about a point.
//!
//! Photons are sorted into cubes of the search radius; a point asks the 27 about it (Jensen 1996, with a fixed radius
//! that shrinks as photons are added while the number within it grows).

use glam::{DVec3, IVec3, Vec3};

/// A photon where it fell.
#[derive(Clone, Copy, Debug)]
pub(super) struct Spot {
    pub(super) position: DVec3,
    /// Unit normal of the surface there, towards the side that was lit.
    pub(super) normal: Vec3,
    pub(super) flux: Vec3,
}

/// Photons, sorted by place.
#[derive(Clone, Debug, Default)]
pub(super) struct Spots {
    radius: f64,
    /// Sorted.
    keys: Vec<[i32; 3]>,
    spots: Vec<Spot>,
}

impl Spots {
    /// Photons that are looked for within `radius` metres of a point.
    pub(super) fn new(spots: Vec<Spot>, radius: f64) -> Self {
        let mut keyed: Vec<([i32; 3], Spot)> = spots
            .into_iter()
            .map(|spot| (key(spot.position, radius).to_array(), spot))
            .collect();
        // Stable: photons of one cube stay in the order in which they were sent out.
        keyed.sort_by_key(|(key, _)| *key);
        let (keys, spots) = keyed.into_iter().unzip();
        Self { radius, keys, spots }
    }

    /// Irradiance at a point of a surface that faces `normal`, W/m².
    pub(super) fn irradiance(&self, p: DVec3, normal: Vec3) -> Vec3 {
        if self.spots.is_empty() {
            return Vec3::ZERO;
        }
        let middle = key(p, self.radius);
        let mut sum = Vec3::ZERO;
        for x in middle.x - 1..=middle.x + 1 {
            for y in middle.y - 1..=middle.y + 1 {
                // Cubes along Z follow one another in the sorted list.
                let first = [x, y, middle.z - 1];
                let last = [x, y, middle.z + 1];
                let from = self.keys.partition_point(|k| *k < first);
                for (key, spot) in self.keys[from..].iter().zip(&self.spots[from..]) {
                    if *key > last {
                        break;
                    }
                    let near = (spot.position - p).length_squared() <= self.radius * self.radius;
                    if near && spot.normal.dot(normal) > 0.7 {
                        sum += spot.flux;
                    }
                }
            }
        }
        sum / (std::f64::consts::PI * self.radius * self.radius) as f32
    }
}

fn key(p: DVec3, radius: f64) -> IVec3 {
    (p / radius).floor().as_ivec3()
}
