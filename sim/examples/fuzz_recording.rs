//! Mutational fuzzer of the recording reader:
//!
//!     cargo run --release -p meniscus-sim --example fuzz_recording -- [SECONDS] [SEED]
//!
//! Every execution changes a small recording (bytes, lengths, cuts, splices, chunks in another order), in most cases
//! repairs the checksums so that the change gets past them, and reads everything that can be read. It counts as a
//! failure if that panics, allocates past the limit, or hands out a frame that was not recorded (where checksums were
//! not repaired) or that no frame may be (where they were). The same seed makes the same executions.

#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    clippy::print_stderr,
    reason = "a tool that reports to a person"
)]

#[path = "../tests/recording_common/counting.rs"]
mod counting;
#[path = "../tests/recording_common/file.rs"]
mod file;
#[path = "../tests/recording_common/mod.rs"]
mod recording_common;

use file::{CHUNK_HEADER, TRAILER, chunks, crc32, reseal, reseal_header, u32_at};
use meniscus_sim::glam::UVec2;
use meniscus_sim::recording::{Reader, RecordingError, Writer};
use meniscus_sim::rng::Rng;
use meniscus_sim::{Channels, Frame};
use recording_common::{bare_scene, bits, frame, report, scene};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::process::ExitCode;
use std::time::{Duration, Instant};

#[global_allocator]
static ALLOCATOR: counting::Counting = counting::Counting;

/// Limit given to the reader.
const LIMIT: u64 = 8 << 20;
/// What may be held at most: header's arrays and a frame up to the limit each, and work space of pco, serde and TOML.
const ALLOWED: usize = 2 * LIMIT as usize + (8 << 20);

/// A recording to start from.
struct Seed {
    bytes: Vec<u8>,
    frames: Vec<Vec<u32>>,
}

fn main() -> ExitCode {
    let mut arguments = std::env::args().skip(1);
    let seconds = arguments.next().map_or(Ok(10), |a| a.parse::<u64>());
    let seed = arguments.next().map_or(Ok(1), |a| a.parse::<u64>());
    let (Ok(seconds), Ok(seed)) = (seconds, seed) else {
        eprintln!("usage: fuzz_recording [SECONDS] [SEED]");
        return ExitCode::from(2);
    };
    // In memory where there is such a place: the files are written and forgotten.
    let memory = Path::new("/dev/shm");
    let folder = if memory.is_dir() {
        tempfile::tempdir_in(memory).unwrap()
    } else {
        tempfile::tempdir().unwrap()
    };
    let path = folder.path().join("fuzz.mrec");
    let seeds = seeds(&path);
    std::panic::set_hook(Box::new(|_| {}));
    let mut tally = Tally::default();
    let end = Instant::now() + Duration::from_secs(seconds);
    while Instant::now() < end {
        let mut rng = Rng::new(seed, tally.executions);
        let (bytes, origin) = mutate(&mut rng, &seeds);
        std::fs::write(&path, &bytes).unwrap();
        let held = counting::reset_peak();
        let outcome = catch_unwind(AssertUnwindSafe(|| execute(&path, origin.map(|n| &seeds[n]))));
        let peak = counting::peak() - held;
        tally.peak = tally.peak.max(peak);
        let failure = match outcome {
            Err(panic) => {
                let text = panic.downcast_ref::<String>().map(String::as_str);
                Some(format!(
                    "panic: {}",
                    text.or(panic.downcast_ref::<&str>().copied()).unwrap_or("?")
                ))
            }
            Ok(Err(failure)) => Some(failure),
            Ok(Ok(_)) if peak > ALLOWED => Some(format!("{peak} bytes allocated")),
            Ok(Ok(done)) => {
                tally.opened += u64::from(done.opened);
                tally.frames += done.frames;
                tally.refused += done.refused;
                None
            }
        };
        if let Some(failure) = failure {
            tally.failures += 1;
            eprintln!("seed {seed}, execution {}: {failure}", tally.executions);
            let kept = std::env::temp_dir().join(format!("fuzz-recording-{seed}-{}.mrec", tally.executions));
            if std::fs::write(&kept, &bytes).is_ok() {
                eprintln!("  kept as {}", kept.display());
            }
        }
        tally.executions += 1;
    }
    println!(
        "{} executions in {seconds} s (seed {seed}): {} opened, {} frames read, {} frames refused, \
         at most {} KiB held, {} failures",
        tally.executions,
        tally.opened,
        tally.frames,
        tally.refused,
        tally.peak / 1024,
        tally.failures
    );
    if tally.failures == 0 {
        ExitCode::SUCCESS
    } else {
        ExitCode::FAILURE
    }
}

