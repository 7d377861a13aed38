//! The water that bodies push aside on a grid.
//!
//! A grid's columns reach through the bodies in them. What a hull displaces is therefore *added* to the columns that it
//! stands in as it enters and taken away as it leaves: the surface rises there by what the hull pushes aside, the
//! surplus flows off as waves, and the level of a pond rises by the submerged volume over its area, as Archimedes' bath
//! did. What was added is kept in a ledger in the whole quanta in which it was exchanged, so that the water itself,
//! the columns less the ledger, is the same to the last bit at any time.

use super::cut::submerged;
use super::hull::Hull;
use super::reference::Plane;
use super::state::State;
use super::water::Water;
use crate::grid::GridSpec;
use glam::{DMat3, DVec3};
use serde::{Deserialize, Serialize};

/// Water on a grid that bodies push and displace.
pub trait Columns: Water {
    /// Where the columns stand.
    fn spec(&self) -> GridSpec;

    /// Adds `height` metres of water to the column of cell `(i, j)`, or takes it away where negative; returns what was
    /// really exchanged, which may be less or rounded. The column keeps its momentum.
    fn add_depth(&mut self, i: usize, j: usize, height: f64) -> f64;

    /// Adds momentum per area and density, m²/s along X and Z, to the column of cell `(i, j)`.
    fn add_discharge(&mut self, i: usize, j: usize, discharge: [f64; 2]);
}

/// Heights of water on cells, sorted by cell number (row-major).
pub(super) type Heights = Vec<(usize, f64)>;

/// What stands in the columns in place of bodies.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Displaced {
    held: Heights,
}

impl Displaced {
    /// Takes the bodies as displacing `heights` already.
    pub(super) fn start(heights: Heights) -> Self {
        Self { held: heights }
    }

    /// Sum over the cells, m.
    pub(super) fn height(&self) -> f64 {
        self.held.iter().map(|(_, h)| h).sum()
    }

    /// Exchanges water until the columns hold `wanted`, as far as they can give and take it.
    pub(super) fn settle(&mut self, wanted: &[(usize, f64)], columns: &mut dyn Columns) {
        let width = columns.spec().width();
        let mut after = Heights::with_capacity(wanted.len());
        let (mut old, mut new) = (self.held.iter().peekable(), wanted.iter().peekable());
        loop {
            let cell = match (old.peek(), new.peek()) {
                (None, None) => break,
                (Some(a), None) => a.0,
                (None, Some(b)) => b.0,
                (Some(a), Some(b)) => a.0.min(b.0),
            };
            let held = old.next_if(|(c, _)| *c == cell).map_or(0.0, |(_, h)| *h);
            let goal = new.next_if(|(c, _)| *c == cell).map_or(0.0, |(_, h)| *h);
            let held = if goal == held {
                held
            } else {
                held + columns.add_depth(cell % width, cell / width, goal - held)
            };
            if held != 0.0 || goal != 0.0 {
                after.push((cell, held));
            }
        }
        self.held = after;
    }

    /// Bytes held.
    pub(super) fn bytes(&self) -> usize {
        self.held.capacity() * size_of::<(usize, f64)>()
    }
}

