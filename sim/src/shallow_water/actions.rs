//! Drops, presses and pushes: whole quanta of water moved between cells, so that every volume is accounted for.

use super::exchange::Exchange;
use super::settings::position;
use crate::events::{Action, EventError};
use crate::grid::GridSpec;
use glam::Vec2;

/// Narrowest bump that a grid can carry, in spacings; narrower ones are widened to it.
const NARROWEST: f64 = 2.0;
/// Largest depth or change of depth that an action may make, m.
const LARGEST_DEPTH: f64 = 1e5;
/// Largest change of velocity, m/s.
const LARGEST_SPEED: f32 = 1e3;

/// A cell within reach of an action.
struct Reached {
    /// Sample along X and along Z.
    at: [usize; 2],
    /// (distance / radius)², below 1.
    square: f64,
}

fn impossible(action: &'static str, quantity: &'static str, value: f32, remedy: &'static str) -> EventError {
    EventError::Impossible {
        action,
        quantity,
        value,
        remedy,
    }
}

/// The cells nearer to `position` than `radius`.
fn reach(
    spec: &GridSpec,
    action: &'static str,
    centre: Vec2,
    radius: f32,
) -> Result<Vec<Reached>, EventError> {
    if !(radius.is_finite() && radius > 0.0) {
        return Err(impossible(
            action,
            "radius",
            radius,
            "give a positive length in metres",
        ));
    }
    for value in centre.to_array() {
        if !value.is_finite() {
            return Err(impossible(action, "position", value, "give finite metres"));
        }
    }
    let spacing = f64::from(spec.spacing);
    let radius = f64::from(radius).max(NARROWEST * spacing);
    let range = |centre: f32, origin: f32, count: usize| {
        let middle = (f64::from(centre) - f64::from(origin)) / spacing;
        let reach = radius / spacing;
        let first = (middle - reach).ceil().clamp(0.0, count as f64) as usize;
        let last = ((middle + reach).floor() + 1.0).clamp(0.0, count as f64) as usize;
        first..last.max(first)
    };
    let columns = range(centre.x, spec.origin.x, spec.width());
    let mut cells = Vec::new();
    for j in range(centre.y, spec.origin.y, spec.height()) {
        for i in columns.clone() {
            let [x, z] = position(spec, i, j);
            let (dx, dz) = (x - f64::from(centre.x), z - f64::from(centre.y));
            let square = (dx * dx + dz * dz) / (radius * radius);
            if square < 1.0 {
                cells.push(Reached { at: [i, j], square });
            }
        }
    }
    Ok(cells)
}

/// (1 − r²)², the bump of all actions: smooth at its edge.
fn bump(square: f64) -> f64 {
    (1.0 - square) * (1.0 - square)
}

/// Shares `total` quanta over cells in proportion to `weights`, none of them getting more than `room`; returns the
/// whole quanta given to each, whose sum is `total` unless the room is too small for it.
fn share(total: f64, weights: &[f64], room: &[f64]) -> Vec<f64> {
    let mut given = vec![0.0; weights.len()];
    let mut left = total;
    // Every pass either places all that is left or fills at least one cell.
    while left >= 1.0 {
        let open: f64 = (0..weights.len())
            .filter(|&c| given[c] < room[c])
            .map(|c| weights[c])
            .sum();
        if open <= 0.0 {
            break;
        }
        let (pass, mut wanted, mut placed) = (left, 0.0_f64, 0.0_f64);
        for c in 0..weights.len() {
            if given[c] >= room[c] || weights[c] <= 0.0 {
                continue;
            }
            // The running sum is rounded, not each share, so that the shares add up.
            wanted += pass * (weights[c] / open);
            let amount = (wanted.round() - placed).clamp(0.0, room[c] - given[c]).min(left);
            placed += (wanted.round() - placed).max(0.0);
            given[c] += amount;
            left -= amount;
        }
        if left == pass {
            break;
        }
    }
    given
}

/// Applies an action to the state.
///
/// # Errors
/// [`EventError::Impossible`] if a value is not finite or asks for water that is not there.
pub(crate) fn apply<E: Exchange + ?Sized>(
    water: &mut E,
    spec: &GridSpec,
    action: &Action,
) -> Result<(), EventError> {
    match *action {
        Action::Drop {
            position,
            radius,
            volume,
        } => drop_water(water, spec, position, radius, volume),
        Action::Press {
            position,
            radius,
            depth,
        } => press(water, spec, position, radius, depth),
        Action::Push {
            position,
            radius,
            velocity,
        } => push(water, spec, position, radius, velocity),
        // Bodies take these, see `floats`.
        Action::Drag { .. } | Action::Release { .. } | Action::Shove { .. } => Ok(()),
        Action::Tilt { .. } => Err(EventError::upright("shallow-water")),
    }
}

