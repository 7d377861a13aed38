//! A mutational fuzzer for the scene parser and for the readers of the files that scenes name.
//!
//! Texts are mutated from `data/scenes`, with a dictionary of keys and values; models, terrain, skies and arrays are
//! mutated from `data`. No input may panic; what is accepted must round-trip; what is refused must say what would be
//! right. Run it with `cargo run --release -p meniscus-sim --example fuzz_scene -- SECONDS [SEED]`.

#![allow(clippy::print_stdout)]

use meniscus_sim::rng::Rng;
use meniscus_sim::scene::description::{Description, Terrain};
use meniscus_sim::scene::{Panorama, SceneError};
use meniscus_sim::{Scene, mesh, npy, terrain};
use std::error::Error;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

const DATA: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../data");

/// What scene files are made of, and what breaks parsers.
const WORDS: &[&str] = &[
    "name",
    "seed",
    "duration",
    "[domain]",
    "origin",
    "size",
    "[water]",
    "level",
    "initial",
    "index",
    "absorption",
    "[terrain]",
    "kind",
    "file",
    "pixel_size",
    "scale",
    "offset",
    "crop",
    "map_origin",
    "nodata_height",
    "[solver]",
    "spacing",
    "scheme",
    "speed",
    "depth",
    "damping",
    "step",
    "[[solver.wave]]",
    "amplitude",
    "wavelength",
    "steepness",
    "[boundary]",
    "x_min",
    "z_max",
    "[[object]]",
    "shape",
    "motion",
    "points",
    "rotation",
    "color",
    "[light]",
    "sun",
    "sky",
    "[[camera]]",
    "position",
    "target",
    "fov",
    "[[event]]",
    "time",
    "radius",
    "volume",
    "rate",
    "start",
    "end",
    "[recording]",
    "channels",
    "tolerance",
    "\"flat\"",
    "\"image\"",
    "\"npy\"",
    "\"ascii-grid\"",
    "\"soundings\"",
    "\"wave-equation\"",
    "\"procedural\"",
    "\"shallow-water\"",
    "\"periodic\"",
    "\"dam\"",
    "\"array\"",
    "\"path\"",
    "\"model\"",
    "\"daylight\"",
    "\"rain\"",
    "\"sweep\"",
    "\"2 cm\"",
    "\"1.5 min\"",
    "\"30 deg\"",
    "\"2 kg\"",
    "nan",
    "-inf",
    "1e308",
    "-0.0",
    "1e-320",
    "9223372036854775807",
    "18446744073709551615",
    "0x7f",
    "true",
    "[]",
    "{}",
    "[[",
    "]]",
    "{ kind = ",
    " = ",
    "\n",
    "\"",
    "'",
    "\"\"\"",
    "\\u0000",
    "#",
    ".",
    ",",
    "\r\n",
    "1979-05-27T07:32:00Z",
    "[0.0, 0.0, 0.0, 1.0]",
    "{ axis = [0, 1, 0], angle = 30 }",
];

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let seconds: f64 = arguments.next().ok_or("how many seconds?")?.parse()?;
    let seed: u64 = arguments.next().map_or(Ok(1), |s| s.parse())?;
    let mut rng = Rng::new(seed, 0);
    let corpus = corpus()?;
    let files = Files::new()?;
    let mut counts = Counts::default();
    let end = Instant::now() + Duration::from_secs_f64(seconds);
    while Instant::now() < end {
        for _ in 0..200 {
            let mut text = corpus[below(&mut rng, corpus.len())].clone();
            mutate(&mut text, &corpus, &mut rng);
            let overrides = overrides(&mut rng);
            counts.run("scene", &text, || scene(&text, files.dir.path(), &overrides));
        }
        let (name, bytes) = files.mutated(&mut rng);
        counts.run(name, &bytes, || files.read(name, &bytes));
    }
    println!(
        "{} executions (seed {seed}): {} accepted, {} refused, {} failures",
        counts.executions, counts.accepted, counts.refused, counts.failures
    );
    if counts.failures > 0 {
        Err("some inputs failed".into())
    } else {
        Ok(())
    }
}

#[derive(Default)]
struct Counts {
    executions: u64,
    accepted: u64,
    refused: u64,
    failures: u64,
}

impl Counts {
    /// Runs one input; `Ok(true)` is accepted, `Ok(false)` refused, an error or a panic a failure.
    fn run(&mut self, what: &str, input: &[u8], execute: impl FnOnce() -> Result<bool, String>) {
        self.executions += 1;
        let outcome = catch_unwind(AssertUnwindSafe(execute)).unwrap_or_else(|_| Err("it panicked".into()));
        match outcome {
            Ok(true) => self.accepted += 1,
            Ok(false) => self.refused += 1,
            Err(reason) => {
                self.failures += 1;
                let file = std::env::temp_dir().join(format!("fuzz-{what}-{}", self.executions));
                let kept = std::fs::write(&file, input).is_ok();
                println!(
                    "{what}: {reason} ({})",
                    if kept {
                        file.display().to_string()
                    } else {
                        "not kept".into()
                    }
                );
            }
        }
    }
}

