//! The seam by which everything outside a scheme acts on its water, cell by cell: actions, droplets, bodies.

use super::storage::Quantum;

/// A grid of water that others give to and take from.
///
/// Depths change by whole quanta and momentum by what the number type holds, and every call says what was really
/// exchanged, so that a giver's and a taker's books agree to the last bit. Cells are `(i, j)`, X first, without
/// ghosts. A call wakes the tiles around its cell and no others.
pub(crate) trait Exchange {
    /// The unit in which depths are exchanged.
    fn quantum(&self) -> Quantum;

    /// Depth up to which a cell counts as dry and holds no momentum for longer than a step, m.
    fn dry(&self) -> f64;

    /// Depth, m.
    fn depth(&self, i: usize, j: usize) -> f64;

    /// Height of the bed above datum, m.
    fn bed(&self, i: usize, j: usize) -> f64;

    /// Depth times velocity along X and Z, m²/s.
    fn discharge(&self, i: usize, j: usize) -> [f64; 2];

    /// Makes the quantum as coarse as water of `depth` m needs, so that it does not change while quanta are counted.
    fn make_room(&mut self, depth: f64);

    /// Adds `dh` m of depth (takes it, where negative): the nearest whole number of quanta, and never more than there
    /// is. Momentum stays as it is. Returns what was added, m.
    fn add_depth(&mut self, i: usize, j: usize, dh: f64) -> f64;

    /// Adds depth times velocity, m²/s. Returns what was added after rounding to the number type, m²/s.
    fn add_discharge(&mut self, i: usize, j: usize, dq: [f64; 2]) -> [f64; 2];

    /// Takes `dh` m of water with its share of the momentum, as much as there is. Returns both, as taken.
    fn take(&mut self, i: usize, j: usize, dh: f64) -> ([f64; 2], f64) {
        let h = self.depth(i, j);
        let taken = -self.add_depth(i, j, -dh.max(0.0));
        if taken <= 0.0 {
            return ([0.0; 2], 0.0);
        }
        let share = self.discharge(i, j).map(|q| -q * (taken / h));
        (self.add_discharge(i, j, share).map(|q| -q), taken)
    }
}
