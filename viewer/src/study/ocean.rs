//! Study `ocean`: heights of seas, points on them and frames of them against theory and cost.

use super::case::{Case, Curves, Outcome, Run, Study};
use super::measure::Probe;
use anyhow::Context as _;
use meniscus_sim::dispersion::Dispersion;
use meniscus_sim::glam::{DVec2, UVec2};
use meniscus_sim::ocean::lattice::{Cells, Draw, Lattice};
use meniscus_sim::ocean::patch::{Field, Patch};
use meniscus_sim::ocean::sea::WaveField;
use meniscus_sim::ocean::transform::Transform;
use meniscus_sim::ocean::{Ocean, Sampling};
use meniscus_sim::scene::description::{Sea, Spectrum, Spreading};
use meniscus_sim::{Channels, Frame, Scene, Solver as _};
use std::f64::consts::TAU;
use std::path::Path;

/// The study.
pub(crate) struct OceanStudy;

const HEIGHT: &str = "relative error of the significant wave height";
const POINT: &str = "largest error of a height over the significant wave height";

/// Frames that a cost is taken of.
const FRAMES: u32 = 10;

impl Study for OceanStudy {
    fn name(&self) -> &'static str {
        "ocean"
    }

    fn title(&self) -> &'static str {
        "Oceans: wave height, points and frames"
    }

    fn summary(&self) -> &'static str {
        "significant wave height against the spectrum's integral, queries against the exact sum, frames against their transforms"
    }

    fn about(&self) -> &'static str {
        "The significant wave height of a sea is four times the root of its variance, and the variance is the integral of \
         its spectrum. A patch holds the waves between its period and two of its samples; how much of the height that is \
         is swept over the samples, for one patch of the domain's size and for cascades.\n\n\
         Forty draws of every spectrum are transformed and their heights compared with the same integral, which shares \
         no code with the transforms.\n\n\
         Points are asked for between the samples and beyond the domain, from the samples of a frame and as the sum of \
         all waves in double precision.\n\n\
         Frames are timed on one thread beside the Fourier transforms that they need at least."
    }

    fn expectations(&self) -> &'static str {
        include_str!("../../../data/expectations/ocean.toml")
    }

    fn cases(&self, quick: bool) -> anyhow::Result<Vec<Case>> {
        Ok(vec![heights(quick), draws(), points(quick), costs(quick)])
    }
}

/// An ocean of `samples`² over `size` metres.
fn ocean(size: f64, samples: u32, edge: &str, sea: &str) -> anyhow::Result<(Scene, Ocean)> {
    let spacing = size / f64::from(samples);
    let text = format!(
        "name = \"study\"\ndomain.size = [{size}, {size}]\n\
         boundary = {{ x_min = \"{edge}\", x_max = \"{edge}\", z_min = \"{edge}\", z_max = \"{edge}\" }}\n\
         [solver]\nkind = \"ocean\"\nspacing = {spacing}\nsea = [{sea}]\n"
    );
    let scene = Scene::from_toml(&text, Path::new("study"), Path::new("."), &[])?;
    let ocean = Ocean::from_scene(&scene)?;
    Ok((scene, ocean))
}

/// Significant height of 1.8 m, peak wavelength of 56 m.
const WIND_SEA: &str = "{ kind = \"jonswap\", wind = 10.0, fetch = 100000.0, direction = 25.0 }";

/// One thread to run on, so that CPU time is that of the work alone.
fn one_thread() -> anyhow::Result<rayon::ThreadPool> {
    rayon::ThreadPoolBuilder::new()
        .num_threads(1)
        .build()
        .context("no thread to measure on")
}

fn heights(quick: bool) -> Case {
    let mut runs = Vec::new();
    let counts: &[u32] = if quick {
        &[32, 64, 128, 256]
    } else {
        &[32, 64, 128, 256, 512]
    };
    for (method, edge) in [("one patch", "periodic"), ("cascades", "open")] {
        for &samples in counts {
            runs.push(Run::new(method, f64::from(samples), move |probe| {
                let (scene, mut ocean) = ocean(200.0, samples, edge, WIND_SEA)?;
                let mut frame = Frame::new(scene.grid);
                for _ in 0..FRAMES {
                    ocean.advance(0.04)?;
                    let (ocean, frame) = (&mut ocean, &mut frame);
                    let pool = one_thread()?;
                    probe.time(|| pool.install(move || ocean.extract(Channels::DISPLACEMENT, frame)));
                }
                Ok(Outcome::of(
                    HEIGHT,
                    (ocean.significant_height() / ocean.sea_height() - 1.0).abs(),
                ))
            }));
        }
    }
    Case {
        name: "a window of 200 m",
        truth: "A JONSWAP sea (10 m/s, 100 km; peak waves of 56 m) seen in a square of 200 m: the height that its patches \
                hold, by their expected variance, against the integral of the spectrum. Costs are of ten frames of \
                elevation and displacement."
            .to_owned(),
        resolution: "samples along a side",
        curves: Curves::standard(HEIGHT),
        runs,
    }
}

