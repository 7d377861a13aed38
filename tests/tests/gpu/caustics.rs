//! Sunlight through waves on the device, against the same laws in double precision.

use crate::support::*;
use glam::{DVec3, UVec2, Vec2};
use meniscus_render_cpu::photon::{self, PhotonMapper};
use meniscus_render_gpu::{GpuRenderer, PhotonMap, Settings, Technique};
use meniscus_sim::{Frame, Grid, Scene, optics};
use std::path::Path;

const SIDE: f32 = 8.0;
const DEPTH: f64 = 1.2;

/// A square of water over a level floor, open to all sides so that nothing stands in the light's way.
fn scene(elevation: f32) -> Scene {
    let text = format!(
        "name = \"square\"\ndomain = {{ size = [{SIDE:?}, {SIDE:?}] }}\nterrain = {{ kind = \"flat\", height = {:?} }}\n\
         solver = {{ kind = \"wave-equation\", spacing = 0.0625 }}\n\
         boundary = {{ x_min = \"open\", x_max = \"open\", z_min = \"open\", z_max = \"open\" }}\n\
         light = {{ sun = {{ elevation = {elevation:?}, azimuth = 90.0 }} }}\n",
        -DEPTH
    );
    Scene::from_toml(&text, Path::new("square.toml"), Path::new("."), &[]).unwrap_or_else(|e| panic!("{e}"))
}

fn wave(p: Vec2) -> f64 {
    let (x, z) = (f64::from(p.x), f64::from(p.y));
    0.012 * (std::f64::consts::TAU * x).sin() + 0.008 * (std::f64::consts::TAU * (0.5 * x + 0.5 * z)).sin()
}

fn slope(x: f64, z: f64) -> (f64, f64) {
    let tau = std::f64::consts::TAU;
    let a = 0.012 * tau * (tau * x).cos();
    let b = 0.008 * tau * 0.5 * (tau * (0.5 * x + 0.5 * z)).cos();
    (a + b, b)
}

fn frame(scene: &Scene, flat: bool) -> Frame {
    let mut frame = Frame::new(scene.grid);
    let spec = scene.grid;
    frame.elevation = Grid::from_fn(spec, |i, j| {
        if flat {
            0.0
        } else {
            wave(spec.position(i, j)) as f32
        }
    });
    frame
}

fn map(scene: &Scene, frame: &Frame, photon_map: PhotonMap, jitter: bool) -> Option<(UVec2, Vec<f32>)> {
    let mut settings = Settings::new(Technique::Heightfield);
    settings.photon_map = photon_map;
    settings.switches.photon_jitter = jitter;
    let mut renderer = GpuRenderer::new(settings);
    let view = view(scene, None, UVec2::new(16, 9));
    gpu_image(&mut renderer, scene, frame, &view);
    renderer.illumination()
}

/// Light on the map's texels by `n` × `n` photons in double precision from the waves' own formulas.
fn truth(sun: DVec3, texels: usize, n: usize) -> Vec<f64> {
    let spacing = f64::from(SIDE) / (texels - 1) as f64;
    let index = f64::from(optics::WATER_INDEX);
    let transmitted = |cos: f64| f64::from(1.0 - optics::fresnel(cos as f32, 1.0 / optics::WATER_INDEX));
    let flat = transmitted(sun.y) * sun.y;
    let mut map = vec![0.0; texels * texels];
    for b in 0..n {
        for a in 0..n {
            let (x, z) = (
                (a as f64 + 0.5) / n as f64 * f64::from(SIDE),
                (b as f64 + 0.5) / n as f64 * f64::from(SIDE),
            );
            let height = wave(Vec2::new(x as f32, z as f32));
            let (sx, sz) = slope(x, z);
            let normal = DVec3::new(-sx, 1.0, -sz).normalize();
            let cos = normal.dot(sun);
            let eta = 1.0 / index;
            let k = 1.0 - eta * eta * (1.0 - cos * cos);
            let down = eta * -sun + (eta * cos - k.sqrt()) * normal;
            let t = (height + DEPTH) / -down.y;
            let share = transmitted(cos) * cos / normal.y / flat;
            let (u, v) = ((x + t * down.x) / spacing, (z + t * down.z) / spacing);
            let (i, j) = (u.floor(), v.floor());
            for (di, wi) in [(0.0, 1.0 - (u - i)), (1.0, u - i)] {
                for (dj, wj) in [(0.0, 1.0 - (v - j)), (1.0, v - j)] {
                    let (p, q) = (i + di, j + dj);
                    if p >= 0.0 && q >= 0.0 && p < texels as f64 && q < texels as f64 {
                        map[q as usize * texels + p as usize] += share * wi * wj;
                    }
                }
            }
        }
    }
    let photons = (n * n) as f64 / ((texels - 1) * (texels - 1)) as f64;
    map.iter_mut().for_each(|v| *v /= photons);
    map
}

/// Texels far enough inside that nothing comes from or goes beyond the rim.
fn inner(texels: usize) -> impl Iterator<Item = usize> {
    let margin = texels / 4;
    (margin..texels - margin).flat_map(move |j| (margin..texels - margin).map(move |i| j * texels + i))
}

