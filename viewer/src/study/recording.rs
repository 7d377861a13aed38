//! Study `recording`: size and speed of recordings against their error.

use super::case::{Against, Case, Curves, Outcome, Run, Study};
use super::measure::Probe;
use super::scenes::{Edges, scene};
use anyhow::Context as _;
use meniscus_sim::events::Action;
use meniscus_sim::glam::{UVec2, Vec2};
use meniscus_sim::recording::{Reader, Writer};
use meniscus_sim::rng::Rng;
use meniscus_sim::scene::description::{Procedural, Solver as Choice, Wave, WaveEquation, WaveScheme};
use meniscus_sim::{Channels, Frame, Grid, GridSpec, Scene, solvers};
use std::sync::Arc;

/// The study.
pub(crate) struct RecordingStudy;

/// Largest difference between a value read back and the original, metres.
const ERROR: &str = "largest error (m)";
/// Bytes of the file over bytes of the values.
const SIZE: &str = "share of the raw size";

/// Frames a recording.
const FRAMES: usize = 16;
/// Frames a second of simulated time.
const RATE: f64 = 30.0;

impl Study for RecordingStudy {
    fn name(&self) -> &'static str {
        "recording"
    }

    fn title(&self) -> &'static str {
        "Recordings: size and speed against error"
    }

    fn summary(&self) -> &'static str {
        "size of recordings and speed of writing and reading them against the largest error of a value"
    }

    fn about(&self) -> &'static str {
        "Sixteen frames of elevation are written as a recording at tolerances from lossless to a centimetre, read back, \
         and compared value by value with the originals. Writing is timed from the first frame pushed to the finished \
         file, reading from opening the file to the last frame decoded; both include checksums and the file system.\n\n\
         Beside them stand two plain ways of storing the same values: as they are, 32 bits each, and as 16-bit steps over \
         the range of each frame, both to memory only."
    }

    fn expectations(&self) -> &'static str {
        include_str!("../../../data/expectations/recording.toml")
    }

    fn cases(&self, quick: bool) -> anyhow::Result<Vec<Case>> {
        let size = if quick { 256 } else { 512 };
        let sea = frames_of_sea(size)?;
        let rain = frames_of_rain(size)?;
        Ok(vec![
            case(
                "lively sea",
                format!(
                    "{FRAMES} frames of {size}² samples, 0.5 m apart, of 64 procedural waves of 4 to 60 m with a \
                     significant height of 1 m, 30 frames a second; the truth is the frames themselves."
                ),
                sea,
            ),
            case(
                "rain",
                format!(
                    "{FRAMES} frames of {size}² samples of the wave equation under heavy rain: steep rings everywhere, \
                     ripples down to two samples; the truth is the frames themselves."
                ),
                rain,
            ),
        ])
    }
}

/// The frames of a case and the scene that they belong to.
struct Footage {
    scene: Scene,
    frames: Vec<Frame>,
}

impl Footage {
    fn values(&self) -> usize {
        self.frames.iter().map(|f| f.elevation.as_slice().len()).sum()
    }
}

fn footage(scene: Scene, mut act: impl FnMut(usize) -> Vec<Action>) -> anyhow::Result<Arc<Footage>> {
    let mut solver = solvers::build(&scene)?;
    // Past the start, so that the surface is as lively as it gets.
    solver.advance(1.0)?;
    let mut frames = Vec::new();
    for k in 0..FRAMES {
        for action in act(k) {
            solver.apply(&action)?;
        }
        solver.advance((1.0 / RATE) as f32)?;
        let mut frame = Frame::new(scene.grid);
        solver.extract(Channels::NONE, &mut frame);
        frame.index = k as u64;
        frames.push(frame);
    }
    Ok(Arc::new(Footage { scene, frames }))
}

/// The sea that the bars on size are stated for: waves of 4 to 60 m on samples 0.5 m apart, significant height 1 m.
fn frames_of_sea(size: u32) -> anyhow::Result<Arc<Footage>> {
    const COUNT: u16 = 64;
    let grid = GridSpec::new(Vec2::ZERO, 0.5, UVec2::splat(size))?;
    let mut rng = Rng::new(11, 0);
    let mut waves: Vec<Wave> = (0..COUNT)
        .map(|n| {
            let wavelength = 60.0 * (4.0_f32 / 60.0).powf(f32::from(n) / f32::from(COUNT - 1));
            Wave {
                amplitude: wavelength.powf(1.5),
                wavelength,
                direction: 180.0 * (rng.uniform_f32() - 0.5),
                phase: 360.0 * rng.uniform_f32(),
                steepness: 0.0,
            }
        })
        .collect();
    let variance: f32 = waves.iter().map(|w| 0.5 * w.amplitude * w.amplitude).sum();
    waves
        .iter_mut()
        .for_each(|w| w.amplitude *= 0.25 / variance.sqrt());
    let choice = Choice::Procedural(Procedural {
        spacing: grid.spacing,
        depth: None,
        waves,
    });
    footage(scene(grid, choice, Edges::Open, None, None)?, |_| Vec::new())
}

fn frames_of_rain(size: u32) -> anyhow::Result<Arc<Footage>> {
    let grid = GridSpec::new(Vec2::ZERO, 0.05, UVec2::splat(size))?;
    let choice = Choice::WaveEquation(WaveEquation {
        spacing: grid.spacing,
        scheme: WaveScheme::Explicit,
        speed: Some(1.5),
        depth: 0.5,
        damping: 0.0,
        step: None,
    });
    let mut rng = Rng::new(12, 0);
    let extent = grid.extent();
    footage(scene(grid, choice, Edges::Walls, None, None)?, |k| {
        // Enough drops before the first frame to cover the basin with rings.
        let drops = if k == 0 { grid.len() / 160 } else { 40 };
        (0..drops)
            .map(|_| Action::Press {
                position: extent * Vec2::new(rng.uniform_f32(), rng.uniform_f32()),
                radius: 0.15,
                depth: 0.02,
            })
            .collect()
    })
}

