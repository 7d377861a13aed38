//! The water surface around a body, as it would pass through the body if that were not there.

use super::hull::Hull;
use super::mass::outer;
use super::state::State;
use super::water::Water;
use glam::{DMat3, DVec2, DVec3};

/// Places around the body at which the surface is looked at.
const PLACES: usize = 16;
/// Distance between hull and places, in cells: outside of what the hull's own cells hold.
const MARGIN: f64 = 2.0;
/// Weight of level water against what the places say, in places: keeps slopes sane where few of them are wet.
const LEVEL: f64 = 0.5;

/// A plane that stands for the surface near a body.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub(super) struct Plane {
    centre: DVec2,
    height: f64,
    slope: DVec2,
}

impl Plane {
    /// Fitted by least squares to the surface on an ellipse around the hull, deep places counting more than shallow
    /// ones; `None` if all is dry there.
    ///
    /// Volume that a hull displaces must not be counted below the very surface that it has just raised, or the two
    /// would lift each other without end.
    pub(super) fn around(hull: &Hull, state: &State, water: &dyn Water) -> Option<Self> {
        let rotation = DMat3::from_quat(state.rotation);
        let plan: Vec<DVec2> = hull
            .corners
            .iter()
            .map(|&p| {
                let p = rotation * p;
                DVec2::new(p.x, p.z)
            })
            .collect();
        let [mut xx, mut xz, mut zz] = [0.0; 3];
        for p in &plan {
            xx += p.x * p.x;
            xz += p.x * p.y;
            zz += p.y * p.y;
        }
        let along = DVec2::from_angle(0.5 * (2.0 * xz).atan2(xx - zz));
        let across = along.perp();
        // An ellipse through the corners of the rectangle that holds the hull.
        let half = |axis: DVec2| plan.iter().fold(0.0_f64, |r, p| r.max(p.dot(axis).abs()));
        let axes =
            [along, across].map(|axis| half(axis) * std::f64::consts::SQRT_2 + MARGIN * water.resolution());
        let centre = DVec2::new(state.position.x, state.position.z);

        let (mut normal, mut right) = (DMat3::ZERO, DVec3::ZERO);
        let mean = 0.5 * (axes[0] + axes[1]);
        for k in 0..PLACES {
            let turn = DVec2::from_angle(std::f64::consts::TAU * k as f64 / PLACES as f64);
            let offset = along * (axes[0] * turn.x) + across * (axes[1] * turn.y);
            let column = water.column(centre.x + offset.x, centre.y + offset.y);
            let depth = column.depth();
            if depth <= 0.0 {
                continue;
            }
            let weight = if depth.is_finite() {
                depth / (depth + 0.1 * mean)
            } else {
                1.0
            };
            let basis = DVec3::new(1.0, offset.x / mean, offset.y / mean);
            normal += outer(basis) * weight;
            right += basis * (weight * column.surface);
        }
        let total = normal.x_axis.x;
        if total <= 0.0 {
            return None;
        }
        // Taken out first, so that the slope's prior does not depend on the height above datum.
        let height = right.x / total;
        right -= normal.x_axis * height;
        normal.y_axis.y += LEVEL;
        normal.z_axis.z += LEVEL;
        let fit = normal.inverse() * right;
        let fit = if fit.is_finite() { fit } else { DVec3::ZERO };
        Some(Self {
            centre,
            height: height + fit.x,
            slope: DVec2::new(fit.y, fit.z) / mean,
        })
    }

    /// Height of the plane in metres.
    pub(super) fn at(&self, x: f64, z: f64) -> f64 {
        self.height + self.slope.dot(DVec2::new(x, z) - self.centre)
    }
}