fn corpus() -> Result<Vec<Vec<u8>>, Box<dyn Error>> {
    let mut paths: Vec<PathBuf> = std::fs::read_dir(Path::new(DATA).join("scenes"))?
        .map(|entry| entry.map(|e| e.path()))
        .collect::<Result<_, _>>()?;
    paths.sort();
    Ok(paths.iter().map(std::fs::read).collect::<Result<_, _>>()?)
}

fn below(rng: &mut Rng, end: usize) -> usize {
    (rng.next_u64() % end.max(1) as u64) as usize
}

/// Changes bytes, words and lines, and splices other inputs in.
fn mutate(input: &mut Vec<u8>, corpus: &[Vec<u8>], rng: &mut Rng) {
    for _ in 0..1 + below(rng, 6) {
        let at = below(rng, input.len() + 1);
        let end = (at + below(rng, 24)).min(input.len());
        let word = WORDS[below(rng, WORDS.len())].as_bytes();
        match below(rng, 9) {
            0 if at < input.len() => input[at] = rng.next_u64() as u8,
            1 if at < input.len() => input[at] ^= 1 << below(rng, 8),
            2 => drop(input.drain(at..end)),
            3 => drop(input.splice(at..at, word.iter().copied())),
            4 => drop(input.splice(at..end, word.iter().copied())),
            5 => replace_word(input, at, word),
            6 => {
                let other = &corpus[below(rng, corpus.len())];
                let from = below(rng, other.len());
                let to = (from + below(rng, 200)).min(other.len());
                drop(input.splice(at..at, other[from..to].iter().copied()));
            }
            7 => move_line(input, at, rng),
            _ => input.truncate(input.len().max(1) - below(rng, input.len() / 8 + 1)),
        }
    }
}

/// Replaces the value or key around a position.
fn replace_word(input: &mut Vec<u8>, at: usize, word: &[u8]) {
    let is_word = |b: &u8| b.is_ascii_alphanumeric() || b"_.-\"".contains(b);
    let start = input[..at].iter().rposition(|b| !is_word(b)).map_or(0, |k| k + 1);
    let end = input[at..]
        .iter()
        .position(|b| !is_word(b))
        .map_or(input.len(), |k| at + k);
    drop(input.splice(start..end, word.iter().copied()));
}

fn move_line(input: &mut Vec<u8>, at: usize, rng: &mut Rng) {
    let start = input[..at].iter().rposition(|&b| b == b'\n').map_or(0, |k| k + 1);
    let end = input[at..]
        .iter()
        .position(|&b| b == b'\n')
        .map_or(input.len(), |k| at + k + 1);
    let line: Vec<u8> = input.drain(start..end).collect();
    let to = below(rng, input.len() + 1);
    drop(input.splice(to..to, line));
}

fn overrides(rng: &mut Rng) -> Vec<String> {
    let mut list = Vec::new();
    while below(rng, 4) == 0 {
        let mut word = || WORDS[below(rng, WORDS.len())].trim_matches(['[', ']', '"']);
        list.push(format!("{}.{}={}", word(), word(), word()));
    }
    list
}

fn scene(text: &[u8], base: &Path, overrides: &[String]) -> Result<bool, String> {
    // What is no text is refused before the parser; here the rest of it is of interest.
    let text = String::from_utf8_lossy(text);
    match Scene::from_toml(&text, Path::new("scene.toml"), base, overrides) {
        Ok(scene) => {
            let canonical = scene.description.to_toml();
            let again = Description::from_toml(&canonical, Path::new("again.toml"), &[])
                .map_err(|e| e.to_string())?;
            if again != scene.description {
                return Err("the description does not round-trip".into());
            }
            let parts = Scene::from_parts(
                scene.description.clone(),
                scene.terrain.clone(),
                scene.meshes.clone(),
                scene.sky.clone(),
                scene.initial_elevation.clone(),
            );
            match parts {
                Ok(parts) if parts == scene => Ok(true),
                Ok(_) => Err("the scene differs from its parts".into()),
                Err(e) => Err(format!("its parts are refused: {e}")),
            }
        }
        Err(error) => refusal(&error, text.lines().count()),
    }
}

