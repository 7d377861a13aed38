//! What particles cost: CPU seconds a simulated second of a dam break, steps a second of the paper's model, and
//! milliseconds a surface. One thread. `cargo run --release --features sph --example sph_cost [SPACING] [SECONDS]`, or
//! `... sph_cost flat`: what a particle costs from 3 thousand of them to a million.
#![allow(clippy::print_stdout)] // its purpose

use meniscus_sim::glam::{UVec2, Vec2, Vec3};
use meniscus_sim::sph::{Boundary, Extractor, Fluid, Model, Root, Settings, cases};
use meniscus_sim::{Channels, Frame, Grid, GridSpec};
use std::error::Error;
use std::time::Instant;

const TANK: Vec2 = Vec2::new(2.0, 0.52);
/// Surfaces of a run, and runs of which the best counts.
const SURFACES: u32 = 100;
const RUNS: u32 = 4;

/// Seconds that this thread has computed, where the system says so.
fn cpu() -> Result<f64, Box<dyn Error + Send + Sync>> {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat")?;
    Ok(1e-9 * text.split(' ').next().unwrap_or_default().parse::<f64>()?)
}

/// A column of 0.5 m by 1 m by 0.5 m in a tank of 2 m by 0.52 m.
fn column(settings: Settings) -> Fluid {
    let mut fluid = Fluid::new(settings, Boundary::tank(Vec2::ZERO, TANK, 0.0));
    cases::fill(&mut fluid, Vec3::ZERO, Vec3::new(0.5, 1.0, 0.5));
    fluid
}

fn measure(spacing: f32, seconds: f64) -> Result<(), Box<dyn Error + Send + Sync>> {
    let mut fluid = column(Settings::water(spacing));
    let (mut t, mut steps, mut iterations, mut stalls) = (0.0, 0_u32, [0_u32; 2], 0_u32);
    let (mut compression, mut worst) = (0.0, 0.0_f64);
    let start = cpu()?;
    while t < seconds {
        let step = fluid.stable_step().min(1.0 / 60.0);
        let stepped = fluid.step(step as f32);
        t += step;
        steps += 1;
        iterations[0] += stepped.iterations[0];
        iterations[1] += stepped.iterations[1];
        stalls += u32::from(stepped.stalled);
        compression += step * stepped.compression;
        worst = worst.max(stepped.compression);
    }
    let spent = cpu()? - start;
    let each = |k: usize| f64::from(iterations[k]) / f64::from(steps);
    if steps > 0 {
        println!(
            "dfsph: {} particles, {:.2} CPU s a second, {steps} steps, {:.2} µs a particle and step, iterations {:.1} \
         (velocities) {:.1} (displacements), {stalls} stalled, compression {:.4} % (worst {:.3} %)",
            fluid.len(),
            spent / t,
            1e6 * spent / f64::from(steps) / fluid.len() as f64,
            each(1),
            each(0),
            100.0 * compression / t,
            100.0 * worst,
        );
    }
    let spec = GridSpec::new(
        Vec2::ZERO,
        0.5 * spacing,
        UVec2::new((4.0 / spacing) as u32 + 1, (1.04 / spacing) as u32 + 1),
    )?;
    let ground = Grid::filled(spec, 0.0);
    let mut frames = [Frame::new(spec), Frame::new(spec)];
    for ((name, root), frame) in [("fast", Root::Fast), ("exact", Root::Exact)]
        .into_iter()
        .zip(&mut frames)
    {
        let mut extractor = Extractor::new(spec, spacing, root);
        extractor.extract(&fluid, &ground, Channels::DEPTH, false, frame);
        let mut best = f64::INFINITY;
        for _ in 0..RUNS {
            let start = cpu()?;
            for _ in 0..SURFACES {
                extractor.extract(&fluid, &ground, Channels::DEPTH, false, frame);
            }
            best = best.min((cpu()? - start) / f64::from(SURFACES));
        }
        println!(
            "surface, {name}: {} columns, {:.2} CPU ms",
            spec.size.x * spec.size.y,
            1e3 * best,
        );
    }
    let [fast, exact] = frames.each_ref().map(|frame| frame.elevation.as_slice());
    // Dry ground has the height of what is beside it.
    let wet = exact.iter().zip(fast).filter(|(a, _)| **a > 0.0);
    let mut errors: Vec<f32> = wet.map(|(a, b)| (a - b).abs() / spacing).collect();
    errors.sort_by(f32::total_cmp);
    println!(
        "surface, fast against exact: median {:.4} d, 95 % within {:.4} d, largest {:.2} d",
        errors[errors.len() / 2],
        errors[errors.len() * 95 / 100],
        errors[errors.len() - 1],
    );
    Ok(())
}

