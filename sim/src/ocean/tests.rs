//! Whole oceans against theory: heights, spectra and periods of frames, loops, queries, foam, extremes.

use super::lattice::{Cells, Draw, Lattice};
use super::patch::{Field, Patch};
use super::sea::WaveField;
use super::*;
use crate::Scene;
use crate::dispersion::Dispersion;
use crate::scene::description::{Sea, Spectrum, Spreading};
use crate::solvers::BuildError;
use glam::{DVec2, UVec2};
use rustfft::FftPlanner;
use std::f64::consts::TAU;
use std::path::Path;

fn scene(text: &str) -> Scene {
    let whole = format!("name = 'sea'\n{text}");
    Scene::from_toml(&whole, Path::new("test"), Path::new("."), &[]).unwrap_or_else(|e| panic!("{e}"))
}

fn build(text: &str) -> Result<Ocean, BuildError> {
    Ocean::from_scene(&scene(text))
}

const PERIODIC: &str =
    "boundary = { x_min = 'periodic', x_max = 'periodic', z_min = 'periodic', z_max = 'periodic' }";
const OPEN: &str = "boundary = { x_min = 'open', x_max = 'open', z_min = 'open', z_max = 'open' }";

/// An ocean of `samples`² on `size` metres.
fn ocean(size: f64, samples: u32, edges: &str, rest: &str, seas: &str) -> Ocean {
    let text = format!(
        "domain.size = [{size}, {size}]\n{edges}\n[solver]\nkind = 'ocean'\nspacing = {}\n{rest}\n{seas}",
        size / f64::from(samples)
    );
    build(&text).unwrap_or_else(|e| panic!("{e}"))
}

const WIND_SEA: &str = "sea = [{ kind = 'jonswap', wind = 10.0, fetch = 50000.0, direction = 20.0 }]";
const SWELL: &str = "sea = [{ kind = 'swell', height = 2.0, period = 9.0, direction = -30.0 }]";

fn frame(ocean: &Ocean, want: Channels) -> Frame {
    let mut frame = Frame::new(ocean.spec);
    ocean.extract(want, &mut frame);
    frame.check_finite().unwrap();
    frame
}

fn deep() -> Dispersion {
    Dispersion::new(None)
}

fn spectra() -> [Spectrum; 5] {
    [
        Spectrum::Phillips {
            wind: 10.0,
            height: 2.0,
        },
        Spectrum::PiersonMoskowitz { wind: 10.0 },
        Spectrum::Jonswap {
            wind: 10.0,
            fetch: 1e5,
            gamma: 3.3,
        },
        Spectrum::Tma {
            wind: 10.0,
            fetch: 1e5,
            gamma: 3.3,
        },
        Spectrum::Swell {
            height: 2.0,
            period: 9.0,
            gamma: 8.0,
        },
    ]
}

fn spreadings() -> [Spreading; 5] {
    [
        Spreading::Hasselmann,
        Spreading::Mitsuyasu,
        Spreading::DonelanBanner,
        Spreading::CosinePower { exponent: 8.0 },
        Spreading::Swell { elongation: 0.7 },
    ]
}

