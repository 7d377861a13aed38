//! Cost of wave particles: `cargo bench -p meniscus-sim --bench wave_particles`. Throughput is particles a second.

use divan::counter::ItemsCount;
use divan::{Bencher, black_box};
use meniscus_sim::events::Action;
use meniscus_sim::glam::{UVec2, Vec2};
use meniscus_sim::rng::Rng;
use meniscus_sim::scene::description::Description;
use meniscus_sim::wave_particles::WaveParticles;
use meniscus_sim::{Channels, Frame, GridSpec, Scene, Solver};

fn main() {
    divan::main();
}

/// Radii in samples.
const RADII: [u32; 3] = [2, 4, 8];

/// A hundred thousand particles, of rings from random drops, on 512 × 512 samples with walls.
fn waters(radius: u32, count: usize) -> WaveParticles {
    let text = "name = \"bench\"\n[solver]\nkind = \"wave-particles\"\nspacing = 1.0\nspeed = 1.0\nlimit = 2e7\nsmallest = 1e-5";
    let description: Description = toml::from_str(text).expect("the bench's scene is right");
    let scene = Scene {
        description,
        grid: GridSpec::new(Vec2::ZERO, 1.0, UVec2::splat(512)).expect("the bench's grid is right"),
        terrain: None,
        meshes: Vec::new(),
        sky: None,
        initial_elevation: None,
        uplifts: Vec::new(),
    };
    let mut solver = WaveParticles::from_scene(&scene).expect("right");
    let mut rng = Rng::new(5, 5);
    while solver.count() < count {
        solver
            .apply(&Action::Drop {
                position: 511.0 * Vec2::new(rng.uniform_f32(), rng.uniform_f32()),
                radius: radius as f32,
                volume: (radius * radius) as f32,
            })
            .expect("right");
    }
    solver.advance(0.5 * radius as f32).expect("right");
    solver
}

fn pool(threads: usize) -> rayon::ThreadPool {
    rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .expect("threads can be started")
}

/// The elevation of a frame.
#[divan::bench(args = RADII, consts = [1, 2])]
fn elevation<const THREADS: usize>(bencher: Bencher, radius: u32) {
    let solver = waters(radius, 100_000);
    let mut frame = Frame::new(solver.spec());
    let pool = pool(THREADS);
    bencher
        .counter(ItemsCount::new(solver.count()))
        .bench_local(|| pool.install(|| solver.extract(black_box(Channels::NONE), &mut frame)));
}

/// A frame with velocity and displacement.
#[divan::bench(args = RADII)]
fn all_channels(bencher: Bencher, radius: u32) {
    let solver = waters(radius, 100_000);
    let mut frame = Frame::new(solver.spec());
    let pool = pool(1);
    bencher
        .counter(ItemsCount::new(solver.count()))
        .bench_local(|| pool.install(|| solver.extract(black_box(Channels::ALL), &mut frame)));
}

/// A thirtieth of a second of splits and reflections, with the totals of the report.
#[divan::bench(args = RADII)]
fn advance(bencher: Bencher, radius: u32) {
    let pool = pool(1);
    bencher
        .counter(ItemsCount::new(100_000_usize))
        .with_inputs(|| waters(radius, 100_000))
        .bench_local_refs(|solver| pool.install(|| solver.advance(black_box(1.0 / 30.0))));
}
