//! Single-thread rates of all casters over one surface, in one run: `cargo bench -p meniscus-render-cpu --bench caster`.
//!
//! Rays per second from the CPU time of this thread (wall time beside it), best of several spans. On a machine with
//! other work only the ratios mean something. Options: a grid size (`-- 1024`), names of casters (`-- blocks bvh`).
//!
//! With `MENISCUS_EMBREE` naming the program that `benches/embree/build` makes, Embree casts the same rays at the same
//! samples in the same run, one ray a call and eight, at triangles and at its own grids; the last lines are ratios.
#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    missing_docs,
    reason = "a bench prints its table"
)]

#[path = "../tests/caster_support/mod.rs"]
mod caster_support;

use caster_support::{Bounds, sea, workload};
use meniscus_render_cpu::caster::{Caster, Heightfield, Hit, MaxMip, Patch, Ray, TriangleBvh};
use meniscus_sim::Grid;
use std::io::Write as _;
use std::time::Instant;

const RAYS: usize = 1 << 16;
/// Rays handed over at a time, as a renderer would for a tile of a picture.
const TOGETHER: usize = 1024;
const SPANS: usize = 7;

/// Seconds that this thread has run, or the wall clock where the system does not say.
fn cpu_seconds(started: Instant) -> f64 {
    std::fs::read_to_string("/proc/thread-self/schedstat")
        .ok()
        .and_then(|text| text.split_whitespace().next()?.parse::<u64>().ok())
        .map_or_else(|| started.elapsed().as_secs_f64(), |nanos| nanos as f64 * 1e-9)
}

/// Shortest span that is timed: the system counts CPU time in steps of some milliseconds.
const SPAN: f64 = 0.1;

/// Least CPU and wall seconds a call, over several spans of calls.
fn best(mut work: impl FnMut()) -> (f64, f64) {
    let started = Instant::now();
    (0..SPANS).fold((f64::INFINITY, f64::INFINITY), |(cpu, wall), _| {
        let (c, w) = (cpu_seconds(started), Instant::now());
        let mut calls = 0.0;
        while calls == 0.0 || cpu_seconds(started) - c < SPAN {
            work();
            calls += 1.0;
        }
        (
            cpu.min((cpu_seconds(started) - c) / calls),
            wall.min(w.elapsed().as_secs_f64() / calls),
        )
    })
}

type Build = fn(&Grid<f32>) -> Box<dyn Caster>;