#[test]
fn the_significant_wave_height_is_that_of_the_spectrum_for_every_spectrum_and_spreading() {
    const SEEDS: u64 = 40;
    let mut plane = Vec::new();
    for spectrum in spectra() {
        for spreading in spreadings() {
            let dispersion = if matches!(spectrum, Spectrum::Tma { .. }) {
                Dispersion::new(Some(15.0))
            } else {
                deep()
            };
            let component = Sea {
                spectrum,
                direction: 35.0,
                spreading,
            };
            let sea = WaveField::new(&[component], dispersion);
            let wave = TAU / dispersion.wave_number(sea.lowest_peak().unwrap());
            // Three patches of disjoint bands, from 24 peak waves to waves of a hundredth of the peak's.
            let periods = [24.0, 3.0, 0.6].map(|p| p * wave);
            let split = |k: usize| 8.0 * TAU / periods[k];
            let bands = [(0.0, split(1)), (split(1), split(2)), (split(2), f64::INFINITY)];
            let (mut measured, mut expected) = (0.0, 0.0);
            for patch in 0..3 {
                let draw = |seed| Draw {
                    period: DVec2::splat(periods[patch]),
                    size: UVec2::splat(if patch == 0 { 144 } else { 96 }),
                    band: bands[patch],
                    seed,
                    patch: patch as u64,
                    loop_period: None,
                };
                let cells = Cells::new(&sea, &draw(0));
                for seed in 0..SEEDS {
                    let lattice = Lattice::from_cells(&cells, &dispersion, &draw(seed));
                    expected += lattice.variance / SEEDS as f64;
                    let patch = Patch::new(lattice, dispersion.depth);
                    let mut work = patch.work();
                    let size = patch.lattice().size.as_usizevec2();
                    plane.resize(size.element_product(), 0.0);
                    patch.turn(3.0, &[Field::Elevation], &mut work);
                    patch.one(Field::Elevation, &mut work, size.y, &mut plane, |row, out| {
                        out.copy_from_slice(row);
                    });
                    let square: f64 = plane.iter().map(|v| f64::from(*v).powi(2)).sum();
                    measured += square / (plane.len() as f64 * SEEDS as f64);
                }
            }
            let truth = sea.variance();
            // The variances of the bands add to m0, less the tail beyond the last patch.
            assert!(
                (expected / truth - 1.0).abs() < 4e-3,
                "{component:?}: bands hold {expected} of {truth}"
            );
            let height = (measured / truth).sqrt();
            assert!(
                (height - 1.0).abs() < 0.01,
                "{component:?}: Hs is {height} of what it should be"
            );
        }
    }
}

/// |η̂|² of a frame with the wave number of each mode: what a person would compute from recorded frames.
fn periodogram(ocean: &Ocean, frame: &Frame) -> Vec<(f64, f64)> {
    let (w, h) = (ocean.spec.width(), ocean.spec.height());
    let mut planner = FftPlanner::<f64>::new();
    let (along_x, along_z) = (planner.plan_fft_forward(w), planner.plan_fft_forward(h));
    let mut rows: Vec<rustfft::num_complex::Complex64> = frame
        .elevation
        .as_slice()
        .iter()
        .map(|v| rustfft::num_complex::Complex64::new(f64::from(*v), 0.0))
        .collect();
    along_x.process(&mut rows);
    let step = TAU / f64::from(ocean.spec.spacing);
    let mut out = Vec::with_capacity(w * h);
    for m in 0..w {
        let mut column: Vec<_> = (0..h).map(|j| rows[j * w + m]).collect();
        along_z.process(&mut column);
        for (n, c) in column.iter().enumerate() {
            let kx = step * lattice::signed(m, w) as f64 / w as f64;
            let kz = step * lattice::signed(n, h) as f64 / h as f64;
            out.push((kx.hypot(kz), c.norm_sqr() / ((w * h) as f64).powi(2)));
        }
    }
    out
}

/// ∫ ωᵖ S dω between two wave numbers, by a quadrature of its own.
fn moment(spectrum: &Spectrum, power: i32, from: f64, to: f64) -> f64 {
    let d = deep();
    let scale = spectrum.scale(&d);
    let (a, b) = (d.omega(from), d.omega(to));
    let n = 4000;
    let step = (b - a) / f64::from(n);
    (0..n)
        .map(|i| {
            let w = a + (f64::from(i) + 0.5) * step;
            w.powi(power) * spectrum.density(w, scale, &d) * step
        })
        .sum()
}

