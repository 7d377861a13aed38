//! Cost of the shallow-water solver: `cargo bench -p meniscus-sim --bench shallow_water`.
//!
//! `Kitem/s` and `Mitem/s` are cell updates (cells times sub-steps) a second, at one and two threads, over a rough bed.
//! Run it on a quiet machine; one row alone: `-- 'lattice_f32::1::1024|triad'`.
//!
//! `triad` is the memory's own speed in the same run, a(i) = b(i) + s c(i) over arrays beyond the caches: a step of the
//! finite volumes in `f32` moves 28 bytes a cell (16 read, 12 written; 40 where a written line is read first, as in the
//! triad, whose 12 bytes then are 16), so the roofline in cell updates is the triad's GB/s over 30. Where all water is
//! calm a step of the lattice is in place and moves 52 bytes a cell (28 read, 24 written), else 76: the triad's GB/s over
//! 39 or over 57.

#![allow(clippy::print_stdout, reason = "a bench reports to a person")]

use divan::counter::{BytesCount, ItemsCount};
use divan::{Bencher, black_box};
use meniscus_sim::glam::{UVec2, Vec2};
use meniscus_sim::rng::Rng;
use meniscus_sim::shallow_water::{
    DEFAULT_RELAXATION, Initial, LatticeSettings, Method, Precision, Settings, ShallowWater,
};
use meniscus_sim::{GridSpec, Solver};
use rayon::prelude::*;

fn main() {
    println!("bytes a cell, with everything that the solver holds:");
    for side in [256, 1024] {
        for (name, method) in [
            ("finite-volume", volumes()),
            ("lattice", lattice()),
            ("bgk", bgk()),
        ] {
            let per_cell =
                |precision| solver(side, method, precision, waves).bytes() as f64 / f64::from(side).powi(2);
            let (single, double) = (per_cell(Precision::Single), per_cell(Precision::Double));
            println!("  {side:>4}²  {name:<13}  f32 {single:.1}  f64 {double:.1}");
        }
    }
    divan::main();
}

const SIDES: [u32; 5] = [256, 512, 1024, 2048, 4096];

/// A length that no arithmetic rounds.
const SPACING: f32 = 0.5;

fn volumes() -> Method {
    Method::FiniteVolume
}

fn lattice() -> Method {
    Method::Lattice(LatticeSettings::default())
}

fn bgk() -> Method {
    Method::Bgk {
        relaxation: DEFAULT_RELAXATION,
    }
}

/// Ground and surface at the sample of these coordinates in m and random number in [0, 1).
type State = fn(f64, f64, f64) -> (f64, f64);

/// Low waves, so that the fastest signal keeps its speed, over hills rough at the scale of a cell.
fn waves(x: f64, z: f64, noise: f64) -> (f64, f64) {
    let ground = -2.0 + 0.5 * (0.05 * x).sin() * (0.07 * z).cos() + 0.1 * noise;
    (ground, 0.01 * (0.2 * x).sin() * (0.15 * z).cos())
}

/// A pond of 20 m in dry hills.
fn pond(x: f64, z: f64, noise: f64) -> (f64, f64) {
    let (x, z) = (x - 100.0, z - 100.0);
    let ground = 0.01 * (x * x + z * z) - 1.0;
    (ground.min(50.0 + noise), 0.01 * (0.5 * x).sin())
}

fn solver(side: u32, method: Method, precision: Precision, state: State) -> ShallowWater {
    let spec = GridSpec::new(Vec2::ZERO, SPACING, UVec2::splat(side)).expect("the bench's grid is right");
    let mut rng = Rng::new(1, 0);
    let (mut ground, mut elevation) = (Vec::with_capacity(spec.len()), Vec::with_capacity(spec.len()));
    for k in 0..spec.len() {
        let at = |n: usize| f64::from(SPACING) * n as f64;
        let (z, e) = state(at(k % spec.width()), at(k / spec.width()), rng.uniform());
        ground.push(z);
        elevation.push(e);
    }
    let initial = Initial {
        ground,
        elevation,
        velocity: None,
    };
    let settings = Settings {
        method,
        precision,
        ..Settings::default()
    };
    ShallowWater::new(spec, &initial, settings).expect("the bench's state is right")
}