/// A column of `height` metres of the paper's model.
fn paper_column(spacing: f32, height: f32) -> Fluid {
    let settings = Settings {
        model: Model::Mcg03,
        stiffness: 20.0,
        viscosity: 1e-3,
        ..Settings::water(spacing)
    };
    let mut fluid = Fluid::new(settings, Boundary::tank(Vec2::ZERO, TANK, 0.0));
    cases::fill(&mut fluid, Vec3::ZERO, Vec3::new(0.5, height, 0.5));
    fluid
}

/// Steps of `dfsph` in which deep water that was let go finds its pressure, and those after them.
const STEPS: [u32; 2] = [6, 18];

/// What a particle costs a step, for ever more of them. When deep water is let go, its pressure has to be found from nothing,
/// which takes iterations that grow with its depth; so these steps are told apart.
fn flat() -> Result<(), Box<dyn Error + Send + Sync>> {
    for (across, steps) in [(12.0, 40), (25.0, 10), (50.0, 4), (80.0, 2)] {
        let spacing = 0.5 / across;
        let mut paper = paper_column(spacing, 1.0);
        let dt = paper.stable_step() as f32;
        paper.step(dt);
        let start = cpu()?;
        for _ in 0..steps {
            paper.step(dt);
        }
        let each = 1e6 / paper.len() as f64;
        print!(
            "{} particles: mcg03 {:.3} µs a step, dfsph",
            paper.len(),
            each * (cpu()? - start) / f64::from(steps)
        );
        drop(paper);
        let mut fluid = column(Settings::water(spacing));
        for (steps, which) in STEPS.into_iter().zip(["at first", "then"]) {
            let (start, mut iterations) = (cpu()?, 0);
            for _ in 0..steps {
                let dt = fluid.stable_step().min(1.0 / 60.0);
                let [a, b] = fluid.step(dt as f32).iterations;
                iterations += a + b;
            }
            print!(
                " {which} {:.2} µs a step ({:.1} iterations)",
                each * (cpu()? - start) / f64::from(steps),
                f64::from(iterations) / f64::from(steps),
            );
        }
        println!();
    }
    Ok(())
}

fn paper() -> Result<(), Box<dyn Error + Send + Sync>> {
    let spacing = 1.0 / 24.0;
    let mut fluid = paper_column(spacing, 21.0 / 24.0);
    let spec = GridSpec::new(
        Vec2::ZERO,
        spacing,
        UVec2::new((2.0 / spacing) as u32 + 1, (0.52 / spacing) as u32 + 1),
    )?;
    let ground = Grid::filled(spec, 0.0);
    let mut frame = Frame::new(spec);
    let mut extractor = Extractor::new(spec, spacing, Root::Fast);
    // The clock of the thread advances by several steps at a time, so it counts all of them; the clock on the wall tells
    // how they divide.
    let (mut stepping, mut surface) = (0.0, 0.0);
    let (steps, start) = (1000_u32, cpu()?);
    for _ in 0..steps {
        let a = Instant::now();
        fluid.step(0.003);
        let b = Instant::now();
        extractor.extract(&fluid, &ground, Channels::DEPTH, false, &mut frame);
        stepping += (b - a).as_secs_f64();
        surface += b.elapsed().as_secs_f64();
    }
    let each = (cpu()? - start) / f64::from(steps);
    let share = surface / (stepping + surface);
    println!(
        "mcg03: {} particles, {:.0} steps a second with a surface each ({:.3} ms step, {:.3} ms surface)",
        fluid.len(),
        1.0 / each,
        1e3 * each * (1.0 - share),
        1e3 * each * share,
    );
    Ok(())
}

fn main() -> Result<(), Box<dyn Error>> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
    let mut arguments = std::env::args().skip(1).peekable();
    if arguments.peek().is_some_and(|a| a == "flat") {
        return pool.install(flat).map_err(|e| e.to_string().into());
    }
    let spacing = arguments.next().map_or(Ok(1.0 / 24.0), |a| a.parse())?;
    let seconds = arguments.next().map_or(Ok(1.5), |a| a.parse())?;
    pool.install(|| measure(spacing, seconds).and_then(|()| paper()))
        .map_err(|e| e.to_string().into())
}