fn main() {
    let options: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with('-')).collect();
    let size = options.iter().find_map(|a| a.parse().ok()).unwrap_or(512_u32);
    let wanted = |name: &str| {
        let mut names = options.iter().filter(|a| a.parse::<u32>().is_err()).peekable();
        names.peek().is_none() || names.any(|n| n == name)
    };
    let casters: Vec<(&str, Build)> = vec![
        ("blocks", |g| Box::new(Heightfield::build(g).unwrap())),
        ("max-mip", |g| {
            Box::new(MaxMip::build(g, Patch::Bilinear).unwrap())
        }),
        ("bvh", |g| Box::new(TriangleBvh::build(g).unwrap())),
    ];

    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    let grid = sea(size);
    let bounds = Bounds::of(&grid);
    let reference = Heightfield::build(&grid).unwrap();
    let kinds = ["primary", "random", "grazing", "reflected"];
    let workloads: Vec<Vec<Ray>> = kinds
        .iter()
        .map(|k| workload(k, RAYS, &bounds, &reference))
        .collect();
    let shares: Vec<String> = workloads
        .iter()
        .zip(kinds)
        .map(|(rays, kind)| {
            let hits = rays
                .iter()
                .filter(|r| reference.cast(r, 0.0, f64::INFINITY).is_some())
                .count();
            format!("{kind} {:.0} %", 100.0 * hits as f64 / rays.len() as f64)
        })
        .collect();
    println!(
        "{size} x {size} samples, {RAYS} rays a kind, one thread; hits: {}",
        shares.join(", ")
    );
    println!("Mray/s by CPU time (by wall time)");
    println!(
        "{:<16}{:>16}{:>16}{:>16}{:>16}{:>12}{:>9}",
        "caster", kinds[0], kinds[1], kinds[2], kinds[3], "build ms", "MiB"
    );
    let mut blocks = Vec::new();
    for (name, build) in casters.into_iter().filter(|(name, _)| wanted(name)) {
        one.install(|| {
            let mut caster = build(&grid);
            let mut row = format!("{name:<16}");
            let mut hits: Vec<Option<Hit>> = vec![None; TOGETHER];
            for rays in &workloads {
                let (cpu, wall) = best(|| {
                    for rays in rays.chunks(TOGETHER) {
                        caster.cast_batch(rays, 1e-3, f64::INFINITY, &mut hits);
                    }
                });
                let rate = |seconds: f64| RAYS as f64 / seconds / 1e6;
                if name == "blocks" {
                    blocks.push(rate(cpu));
                }
                row += &format!("{:>16}", format!("{:.2} ({:.2})", rate(cpu), rate(wall)));
            }
            let (cpu, _) = best(|| caster.rebuild(&grid).unwrap());
            println!(
                "{row}{:>12.2}{:>9.1}",
                cpu * 1e3,
                caster.bytes() as f64 / f64::from(1 << 20)
            );
        });
    }
    match std::env::var_os("MENISCUS_EMBREE") {
        Some(program) => embree(std::path::Path::new(&program), &grid, &workloads, &blocks),
        None => println!(
            "embree          skipped: MENISCUS_EMBREE does not name the program of benches/embree/build"
        ),
    }
}

/// Hands surface and rays to the program that times Embree, and prints what it says and the ratios to it.
fn embree(program: &std::path::Path, grid: &Grid<f32>, workloads: &[Vec<Ray>], blocks: &[f64]) {
    let mut file = tempfile::NamedTempFile::new().unwrap();
    let spec = grid.spec();
    let mut bytes = Vec::new();
    let count = |n: usize| (n as u32).to_le_bytes();
    bytes.extend(spec.size.to_array().iter().flat_map(|n| n.to_le_bytes()));
    let places = [spec.spacing, spec.origin.x, spec.origin.y];
    bytes.extend(places.iter().chain(grid.as_slice()).flat_map(|v| v.to_le_bytes()));
    bytes.extend(count(workloads.len()));
    for rays in workloads {
        bytes.extend(count(rays.len()));
        let numbers = rays.iter().flat_map(|r| [r.origin, r.direction]);
        bytes.extend(
            numbers
                .flat_map(|v| v.as_vec3().to_array())
                .flat_map(f32::to_le_bytes),
        );
    }
    file.write_all(&bytes).unwrap();
    file.flush().unwrap();
    let output = std::process::Command::new(program).arg(file.path()).output();
    let Ok(output) = output else {
        println!("embree          skipped: {} cannot be started", program.display());
        return;
    };
    print!("{}", String::from_utf8_lossy(&output.stderr));
    for line in String::from_utf8_lossy(&output.stdout).lines() {
        let fields: Vec<&str> = line.split('\t').collect();
        let [name, build, rates @ ..] = fields.as_slice() else {
            continue;
        };
        let rates: Vec<f64> = rates.iter().filter_map(|r| r.parse().ok()).collect();
        let mut row = format!("{name:<20}");
        for rate in &rates {
            row += &format!("{rate:>14.2}  ");
        }
        println!("{row}{build:>8}");
        let ratios = blocks.iter().zip(&rates).map(|(ours, theirs)| ours / theirs);
        let ratios: Vec<String> = ratios.map(|r| format!("{r:>14.2}  ")).collect();
        println!("{:<20}{}", "  blocks over it", ratios.concat());
    }
}
