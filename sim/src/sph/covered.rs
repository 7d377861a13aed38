//! The surface where bodies stand in it.
//!
//! The potential knows nothing of what fills a body, so that beside and below one the surface dips. There it is what the
//! surface around says, as if the water went on through the body: nobody sees it inside, and the waterline runs
//! where the water ends.

use super::obstacle::Obstacle;
use crate::grid::Grid;
use glam::{Vec2, Vec3};

/// How near to a body, in particle spacings, the surface is taken for its dent.
const NEAR: f32 = 1.0;
/// Least upward part of a body's normal where the water lies on top of it, up to so many spacings deep: what stands there
/// says nothing of the surface around.
const ON_TOP: f32 = 0.5;
const FILM: f32 = 4.0;

/// Closes the surface over the bodies that stand in it. Dry samples stay dry.
pub(super) fn close(obstacles: &[Obstacle], spacing: f32, ground: &Grid<f32>, elevation: &mut Grid<f32>) {
    let spec = *elevation.spec();
    let (width, height) = (spec.width(), spec.height());
    let (mut open, mut roofs) = (Vec::new(), Vec::new());
    for obstacle in obstacles {
        let reach = obstacle.radius() + FILM * spacing;
        let centre = Vec2::new(obstacle.pose.position.x, obstacle.pose.position.z);
        let first = spec
            .to_grid(centre - reach)
            .floor()
            .max(Vec2::ZERO)
            .as_usizevec2();
        let last = spec.to_grid(centre + reach).ceil().max(Vec2::ZERO).as_usizevec2();
        for j in first.y..(last.y + 1).min(height) {
            for i in first.x..(last.x + 1).min(width) {
                let (at, y) = (spec.position(i, j), elevation[(i, j)]);
                match obstacle.near(Vec3::new(at.x, y, at.y), FILM * spacing) {
                    _ if y <= ground[(i, j)] => {}
                    Some((_, normal, _)) if normal.y >= ON_TOP => roofs.push((j, i)),
                    Some((distance, ..)) if distance < NEAR * spacing => open.push((j, i)),
                    _ => {}
                }
            }
        }
    }
    for list in [&mut open, &mut roofs] {
        list.sort_unstable();
        list.dedup();
    }
    open.retain(|sample| roofs.binary_search(sample).is_err());
    // Ring by ring from outside, each sample the mean of the neighbours that are known by then.
    let mut filled = Vec::new();
    while !open.is_empty() {
        filled.clear();
        for &(j, i) in &open {
            let (mut sum, mut count) = (0.0, 0.0);
            for b in j.saturating_sub(1)..(j + 2).min(height) {
                for a in i.saturating_sub(1)..(i + 2).min(width) {
                    let known = |list: &[(usize, usize)]| list.binary_search(&(b, a)).is_err();
                    if elevation[(a, b)] > ground[(a, b)] && known(&open) && known(&roofs) {
                        sum += elevation[(a, b)];
                        count += 1.0;
                    }
                }
            }
            if count > 0.0 {
                filled.push((j, i, sum / count));
            }
        }
        if filled.is_empty() {
            return;
        }
        for &(j, i, y) in &filled {
            elevation[(i, j)] = y;
        }
        open.retain(|sample| filled.binary_search_by_key(sample, |&(j, i, _)| (j, i)).is_err());
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::BodyPose;
    use crate::grid::GridSpec;
    use crate::sph::Solid;
    use glam::UVec2;

    #[test]
    fn a_dent_under_a_box_is_closed_and_water_on_top_of_it_stays() {
        let spec = GridSpec::new(Vec2::ZERO, 0.1, UVec2::splat(21)).unwrap();
        let ground = Grid::filled(spec, -1.0);
        let pose = BodyPose {
            position: Vec3::new(1.0, 0.0, 1.0),
            ..BodyPose::default()
        };
        let block = [Obstacle::new(Solid::Box(Vec3::new(0.35, 0.3, 0.35)), pose)];
        let hull = |i: usize, j: usize| (i as i32 - 10).abs().max((j as i32 - 10).abs()) < 4;
        let mut dented = Grid::from_fn(spec, |i, j| if hull(i, j) { -0.35 } else { 0.02 });
        close(&block, 0.2, &ground, &mut dented);
        assert!(dented.as_slice().iter().all(|y| (y - 0.02).abs() < 1e-6));
        let mut over = Grid::from_fn(spec, |i, j| if hull(i, j) { 0.4 } else { -0.02 });
        let before = over.clone();
        close(&block, 0.2, &ground, &mut over);
        assert!(over == before);
    }
}
