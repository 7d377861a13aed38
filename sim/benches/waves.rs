//! Cost of the wave solvers: `cargo bench -p meniscus-sim --bench waves`. Throughput is samples a second and sub-step
//! (or frame).

use divan::counter::ItemsCount;
use divan::{Bencher, black_box};
use meniscus_sim::glam::{UVec2, Vec2};
use meniscus_sim::procedural::Procedural;
use meniscus_sim::scene::description::Description;
use meniscus_sim::wave_equation::WaveEquation;
use meniscus_sim::{Channels, Frame, Grid, GridSpec, Scene, Solver};
use std::fmt::Write;

fn main() {
    divan::main();
}

const SIDES: [u32; 3] = [128, 512, 1024];

fn scene(side: u32, solver: &str, terrain: bool) -> Scene {
    let text = format!(
        "name = \"bench\"\n[water.initial]\nkind = \"disturbance\"\nposition = [20, 30]\nradius = 3\nheight = 0.3\n\
         [solver]\nspacing = 0.5\n{solver}"
    );
    let mut description: Description = toml::from_str(&text).expect("the bench's scene is right");
    if solver.contains("procedural") {
        description.water.initial = Default::default();
    }
    let grid = GridSpec::new(Vec2::ZERO, 0.5, UVec2::splat(side)).expect("the bench's grid is right");
    Scene {
        description,
        grid,
        terrain: terrain.then(|| {
            Grid::from_fn(grid, |i, j| {
                -3.0 + 2.5 * (i as f32 * 0.03).sin() * (j as f32 * 0.05).cos()
            })
        }),
        meshes: Vec::new(),
        sky: None,
        initial_elevation: None,
        uplifts: Vec::new(),
    }
}

/// Threads for the solvers of a bench.
fn pool(threads: usize) -> rayon::ThreadPool {
    rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .expect("threads can be started")
}

/// One frame of many explicit sub-steps: the scheme itself.
#[divan::bench(args = SIDES, consts = [1, 2])]
fn explicit_substeps<const THREADS: usize>(bencher: Bencher, side: u32) {
    let mut solver = WaveEquation::from_scene(&scene(side, "kind = \"wave-equation\"", true)).expect("right");
    let dt = (0.9 * solver.courant_limit() * 64.0) as f32;
    let pool = pool(THREADS);
    bencher
        .counter(ItemsCount::new(64 * side as usize * side as usize))
        .bench_local(|| pool.install(|| solver.advance(black_box(dt))));
}

/// Calls of one sub-step each: the scheme and its report.
#[divan::bench(args = SIDES, consts = [1, 2])]
fn explicit_single_steps<const THREADS: usize>(bencher: Bencher, side: u32) {
    let mut solver = WaveEquation::from_scene(&scene(side, "kind = \"wave-equation\"", true)).expect("right");
    let dt = (0.9 * solver.courant_limit()) as f32;
    let pool = pool(THREADS);
    bencher
        .counter(ItemsCount::new(side as usize * side as usize))
        .bench_local(|| pool.install(|| solver.advance(black_box(dt))));
}

/// Implicit steps at ten times the explicit limit.
#[divan::bench(args = SIDES, consts = [1, 2])]
fn implicit_substeps<const THREADS: usize>(bencher: Bencher, side: u32) {
    let limit = WaveEquation::from_scene(&scene(side, "kind = \"wave-equation\"", true))
        .expect("right")
        .courant_limit();
    let keys = format!(
        "kind = \"wave-equation\"\nscheme = \"implicit\"\nstep = {}",
        10.0 * limit
    );
    let mut solver = WaveEquation::from_scene(&scene(side, &keys, true)).expect("right");
    let pool = pool(THREADS);
    bencher
        .counter(ItemsCount::new(16 * side as usize * side as usize))
        .bench_local(|| pool.install(|| solver.advance(black_box((160.0 * limit) as f32))));
}

/// Elevation of 16 waves.
#[divan::bench(args = SIDES, consts = [1, 2])]
fn procedural_elevation<const THREADS: usize>(bencher: Bencher, side: u32) {
    procedural::<THREADS>(bencher, side, Channels::NONE);
}

/// Elevation, displacement and velocity of 16 Gerstner waves.
#[divan::bench(args = SIDES, consts = [1, 2])]
fn procedural_everything<const THREADS: usize>(bencher: Bencher, side: u32) {
    procedural::<THREADS>(bencher, side, Channels::ALL);
}

fn procedural<const THREADS: usize>(bencher: Bencher, side: u32, channels: Channels) {
    let mut keys = "kind = \"procedural\"\nwave = [".to_owned();
    for n in 0..16 {
        write!(
            keys,
            "{{ amplitude = 0.01, wavelength = {}, direction = {}, steepness = 0.5 }},",
            3 + n,
            20 * n
        )
        .expect("a string takes everything");
    }
    keys.push(']');
    let mut solver = Procedural::from_scene(&scene(side, &keys, false)).expect("right");
    let mut frame = Frame::new(solver.spec());
    let pool = pool(THREADS);
    bencher
        .counter(ItemsCount::new(side as usize * side as usize))
        .bench_local(|| {
            pool.install(|| {
                let report = solver.advance(1.0 / 30.0);
                solver.extract(channels, &mut frame);
                report
            })
        });
}
