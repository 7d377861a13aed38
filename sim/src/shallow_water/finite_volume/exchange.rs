//! Giving to and taking from single cells.

use super::tile::HALO;
use super::{BAND, FiniteVolume, part};
use crate::shallow_water::exchange::Exchange;
use crate::shallow_water::real::Real;
use crate::shallow_water::storage::Quantum;

impl<T: Real> Exchange for FiniteVolume<T> {
    fn quantum(&self) -> Quantum {
        self.quantum
    }

    fn dry(&self) -> f64 {
        Self::dry(self)
    }

    fn depth(&self, i: usize, j: usize) -> f64 {
        self.now.h[self.layout.at(i, j)].to_f64()
    }

    fn bed(&self, i: usize, j: usize) -> f64 {
        self.base + self.bed[self.layout.at(i, j)].to_f64()
    }

    fn discharge(&self, i: usize, j: usize) -> [f64; 2] {
        let at = self.layout.at(i, j);
        [self.now.qx[at].to_f64(), self.now.qz[at].to_f64()]
    }

    fn make_room(&mut self, depth: f64) {
        if depth >= self.quantum.depth_limit::<T>() {
            self.coarsen(depth);
        }
    }

    fn add_depth(&mut self, i: usize, j: usize, dh: f64) -> f64 {
        if !dh.is_finite() {
            return 0.0;
        }
        let at = self.layout.at(i, j);
        self.make_room(self.now.h[at].to_f64() + dh);
        let h = self.now.h[at].to_f64();
        // Both are whole quanta, and few enough of them for every sum to be exact.
        let added = self.quantum.round(dh).max(-h);
        if added != 0.0 {
            self.now.h[at] = T::from_f64(h + added);
            self.touch(i, j);
        }
        added
    }

    fn add_discharge(&mut self, i: usize, j: usize, dq: [f64; 2]) -> [f64; 2] {
        let at = self.layout.at(i, j);
        let add = |q: &mut T, dq: f64| {
            let before = q.to_f64();
            if dq.is_finite() {
                *q = T::from_f64(before + dq);
            }
            q.to_f64() - before
        };
        let added = [add(&mut self.now.qx[at], dq[0]), add(&mut self.now.qz[at], dq[1])];
        if added != [0.0; 2] {
            self.touch(i, j);
        }
        added
    }
}

impl<T: Real> FiniteVolume<T> {
    /// Wakes the tiles that see cell `(i, j)`: its own, and those to whose halo it belongs, without which a face would
    /// be crossed on one side only.
    pub(super) fn touch(&mut self, i: usize, j: usize) {
        self.touched = true;
        let wraps = self.boundary.wraps();
        let bands = self.tiles.len() / self.tiles_x;
        let columns = seen_by(i, self.layout.nx, self.tiles_x, wraps[0]);
        let rows = seen_by(j, self.layout.nz, bands, wraps[1]);
        for row in rows {
            for column in columns {
                self.tiles[row * self.tiles_x + column].awake = true;
            }
        }
    }
}

/// The parts of a length that hold cell `k`, the cell a halo before it and the cell a halo behind it.
fn seen_by(k: usize, length: usize, parts: usize, wraps: bool) -> [usize; 3] {
    let reach = |offset: isize| {
        let cell = k as isize + offset;
        let cell = if wraps {
            cell.rem_euclid(length as isize)
        } else {
            cell.clamp(0, length as isize - 1)
        };
        part_of(cell as usize, length, parts)
    };
    // No part is thinner than a halo unless it is the only one or the grid is tiny, where all parts touch each other.
    [
        reach(-(HALO as isize)),
        part_of(k, length, parts),
        reach(HALO as isize),
    ]
}

/// The part that holds cell `k`.
fn part_of(k: usize, length: usize, parts: usize) -> usize {
    let guess = k * parts / length;
    guess + usize::from(part(length, parts, guess + 1) <= k)
}

