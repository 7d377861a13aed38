//! Drops, presses and pushes, as far as particles can take them.

use super::fluid::Fluid;
use crate::events::{Action, EventError};
use glam::{Vec2, Vec3};
use rayon::prelude::*;

/// Particles that one drop may add.
const MOST: f32 = 1e6;
/// Largest change of velocity, m/s.
const FASTEST: f32 = 1e3;

/// (1 − s)² for the squared distance over the squared radius, 0 beyond.
fn bump(square: f32) -> f32 {
    let left = (1.0 - square).max(0.0);
    left * left
}

fn impossible(action: &Action, quantity: &'static str, value: f32, remedy: &'static str) -> EventError {
    EventError::Impossible {
        action: action.name(),
        quantity,
        value,
        remedy,
    }
}

/// Acts on the particles at once.
pub(super) fn apply(fluid: &mut Fluid, action: &Action) -> Result<(), EventError> {
    action.check()?;
    match *action {
        Action::Drop {
            position,
            radius,
            volume,
        } => {
            let spacing = fluid.settings().spacing;
            let count = volume.abs() / spacing.powi(3);
            if count > MOST {
                return Err(impossible(
                    action,
                    "volume",
                    volume,
                    "give at most a million particles",
                ));
            }
            let count = count.round() as usize;
            if volume < 0.0 {
                take(fluid, position, radius, count);
            } else {
                pour(fluid, position, radius, count);
            }
            Ok(())
        }
        Action::Press {
            position,
            radius,
            depth,
        } => {
            // The speed of a fall through that depth, downwards; the walls and the water below do the rest.
            let speed = (2.0 * fluid.settings().gravity.length() * depth.abs()).sqrt();
            if speed > FASTEST {
                return Err(impossible(action, "depth", depth, "give a smaller depth"));
            }
            push(
                fluid,
                position,
                radius,
                Vec3::new(0.0, -speed.copysign(depth), 0.0),
            );
            Ok(())
        }
        Action::Push {
            position,
            radius,
            velocity,
        } => {
            if velocity.length() > FASTEST {
                let fast = velocity.length();
                return Err(impossible(action, "velocity", fast, "give at most 1000 m/s"));
            }
            push(fluid, position, radius, Vec3::new(velocity.x, 0.0, velocity.y));
            Ok(())
        }
        #[allow(unreachable_patterns, reason = "actions of other solvers may follow")]
        _ => Err(EventError::Unsupported {
            solver: "sph",
            action: action.name(),
            remedy: "use drop, press or push",
        }),
    }
}

fn push(fluid: &mut Fluid, at: Vec2, radius: f32, change: Vec3) {
    let inverse = 1.0 / (radius * radius);
    let p = &mut fluid.particles;
    p.velocity
        .par_iter_mut()
        .with_min_len(4096)
        .zip(&p.position)
        .for_each(|(v, p)| {
            let square = at.distance_squared(Vec2::new(p.x, p.z)) * inverse;
            *v += (bump(square) * change).extend(0.0);
        });
}

/// Adds a ball of particles just above the water, falling from there.
fn pour(fluid: &mut Fluid, at: Vec2, radius: f32, count: usize) {
    let d = fluid.settings().spacing;
    let reach = radius.max((count as f32).cbrt() * d) + 2.0 * d;
    let near = |p: &&glam::Vec4| at.distance(Vec2::new(p.x, p.z)) < reach;
    let ground = fluid
        .boundary()
        .ground_at(Vec3::new(at.x, 0.0, at.y))
        .map_or(0.0, |g| g.0);
    let top = fluid
        .positions()
        .iter()
        .filter(near)
        .map(|p| p.y)
        .fold(ground, f32::max);
    // The nearest places of a lattice to its middle, nearest first.
    let side = (count as f32).cbrt().ceil() as i32 + 1;
    let mut places: Vec<Vec3> = (-side..=side)
        .flat_map(|x| {
            (-side..=side)
                .flat_map(move |y| (-side..=side).map(move |z| Vec3::new(x as f32, y as f32, z as f32)))
        })
        .collect();
    places.sort_by(|a, b| a.length_squared().total_cmp(&b.length_squared()));
    places.truncate(count);
    let size = places.last().map_or(0.0, |p| p.length());
    let centre = Vec3::new(at.x, top + d * (size + 1.0), at.y);
    let (spacing, mut v) = (d, Vec3::ZERO);
    for place in places {
        let mut p = centre + d * place;
        fluid.boundary().confine(spacing, &mut p, &mut v);
        fluid.add(p, Vec3::ZERO);
    }
}

/// Takes away the highest `count` particles within `radius`.
fn take(fluid: &mut Fluid, at: Vec2, radius: f32, count: usize) {
    let mut heights: Vec<f32> = fluid
        .positions()
        .iter()
        .filter(|p| at.distance(Vec2::new(p.x, p.z)) < radius)
        .map(|p| p.y)
        .collect();
    heights.sort_by(|a, b| b.total_cmp(a));
    let Some(&lowest) = count
        .checked_sub(1)
        .and_then(|k| heights.get(k).or(heights.last()))
    else {
        return;
    };
    fluid.remove(|p| p.y >= lowest && at.distance(Vec2::new(p.x, p.z)) < radius);
}
