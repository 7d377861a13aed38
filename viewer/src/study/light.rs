//! Study `light`: how well the renderers with noise light the floor, against closed forms.

use super::case::{Case, Curves, Outcome, Run, Study};
use super::scenes::{Edges, scene};
use anyhow::Context as _;
use meniscus_render_cpu::path::{self, PathTracer};
use meniscus_render_cpu::photon::{PhotonMapper, Settings};
use meniscus_sim::glam::{DVec2, UVec2, Vec2, Vec3};
use meniscus_sim::optics::fresnel;
use meniscus_sim::render::{Image, Renderer as _, View};
use meniscus_sim::scene::description::{Procedural, Sky, Solver, Sun};
use meniscus_sim::stage::light::entering_share;
use meniscus_sim::{Frame, Grid, GridSpec, Scene};
use std::f64::consts::{PI, TAU};
use std::sync::Arc;

/// The study.
pub(crate) struct LightStudy;

const ERROR: &str = "relative RMS error of the light on the floor";
const BIAS: &str = "relative error of the mean";
const BALANCE: &str = "light that enters and does not leave, share";

/// Albedo of the floor: so little is sent back that it cannot be told from none.
const DARK: f32 = 1e-3;
const SUN: f32 = 3.0;
const SKY: f32 = 0.3;
const DEPTH: f32 = 0.8;

impl Study for LightStudy {
    fn name(&self) -> &'static str {
        "light"
    }

    fn title(&self) -> &'static str {
        "Light on the floor"
    }

    fn summary(&self) -> &'static str {
        "photon maps and path tracing of the light below still water and below a wave, against closed forms"
    }

    fn about(&self) -> &'static str {
        "Sun and an even sky light a dark floor through clear water. Below still water the truth is the closed form of Snell and \
         Fresnel, the same everywhere: `photon` is asked for its map, cell by cell, `path` for a picture of the floor taken \
         under water, pixel by pixel. Below a sine wave under a sun overhead, at half its focal length, the truth is a \
         quadrature of the exact wave in double precision with a million rays a wavelength.\n\n\
         Photons are thrown on a lattice, one at random in each mesh: what scatters is how many fall on either side of a cell's \
         rim, and the error falls faster than the root of their number. Paths are independent of one another and theirs does \
         not."
    }

    fn expectations(&self) -> &'static str {
        include_str!("../../../data/expectations/light.toml")
    }

    fn cases(&self, quick: bool) -> anyhow::Result<Vec<Case>> {
        Ok(vec![still(quick)?, wave(quick)?])
    }
}

/// A scene over `grid` with a level floor and clear water.
fn pool(
    grid: GridSpec,
    edges: Edges,
    depth: f32,
    elevation: f32,
    radius: f32,
    sky: f32,
) -> anyhow::Result<Scene> {
    let solver = Solver::Procedural(Procedural {
        spacing: grid.spacing,
        depth: None,
        waves: Vec::new(),
    });
    let mut scene = scene(grid, solver, edges, Some(Grid::filled(grid, -depth)), None)?;
    let d = &mut scene.description;
    d.water.absorption = Vec3::ZERO;
    d.water.scattering = Vec3::ZERO;
    d.ground.albedo = Vec3::splat(DARK);
    d.ground.steep_albedo = d.ground.albedo;
    d.ground.shore_albedo = d.ground.albedo;
    d.light.sky = Sky::Uniform {
        radiance: Vec3::splat(sky),
    };
    d.light.sun = Some(Sun {
        elevation,
        azimuth: 40.0,
        irradiance: Vec3::splat(SUN),
        radius,
    });
    Ok(scene)
}

fn look(position: Vec3, target: Vec3, samples: u32) -> View {
    View {
        position,
        target,
        up: Vec3::NEG_Z,
        vertical_fov: 0.6,
        size: UVec2::new(24, 18),
        samples,
        pass: 0,
    }
}