fn spectra() -> [(&'static str, Spectrum); 5] {
    [
        (
            "phillips",
            Spectrum::Phillips {
                wind: 10.0,
                height: 2.0,
            },
        ),
        ("pierson-moskowitz", Spectrum::PiersonMoskowitz { wind: 10.0 }),
        (
            "jonswap",
            Spectrum::Jonswap {
                wind: 10.0,
                fetch: 1e5,
                gamma: 3.3,
            },
        ),
        (
            "tma",
            Spectrum::Tma {
                wind: 10.0,
                fetch: 1e5,
                gamma: 3.3,
            },
        ),
        (
            "swell",
            Spectrum::Swell {
                height: 2.0,
                period: 9.0,
                gamma: 8.0,
            },
        ),
    ]
}

/// The spreadings, numbered as the case's resolution does.
fn spreadings() -> [Spreading; 5] {
    [
        Spreading::Hasselmann,
        Spreading::Mitsuyasu,
        Spreading::DonelanBanner,
        Spreading::CosinePower { exponent: 8.0 },
        Spreading::Swell { elongation: 0.7 },
    ]
}

fn draws() -> Case {
    let mut runs = Vec::new();
    for (name, spectrum) in spectra() {
        for (number, spreading) in spreadings().into_iter().enumerate() {
            runs.push(Run::new(name, (number + 1) as f64, move |probe| {
                forty_draws(spectrum, spreading, probe)
            }));
        }
    }
    Case {
        name: "forty draws",
        truth: "Height of forty draws of a sea on three patches of disjoint bands, from the mean square of the transformed \
                samples, against the integral of the spectrum; spreadings are Hasselmann, Mitsuyasu, Donelan-Banner, \
                cosine power 8 and swell 0.7, in this order. Forty draws leave a deviation of 0.4 %."
            .to_owned(),
        resolution: "number of the spreading",
        curves: Vec::new(),
        runs,
    }
}

fn forty_draws(spectrum: Spectrum, spreading: Spreading, probe: &mut Probe) -> anyhow::Result<Outcome> {
    const SEEDS: u64 = 40;
    let depth = matches!(spectrum, Spectrum::Tma { .. }).then_some(15.0);
    let dispersion = Dispersion::new(depth);
    let sea = Sea {
        spectrum,
        direction: 35.0,
        spreading,
    };
    let sea = WaveField::new(&[sea], dispersion);
    let peak = sea.lowest_peak().context("the sea is calm")?;
    let wave = TAU / dispersion.wave_number(peak);
    let periods = [24.0, 3.0, 0.6].map(|p| p * wave);
    let split = [1, 2].map(|k: usize| 8.0 * TAU / periods[k]);
    let bands = [(0.0, split[0]), (split[0], split[1]), (split[1], f64::INFINITY)];
    let (mut variance, mut heights) = (0.0, Vec::new());
    for (number, (period, band)) in periods.into_iter().zip(bands).enumerate() {
        let mut draw = Draw {
            period: DVec2::splat(period),
            size: UVec2::splat(if number == 0 { 144 } else { 96 }),
            band,
            seed: 0,
            patch: number as u64,
            loop_period: None,
        };
        let cells = Cells::new(&sea, &draw);
        for seed in 1000..1000 + SEEDS {
            draw.seed = seed;
            let patch = Patch::new(Lattice::from_cells(&cells, &dispersion, &draw), dispersion.depth);
            let mut work = patch.work();
            let size = draw.size.as_usizevec2();
            heights.resize(size.element_product(), 0.0);
            probe.time(|| {
                patch.turn(3.0, &[Field::Elevation], &mut work);
                patch.one(Field::Elevation, &mut work, size.y, &mut heights, |row, out| {
                    out.copy_from_slice(row);
                });
            });
            let square: f64 = heights.iter().map(|v| f64::from(*v).powi(2)).sum();
            variance += square / (heights.len() as f64 * SEEDS as f64);
        }
    }
    Ok(Outcome::of(
        HEIGHT,
        ((variance / sea.variance()).sqrt() - 1.0).abs(),
    ))
}

fn points(quick: bool) -> Case {
    let counts: &[u32] = if quick {
        &[64, 128, 256]
    } else {
        &[64, 128, 256, 512]
    };
    let mut runs = Vec::new();
    for (method, sampling) in [
        ("splines on the samples", Sampling::Frame),
        ("splines on twice the samples", Sampling::Twice),
    ] {
        for &samples in counts {
            runs.push(Run::new(method, f64::from(samples), move |probe| {
                let (_, ocean) = ocean(300.0, samples, "periodic", WIND_SEA)?;
                let place = |k: u32| DVec2::new(37.31 * f64::from(k) - 400.0, 91.7 * f64::from(k) + 5.1);
                let time = 1e5;
                let mut sampler = ocean.sampler(sampling);
                let sampled = probe.time(|| {
                    let snapshot = sampler.snapshot(&ocean, time);
                    (0..1000)
                        .map(|k| snapshot.surface_at(place(k)).height)
                        .collect::<Vec<_>>()
                });
                let worst = (0..16)
                    .map(|k| (ocean.surface_at(place(60 * k), time).height - sampled[60 * k as usize]).abs())
                    .fold(0.0, f64::max);
                Ok(Outcome::of(POINT, worst / ocean.significant_height()))
            }));
        }
    }
    Case {
        name: "points",
        truth: "A thousand points of a choppy sea of 300 m a period, inside and beyond the domain, 10⁵ s after the start: \
                the samples' displacement is inverted and heights are interpolated; sixteen of them are compared with the \
                sum of all waves in double precision. Costs include the transforms."
            .to_owned(),
        resolution: "samples along a side",
        curves: Curves::standard(POINT),
        runs,
    }
}

/// The eight fields of a choppy, lit, foaming sea.
const EIGHT: [(Field, Field); 4] = [
    (Field::Elevation, Field::StretchXZ),
    (Field::DisplacementX, Field::DisplacementZ),
    (Field::SlopeX, Field::SlopeZ),
    (Field::StretchXX, Field::StretchZZ),
];

fn costs(quick: bool) -> Case {
    let counts: &[u32] = if quick { &[256, 512] } else { &[256, 512, 1024] };
    let mut runs = Vec::new();
    for &samples in counts {
        let resolution = f64::from(samples);
        for (method, real, complex) in [
            ("transforms alone, elevation and displacement", 1, 1),
            ("transforms alone, eight fields", 0, 4),
        ] {
            runs.push(Run::new(method, resolution, move |probe| {
                let mut transform = Transform::new(UVec2::splat(samples));
                transform.alone(real, complex);
                let (pool, transform) = (one_thread()?, &mut transform);
                probe.time(|| {
                    pool.install(move || (0..FRAMES).for_each(|_| transform.alone(real, complex)));
                });
                Ok(Outcome::of(POINT, 0.0))
            }));
        }
        runs.push(Run::new(
            "frame, elevation and displacement",
            resolution,
            move |probe| {
                let (scene, mut ocean) = ocean(resolution, samples, "periodic", WIND_SEA)?;
                let mut frame = Frame::new(scene.grid);
                ocean.extract(Channels::DISPLACEMENT, &mut frame);
                let (moving, out) = (&mut ocean, &mut frame);
                let pool = one_thread()?;
                probe.time(|| {
                    pool.install(move || {
                        for _ in 0..FRAMES {
                            // A step cannot fail: it is positive and finite.
                            let _ = moving.advance(0.04);
                            moving.extract(Channels::DISPLACEMENT, out);
                        }
                    });
                });
                let mut worst = 0.0_f64;
                for k in [3, 77, 200] {
                    let moved = frame.displacement.as_ref().context("no displacement")?[(k, 255 - k)];
                    let place = (scene.grid.position(k, 255 - k) + moved).as_dvec2();
                    let exact = ocean.surface_at(place, ocean.time()).height;
                    worst = worst.max((exact - f64::from(frame.elevation[(k, 255 - k)])).abs());
                }
                Ok(Outcome::of(POINT, worst / ocean.significant_height()))
            },
        ));
        runs.push(Run::new("eight fields", resolution, move |probe| {
            let draw = Draw {
                period: DVec2::splat(resolution),
                size: UVec2::splat(samples),
                band: (0.0, f64::INFINITY),
                seed: 1,
                patch: 0,
                loop_period: None,
            };
            let sea = Sea {
                spectrum: spectra()[2].1,
                direction: 25.0,
                spreading: Spreading::Hasselmann,
            };
            let lattice = Lattice::new(&WaveField::new(&[sea], Dispersion::new(None)), &draw);
            let patch = Patch::new(lattice, f64::INFINITY);
            let mut work = patch.work();
            let mut out = EIGHT.map(|_| vec![[0.0; 2]; (samples * samples) as usize]);
            let mut frame = move |k: u32| {
                patch.turn(0.04 * f64::from(k), &[Field::Elevation], &mut work);
                for (fields, out) in EIGHT.into_iter().zip(&mut out) {
                    let rows = samples as usize;
                    patch.two(fields, &mut work, rows, out, |row, out| {
                        for (out, value) in out.iter_mut().zip(row) {
                            *out = [value.re, value.im];
                        }
                    });
                }
            };
            frame(0);
            let pool = one_thread()?;
            probe.time(|| pool.install(move || (0..FRAMES).for_each(frame)));
            Ok(Outcome::of(POINT, 0.0))
        }));
    }
    Case {
        name: "cost of a frame",
        truth: "Ten frames of one patch on one thread, and the Fourier transforms (with their transposition) that such \
                frames need at least. Elevations are compared with the sum of all waves at their displaced places."
            .to_owned(),
        resolution: "samples along a side",
        curves: Vec::new(),
        runs,
    }
}