#[test]
fn frames_give_the_spectrum_and_the_significant_period_back() {
    const SEEDS: u64 = 40;
    let spectrum = Spectrum::Jonswap {
        wind: 10.0,
        fetch: 5e4,
        gamma: 3.3,
    };
    let peak = deep().wave_number(spectrum.peak().unwrap());
    let edges = [0.3, 0.75, 0.9, 1.1, 1.4, 2.0, 3.0, 5.0].map(|f| f * peak);
    let mut found = [0.0; 7];
    // Moments −1 and 0 within the outermost edges.
    let (mut energy, mut variance) = (0.0, 0.0);
    for seed in 0..SEEDS {
        let text = format!(
            "seed = {seed}\ndomain.size = [900, 900]\n{PERIODIC}\n[solver]\nkind = 'ocean'\nspacing = {}\n{WIND_SEA}",
            900.0 / 256.0
        );
        let ocean = build(&text).unwrap();
        for (k, power) in periodogram(&ocean, &frame(&ocean, Channels::NONE)) {
            if let Some(band) = (0..7).find(|b| k >= edges[*b] && k < edges[b + 1]) {
                found[band] += power / SEEDS as f64;
                variance += power;
                energy += power / deep().omega(k);
            }
        }
    }
    for band in 0..7 {
        let truth = moment(&spectrum, 0, edges[band], edges[band + 1]);
        let ratio = found[band] / truth;
        // The narrowest band holds some 60 waves a draw; 40 draws leave 2 %. A cell astride an edge counts on one side.
        assert!((ratio - 1.0).abs() < 0.06, "band {band}: {ratio}");
    }
    let truth = moment(&spectrum, -1, edges[0], edges[7]) / moment(&spectrum, 0, edges[0], edges[7]);
    assert!(
        (energy / variance / truth - 1.0).abs() < 0.01,
        "{}",
        energy / variance / truth
    );
}

#[test]
fn waves_cross_the_mean_level_as_often_as_their_moments_say() {
    // Rice 1944: the mean period between upward crossings is 2π √(m0/m2), here of the waves that the patch holds.
    let mut ocean = ocean(600.0, 64, PERIODIC, "choppiness = 0.0", SWELL);
    let lattice = ocean.cascades[0].patch.lattice().clone();
    let (mut m0, mut m2) = (0.0, 0.0);
    for m in 0..lattice.active_rows {
        for n in 0..64 {
            let at = m * 64 + n;
            let weight = if m == 0 { 1.0 } else { 2.0 };
            let omega = TAU * lattice.turns[m * 33 + n.min(64 - n)];
            // Mean over time of |ĥ|², of this draw.
            let power = 0.5 * (lattice.even[at].norm_sqr() + lattice.odd[at].norm_sqr());
            m0 += weight * f64::from(power);
            m2 += weight * omega * omega * f64::from(power);
        }
    }
    let (dt, steps) = (0.25_f32, 1200);
    let mut before = frame(&ocean, Channels::NONE);
    let mut crossings = 0_u64;
    for _ in 0..steps {
        ocean.advance(dt).unwrap();
        let now = frame(&ocean, Channels::NONE);
        let pairs = before.elevation.as_slice().iter().zip(now.elevation.as_slice());
        crossings += pairs.filter(|(a, b)| **a < 0.0 && **b >= 0.0).count() as u64;
        before = now;
    }
    let period = f64::from(dt) * f64::from(steps) * 4096.0 / crossings as f64;
    let truth = TAU * (m0 / m2).sqrt();
    assert!((period / truth - 1.0).abs() < 0.01, "{period} s, {truth} s");
    // The mean period of a narrow swell is a little below that of its peak.
    assert!(truth > 0.75 * 9.0 && truth < 9.0);
}

#[test]
fn a_loop_closes_bit_for_bit_on_the_clock_of_a_live_run() {
    let rest = "loop_period = 12.0\nfoam = { threshold = 0.9 }";
    let mut ocean = ocean(150.0, 48, PERIODIC, rest, WIND_SEA);
    let all = Channels::ALL - Channels::BODIES;
    let mut first = Vec::new();
    // Frames as a live source takes them: each step leads from where the clock is to the frame's time.
    for k in 0..=720_u32 {
        let time = f64::from(k) / 30.0;
        let dt = (time - ocean.time()) as f32;
        if dt > 0.0 {
            ocean.advance(dt).unwrap();
        }
        let mut now = frame(&ocean, all);
        now.time = 0.0;
        if k < 360 {
            first.push(now);
        } else {
            assert!(now == first[k as usize % 360], "frame {k}");
        }
    }
    assert!(first[0] != first[180]);
}