/// A refusal must say what is wrong, where, and what would be right.
fn refusal(error: &SceneError, lines: usize) -> Result<bool, String> {
    if error.problems.is_empty() {
        return Err("refused without a problem".into());
    }
    for p in &error.problems {
        if p.message.is_empty() || p.remedy.is_empty() {
            return Err(format!("no message or remedy: {p:?}"));
        }
        let in_scene = p.file == Path::new("scene.toml");
        if in_scene && p.line.is_some_and(|line| line == 0 || line as usize > lines + 1) {
            return Err(format!("no such line: {p:?}"));
        }
    }
    Ok(false)
}

/// Small and large files to mutate, and a folder to put them in.
struct Files {
    dir: tempfile::TempDir,
    samples: Vec<(&'static str, Vec<u8>)>,
}

const GRID: &str = "ncols 4\nnrows 3\nxllcorner 500000\nyllcorner 4000000\ncellsize 10\nNODATA_value -9999\n\
    1 2 3 4\n5 6 7 8\n9 10 -9999 12\n";

impl Files {
    fn new() -> Result<Self, Box<dyn Error>> {
        let read = |name: &str| std::fs::read(Path::new(DATA).join(name));
        let mut array = Vec::new();
        npy::write(&mut array, &[3, 4], &[0.5_f32; 12])?;
        let soundings: String = (0..40).map(|k| format!("{} {} {}\n", k % 7, k / 7, -k)).collect();
        let samples = vec![
            ("model.glb", read("models/bunny.glb")?),
            ("terrain.png", read("terrain/jacksboro.png")?),
            ("sky.exr", read("sky/sky.exr")?),
            ("array.npy", array),
            ("grid.asc", GRID.into()),
            ("soundings.xyz", soundings.into()),
        ];
        Ok(Self {
            dir: tempfile::tempdir()?,
            samples,
        })
    }

    fn mutated(&self, rng: &mut Rng) -> (&'static str, Vec<u8>) {
        let (name, bytes) = &self.samples[below(rng, self.samples.len())];
        let mut bytes = bytes.clone();
        // Headers and the JSON of models stand in the first bytes; most of the rest is data that may be anything.
        let reach = if below(rng, 2) == 0 {
            bytes.len().min(2000)
        } else {
            bytes.len()
        };
        for _ in 0..1 + below(rng, 8) {
            let at = below(rng, reach.min(bytes.len()));
            match below(rng, 4) {
                0 => bytes[at] = rng.next_u64() as u8,
                1 => bytes[at] ^= 1 << below(rng, 8),
                2 => {
                    let digit = bytes
                        .iter()
                        .skip(at)
                        .position(u8::is_ascii_digit)
                        .map_or(at, |k| at + k);
                    bytes[digit] = b'0' + below(rng, 10) as u8;
                }
                _ if below(rng, 20) == 0 => bytes.truncate(at.max(1)),
                _ => bytes[at] = [0, 0x7f, 0x80, 0xff][below(rng, 4)],
            }
        }
        (name, bytes)
    }

    fn read(&self, name: &str, bytes: &[u8]) -> Result<bool, String> {
        let path = self.dir.path().join(name);
        std::fs::write(&path, bytes).map_err(|e| e.to_string())?;
        let file = PathBuf::from(name);
        let ground = |t: Terrain| match terrain::load(&t, self.dir.path()) {
            Ok(Some(grid)) if grid.find_non_finite().is_none() => Ok(true),
            Ok(_) => Err("ground that is not finite".to_string()),
            Err(_) => Ok(false),
        };
        let (scale, offset, map_origin) = (1.0, 0.0, None);
        let pixel_size = meniscus_sim::glam::Vec2::new(74.5, 92.6);
        match name {
            "model.glb" => match mesh::load_gltf(&path, 1.0) {
                Ok(mesh) => mesh.validate().map(|()| true).map_err(|e| e.to_string()),
                Err(_) => Ok(false),
            },
            "terrain.png" => ground(Terrain::Image {
                file,
                pixel_size,
                scale,
                offset,
                crop: None,
                origin: Default::default(),
            }),
            "array.npy" => ground(Terrain::Npy {
                file,
                pixel_size,
                scale,
                offset,
                origin: Default::default(),
            }),
            "grid.asc" => ground(Terrain::AsciiGrid {
                file,
                scale,
                offset,
                nodata_height: Some(0.0),
                map_origin,
            }),
            "soundings.xyz" => ground(Terrain::Soundings {
                file,
                coordinates: Default::default(),
                spacing: 0.3,
                scale,
                offset,
                map_origin,
            }),
            _ => match Panorama::load(&path, Default::default()) {
                Ok(sky) if sky.pixels.iter().all(|p| p.is_finite() && p.min_element() >= 0.0) => Ok(true),
                Ok(_) => Err("a sky that is no light".into()),
                Err(_) => Ok(false),
            },
        }
    }
}