const _: () = assert!(BAND / 2 >= HALO, "a band must be wider than the halo");

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::GridSpec;
    use crate::shallow_water::edges::{Condition, Edges};
    use crate::shallow_water::settings::Initial;
    use crate::shallow_water::storage::{self, Layout};
    use glam::{UVec2, Vec2};

    #[test]
    fn every_cell_belongs_to_the_part_that_holds_it() {
        for (length, parts) in [(3, 1), (33, 2), (97, 4), (123, 2), (245, 8), (1000, 32)] {
            for p in 0..parts {
                for k in part(length, parts, p)..part(length, parts, p + 1) {
                    assert_eq!(part_of(k, length, parts), p, "{k} of {length} in {parts}");
                }
            }
        }
    }

    /// A lake of 600 x 100 cells over a rough bed, stepped until it sleeps.
    fn lake(edge: &Condition) -> FiniteVolume<f32> {
        let spec = GridSpec {
            origin: Vec2::ZERO,
            spacing: 1.0,
            size: UVec2::new(600, 100),
        };
        let initial = Initial::still(&spec, |x, z| (0.3 * (x + 1.7 * z).sin(), 1.0));
        let layout = Layout::new(600, 100);
        let start = storage::quantise::<f32>(layout, &initial, 1.0);
        let mut core = FiniteVolume::new(layout, 1.0, Edges::all(edge), start, 1e-5, 0.0);
        for _ in 0..2 {
            core.try_step(0.0, 0.05, 1.0).unwrap();
        }
        assert!(core.tiles.iter().all(|t| !t.awake));
        core
    }

    #[test]
    fn a_touched_cell_wakes_its_neighbourhood_and_the_run_is_that_of_a_grid_all_awake() {
        for (edge, [i, j]) in [
            (Condition::Wall, [199, 24]),
            (Condition::Wall, [200, 50]),
            (Condition::Periodic, [1, 98]),
        ] {
            let mut some = lake(&edge);
            let mut all = lake(&edge);
            for core in [&mut some, &mut all] {
                assert_eq!(core.add_depth(i, j, 0.1), core.quantum().round(0.1));
                core.add_discharge(i, j, [0.2, -0.1]);
            }
            assert!(some.tiles.iter().any(|t| !t.awake));
            all.fields_mut();
            for step in 0..40 {
                some.try_step(0.0, 0.05, 1.0).unwrap();
                all.try_step(0.0, 0.05, 1.0).unwrap();
                for j in 0..100 {
                    let row = some.layout.row(j);
                    assert_eq!(some.now.h[row.clone()], all.now.h[row.clone()], "step {step}");
                    assert_eq!(some.now.qx[row.clone()], all.now.qx[row], "step {step}");
                }
            }
        }
    }

    #[test]
    fn exchanges_are_whole_quanta_and_never_more_than_there_is() {
        let mut core = lake(&Condition::Wall);
        let (quantum, before) = (core.quantum().length(), core.depth(7, 7));
        assert_eq!(core.add_depth(7, 7, 0.4 * quantum), 0.0);
        assert_eq!(core.add_depth(7, 7, 2.6 * quantum), 3.0 * quantum);
        assert_eq!(core.add_depth(7, 7, f64::NAN), 0.0);
        let added = core.add_discharge(7, 7, [0.3, f64::INFINITY]);
        assert_eq!(added, core.discharge(7, 7));
        assert_eq!(added[1], 0.0);
        // Half the water takes half the momentum, all of it takes all.
        let h = core.depth(7, 7);
        let (momentum, taken) = core.take(7, 7, 0.5 * h);
        assert!((momentum[0] / added[0] - taken / h).abs() < 1e-6);
        let (_, rest) = core.take(7, 7, 1e9);
        assert_eq!(rest + taken, before + 3.0 * quantum);
        assert_eq!((core.depth(7, 7), core.discharge(7, 7)), (0.0, [0.0; 2]));
        assert_eq!(core.take(7, 7, 1.0), ([0.0; 2], 0.0));
        // A depth that outgrows the quantum coarsens it; what was added is still exact.
        let before = core.depth(8, 8);
        let added = core.add_depth(8, 8, 100.0);
        assert!(core.quantum().length() > quantum);
        assert!((core.depth(8, 8) - before - added).abs() <= core.quantum().length());
    }
}
