//! Size and speed of recordings: `cargo bench -p meniscus-sim --bench recording`.
//!
//! Prints the stored share of raw bytes for several surfaces and tolerances, beside that of pco alone, then times
//! encoding, decoding and seeking. Throughput is in raw bytes.

#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "a benchmark reports to a person"
)]

#[path = "../tests/recording_common/mod.rs"]
mod recording_common;

use divan::Bencher;
use divan::counter::BytesCount;
use meniscus_sim::glam::UVec2;
use meniscus_sim::recording::{Reader, Writer};
use meniscus_sim::{Channels, Frame, Grid};
use recording_common::{Sea, bare_scene};
use std::path::{Path, PathBuf};
use std::sync::LazyLock;

const SIZE: UVec2 = UVec2::new(512, 512);
const FRAMES: usize = 8;
const RAW: u64 = 4 * 512 * 512;
const TOLERANCES: [f32; 4] = [0.0, 1e-5, 1e-4, 1e-3];

fn main() {
    ratios();
    per_core();
    divan::main();
}

/// Frames of a sea, a thirtieth of a second apart.
fn frames(sea: &Sea) -> Vec<Frame> {
    let spec = bare_scene(SIZE, 0.0).grid;
    (0..FRAMES)
        .map(|k| {
            let mut frame = Frame::new(spec);
            (frame.time, frame.index) = (k as f64 / 30.0, k as u64);
            frame.elevation = sea.elevation(spec, frame.time);
            frame
        })
        .collect()
}

static LIVELY: LazyLock<Vec<Frame>> = LazyLock::new(|| frames(&Sea::lively()));
static FOLDER: LazyLock<tempfile::TempDir> = LazyLock::new(|| tempfile::tempdir().unwrap());

fn record(path: &Path, frames: &[Frame], tolerance: f32) {
    let mut writer = Writer::create(path, &bare_scene(SIZE, tolerance), Channels::NONE).unwrap();
    for frame in frames {
        writer.push(frame, None).unwrap();
    }
    writer.finish().unwrap();
}

/// A recording of the lively sea.
fn recorded(tolerance: f32) -> PathBuf {
    let path = FOLDER.path().join(format!("{tolerance:e}.mrec"));
    if !path.exists() {
        record(&path, &LIVELY, tolerance);
    }
    path
}

fn ratios() {
    let noise = {
        let mut rng = meniscus_sim::rng::Rng::new(1, 2);
        let spec = bare_scene(SIZE, 0.0).grid;
        let mut frame = Frame::new(spec);
        frame.elevation = Grid::from_fn(spec, |_, _| rng.normal() as f32);
        vec![frame]
    };
    let seas = [
        ("lively sea, waves 4-60 m", LIVELY.clone()),
        (
            "swell, waves 8-100 m",
            frames(&Sea::new(7, 300, [8.0, 100.0], 1.0, 2.0)),
        ),
        (
            "choppy, waves 2-60 m",
            frames(&Sea::new(7, 300, [2.0, 60.0], 1.0, 1.0)),
        ),
        ("white noise", noise),
    ];
    println!("stored share of raw elevation, 512 x 512 samples 0.5 m apart; in brackets pco level 4 alone");
    print!("{:28}", "tolerance, m");
    TOLERANCES.iter().for_each(|t| print!("{t:>18}"));
    println!();
    for (name, frames) in &seas {
        print!("{name:28}");
        for tolerance in TOLERANCES {
            let path = FOLDER.path().join("ratio.mrec");
            record(&path, frames, tolerance);
            let statistics = Reader::open(&path).unwrap().statistics().unwrap();
            let share = statistics.stored_bytes() as f64 / statistics.raw_bytes() as f64;
            let alone = pco_alone(&frames[0], tolerance);
            print!("{:>18}", format!("{share:.3} ({alone:.3})"));
        }
        println!();
    }
    println!();
}

fn pco_alone(frame: &Frame, tolerance: f32) -> f64 {
    let config = pco::ChunkConfig::default().with_compression_level(4);
    let values = frame.elevation.as_slice();
    let bytes = if tolerance > 0.0 {
        let step = 2.0 * f64::from(tolerance);
        let quantised: Vec<i32> = values
            .iter()
            .map(|&v| (f64::from(v) / step).round() as i32)
            .collect();
        pco::standalone::simple_compress(&quantised, &config)
    } else {
        pco::standalone::simple_compress(values, &config)
    };
    bytes.unwrap().len() as f64 / RAW as f64
}