fn drop_water<E: Exchange + ?Sized>(
    water: &mut E,
    spec: &GridSpec,
    centre: Vec2,
    radius: f32,
    volume: f32,
) -> Result<(), EventError> {
    let cells = reach(spec, "drop", centre, radius)?;
    if !volume.is_finite() || f64::from(volume.abs()) > LARGEST_DEPTH * spec.cell_area() {
        return Err(impossible(
            "drop",
            "volume",
            volume,
            "give finite cubic metres, at most 1e5 m of depth a cell",
        ));
    }
    if cells.is_empty() {
        return Err(impossible(
            "drop",
            "position",
            centre.x,
            "let the drop fall onto the grid",
        ));
    }
    let weights: Vec<f64> = cells.iter().map(|c| bump(c.square)).collect();
    let height = f64::from(volume) / spec.cell_area();
    // A drop deeper than the quantum was made for coarsens it first.
    let rise = height.max(0.0) / weights.iter().sum::<f64>();
    water.make_room(deepest(water, &cells) + rise);
    let quantum = water.quantum();
    let total = quantum.count(height.abs());
    if volume >= 0.0 {
        // Water that falls brings no momentum; water that is taken away takes its own with it.
        let given = share(total, &weights, &vec![f64::INFINITY; cells.len()]);
        for (cell, count) in cells.iter().zip(given) {
            let [i, j] = cell.at;
            water.add_depth(i, j, count * quantum.length());
        }
        return Ok(());
    }
    let room: Vec<f64> = cells
        .iter()
        .map(|c| quantum.count(water.depth(c.at[0], c.at[1])))
        .collect();
    if room.iter().sum::<f64>() < total {
        return Err(impossible(
            "drop",
            "volume",
            volume,
            "take no more water than stands within the radius",
        ));
    }
    for (cell, count) in cells.iter().zip(share(total, &weights, &room)) {
        water.take(cell.at[0], cell.at[1], count * quantum.length());
    }
    Ok(())
}

/// Depth of the deepest of some cells, m.
fn deepest<E: Exchange + ?Sized>(water: &E, cells: &[Reached]) -> f64 {
    cells
        .iter()
        .fold(0.0, |d, c| d.max(water.depth(c.at[0], c.at[1])))
}

fn press<E: Exchange + ?Sized>(
    water: &mut E,
    spec: &GridSpec,
    centre: Vec2,
    radius: f32,
    depth: f32,
) -> Result<(), EventError> {
    let cells = reach(spec, "press", centre, radius)?;
    if !depth.is_finite() || f64::from(depth.abs()) > LARGEST_DEPTH {
        return Err(impossible(
            "press",
            "depth",
            depth,
            "give finite metres, at most 1e5",
        ));
    }
    water.make_room(deepest(water, &cells) + f64::from(depth.abs()));
    let quantum = water.quantum();
    let (mut weights, mut room) = (Vec::new(), Vec::new());
    for cell in &cells {
        // (1 − r²)² (1 − 4r²) has no volume over the disc: a depression with its rim.
        let height = -f64::from(depth) * bump(cell.square) * (1.0 - 4.0 * cell.square);
        weights.push(height);
        room.push(quantum.count(water.depth(cell.at[0], cell.at[1])));
    }
    // Water is taken where the surface sinks, as far as there is any, and given to wet cells where it rises.
    let taken: Vec<f64> = weights
        .iter()
        .zip(&room)
        .map(|(&w, &r)| quantum.count((-w).max(0.0)).min(r))
        .collect();
    let rising: Vec<f64> = weights
        .iter()
        .zip(&room)
        .map(|(&w, &r)| if r > 0.0 { w.max(0.0) } else { 0.0 })
        .collect();
    let total: f64 = taken.iter().sum();
    let given = share(total, &rising, &vec![f64::INFINITY; cells.len()]);
    if total == 0.0 || given.iter().sum::<f64>() != total {
        // No water to take, or nothing in reach to take it: it stays where it is.
        return Ok(());
    }
    // The water takes its momentum along.
    let mut moved = [0.0; 2];
    for (cell, take) in cells.iter().zip(&taken) {
        let (momentum, _) = water.take(cell.at[0], cell.at[1], take * quantum.length());
        moved = [moved[0] + momentum[0], moved[1] + momentum[1]];
    }
    for (cell, give) in cells.iter().zip(given) {
        let [i, j] = cell.at;
        water.add_depth(i, j, give * quantum.length());
        water.add_discharge(i, j, moved.map(|q| q * (give / total)));
    }
    Ok(())
}

fn push<E: Exchange + ?Sized>(
    water: &mut E,
    spec: &GridSpec,
    centre: Vec2,
    radius: f32,
    velocity: Vec2,
) -> Result<(), EventError> {
    let cells = reach(spec, "push", centre, radius)?;
    for value in velocity.to_array() {
        if !(value.abs() <= LARGEST_SPEED) {
            return Err(impossible(
                "push",
                "velocity",
                value,
                "give finite m/s, at most 1000",
            ));
        }
    }
    for cell in &cells {
        let [i, j] = cell.at;
        let h = water.depth(i, j);
        if h > water.dry() {
            let weight = h * bump(cell.square);
            water.add_discharge(i, j, velocity.to_array().map(|v| weight * f64::from(v)));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_add_up_and_keep_to_the_room() {
        let given = share(1001.0, &[1.0, 2.0, 0.0, 4.0], &[f64::INFINITY; 4]);
        assert_eq!(given, [143.0, 286.0, 0.0, 572.0]);
        let given = share(100.0, &[1.0, 1.0, 1.0], &[5.0, f64::INFINITY, 80.0]);
        assert_eq!(given[0], 5.0);
        assert_eq!(given.iter().sum::<f64>(), 100.0);
        // Less room than water: all rooms are full.
        assert_eq!(share(100.0, &[1.0, 3.0], &[7.0, 9.0]), [7.0, 9.0]);
        assert_eq!(share(5.0, &[0.0, 0.0], &[9.0, 9.0]), [0.0, 0.0]);
    }
}
