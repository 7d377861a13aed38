//! One frame of an ocean beside its Fourier transforms alone, on one thread.
#![allow(clippy::unwrap_used)] // a bench may panic

use divan::{Bencher, black_box};
use glam::{DVec2, UVec2};
use meniscus_sim::dispersion::Dispersion;
use meniscus_sim::ocean::lattice::{Draw, Lattice};
use meniscus_sim::ocean::patch::{Field, Patch};
use meniscus_sim::ocean::sea::WaveField;
use meniscus_sim::ocean::transform::Transform;
use meniscus_sim::scene::description::{Sea, Spectrum, Spreading};
use meniscus_sim::{Channels, Frame, Scene, Solver as _, glam, ocean::Ocean};
use rayon::{ThreadPool, ThreadPoolBuilder};
use std::path::Path;

fn main() {
    divan::main();
}

const SIZES: [u32; 3] = [256, 512, 1024];

fn one_thread() -> ThreadPool {
    ThreadPoolBuilder::new().num_threads(1).build().unwrap()
}

fn sea() -> Sea {
    Sea {
        spectrum: Spectrum::Jonswap {
            wind: 12.0,
            fetch: 1e5,
            gamma: 3.3,
        },
        direction: 30.0,
        spreading: Spreading::Hasselmann,
    }
}

/// The eight fields of a choppy, lit, foaming sea.
const EIGHT: [(Field, Field); 4] = [
    (Field::Elevation, Field::StretchXZ),
    (Field::DisplacementX, Field::DisplacementZ),
    (Field::SlopeX, Field::SlopeZ),
    (Field::StretchXX, Field::StretchZZ),
];

fn patch(n: u32) -> Patch {
    let draw = Draw {
        period: DVec2::splat(f64::from(n)),
        size: UVec2::splat(n),
        band: (0.0, f64::INFINITY),
        seed: 1,
        patch: 0,
        loop_period: None,
    };
    let sea = WaveField::new(&[sea()], Dispersion::new(None));
    Patch::new(Lattice::new(&sea, &draw), f64::INFINITY)
}

fn transforms(bencher: Bencher, n: u32, real: usize, complex: usize) {
    let mut transform = Transform::new(UVec2::splat(n));
    let pool = one_thread();
    bencher.bench_local(|| pool.install(|| transform.alone(real, complex)));
}

#[divan::bench(args = SIZES)]
fn elevation_and_displacement_transforms_alone(bencher: Bencher, n: u32) {
    transforms(bencher, n, 1, 1);
}

#[divan::bench(args = SIZES)]
fn elevation_and_displacement_frame(bencher: Bencher, n: u32) {
    let text = format!(
        "name = 'bench'\ndomain.size = [{n}, {n}]\n\
         boundary = {{ x_min = 'periodic', x_max = 'periodic', z_min = 'periodic', z_max = 'periodic' }}\n\
         [solver]\nkind = 'ocean'\nspacing = 1.0\n\
         sea = [{{ kind = 'jonswap', wind = 12.0, fetch = 100000.0, direction = 30.0 }}]"
    );
    let scene = Scene::from_toml(&text, Path::new("bench"), Path::new("."), &[]).unwrap();
    let mut ocean = Ocean::from_scene(&scene).unwrap();
    let mut frame = Frame::new(scene.grid);
    let pool = one_thread();
    bencher.bench_local(|| {
        ocean.advance(0.04).unwrap();
        // An ocean is not shared between threads; the pool is entered inside.
        let (ocean, frame) = (&mut ocean, &mut frame);
        pool.install(move || ocean_frame(ocean, frame));
    });
}

fn ocean_frame(ocean: &mut Ocean, frame: &mut Frame) {
    ocean.extract(Channels::DISPLACEMENT, frame);
    black_box(frame.elevation.as_slice());
}

#[divan::bench(args = SIZES)]
fn eight_fields_transforms_alone(bencher: Bencher, n: u32) {
    transforms(bencher, n, 0, 4);
}

#[divan::bench(args = SIZES)]
fn eight_fields(bencher: Bencher, n: u32) {
    let patch = patch(n);
    let mut work = patch.work();
    let mut out = EIGHT.map(|_| vec![[0.0; 2]; (n * n) as usize]);
    let pool = one_thread();
    let mut time = 0.0;
    bencher.bench_local(|| {
        time += 0.04;
        pool.install(|| {
            patch.turn(time, &[Field::Elevation], &mut work);
            for (fields, out) in EIGHT.into_iter().zip(&mut out) {
                patch.two(fields, &mut work, n as usize, out, |row, out| {
                    for (out, value) in out.iter_mut().zip(row) {
                        *out = [value.re, value.im];
                    }
                });
            }
            black_box(&mut out);
        })
    });
}

#[divan::bench]
fn query_exact(bencher: Bencher) {
    let (ocean, mut k) = (small(), 0.0);
    bencher.bench_local(|| {
        k += 1.0;
        ocean.surface_at(DVec2::new(17.0 * k, 5.0 * k), k)
    });
}

#[divan::bench]
fn query_sampled(bencher: Bencher) {
    let ocean = small();
    let (snapshot, mut k) = (ocean.snapshot(3.0), 0.0);
    bencher.bench_local(|| {
        k += 1.0;
        snapshot.surface_at(DVec2::new(17.0 * k, 5.0 * k))
    });
}

fn small() -> Ocean {
    let text = "name = 'bench'\ndomain.size = [256, 256]\n\
        boundary = { x_min = 'periodic', x_max = 'periodic', z_min = 'periodic', z_max = 'periodic' }\n\
        [solver]\nkind = 'ocean'\nspacing = 1.0\nsea = [{ kind = 'jonswap', wind = 12.0, fetch = 100000.0 }]";
    Ocean::from_scene(&Scene::from_toml(text, Path::new("bench"), Path::new("."), &[]).unwrap()).unwrap()
}