fn rms(a: impl Iterator<Item = f64>) -> f64 {
    let (mut sum, mut n) = (0.0, 0.0);
    for v in a {
        sum += v * v;
        n += 1.0;
    }
    (sum / n).sqrt()
}

#[test]
fn the_map_is_that_of_double_precision() {
    let scene = scene(60.0);
    let frame = frame(&scene, false);
    let sun = DVec3::new(60_f64.to_radians().cos(), 60_f64.to_radians().sin(), 0.0);
    let (size, found) = map(&scene, &frame, PhotonMap::Grid { filter: false }, false).unwrap();
    assert_eq!(size, UVec2::splat(129));
    let truth = truth(sun, 129, 256);
    let error = rms(inner(129).map(|k| f64::from(found[k]) - truth[k]));
    let signal = rms(inner(129).map(|k| truth[k] - 1.0));
    println!("rms error {error}, rms of the light's pattern {signal}");
    assert!(error <= 0.05 && signal > 0.1, "{error} {signal}");
}

/// The map of photons that the CPU follows one by one, in cells where this one has texels.
#[test]
fn the_map_is_that_of_the_photon_mapper() {
    let scene = scene(60.0);
    let frame = frame(&scene, false);
    let (size, found) = map(&scene, &frame, PhotonMap::Grid { filter: false }, false).unwrap();
    let view = view(&scene, None, UVec2::new(16, 9));
    let mut mapper = PhotonMapper::new(photon::Settings::caustics(1 << 21));
    let maps = mapper.maps(&scene, &frame, &view, &|_| true).unwrap();
    let theirs = maps.floor.unwrap().relative();
    assert_eq!(theirs.spec().size, size);
    let theirs = theirs.as_slice();
    let error = rms(inner(129).map(|k| f64::from(found[k] - theirs[k])));
    let signal = rms(inner(129).map(|k| f64::from(theirs[k] - 1.0)));
    println!("rms difference {error}, rms of the light's pattern {signal}");
    assert!(error <= 0.05 && signal > 0.1, "{error} {signal}");
}

/// What lands is what entered: the sum over a window of whole waves, into which as much drifts as out of it.
#[test]
fn no_light_is_lost_or_made() {
    let scene = scene(90.0);
    let frame = frame(&scene, false);
    for (filter, jitter) in [(false, false), (true, false)] {
        let (_, found) = map(&scene, &frame, PhotonMap::Grid { filter }, jitter).unwrap();
        // Two whole wavelengths of both waves along both axes, 64 texels.
        let sum: f64 = (32..96)
            .flat_map(|j| (32..96).map(move |i| j * 129 + i))
            .map(|k| f64::from(found[k]))
            .sum();
        let mean = sum / (64.0 * 64.0);
        // The truth is not 1: (1 − F) cos / n_y over the waves is not that of flat water. Its mean from the formulas.
        let truth = truth(DVec3::Y, 129, 1024);
        let expected: f64 = (32..96)
            .flat_map(|j| (32..96).map(move |i| j * 129 + i))
            .map(|k| truth[k])
            .sum::<f64>()
            / (64.0 * 64.0);
        println!("filter {filter}: mean {mean}, expected {expected}");
        assert!((mean / expected - 1.0).abs() < 1e-4, "{mean} {expected}");
    }
    assert!(
        map(
            &scene,
            &self::frame(&scene, true),
            PhotonMap::Grid { filter: false },
            false
        )
        .is_none(),
        "still water needs no map"
    );
}

/// The paper's 256² jittered photons on 128²: the filter lowers the error against 4 million photons and keeps the peak.
#[test]
fn the_filter_takes_noise_and_leaves_caustics() {
    let scene = scene(60.0);
    let frame = frame(&scene, false);
    let square = |filter| PhotonMap::Square {
        photons: 256,
        map: 128,
        filter,
    };
    let (_, raw) = map(&scene, &frame, square(false), true).unwrap();
    let (_, filtered) = map(&scene, &frame, square(true), true).unwrap();
    let sun = DVec3::new(60_f64.to_radians().cos(), 60_f64.to_radians().sin(), 0.0);
    let truth = truth(sun, 128, 2048);
    let error = |found: &[f32]| rms(inner(128).map(|k| f64::from(found[k]) - truth[k]));
    let peak = |found: &dyn Fn(usize) -> f64| inner(128).map(found).fold(0.0, f64::max);
    let total = |found: &[f32]| found.iter().map(|v| f64::from(*v)).sum::<f64>();
    let (before, after) = (error(&raw), error(&filtered));
    let (high, truly) = (peak(&|k| f64::from(filtered[k])), peak(&|k| truth[k]));
    println!(
        "error {before} -> {after}; peak {high} of {truly}; flux {}",
        total(&filtered) / total(&raw)
    );
    assert!(after < before, "{after} {before}");
    assert!(high >= 0.7 * truly, "{high} {truly}");
    assert!((total(&filtered) / total(&raw) - 1.0).abs() < 0.01);
}