/// Seconds that this process's threads have run, where the system tells (Linux).
fn cpu_seconds() -> Option<f64> {
    let mut nanoseconds = 0.0;
    for thread in std::fs::read_dir("/proc/self/task").ok()? {
        let text = std::fs::read_to_string(thread.ok()?.path().join("schedstat")).ok()?;
        nanoseconds += text.split_whitespace().next()?.parse::<f64>().ok()?;
    }
    Some(1e-9 * nanoseconds)
}

/// Throughput by processor time rather than by the clock, which depends on what else the machine does.
fn per_core() {
    if cpu_seconds().is_none() {
        return;
    }
    println!(
        "raw MB a second of processor time (best of 5), lively sea, copying, checks and system calls included"
    );
    for tolerance in TOLERANCES {
        let path = FOLDER.path().join("cpu.mrec");
        let repeats = 8;
        let megabytes = 1e-6 * (RAW * (FRAMES * repeats) as u64) as f64;
        let rate = |work: &mut dyn FnMut()| {
            let seconds = (0..5).filter_map(|_| {
                let start = cpu_seconds()?;
                (0..repeats).for_each(|_| work());
                Some(cpu_seconds()? - start)
            });
            megabytes / seconds.fold(f64::INFINITY, f64::min)
        };
        let scene = bare_scene(SIZE, tolerance);
        let mut writer = in_pool(1, || Writer::create(&path, &scene, Channels::NONE).unwrap());
        let mut time = 0.0;
        let encode = rate(&mut || {
            for frame in LIVELY.iter() {
                let mut frame = frame.clone();
                (frame.time, time) = (time, time + 1.0);
                writer.push(&frame, None).unwrap();
            }
            writer.flush().unwrap();
        });
        drop(writer);
        let mut reader = Reader::open(recorded(tolerance)).unwrap();
        let mut frame = Frame::new(scene.grid);
        let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
        let decode = rate(&mut || {
            for k in 0..FRAMES {
                pool.install(|| reader.read(k, &mut frame)).unwrap();
            }
        });
        println!("  tolerance {tolerance:>7}: encode {encode:4.0}, decode {decode:4.0}");
    }
    println!();
}

fn in_pool<T: Send>(threads: usize, f: impl FnOnce() -> T + Send) -> T {
    rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .unwrap()
        .install(f)
}

fn encode(bencher: Bencher, threads: usize, tolerance: f32) {
    LazyLock::force(&LIVELY);
    let path = FOLDER.path().join("encode.mrec");
    // The writer makes a pool as large as the one it is created in.
    let create = || Writer::create(&path, &bare_scene(SIZE, tolerance), Channels::NONE).unwrap();
    bencher
        .counter(BytesCount::new(RAW * FRAMES as u64))
        .with_inputs(|| in_pool(threads, create))
        .bench_local_values(|mut writer| {
            for frame in LIVELY.iter() {
                writer.push(frame, None).unwrap();
            }
            writer.flush().unwrap();
            writer
        });
}

#[divan::bench(args = TOLERANCES, sample_count = 10, sample_size = 1)]
fn encode_one_thread(bencher: Bencher, tolerance: f32) {
    encode(bencher, 1, tolerance);
}

#[divan::bench(args = TOLERANCES, sample_count = 10, sample_size = 1)]
fn encode_two_threads(bencher: Bencher, tolerance: f32) {
    encode(bencher, 2, tolerance);
}

fn decode(bencher: Bencher, threads: usize, tolerance: f32, which: &[usize]) {
    let mut reader = Reader::open(recorded(tolerance)).unwrap();
    let mut frame = Frame::new(reader.scene().grid);
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .unwrap();
    bencher
        .counter(BytesCount::new(RAW * which.len() as u64))
        .bench_local(|| {
            for &k in which {
                pool.install(|| reader.read(k, &mut frame)).unwrap();
            }
        });
}

#[divan::bench(args = TOLERANCES, sample_count = 20, sample_size = 1)]
fn decode_one_thread(bencher: Bencher, tolerance: f32) {
    decode(bencher, 1, tolerance, &[0, 1, 2, 3, 4, 5, 6, 7]);
}

#[divan::bench(args = TOLERANCES, sample_count = 20, sample_size = 1)]
fn decode_two_threads(bencher: Bencher, tolerance: f32) {
    decode(bencher, 2, tolerance, &[0, 1, 2, 3, 4, 5, 6, 7]);
}

/// A frame in the middle, the first, the last: seeking costs as much a frame as reading on.
#[divan::bench(args = TOLERANCES, sample_count = 20, sample_size = 1)]
fn seek_one_thread(bencher: Bencher, tolerance: f32) {
    decode(bencher, 1, tolerance, &[4, 0, 7]);
}

/// Opening reads the header and the index, however many frames there are.
#[divan::bench(sample_count = 20, sample_size = 1)]
fn open() -> Reader {
    Reader::open(recorded(0.0)).unwrap()
}