/// Values of a field at all samples.
fn plane(ocean: &Ocean, time: f64, field: Field) -> Vec<f32> {
    let mut out = vec![0.0; ocean.spec.len()];
    ocean.turn(ocean.moment(time), &[field]);
    ocean.sample(field, &mut out, |row: &[f32], out| out.copy_from_slice(row));
    out
}

#[test]
fn slopes_are_differences_of_heights_and_the_jacobian_is_the_area_that_is_left() {
    let mut ocean = ocean(400.0, 256, PERIODIC, "depth = 20.0", WIND_SEA);
    let (w, h) = (256_usize, 256_usize);
    let dx = f64::from(ocean.spec.spacing);
    // Every wave is at least sixteen samples long, so that differences of sixth order err by (2π/16)⁶/140 = 3e-5.
    let wind = Sea {
        spectrum: spectra()[2],
        direction: 25.0,
        spreading: Spreading::Hasselmann,
    };
    let draw = Draw {
        period: DVec2::splat(400.0),
        size: UVec2::splat(256),
        band: (0.0, TAU / (16.0 * dx)),
        seed: 2,
        patch: 0,
        loop_period: None,
    };
    let lattice = Lattice::new(&WaveField::new(&[wind], Dispersion::new(Some(20.0))), &draw);
    ocean.cascades[0].patch = Patch::new(lattice, 20.0);
    let at = |f: &[f32], i: isize, j: isize| {
        f64::from(f[j.rem_euclid(h as isize) as usize * w + i.rem_euclid(w as isize) as usize])
    };
    let difference = |f: &[f32], i: isize, j: isize, (a, b): (isize, isize)| {
        let d = |n: isize| at(f, i + n * a, j + n * b) - at(f, i - n * a, j - n * b);
        (45.0 * d(1) - 9.0 * d(2) + d(3)) / (60.0 * dx)
    };
    let eta = plane(&ocean, 4.0, Field::Elevation);
    let (px, pz) = (
        plane(&ocean, 4.0, Field::DisplacementX),
        plane(&ocean, 4.0, Field::DisplacementZ),
    );
    let (sx, sz) = (
        plane(&ocean, 4.0, Field::SlopeX),
        plane(&ocean, 4.0, Field::SlopeZ),
    );
    let mut j_field = Vec::new();
    ocean.jacobian(4.0, &mut j_field);
    let rms = (sx.iter().map(|v| f64::from(*v).powi(2)).sum::<f64>() / sx.len() as f64).sqrt();
    let (mut slope_error, mut area_error) = (0.0_f64, 0.0_f64);
    for j in (0..h as isize).step_by(7) {
        for i in (0..w as isize).step_by(5) {
            slope_error = slope_error.max((difference(&eta, i, j, (1, 0)) - at(&sx, i, j)).abs());
            slope_error = slope_error.max((difference(&eta, i, j, (0, 1)) - at(&sz, i, j)).abs());
            let xx = 1.0 + difference(&px, i, j, (1, 0));
            let zz = 1.0 + difference(&pz, i, j, (0, 1));
            let area = xx * zz - difference(&px, i, j, (0, 1)) * difference(&pz, i, j, (1, 0));
            area_error = area_error.max((area - at(&j_field, i, j)).abs());
        }
    }
    assert!(slope_error < 3e-4 * rms, "{slope_error} of {rms}");
    assert!(area_error < 3e-4 * rms, "{area_error} of {rms}");
    // No water comes or goes: the displaced surface covers the plane once, ∫J dA = A.
    let mean = j_field.iter().map(|j| f64::from(*j)).sum::<f64>() / j_field.len() as f64;
    assert!((mean - 1.0).abs() < 1e-5, "{mean}");
}