/// Calls of `advance` over whole numbers of sub-steps.
fn measure(bencher: Bencher, threads: usize, mut solver: ShallowWater) {
    let pool = pool(threads);
    let cells = solver.spec().len();
    let substeps: u32 = if cells > 1 << 21 { 4 } else { 16 };
    // The speed is known after a first step; half a step less than the limit leaves room for its change.
    let first = pool.install(|| solver.advance(1e-3)).expect("a step is taken");
    let dt = ((f64::from(substeps) - 0.5) * first.largest_stable_step) as f32;
    bencher
        .counter(ItemsCount::new(cells * substeps as usize))
        .bench_local(|| {
            let report = pool
                .install(|| solver.advance(black_box(dt)))
                .expect("a step is taken");
            assert_eq!(
                report.substeps, substeps,
                "the count of cell updates would be wrong"
            );
        });
}

fn pool(threads: usize) -> rayon::ThreadPool {
    rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .expect("threads can be started")
}

#[divan::bench(args = SIDES, consts = [1, 2], sample_count = 7, sample_size = 1)]
fn finite_volume_f32<const THREADS: usize>(bencher: Bencher, side: u32) {
    measure(
        bencher,
        THREADS,
        solver(side, volumes(), Precision::Single, waves),
    );
}

#[divan::bench(args = [256, 1024], consts = [1, 2], sample_count = 7, sample_size = 1)]
fn finite_volume_f64<const THREADS: usize>(bencher: Bencher, side: u32) {
    measure(
        bencher,
        THREADS,
        solver(side, volumes(), Precision::Double, waves),
    );
}

/// Cells that are dry and far from water cost nothing: all cells are counted, one in a thousand is wet at 2048².
#[divan::bench(args = [256, 1024, 2048], consts = [1, 2], sample_count = 7, sample_size = 1)]
fn finite_volume_mostly_dry<const THREADS: usize>(bencher: Bencher, side: u32) {
    measure(bencher, THREADS, solver(side, volumes(), Precision::Single, pond));
}

/// All cells deep and calm.
#[divan::bench(args = SIDES, consts = [1, 2], sample_count = 7, sample_size = 1)]
fn lattice_f32<const THREADS: usize>(bencher: Bencher, side: u32) {
    measure(
        bencher,
        THREADS,
        solver(side, lattice(), Precision::Single, waves),
    );
}

#[divan::bench(args = [256, 1024], consts = [1, 2], sample_count = 7, sample_size = 1)]
fn lattice_f64<const THREADS: usize>(bencher: Bencher, side: u32) {
    measure(
        bencher,
        THREADS,
        solver(side, lattice(), Precision::Double, waves),
    );
}

#[divan::bench(args = [256, 1024, 2048], consts = [1, 2], sample_count = 7, sample_size = 1)]
fn lattice_mostly_dry<const THREADS: usize>(bencher: Bencher, side: u32) {
    measure(bencher, THREADS, solver(side, lattice(), Precision::Single, pond));
}

#[divan::bench(args = SIDES, consts = [1, 2], sample_count = 7, sample_size = 1)]
fn bgk_f32<const THREADS: usize>(bencher: Bencher, side: u32) {
    measure(bencher, THREADS, solver(side, bgk(), Precision::Single, waves));
}

/// The memory's speed.
#[divan::bench(consts = [1, 2], sample_count = 15, sample_size = 1)]
fn triad<const THREADS: usize>(bencher: Bencher) {
    const VALUES: usize = 1 << 25;
    let (mut a, b, c) = (
        vec![0.0_f32; VALUES],
        vec![1.0_f32; VALUES],
        vec![2.0_f32; VALUES],
    );
    let pool = pool(THREADS);
    let part = VALUES / (4 * THREADS);
    bencher.counter(BytesCount::new(3 * 4 * VALUES)).bench_local(|| {
        let s = black_box(3.0_f32);
        pool.install(|| {
            a.par_chunks_mut(part)
                .zip(b.par_chunks(part))
                .zip(c.par_chunks(part))
                .for_each(|((a, b), c)| {
                    for ((a, b), c) in a.iter_mut().zip(b).zip(c) {
                        *a = b + s * c;
                    }
                });
        });
        black_box(&mut a);
    });
}
