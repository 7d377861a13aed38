//! Where the light went.

use glam::DVec3;

/// Flux by colour, in watts where the scene's irradiance is in W/m².
///
/// What enters the water is what leaves it: `transmitted + sent_back = absorbed + floor + walls + objects + emerged +
/// lost`, to rounding.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Ledger {
    /// Sent out by sun and sky towards the rectangle that the maps can receive light from.
    pub emitted: DVec3,
    /// Passed from air into water, by the surface or a glass side.
    pub transmitted: DVec3,
    /// Sent back into the water by matt surfaces.
    pub sent_back: DVec3,
    /// Lost on the way through water: absorbed, or scattered by more than the similarity relation forgives.
    pub absorbed: DVec3,
    /// Fell on ground under water.
    pub floor: DVec3,
    /// Fell on walls of a basin under water.
    pub walls: DVec3,
    /// Fell on objects, and on foam from below, under water.
    pub objects: DVec3,
    /// Passed from water into air.
    pub emerged: DVec3,
    /// Left under water for where nothing is, or was given up after too many reflections.
    pub lost: DVec3,
}

impl Ledger {
    /// What entered and did not leave, as a share of what entered, worst colour: 0 but for rounding.
    pub fn imbalance(&self) -> f64 {
        let entered = self.transmitted + self.sent_back;
        let left = self.absorbed + self.floor + self.walls + self.objects + self.emerged + self.lost;
        let scale = entered.max_element();
        if scale > 0.0 {
            (entered - left).abs().max_element() / scale
        } else {
            left.abs().max_element()
        }
    }

    pub(super) fn add(&mut self, other: &Self) {
        let Self {
            emitted,
            transmitted,
            sent_back,
            absorbed,
            floor,
            walls,
            objects,
            emerged,
            lost,
        } = other;
        self.emitted += *emitted;
        self.transmitted += *transmitted;
        self.sent_back += *sent_back;
        self.absorbed += *absorbed;
        self.floor += *floor;
        self.walls += *walls;
        self.objects += *objects;
        self.emerged += *emerged;
        self.lost += *lost;
    }
}
