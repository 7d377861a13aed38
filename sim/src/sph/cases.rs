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

/// A surge front against measured ones.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Front {
    /// Root mean square of the relative error.
    pub error: f64,
    /// Delay of the measured times that makes the error least, in units of T.
    pub delay: f64,
    /// The error that then is left.
    pub delayed_error: f64,
}

/// The surge front against `data`: pairs of T = t √(2g/a) and Z = x/a in order of time, for a column of width `a` metres
/// and twice that height (Martin & Moyce 1952, n² = 2). The front is the foremost particle's edge.
///
/// In the experiment a diaphragm had to leave first, so that its clock and that of water set free at once differ by a
/// constant: [`Front::delay`], up to 0.4.
pub fn surge_front(settings: Settings, a: f32, data: &[(f64, f64)]) -> Front {
    let d = settings.spacing;
    let farthest = data.iter().map(|p| p.1).fold(1.0, f64::max) as f32;
    let unit = f64::from(a / (2.0 * settings.gravity.length())).sqrt();
    let mut fluid = sheet(settings, (1.3 * farthest + 4.0) * a, Vec2::new(a, 2.0 * a));
    let mut seen = vec![(0.0, 1.0)];
    let end = data.last().map_or(0.0, |p| p.0 * unit);
    run(&mut fluid, end, f64::INFINITY, |fluid, t| {
        let front = fluid.positions().iter().map(|p| p.x).fold(0.0, f32::max) + 0.5 * d;
        seen.push((t / unit, f64::from(front / a)));
    });
    let at = |t: f64| {
        let next = seen.partition_point(|p| p.0 < t).clamp(1, seen.len() - 1);
        let (p, q) = (seen[next - 1], seen[next]);
        p.1 + (q.1 - p.1) * ((t - p.0) / (q.0 - p.0)).clamp(0.0, 1.0)
    };
    let error = |delay: f64| {
        let square = |p: &(f64, f64)| (at((p.0 - delay).max(0.0)) / p.1 - 1.0).powi(2);
        (data.iter().map(square).sum::<f64>() / data.len().max(1) as f64).sqrt()
    };
    let delays = (0..=40).map(|k| 0.01 * f64::from(k));
    let (delayed_error, delay) =
        delays
            .map(|delay| (error(delay), delay))
            .fold(
                (f64::INFINITY, 0.0),
                |best, new| if new.0 < best.0 { new } else { best },
            );
    Front {
        error: error(0.0),
        delay,
        delayed_error,
    }
}

/// How a blow on a wall began and how hard it was, as published: time in √(H/g), pressure in ρ g H.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Blow {
    /// When the pressure first is a quarter of the peak.
    pub arrival: f64,
    /// Largest pressure.
    pub peak: f64,
}

impl Blow {
    /// Of a curve of times and pressures in order of time, each pressure the mean over `window` of time about it.
    pub fn of(curve: &[(f64, f64)], window: f64) -> Self {
        // The integral up to each time, linear between the points.
        let mut sums = vec![0.0];
        for pair in curve.windows(2) {
            let last = sums.last().copied().unwrap_or(0.0);
            sums.push(last + 0.5 * (pair[1].0 - pair[0].0) * (pair[0].1 + pair[1].1));
        }
        let until = |t: f64| {
            let k = curve.partition_point(|p| p.0 <= t);
            let (Some(a), Some(b)) = (k.checked_sub(1).map(|a| curve[a]), curve.get(k)) else {
                return if k == 0 { 0.0 } else { sums[k - 1] };
            };
            let share = (t - a.0) / (b.0 - a.0);
            sums[k - 1] + (t - a.0) * (a.1 + 0.5 * share * (b.1 - a.1))
        };
        let mean = |t: f64| (until(t + 0.5 * window) - until(t - 0.5 * window)) / window;
        let peak = curve.iter().map(|p| mean(p.0)).fold(0.0, f64::max);
        let arrival = curve.iter().find(|p| mean(p.0) >= 0.25 * peak);
        Self {
            arrival: arrival.map_or(f64::INFINITY, |p| p.0),
            peak,
        }
    }

    /// The time that water as fast as a broken dam's front, 2 √(g H), takes to pass a kernel: what happens in less, particles
    /// cannot tell. Measured curves are seen through the same window.
    pub fn window(settings: &Settings, depth: f32) -> f64 {
        f64::from(0.5 * settings.support() / depth)
    }
}

/// A column of `depth` metres and twice that width collapses onto the far wall of a tank 1.61/0.3 of the depth long: the
/// pressure there, at a hundredth and a tenth of the depth above the floor (probes 1 and 3 of Lobovský et al. 2014,
/// doi:10.1016/j.jfluidstructs.2014.03.009), up to t √(g/H) = 3.5.
pub fn wall_blow(settings: Settings, depth: f32) -> [Blow; 2] {
    let gravity = settings.gravity.length();
    let width = 1.61 / 0.3 * depth;
    let unit = f64::from(depth / gravity).sqrt();
    let scale = f64::from(gravity * depth);
    let middle = 0.5 * settings.spacing;
    let window = Blow::window(&settings, depth);
    let probes = [0.01, 0.1].map(|share| Vec3::new(width, share * depth, middle));
    let mut fluid = sheet(settings, width, Vec2::new(2.0 * depth, depth));
    let mut seen = [Vec::new(), Vec::new()];
    run(&mut fluid, 3.5 * unit, f64::INFINITY, |fluid, t| {
        for (seen, probe) in seen.iter_mut().zip(probes) {
            seen.push((t / unit, fluid.pressure_at(probe) / scale));
        }
    });
    seen.map(|curve| Blow::of(&curve, window))
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
    let mut seen = Vec::new();
    run(&mut fluid, 3.6 * truth, 0.01 * truth, |fluid, t| {
        let all = fluid.positions().iter().zip(fluid.velocities());
        let mode = all.map(|(p, v)| f64::from(v.x * (k * p.x).sin())).sum::<f64>();
        seen.push((t, mode / fluid.len() as f64));
    });
    (TAU / frequency(&seen, omega), truth)
}

/// Angular frequency of the damped oscillation that fits `seen`, times and values, best; within 20 % of `guess`.
fn frequency(seen: &[(f64, f64)], guess: f64) -> f64 {
    // What a cosine and a sine of that frequency and decay explain of the values.
    let explained = |omega: f64, decay: f64| {
        let (mut m, mut b, mut before) = ([0.0; 3], [0.0; 2], 0.0);
        for &(t, value) in seen {
            let (dt, size) = (t - before, (-decay * t).exp());
            let (c, s) = (size * (omega * t).cos(), size * (omega * t).sin());
            m = [m[0] + dt * c * c, m[1] + dt * c * s, m[2] + dt * s * s];
            b = [b[0] + dt * c * value, b[1] + dt * s * value];
            before = t;
        }
        (m[2] * b[0] * b[0] - 2.0 * m[1] * b[0] * b[1] + m[0] * b[1] * b[1]) / (m[0] * m[2] - m[1] * m[1])
    };
    let mut best = (f64::NEG_INFINITY, f64::NAN);
    for a in -200..=200 {
        for b in 0..20 {
            let omega = guess * (1.0 + 1e-3 * f64::from(a));
            let fit = explained(omega, 0.01 * guess * f64::from(b));
            if fit > best.0 {
                best = (fit, omega);
            }
        }
    }
    best.1
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
