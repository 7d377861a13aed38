//! Flows with a known truth, for tests and studies. All are plane: one layer of particles between two walls.

use super::boundary::Boundary;
use super::fluid::Fluid;
use super::settings::Settings;
use glam::{Vec2, Vec3};
use std::f64::consts::{PI, TAU};

/// Lays a lattice of particles at rest into the box from `low` to `high`, metres.
pub fn fill(fluid: &mut Fluid, low: Vec3, high: Vec3) {
    let d = fluid.settings().spacing;
    let n = ((high - low) / d).round().as_uvec3();
    for y in 0..n.y {
        for z in 0..n.z {
            for x in 0..n.x {
                fluid.add(
                    low + d * (Vec3::new(x as f32, y as f32, z as f32) + 0.5),
                    Vec3::ZERO,
                );
            }
        }
    }
}

/// A tank of that `width`, one particle thick, with its floor at height 0 and a block of water in the corner.
pub fn sheet(settings: Settings, width: f32, block: Vec2) -> Fluid {
    let d = settings.spacing;
    let mut fluid = Fluid::new(settings, Boundary::tank(Vec2::ZERO, Vec2::new(width, d), 0.0));
    fill(&mut fluid, Vec3::ZERO, Vec3::new(block.x, block.y, d));
    fluid
}

/// Steps for `time` seconds, with sub-steps no longer than `longest`. `each` sees the state and time after every one.
pub fn run(fluid: &mut Fluid, time: f64, longest: f64, mut each: impl FnMut(&Fluid, f64)) {
    let mut t = 0.0;
    while t < time {
        let left = time - t;
        let step = left / (left / fluid.stable_step().min(longest)).ceil();
        fluid.step(step as f32);
        t = if left <= step { time } else { t + step };
        each(fluid, t);
    }
}

/// Kinetic plus potential energy in J, the latter above the origin.
pub fn energy(fluid: &Fluid) -> f64 {
    let (m, g) = (fluid.particle_mass(), fluid.settings().gravity);
    let all = fluid.positions().iter().zip(fluid.velocities());
    all.map(|(p, v)| m * f64::from(0.5 * v.truncate().length_squared() - g.dot(p.truncate())))
        .sum()
}

/// Root mean square error of the surge front, relative to `data`: pairs of T = t √(2g/a) and Z = x/a in order of time,
/// for a column of width `a` metres and twice that height (Martin & Moyce 1952, n² = 2). The front is the foremost
/// particle's edge.
pub fn surge_front(settings: Settings, a: f32, data: &[(f64, f64)]) -> f64 {
    let d = settings.spacing;
    let farthest = data.iter().map(|p| p.1).fold(1.0, f64::max) as f32;
    let unit = f64::from(a / (2.0 * settings.gravity.length())).sqrt();
    let mut fluid = sheet(settings, (farthest + 4.0) * a, Vec2::new(a, 2.0 * a));
    let (mut time, mut sum) = (0.0, 0.0);
    for (t, z) in data {
        run(&mut fluid, t * unit - time, f64::INFINITY, |_, _| {});
        time = t * unit;
        let front = fluid.positions().iter().map(|p| p.x).fold(0.0, f32::max) + 0.5 * d;
        sum += (f64::from(front / a) / z - 1.0).powi(2);
    }
    (sum / data.len().max(1) as f64).sqrt()
}

/// Period in seconds of the first sloshing mode in a tank of `length` and `depth` metres, and that of linear theory,
/// ω² = g k tanh(k h).
pub fn sloshing(settings: Settings, length: f32, depth: f32) -> (f64, f64) {
    let k = PI as f32 / length;
    let gravity = settings.gravity.length();
    let mut fluid = sheet(settings, length, Vec2::new(length, depth));
    // The lattice settles; then it gets the velocity of the mode, 4 % of that of a shallow wave.
    run(&mut fluid, 0.3, f64::INFINITY, |_, _| {});
    let size = 0.04 * (gravity * depth).sqrt() / (k * depth).cosh();
    let positions = fluid.positions().to_vec();
    for (v, p) in fluid.velocities_mut().iter_mut().zip(positions) {
        v.x += size * (k * p.y).cosh() * (k * p.x).sin();
        v.y -= size * (k * p.y).sinh() * (k * p.x).cos();
    }
    let omega = f64::from(gravity * k * (k * depth).tanh()).sqrt();
    let truth = TAU / omega;
    let mut last = (0.0, 0.0_f64);
    let mut crossings = Vec::new();
    run(&mut fluid, 3.6 * truth, 0.01 * truth, |fluid, t| {
        let flow: f64 = fluid.velocities().iter().map(|v| f64::from(v.x)).sum();
        if last.1 * flow < 0.0 {
            crossings.push(last.0 + (t - last.0) * last.1 / (last.1 - flow));
        }
        last = (t, flow);
    });
    let whole = crossings.len().saturating_sub(1);
    let period = match (crossings.first(), crossings.last()) {
        (Some(first), Some(last)) if whole > 0 => 2.0 * (last - first) / whole as f64,
        _ => f64::NAN,
    };
    (period, truth)
}

/// What a still column showed over its second half.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Still {
    /// Smallest and largest depth (twice the mean height of the particles), relative to the water's volume.
    pub depth: [f64; 2],
    /// Root mean square error of the pressure, relative to that of ρ g (H − y).
    pub pressure: f64,
    /// Mean compression that the densities show.
    pub compression: f64,
    /// Largest speed in m/s at the end.
    pub speed: f64,
}

/// A column of `depth` metres and 0.6 of that width stands for `time` seconds.
pub fn still_column(settings: Settings, depth: f32, time: f64) -> Still {
    let gravity = f64::from(settings.gravity.length());
    let width = (0.6 * depth / settings.spacing).round() * settings.spacing;
    let mut fluid = sheet(settings, width, Vec2::new(width, depth));
    let mut still = Still {
        depth: [f64::INFINITY, 0.0],
        ..Still::default()
    };
    let (mut error, mut weight, mut over, mut count) = (0.0, 0.0, 0.0, 0.0);
    run(&mut fluid, time, f64::INFINITY, |fluid, t| {
        if t < 0.5 * time {
            return;
        }
        let n = fluid.len() as f64;
        let mean: f64 = fluid.positions().iter().map(|p| f64::from(p.y)).sum::<f64>() / n;
        let relative = 2.0 * mean / f64::from(depth);
        still.depth = [still.depth[0].min(relative), still.depth[1].max(relative)];
        for (k, p) in fluid.positions().iter().enumerate() {
            let truth = gravity * f64::from(depth - p.y);
            error += (fluid.pressure(k) - truth).powi(2);
            weight += truth * truth;
        }
        over += fluid
            .densities()
            .iter()
            .map(|d| f64::from((d - 1.0).max(0.0)))
            .sum::<f64>()
            / n;
        count += 1.0;
    });
    still.pressure = (error / weight).sqrt();
    still.compression = over / count;
    still.speed = f64::from(fluid.fastest());
    still
}
