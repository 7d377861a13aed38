//! Water that pours in and is taken out.

use super::fluid::Fluid;
use crate::scene::description::{Drain, Emitter};
use glam::Vec3;

/// A round jet that lays down one layer of lattice after the other.
#[derive(Clone, Debug)]
pub(crate) struct Jet {
    emitter: Emitter,
    /// Places of a layer in the opening.
    places: Vec<Vec3>,
    /// Way since the last layer, m.
    way: f64,
}

impl Jet {
    pub(crate) fn new(emitter: Emitter, spacing: f32) -> Self {
        let axis = emitter.velocity.normalize_or(Vec3::NEG_Y);
        let (a, b) = axis.any_orthonormal_pair();
        let most = (emitter.radius / spacing).ceil() as i32;
        let places = (-most..=most)
            .flat_map(|i| (-most..=most).map(move |j| (i as f32 * spacing, j as f32 * spacing)))
            .filter(|(x, y)| x.hypot(*y) <= emitter.radius)
            .map(|(x, y)| emitter.position + x * a + y * b)
            .collect();
        Self {
            emitter,
            places,
            way: f64::from(spacing),
        }
    }

    /// Speed of the jet while it runs within `time` and `time + dt`, m/s.
    pub(crate) fn speed(&self, time: f64) -> f32 {
        if self.runs(time) {
            self.emitter.velocity.length()
        } else {
            0.0
        }
    }

    fn runs(&self, time: f64) -> bool {
        time >= self.emitter.start && self.emitter.end.is_none_or(|end| time < end)
    }

    /// Lays down what leaves the opening in the `dt` seconds before `time + dt`. Returns the particles made.
    pub(crate) fn pour(&mut self, fluid: &mut Fluid, time: f64, dt: f64) -> usize {
        if !self.runs(time) {
            return 0;
        }
        let spacing = f64::from(fluid.settings().spacing);
        let velocity = self.emitter.velocity;
        let speed = f64::from(velocity.length());
        self.way += speed * dt;
        let mut made = 0;
        while self.way >= spacing && speed > 0.0 {
            self.way -= spacing;
            // The layer left the opening a moment ago.
            let ahead = velocity * (self.way / speed) as f32;
            for &place in &self.places {
                let (mut x, mut v) = (place + ahead, velocity);
                fluid.boundary().confine(fluid.settings().spacing, &mut x, &mut v);
                fluid.add(x, v);
                made += 1;
            }
        }
        made
    }
}

/// Takes out what is in one of the `drains`. Returns the particles taken.
pub(crate) fn drain(fluid: &mut Fluid, drains: &[Drain]) -> usize {
    if drains.is_empty() {
        return 0;
    }
    let inside = |d: &Drain, p: Vec3| p.cmpge(d.min).all() && p.cmple(d.max).all();
    fluid.remove(|p| drains.iter().any(|d| inside(d, p)))
}