#[derive(Default)]
struct Tally {
    executions: u64,
    failures: u64,
    opened: u64,
    frames: u64,
    refused: u64,
    peak: usize,
}

#[derive(Default)]
struct Done {
    opened: bool,
    frames: u64,
    refused: u64,
}

/// Recordings of several kinds.
fn seeds(path: &Path) -> Vec<Seed> {
    let mut seeds = Vec::new();
    let kinds = [
        (UVec2::new(48, 45), Channels::ALL, 0.0, true),
        (UVec2::new(48, 45), Channels::ALL, 1e-4, false),
        (UVec2::new(13, 9), Channels::DEPTH | Channels::DROPLETS, 0.0, true),
        (UVec2::new(9, 7), Channels::BODIES, 1e-3, true),
        (UVec2::new(300, 120), Channels::NONE, 1e-4, true),
    ];
    for (n, (size, channels, tolerance, finished)) in kinds.into_iter().enumerate() {
        let scene = if n % 2 == 0 {
            scene(size, tolerance)
        } else {
            bare_scene(size, tolerance)
        };
        let mut writer = Writer::create(path, &scene, channels).unwrap();
        for k in 0..4 {
            writer
                .push(&frame(scene.grid, channels, k), (k != 2).then(|| report(k)))
                .unwrap();
        }
        if finished {
            writer.finish().unwrap();
        } else {
            drop(writer);
        }
        let mut reader = Reader::open(path).unwrap();
        let mut out = Frame::new(scene.grid);
        let frames = (0..4)
            .map(|k| {
                reader.read(k, &mut out).unwrap();
                bits(&out)
            })
            .collect();
        seeds.push(Seed {
            bytes: std::fs::read(path).unwrap(),
            frames,
        });
    }
    seeds
}

/// Reads everything that can be read. `origin` is the recording that the file was made from, if its checksums were
/// left as they were.
fn execute(path: &Path, origin: Option<&Seed>) -> Result<Done, String> {
    let mut done = Done::default();
    let Ok(mut reader) = Reader::open_with_limit(path, LIMIT) else {
        return Ok(done);
    };
    done.opened = true;
    let spec = reader.scene().grid;
    let mut out = Frame::new(meniscus_sim::GridSpec {
        size: UVec2::ONE,
        ..spec
    });
    for k in 0..reader.len() {
        match reader.read(k, &mut out) {
            Ok(_) => {
                done.frames += 1;
                if out.check_finite().is_err() || *out.spec() != spec || out.channels() != reader.channels() {
                    return Err(format!("frame {k} is no frame of its recording"));
                }
                if origin.is_some_and(|o| o.frames.get(k) != Some(&bits(&out))) {
                    return Err(format!("frame {k} was never recorded"));
                }
            }
            Err(RecordingError::DamagedFrame { .. } | RecordingError::TooLarge { .. }) => done.refused += 1,
            Err(other) => return Err(format!("frame {k}: {other}")),
        }
    }
    reader.statistics().map_err(|e| e.to_string())?;
    Ok(done)
}

fn pick(rng: &mut Rng, below: usize) -> usize {
    (rng.next_u64() % below.max(1) as u64) as usize
}

/// A changed recording, and which it was made from if its checksums were not repaired.
fn mutate(rng: &mut Rng, seeds: &[Seed]) -> (Vec<u8>, Option<usize>) {
    let origin = pick(rng, seeds.len());
    let mut bytes = seeds[origin].bytes.clone();
    let repair = rng.uniform() < 0.7;
    if repair {
        let list = chunks(&bytes);
        for _ in 0..1 + pick(rng, 3) {
            let chunk = list[pick(rng, list.len())];
            change_chunk(rng, &mut bytes, chunk);
        }
        repair_all(&mut bytes, &list);
    }
    if !repair || rng.uniform() < 0.2 {
        for _ in 0..1 + pick(rng, 3) {
            change_file(rng, &mut bytes, seeds);
        }
    }
    (bytes, (!repair).then_some(origin))
}