/// RMS and mean of `values` against `truth`, value by value, both relative to the mean of `truth`.
fn errors(values: &[f64], truth: &[f64]) -> (f64, f64) {
    let n = values.len().max(1) as f64;
    let scale = truth.iter().sum::<f64>() / n;
    let square: f64 = values.iter().zip(truth).map(|(v, t)| (v - t).powi(2)).sum();
    let mean: f64 = values.iter().zip(truth).map(|(v, t)| v - t).sum();
    ((square / n).sqrt() / scale, (mean / n / scale).abs())
}

fn still(quick: bool) -> anyhow::Result<Case> {
    let grid = GridSpec::new(Vec2::ZERO, 0.1, UVec2::splat(33))?;
    let scene = Arc::new(pool(grid, Edges::Open, DEPTH, 35.0, 0.2665, SKY)?);
    let n = f64::from(scene.description.water.index);
    let cos = 35.0_f64.to_radians().sin();
    let passed = f64::from(1.0 - fresnel(cos as f32, (1.0 / n) as f32));
    let sun = f64::from(SUN) * cos * passed;
    let sky = PI * f64::from(SKY) * f64::from(entering_share(n as f32)) * n * n;
    let truth = sun + sky;
    let frame = Arc::new(Frame::new(grid));
    let mut runs = Vec::new();
    for log in (10..=if quick { 16 } else { 21 }).step_by(2) {
        let (scene, frame) = (Arc::clone(&scene), Arc::clone(&frame));
        let photons = 1_u64 << log;
        let run = Run::new("photon", photons as f64, move |probe| {
            let mut mapper = PhotonMapper::new(Settings {
                photons: Some(photons),
                bounces: Some(0),
                ..Settings::default()
            });
            let view = look(Vec3::new(1.6, 2.0, 1.6), Vec3::new(1.6, 0.0, 1.6), 1);
            let maps = probe.time(|| mapper.maps(&scene, &frame, &view, &|_| true))?;
            let map = maps.floor.context("the pool has a floor")?.irradiance();
            let values: Vec<f64> = map.as_slice().iter().map(|e| f64::from(e.y)).collect();
            let (rms, bias) = errors(&values, &vec![truth; values.len()]);
            Ok(Outcome::of(ERROR, rms)
                .and(BIAS, bias)
                .and(BALANCE, maps.ledger.imbalance()))
        });
        runs.push(run.with("photons", photons));
    }
    for log in (0..=if quick { 6 } else { 12 }).step_by(2) {
        let (scene, frame) = (Arc::clone(&scene), Arc::clone(&frame));
        let samples = 1_u32 << log;
        let run = Run::new("path", f64::from(samples), move |probe| {
            let mut tracer = PathTracer::new(path::Settings {
                visual_range: None,
                ..path::Settings::default()
            });
            let view = look(Vec3::new(1.6, -0.2, 1.6), Vec3::new(1.6, -1.0, 1.6), samples);
            let mut image = Image::default();
            probe.time(|| tracer.render(&scene, &frame, &view, &mut image, &|_| true))?;
            // Basic radiance of the floor: albedo over π, over n².
            let scale = PI * n * n / f64::from(DARK);
            let values: Vec<f64> = image.pixels.iter().map(|p| f64::from(p.y) * scale).collect();
            let (rms, bias) = errors(&values, &vec![truth; values.len()]);
            Ok(Outcome::of(ERROR, rms).and(BIAS, bias))
        });
        runs.push(run.with("samples", samples));
    }
    Ok(Case {
        name: "still water",
        truth: format!(
            "{:.4} W/m² everywhere: {sun:.4} of the sun at 35° by Snell and Fresnel, {sky:.4} of an even sky by the integral of \
             Fresnel's equations",
            truth
        ),
        resolution: "photons of each light, or samples a pixel",
        curves: Curves::standard(ERROR),
        runs,
    })
}