#[test]
fn cascades_beside_each_other_are_the_sum_of_their_waves() {
    // Open edges and named patches: the coarser two are interpolated to the frame's samples.
    let rest = "choppiness = 0.0\n\
        cascade = [{ period = 1200.0 }, { period = 200.0 }, { period = 32.0 }]";
    let ocean = ocean(64.0, 64, OPEN, rest, WIND_SEA);
    assert_eq!(ocean.bands().count(), 3);
    let variance: f64 = ocean.bands().map(|b| b.variance).sum();
    assert!((variance / ocean.sea_variance - 1.0).abs() < 0.01, "{variance}");
    let mut ocean = ocean;
    ocean.advance(50_000.0).unwrap();
    let frame = frame(&ocean, Channels::VELOCITY);
    let mut worst = 0.0_f64;
    for (i, j) in [(0, 0), (5, 17), (33, 60), (64, 64), (41, 2)] {
        let exact = ocean.surface_at(ocean.spec.position(i, j).as_dvec2(), ocean.time());
        worst = worst.max((f64::from(frame.elevation[(i, j)]) - exact.height).abs());
        let flow = frame.velocity.as_ref().unwrap()[(i, j)].as_dvec2();
        worst = worst.max((flow - DVec2::new(exact.velocity.x, exact.velocity.z)).length());
    }
    assert!(worst < 1e-3 * ocean.significant_height(), "{worst}");
}

#[test]
fn a_window_on_a_long_swell_needs_no_cascade_named() {
    // A boat's length of a 126 m swell: without longer patches it would be flat.
    let swell = ocean(20.0, 40, OPEN, "", SWELL);
    assert!(
        swell.significant_height() > 1.98,
        "{}",
        swell.significant_height()
    );
    assert!(swell.bands().count() > 1);
    // A periodic domain holds the waves that fit it and no other.
    let basin = ocean(20.0, 40, PERIODIC, "", SWELL);
    assert_eq!(basin.bands().count(), 1);
    assert!(basin.significant_height() < 0.5);
}

#[test]
fn the_sampled_surface_is_the_exact_one() {
    let ocean = ocean(150.0, 256, PERIODIC, "choppiness = 1.0", WIND_SEA);
    let time = 1e5 + 3.25;
    let sampled = ocean.snapshot(time);
    let fine = ocean.sampler(Sampling::Twice).snapshot(&ocean, time);
    let height = ocean.significant_height();
    for k in 0..12 {
        let k = f64::from(k);
        // Inside the domain and a long way beyond it.
        let x = DVec2::new(37.3 * k - 1000.0, 211.7 * k + 5.1);
        let (exact, near) = (ocean.surface_at(x, time), sampled.surface_at(x));
        assert!(
            (exact.height - near.height).abs() < 0.02 * height,
            "{k}: {exact:?} {near:?}"
        );
        assert!(
            (exact.velocity - near.velocity).length() < 0.1 * height,
            "{k}: {exact:?} {near:?}"
        );
        assert!(exact.normal.dot(near.normal) > 0.98, "{k}: {exact:?} {near:?}");
        // Ten times the mean error of a spline over a spectrum that ends at four samples a wave.
        let fine = fine.surface_at(x);
        assert!(
            (exact.height - fine.height).abs() < 1e-3 * height,
            "{k}: {exact:?} {fine:?}"
        );
        assert!(exact.normal.dot(fine.normal) > 0.9999, "{k}: {exact:?} {fine:?}");
        assert!(exact.normal.y > 0.5 && exact.jacobian > 0.0);
    }
}

#[test]
fn queries_agree_with_differences_of_their_own_heights() {
    let ocean = ocean(200.0, 32, PERIODIC, "depth = 12.0", SWELL);
    let (e, time) = (1e-3, 77.0);
    for k in 0..6 {
        let x = DVec2::new(13.7 * f64::from(k), 40.0 - 9.1 * f64::from(k));
        let at = |dx: f64, dz: f64| ocean.surface_at(x + DVec2::new(dx, dz), time).height;
        let slope = DVec2::new(at(e, 0.0) - at(-e, 0.0), at(0.0, e) - at(0.0, -e)) / (2.0 * e);
        let normal = ocean.surface_at(x, time).normal;
        let found = -DVec2::new(normal.x, normal.z) / normal.y;
        assert!((slope - found).length() < 1e-5, "{slope} {found}");
    }
}