/// Changes a few bytes of one chunk, mostly in its structure, where lengths and counts are.
fn change_chunk(rng: &mut Rng, bytes: &mut [u8], (start, end): (usize, usize)) {
    let payload = start + CHUNK_HEADER;
    let structure = if &bytes[start + 8..start + 12] == b"INDX" {
        end - payload
    } else {
        (4 + u32_at(bytes, payload) as usize).min(end - payload)
    };
    let place = rng.uniform();
    let at = if place < 0.6 {
        payload + pick(rng, structure)
    } else if place < 0.9 {
        payload + pick(rng, end - payload)
    } else {
        // Kind, recording, sequence, time, length.
        start + 8 + pick(rng, 32)
    };
    let width = [1, 1, 2, 4, 8][pick(rng, 5)].min(end - at);
    let old = u32_at(&[&bytes[at..(at + 4).min(end)], &[0; 4]].concat(), 0);
    let value: u64 = match pick(rng, 6) {
        0 => rng.next_u64(),
        1 => u64::MAX >> pick(rng, 64),
        2 => 1 << pick(rng, 64),
        3 => u64::from(old.wrapping_add(1)),
        4 => u64::from(old.wrapping_sub(1)),
        _ => 0,
    };
    bytes[at..at + width].copy_from_slice(&value.to_le_bytes()[..width]);
}

/// Makes every checksum right again. Lengths that were changed stay so.
fn repair_all(bytes: &mut [u8], list: &[(usize, usize)]) {
    let mut recording = None;
    for &(start, end) in list {
        let length = bytes[start + 32..start + 40].to_vec();
        reseal(bytes, start, end);
        bytes[start + 32..start + 40].copy_from_slice(&length);
        let recording = *recording.get_or_insert_with(|| u32_at(bytes, start + 12));
        bytes[start + 12..start + 16].copy_from_slice(&recording.to_le_bytes());
        reseal_header(bytes, start);
    }
    let end = list.last().map_or(0, |c| c.1);
    if let (Some(recording), true) = (recording, bytes.len() == end + TRAILER) {
        bytes[end + 8..end + 12].copy_from_slice(&recording.to_le_bytes());
        let crc = crc32(&bytes[end..end + 12]);
        bytes[end + 12..end + 16].copy_from_slice(&crc.to_le_bytes());
    }
}

/// Changes a file without regard to what is in it.
fn change_file(rng: &mut Rng, bytes: &mut Vec<u8>, seeds: &[Seed]) {
    if bytes.is_empty() {
        return;
    }
    let at = pick(rng, bytes.len());
    let list = chunks(bytes);
    match pick(rng, 8) {
        0 => bytes.truncate(at),
        1 => bytes[at] ^= 1 << pick(rng, 8),
        2 => bytes[at] = rng.next_u64() as u8,
        3 => {
            let end = (at + pick(rng, 400)).min(bytes.len());
            bytes.drain(at..end);
        }
        4 => {
            let other = &seeds[pick(rng, seeds.len())].bytes;
            let from = pick(rng, other.len());
            let to = (from + pick(rng, 3000)).min(other.len());
            bytes.splice(at..at, other[from..to].iter().copied());
        }
        5 => {
            let end = (at + pick(rng, 3000)).min(bytes.len());
            bytes[at..end].fill(0);
        }
        6 if !list.is_empty() => {
            // A chunk again at its end, or somewhere else.
            let (start, end) = list[pick(rng, list.len())];
            let chunk = bytes[start..end].to_vec();
            let to = if rng.uniform() < 0.5 { end } else { at };
            bytes.splice(to..to, chunk);
        }
        7 if list.len() > 1 => {
            let (a, b) = (pick(rng, list.len()), pick(rng, list.len()));
            let ((a0, a1), (b0, b1)) = (list[a.min(b)], list[a.max(b)]);
            if a != b {
                let swapped = [
                    &bytes[..a0],
                    &bytes[b0..b1],
                    &bytes[a1..b0],
                    &bytes[a0..a1],
                    &bytes[b1..],
                ]
                .concat();
                *bytes = swapped;
            }
        }
        _ => bytes.extend(std::iter::repeat_with(|| rng.next_u64() as u8).take(100)),
    }
}