fn wave(quick: bool) -> anyhow::Result<Case> {
    let (amplitude, wavelength, count) = (0.04, 2.0, 40_usize);
    let k = TAU / wavelength;
    let spacing = wavelength / count as f64;
    let grid = GridSpec::new(Vec2::ZERO, spacing as f32, UVec2::new(2 * count as u32, 32))?;
    let index = f64::from(meniscus_sim::optics::WATER_INDEX);
    let focus = 1.0 / ((1.0 - 1.0 / index) * amplitude * k * k);
    let depth = 0.5 * focus;
    let mut scene = pool(grid, Edges::Periodic, depth as f32, 90.0, 0.001, 0.0)?;
    scene.description.water.index = index as f32;
    let mut frame = Frame::new(grid);
    frame.elevation = Grid::from_fn(grid, |i, _| (amplitude * (k * spacing * i as f64).cos()) as f32);
    let truth = Arc::new(focused(amplitude, k, depth, index, count));
    let (scene, frame) = (Arc::new(scene), Arc::new(frame));
    let mut runs = Vec::new();
    for log in (12..=if quick { 18 } else { 22 }).step_by(2) {
        let (scene, frame, truth) = (Arc::clone(&scene), Arc::clone(&frame), Arc::clone(&truth));
        let photons = 1_u64 << log;
        let run = Run::new("photon", photons as f64, move |probe| {
            let mut mapper = PhotonMapper::new(Settings::caustics(photons));
            let view = look(Vec3::new(2.0, 3.0, 0.8), Vec3::new(2.0, 0.0, 0.8), 1);
            let maps = probe.time(|| mapper.maps(&scene, &frame, &view, &|_| true))?;
            let map = maps.floor.context("the floor is there")?.relative();
            let values: Vec<f64> = map.as_slice().iter().map(|e| f64::from(*e)).collect();
            let columns = grid.width();
            let truth: Vec<f64> = (0..values.len())
                .map(|c| truth[c % columns % truth.len()])
                .collect();
            let (rms, bias) = errors(&values, &truth);
            Ok(Outcome::of(ERROR, rms)
                .and(BIAS, bias)
                .and(BALANCE, maps.ledger.imbalance()))
        });
        runs.push(run.with("photons", photons));
    }
    Ok(Case {
        name: "sine wave",
        truth: format!(
            "Waves of {amplitude} m and {wavelength} m length, floor at {depth:.2} m, half of the focal length 1/((1 - 1/n) a k²); \
             a quadrature over the exact wave"
        ),
        resolution: "photons of each light, or samples a pixel",
        curves: Curves::standard(ERROR),
        runs,
    })
}

/// Light on `count` cells of a wavelength of the floor relative to that below still water: vertical rays, evenly spaced,
/// refracted at y = a cos kx.
fn focused(amplitude: f64, k: f64, depth: f64, index: f64, count: usize) -> Vec<f64> {
    const RAYS: usize = 1_000_000;
    let wavelength = TAU / k;
    let still = 1.0 - f64::from(fresnel(1.0, (1.0 / index) as f32));
    let mut cells = vec![0.0; count];
    for r in 0..RAYS {
        let x = (r as f64 + 0.5) / RAYS as f64 * wavelength;
        let normal = DVec2::new(amplitude * k * (k * x).sin(), 1.0).normalize();
        let cos = normal.y;
        let cos_t = (1.0 - (1.0 - cos * cos) / (index * index)).sqrt();
        // Snell in the plane of the ray, which comes straight down.
        let down = DVec2::NEG_Y / index + (cos / index - cos_t) * normal;
        let fall = amplitude * (k * x).cos() + depth;
        let landed = x - fall * down.x / down.y;
        let cell = (landed / wavelength * count as f64 + 0.5).rem_euclid(count as f64) as usize;
        let passed = 1.0 - f64::from(fresnel(cos as f32, (1.0 / index) as f32));
        cells[cell.min(count - 1)] += passed / still * count as f64 / RAYS as f64;
    }
    cells
}