fn case(name: &'static str, truth: String, footage: Arc<Footage>) -> Case {
    let mut runs = Vec::new();
    for tolerance in [0.0_f32, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2] {
        for (method, timed_writing) in [("write", true), ("read", false)] {
            let footage = Arc::clone(&footage);
            let values = footage.values();
            let steps = if tolerance > 0.0 {
                (1.0 / f64::from(tolerance)).round()
            } else {
                0.0
            };
            let run = Run::new(method, steps, move |probe| {
                record(&footage, tolerance, timed_writing, probe)
            });
            // The shortest text that reads back as the same number, so that a row can be asked for by 1e-4.
            let written: f64 = tolerance.to_string().parse().unwrap_or(f64::from(tolerance));
            runs.push(run.with("tolerance", written).with("values", values));
        }
    }
    for (method, plain) in [
        ("32-bit values", plain_copy as PlainStore),
        ("16-bit steps", sixteen_bits),
    ] {
        let footage = Arc::clone(&footage);
        let values = footage.values();
        let run = Run::new(method, 0.0, move |probe| plain_store(&footage, plain, probe));
        runs.push(run.with("values", values));
    }
    Case {
        name,
        truth,
        resolution: "steps of the tolerance a metre (0: none asked for)",
        curves: vec![
            Curves {
                metric: ERROR,
                against: Against::Metric {
                    metric: SIZE,
                    front: true,
                },
                slopes: &[],
            },
            Curves {
                metric: ERROR,
                against: Against::CpuPer {
                    parameter: "values",
                    scale: 1e9,
                    label: "CPU time (ns a value of 4 bytes)",
                },
                slopes: &[],
            },
        ],
        runs,
    }
}

/// Writes a recording and reads it back; times one of the two.
fn record(
    footage: &Footage,
    tolerance: f32,
    timed_writing: bool,
    probe: &mut Probe,
) -> anyhow::Result<Outcome> {
    let dir = tempfile::tempdir().context("no directory for a temporary recording")?;
    let path = dir.path().join("study.mrec");
    let mut scene = footage.scene.clone();
    scene.description.recording.tolerance = tolerance;
    scene.description.recording.rate = RATE;
    let write = || -> anyhow::Result<u64> {
        let mut writer = Writer::create(&path, &scene, Channels::NONE)?;
        for frame in &footage.frames {
            writer.push(frame, None)?;
        }
        Ok(writer.finish()?.file_bytes)
    };
    let mut worst = 0.0_f64;
    let mut read = || -> anyhow::Result<()> {
        let mut reader = Reader::open(&path)?;
        anyhow::ensure!(
            reader.len() == footage.frames.len(),
            "{} frames came back",
            reader.len()
        );
        let mut frame = Frame::new(scene.grid);
        for (k, original) in footage.frames.iter().enumerate() {
            reader.read(k, &mut frame)?;
            worst = worst.max(largest_difference(&frame.elevation, &original.elevation));
        }
        Ok(())
    };
    let bytes = if timed_writing {
        let bytes = probe.time(write)?;
        read()?;
        bytes
    } else {
        let bytes = write()?;
        probe.forget_memory();
        probe.time(read)?;
        bytes
    };
    let outcome = Outcome::of(ERROR, worst).and(SIZE, bytes as f64 / (4 * footage.values()) as f64);
    Ok(if worst <= f64::from(tolerance) {
        outcome
    } else {
        outcome.wrong(format!("the error exceeds the tolerance of {tolerance} m"))
    })
}

fn largest_difference(a: &Grid<f32>, b: &Grid<f32>) -> f64 {
    let pairs = a.as_slice().iter().zip(b.as_slice());
    pairs
        .map(|(a, b)| (f64::from(*a) - f64::from(*b)).abs())
        .fold(0.0, f64::max)
}

/// Stores the values of a frame and tells the bytes and what comes back.
type PlainStore = fn(&[f32]) -> (Vec<u8>, Vec<f32>);

fn plain_copy(values: &[f32]) -> (Vec<u8>, Vec<f32>) {
    let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
    (bytes, values.to_vec())
}

fn sixteen_bits(values: &[f32]) -> (Vec<u8>, Vec<f32>) {
    let (low, high) = values
        .iter()
        .fold((f32::INFINITY, f32::NEG_INFINITY), |(l, h), &v| {
            (l.min(v), h.max(v))
        });
    let step = ((high - low) / f32::from(u16::MAX)).max(f32::MIN_POSITIVE);
    let steps: Vec<u16> = values.iter().map(|v| ((v - low) / step).round() as u16).collect();
    let back = steps.iter().map(|s| low + step * f32::from(*s)).collect();
    (steps.iter().flat_map(|s| s.to_le_bytes()).collect(), back)
}

fn plain_store(footage: &Footage, store: PlainStore, probe: &mut Probe) -> anyhow::Result<Outcome> {
    let (mut bytes, mut worst) = (0, 0.0_f64);
    for frame in &footage.frames {
        let (stored, back) = probe.time(|| store(frame.elevation.as_slice()));
        bytes += stored.len();
        let back = Grid::from_vec(footage.scene.grid, back)?;
        worst = worst.max(largest_difference(&back, &frame.elevation));
    }
    Ok(Outcome::of(ERROR, worst).and(SIZE, bytes as f64 / (4 * footage.values()) as f64))
}