#[test]
fn foam_comes_with_storm_and_depends_on_time_alone() {
    let storm = "sea = [{ kind = 'jonswap', wind = 22.0, fetch = 30000.0 }]";
    // Waves of 3 m and more: what breaks below that is left to the threshold.
    let build = || ocean(400.0, 128, PERIODIC, "foam = { threshold = 0.8 }", storm);
    let want = Channels::FOAM;
    let covered = |f: &Frame| f.foam.as_ref().unwrap().as_slice().iter().sum::<f32>() / 16384.0;
    let mut one = build();
    one.advance(6.0).unwrap();
    let at_once = frame(&one, want);
    let mut many = build();
    for _ in 0..96 {
        frame(&many, want);
        many.advance(0.0625).unwrap();
    }
    let in_steps = frame(&many, want);
    // Running on from 6 s before or beginning 12 s before: what is older than 12 s has faded to exp(−3).
    let apart = at_once.foam.as_ref().unwrap().as_slice().iter();
    let apart = apart.zip(in_steps.foam.as_ref().unwrap().as_slice());
    let apart = apart.fold(0.0_f32, |m, (a, b)| m.max((a - b).abs()));
    assert!(apart < 0.06, "{apart}");
    let cover = covered(&at_once);
    assert!((1e-4..0.5).contains(&cover), "{cover}");
    let all = at_once.foam.as_ref().unwrap().range();
    assert!(all.0 >= 0.0 && all.1 <= 1.0);
    let calm = ocean(400.0, 128, PERIODIC, "foam = {}", SWELL);
    assert_eq!(covered(&frame(&calm, want)), 0.0);
}

#[test]
fn extremes_are_refused_clearly_or_stay_sane() {
    let jonswap =
        |wind: f64, fetch: f64| format!("sea = [{{ kind = 'jonswap', wind = {wind}, fetch = {fetch} }}]");
    let tma = |wind: f64| format!("sea = [{{ kind = 'tma', wind = {wind}, fetch = 100000 }}]");
    let cases = [
        (100.0, "", String::new(), false),
        (100.0, "", jonswap(0.0, 1e5), false),
        (100.0, "", jonswap(10.0, 0.0), false),
        (100.0, "", jonswap(60.0, 1e6), true),
        (
            100.0,
            "choppiness = 10.0\nfoam = { growth = 1000.0 }",
            jonswap(60.0, 1e4),
            true,
        ),
        (0.2, "depth = 0.001", tma(0.3), true),
        (1.0, "depth = 10000.0", tma(10.0), true),
        (1.0, "", jonswap(10.0, 1e5), true),
        (1e5, "", jonswap(10.0, 1e5), true),
        (1e5, "depth = 0.001\ncapillary = false", tma(0.3), true),
    ];
    for edges in [PERIODIC, OPEN] {
        for (size, rest, seas, moves) in &cases {
            let text = format!(
                "domain.size = [{size}, {size}]\n{edges}\n[solver]\nkind = 'ocean'\nspacing = {}\n{rest}\n{seas}",
                size / 32.0
            );
            let mut ocean = match build(&text) {
                Ok(ocean) => ocean,
                Err(e) => panic!("{text}\n{e}"),
            };
            let report = ocean.advance(1e6).unwrap();
            assert!(report.energy.is_finite() && report.momentum.iter().all(|m| m.is_finite()));
            let now = frame(&ocean, Channels::ALL);
            let (low, high) = now.elevation.range();
            let height = ocean.significant_height() as f32;
            assert!(high - low <= 5.0 * height, "{text}: {low} to {high}, Hs {height}");
            assert_eq!(high > low, *moves && height > 1e-9, "{text}");
            if let Some(depth) = &now.depth {
                assert!(depth.range().0 >= 0.0);
            }
            let point = ocean.surface_at(DVec2::new(1.0, 2.0), 1e6);
            assert!(point.height.is_finite() && point.normal.is_finite() && point.velocity.is_finite());
        }
    }
    let refused = |rest: &str, seas: &str, words: &[&str]| {
        let text = format!(
            "domain.size = [100, 100]\n{OPEN}\n[solver]\nkind = 'ocean'\nspacing = 1\n{rest}\n{seas}"
        );
        let message = build(&text).err().unwrap_or_else(|| panic!("{text}")).to_string();
        assert!(words.iter().all(|w| message.contains(w)), "{message}");
    };
    refused(
        "depth = 0.001",
        &jonswap(20.0, 1e5),
        &["solver.depth", "broken", "tma"],
    );
    refused(
        "cascade = [{ period = 5 }]",
        &jonswap(20.0, 1e5),
        &["solver.cascade", "16 samples"],
    );
    refused(
        "cascade = [{ period = 1e9 }, { period = 50 }]",
        &jonswap(20.0, 1e5),
        &["samples", "coarser"],
    );
    refused(
        "cascade = [{ period = 50 }, { period = 50 }]",
        &jonswap(20.0, 1e5),
        &["too near"],
    );
}