/// The volume of the hull below `plane` as heights of water on the cells around it, each part spread over 3 × 3 cells
/// by quadratic B-splines: a hull that moves less than a cell changes them smoothly. The sum is the volume below the
/// plane, exactly, as long as the columns are deep enough for it.
pub(super) fn heights(hull: &Hull, state: &State, plane: &Plane, columns: &dyn Columns) -> Heights {
    let spec = columns.spec();
    let (spacing, size) = (f64::from(spec.spacing), [spec.width(), spec.height()]);
    let origin = spec.origin.as_dvec2();
    let grid = |p: DVec3| [(p.x - origin.x) / spacing, (p.z - origin.y) / spacing];
    let reach = hull.reach / spacing + 2.0;
    let bounds = |middle: f64, count: usize| {
        let last = (count - 1) as f64;
        (
            (middle - reach).floor().clamp(0.0, last) as usize,
            (middle + reach).ceil().clamp(0.0, last) as usize,
        )
    };
    let [gx, gz] = grid(state.position);
    let ((i0, i1), (j0, j1)) = (bounds(gx, size[0]), bounds(gz, size[1]));
    let width = i1 - i0 + 1;
    let mut patch = vec![0.0; width * (j1 - j0 + 1)];
    let rotation = DMat3::from_quat(state.rotation);
    let points: Vec<(DVec3, f64)> = hull
        .vertices
        .iter()
        .map(|&p| {
            let p = state.position + rotation * p;
            (p, plane.at(p.x, p.z) - p.y)
        })
        .collect();
    for panel in &hull.panels {
        submerged(panel.map(|k| points[k as usize]), |part| {
            let [(a, da), (b, db), (c, dc)] = part;
            let down = -0.5 * (b - a).cross(c - a).y;
            // The prism between a panel and the plane; upper panels take away what is above them.
            let height = down * (da + db + dc) / (3.0 * spacing * spacing);
            let [gx, gz] = grid((a + b + c) / 3.0);
            for (j, v) in spread(gz, j0, j1) {
                for (i, u) in spread(gx, i0, i1) {
                    patch[(j - j0) * width + (i - i0)] += height * u * v;
                }
            }
        });
    }
    let mut out = Heights::new();
    for (k, &height) in patch.iter().enumerate() {
        if height == 0.0 {
            continue;
        }
        let (i, j) = (i0 + k % width, j0 + k / width);
        let (x, z) = (origin.x + spacing * i as f64, origin.y + spacing * j as f64);
        // No more than the whole column can be displaced. What counts is where the surface would be: what stands
        // there now has been changed by the body already.
        let depth = plane.at(x, z) - columns.column(x, z).bed;
        if depth > 0.0 {
            out.push((j * size[0] + i, height.min(depth)));
        }
    }
    out
}

/// Quadratic B-spline weights of the cells around a coordinate; what falls outside goes to the outermost cell.
pub(crate) fn spread(at: f64, first: usize, last: usize) -> [(usize, f64); 3] {
    let nearest = at.round();
    let f = at - nearest;
    let weights = [
        0.5 * (0.5 - f) * (0.5 - f),
        0.75 - f * f,
        0.5 * (0.5 + f) * (0.5 + f),
    ];
    let mut out = [(first, 0.0); 3];
    for (k, weight) in weights.into_iter().enumerate() {
        let cell = (nearest + k as f64 - 1.0).clamp(first as f64, last as f64);
        out[k] = (cell as usize, weight);
    }
    out
}

/// Adds up sorted lists.
pub(super) fn sum<'a>(lists: impl Iterator<Item = &'a Heights>) -> Heights {
    let mut all: Heights = lists.flatten().copied().collect();
    // Stable: heights of one cell add up in the order of the bodies.
    all.sort_by_key(|(cell, _)| *cell);
    all.dedup_by(|b, a| {
        let same = a.0 == b.0;
        if same {
            a.1 += b.1;
        }
        same
    });
    all
}

/// Gives the columns `impulse` (kg m/s along X and Z), shared by how much of the body stands in each. Returns whether
/// there was any to take it.
pub(super) fn push(columns: &mut dyn Columns, footprint: &Heights, impulse: [f64; 2], density: f64) -> bool {
    let total: f64 = footprint.iter().map(|(_, h)| h.max(0.0)).sum();
    if total <= 0.0 {
        return false;
    }
    let spec = columns.spec();
    let scale = 1.0 / (density * spec.cell_area() * total);
    for &(cell, height) in footprint {
        let share = height.max(0.0) * scale;
        if share > 0.0 {
            columns.add_discharge(
                cell % spec.width(),
                cell / spec.width(),
                [impulse[0] * share, impulse[1] * share],
            );
        }
    }
    true
}
