//! The scene that Stuetzle, Warner & Mayer time: five and twenty waves on a mesh of 100 by 100, 640 by 480 pixels, one
//! sample a pixel, on one and two threads: `cargo bench -p meniscus-render-cpu --bench horizon`.
//!
//! CPU seconds are of the whole process. `--write DIR` also writes the pictures.
#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    missing_docs,
    reason = "a bench prints its table"
)]

#[path = "../tests/common/mod.rs"]
mod common;

use meniscus_render_cpu::output::write_png;
use meniscus_render_cpu::tonemap::ToneMap;
use meniscus_render_cpu::{HorizonRenderer, camera};
use meniscus_sim::glam::UVec2;
use meniscus_sim::render::{Image, Renderer};
use meniscus_sim::{Frame, Scene};
use std::path::Path;
use std::time::Instant;

const SPANS: usize = 7;

/// CPU seconds of the process, or wall seconds where the system does not say.
fn cpu_seconds(started: Instant) -> f64 {
    let stat = std::fs::read_to_string("/proc/self/schedstat").ok();
    let tasks = std::fs::read_dir("/proc/self/task").ok().map(|tasks| {
        tasks
            .flatten()
            .filter_map(|task| std::fs::read_to_string(task.path().join("schedstat")).ok())
            .filter_map(|text| text.split_whitespace().next()?.parse::<u64>().ok())
            .sum::<u64>()
    });
    match (stat, tasks) {
        (Some(_), Some(nanos)) => nanos as f64 * 1e-9,
        _ => started.elapsed().as_secs_f64(),
    }
}

fn scene(waves: usize) -> (Scene, Frame) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../data/scenes/five-waves.toml");
    let scene = Scene::load(&path, &[]).unwrap();
    let frame = common::rings(&scene, waves, 4.0);
    (scene, frame)
}

fn main() {
    let options: Vec<String> = std::env::args().skip(1).collect();
    let write = options
        .iter()
        .position(|a| a == "--write")
        .and_then(|k| options.get(k + 1));
    let started = Instant::now();
    // Kept to the end: the time of threads that have ended is no longer told.
    let pools = [1, 2].map(|threads| {
        rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap()
    });
    println!("waves threads  CPU s  wall s   rays");
    for waves in [5, 20] {
        let (scene, frame) = scene(waves);
        let view = camera::view(&scene, None, UVec2::new(640, 480), 1).unwrap();
        for (threads, pool) in [1, 2].into_iter().zip(&pools) {
            let mut renderer = HorizonRenderer::default();
            let mut image = Image::default();
            let (mut cpu, mut wall, mut rays) = (f64::INFINITY, f64::INFINITY, 0);
            // The first picture also prepares the sky.
            for _ in 0..=SPANS {
                let (c, w) = (cpu_seconds(started), Instant::now());
                let report = pool
                    .install(|| renderer.render(&scene, &frame, &view, &mut image, &|_| true))
                    .unwrap();
                rays = report.rays;
                cpu = cpu.min(cpu_seconds(started) - c);
                wall = wall.min(w.elapsed().as_secs_f64());
            }
            println!("{waves:5} {threads:7} {cpu:6.3} {wall:7.3} {rays:6}");
            if let Some(dir) = write.filter(|_| threads == 1) {
                let path = Path::new(dir).join(format!("horizon_{waves}.png"));
                write_png(&path, &image, &ToneMap::new(0.0)).unwrap();
            }
        }
    }
}