#[test]
fn a_surface_steeper_than_breaking_is_seen_in_the_jacobian() {
    let storm = "sea = [{ kind = 'jonswap', wind = 30.0, fetch = 3000.0 }]";
    let gentle = ocean(200.0, 128, PERIODIC, "choppiness = 0.2", storm).fold(0.0);
    let folded = ocean(200.0, 128, PERIODIC, "choppiness = 3.0", storm).fold(0.0);
    assert!(gentle.share == 0.0 && gentle.smallest > 0.0, "{gentle:?}");
    assert!(folded.share > 0.0 && folded.smallest < 0.0, "{folded:?}");
}

#[test]
fn only_what_is_wanted_is_transformed() {
    let ocean = ocean(100.0, 64, PERIODIC, "foam = {}", WIND_SEA);
    frame(&ocean, Channels::NONE);
    let height_alone = ocean.bytes();
    frame(&ocean, Channels::DISPLACEMENT);
    // A complex transform has 64 columns where a real one has 33.
    assert_eq!(ocean.bytes(), height_alone + 8 * (64 - 33) * 64);
    // Foam is not even begun before it is asked for.
    assert_eq!(ocean.foam.as_ref().unwrap().borrow().bytes(), 0);
    frame(&ocean, Channels::FOAM);
    assert!(ocean.foam.as_ref().unwrap().borrow().bytes() > 0);
}

#[test]
fn energy_is_half_that_of_the_surface_and_does_not_change() {
    // Equipartition: potential energy ½ ρ g var η is half of the whole, in the mean over draws.
    let (mut whole, mut potential) = (0.0, 0.0);
    for seed in 0..20 {
        let text = format!(
            "seed = {seed}\ndomain.size = [900, 900]\n{PERIODIC}\n[solver]\nkind = 'ocean'\nspacing = 10\n{SWELL}"
        );
        let mut ocean = build(&text).unwrap();
        let before = ocean.report();
        let after = ocean.advance(100.0).unwrap();
        assert_eq!((before.energy, before.momentum), (after.energy, after.momentum));
        whole += before.energy;
        let square: f64 = frame(&ocean, Channels::NONE)
            .elevation
            .as_slice()
            .iter()
            .map(|v| f64::from(*v).powi(2))
            .sum();
        potential += 0.5 * 1000.0 * crate::solvers::GRAVITY * square * ocean.spec.cell_area();
        // A swell towards −30° carries momentum there.
        assert!(before.momentum[0] > 0.0 && before.momentum[1] < 0.0);
    }
    assert!(
        (potential / whole / 0.5 - 1.0).abs() < 0.03,
        "{}",
        potential / whole
    );
}
