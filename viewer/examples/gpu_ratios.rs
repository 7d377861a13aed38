//! Costs of the techniques on this machine's first graphics adapter, as ratios taken in one run, and a check that what was timed
//! is right. Needs no other file and takes two or three minutes.
//!
//!     cargo build --release -p meniscus --features gpu --example gpu_ratios
//!     target/release/examples/gpu_ratios [WIDTHxHEIGHT] [FRAMES]
#![allow(clippy::print_stdout)]

use anyhow::Context as _;
use meniscus::study::measure::process_cpu_seconds;
use meniscus::study::tiled_pool::{self, Things, waves};
use meniscus_render_cpu::metrics::{Summary, flip};
use meniscus_render_cpu::tonemap::{ToneMap, srgb};
use meniscus_render_cpu::{Settings as CpuSettings, Whitted};
use meniscus_render_gpu::{GpuRenderer, Heights, Settings, Technique, Walk};
use meniscus_sim::glam::{UVec2, Vec3};
use meniscus_sim::mesh::TriangleMesh;
use meniscus_sim::render::{Image, Renderer as _, View};
use meniscus_sim::{Frame, Scene};
use std::time::Instant;

/// A ball of about so many triangles.
fn ball(radius: f32, triangles: u32) -> TriangleMesh {
    let rows = ((triangles as f32 / 4.0).sqrt().round() as u32).max(3);
    let columns = 2 * rows;
    let mut mesh = TriangleMesh::default();
    for j in 0..=rows {
        for i in 0..=columns {
            let (polar, around) = (
                j as f32 / rows as f32 * std::f32::consts::PI,
                i as f32 / columns as f32 * std::f32::consts::TAU,
            );
            let n = Vec3::new(
                polar.sin() * around.cos(),
                polar.cos(),
                polar.sin() * around.sin(),
            );
            mesh.positions.push(radius * n);
            mesh.normals.push(n);
        }
    }
    for j in 0..rows {
        for i in 0..columns {
            let a = j * (columns + 1) + i;
            let b = a + columns + 1;
            mesh.triangles.push([a, a + 1, b]);
            mesh.triangles.push([a + 1, b + 1, b]);
        }
    }
    mesh
}

fn scene(triangles: u32) -> anyhow::Result<Scene> {
    let mut scene = tiled_pool::scene(Things::OneModel, 0.02)?;
    scene.meshes[0] = ball(0.55, triangles);
    Ok(scene)
}

fn view(size: UVec2, position: Vec3, target: Vec3) -> View {
    View {
        position,
        target,
        up: Vec3::Y,
        vertical_fov: 52_f32.to_radians(),
        size,
        samples: 1,
        pass: 0,
    }
}

/// Milliseconds of a frame, best of several: the passes' own times where the device tells, else wall time; on a software adapter
/// processor time, for there other work on the machine would be counted too. And the best of each pass.
struct Times {
    total: f64,
    passes: Vec<(&'static str, f64)>,
}

const HOST: [&str; 4] = ["scene", "frame", "upload", "device"];
/// Frames that are drawn before any is counted: the first make pipelines.
const WARM_UP: u32 = 2;

/// Times of each of these renderers, which take turns frame by frame, so that what else happens to the machine happens to all.
fn race(
    all: Vec<Settings>,
    scene: &Scene,
    frame: &Frame,
    view: &View,
    frames: u32,
) -> anyhow::Result<Vec<Times>> {
    let mut entries: Vec<(GpuRenderer, Times)> = all
        .into_iter()
        .map(|settings| {
            let none = Times {
                total: f64::INFINITY,
                passes: Vec::new(),
            };
            (GpuRenderer::new(settings), none)
        })
        .collect();
    let mut image = Image::default();
    for k in 0..frames + WARM_UP {
        for (renderer, best) in &mut entries {
            let (start, cpu) = (Instant::now(), process_cpu_seconds());
            let report = renderer.render(scene, frame, view, &mut image, &|_| true)?;
            let wall = start.elapsed().as_secs_f64();
            let cpu = cpu.zip(process_cpu_seconds()).map(|(a, b)| b - a);
            if k < WARM_UP {
                continue;
            }
            let mut total = 0.0;
            for (name, seconds) in report.stages.iter().filter(|(n, _)| !HOST.contains(n)) {
                total += seconds;
                match best.passes.iter_mut().find(|(n, _)| n == name) {
                    Some((_, least)) => *least = least.min(1e3 * seconds),
                    None => best.passes.push((name, 1e3 * seconds)),
                }
            }
            let total = match cpu.filter(|_| is_software(renderer)) {
                Some(cpu) => cpu,
                None if renderer.is_timed() => total,
                None => wall,
            };
            best.total = best.total.min(1e3 * total);
        }
    }
    Ok(entries.into_iter().map(|(_, times)| times).collect())
}

/// Times of one renderer alone.
fn only(settings: Settings, scene: &Scene, frame: &Frame, view: &View, frames: u32) -> anyhow::Result<Times> {
    let mut all = race(vec![settings], scene, frame, view, frames)?;
    all.pop().context("one renderer was timed")
}

/// Milliseconds of the traced pass, or where it is not known, of the frame.
fn of_pass(times: &Times) -> f64 {
    let pass = times.passes.iter().find(|(n, _)| *n == "heightfield");
    pass.map_or(times.total, |(_, v)| *v)
}

fn is_software(renderer: &GpuRenderer) -> bool {
    renderer.adapter().is_some_and(|a| a.kind == "software")
}

fn settings(technique: Technique, plain: bool) -> Settings {
    let mut settings = Settings::new(technique);
    if plain {
        // Refraction alone: no rays for shadows, mirrors and caustics.
        settings.switches.shadows = false;
        settings.switches.traced_reflection = false;
        settings.switches.self_reflection = false;
        settings.caustics = false;
    }
    settings
}

fn line(label: &str, times: &Times) {
    let passes: Vec<String> = times.passes.iter().map(|(n, t)| format!("{n} {t:.3}")).collect();
    println!("  {label:<34} {:>9.3} ms   ({})", times.total, passes.join(", "));
}

fn display(image: &Image) -> Vec<Vec3> {
    let map = ToneMap::new(0.0);
    image.pixels.iter().map(|&p| srgb(map.display(p))).collect()
}

fn check(size: UVec2) -> anyhow::Result<()> {
    println!(
        "check: FLIP (mean, 95th percentile over water) against the ray tracer, {} x {}",
        size.x, size.y
    );
    let scene = scene(4_000)?;
    let frame = waves(&scene, 0.02);
    let view = view(size, Vec3::new(0.5, 1.7, 5.2), Vec3::new(3.1, -0.9, 2.0));
    let mut whitted = Whitted::new(CpuSettings {
        interface_depth: 1,
        ..CpuSettings::default()
    });
    let mut truth = Image::default();
    whitted.render(&scene, &frame, &view, &mut truth, &|_| true)?;
    let places = whitted.render_aux(&scene, &frame, &view, &|_| true)?;
    let water: Vec<bool> = places.pixels.iter().map(|p| p.water).collect();
    let more = [2, 3].map(|rounds| {
        let mut settings = Settings::new(Technique::TwoPhase);
        settings.switches.narrow_steps = rounds;
        (
            settings,
            if rounds == 2 {
                "two-phase, 2 rounds"
            } else {
                "two-phase, 3 rounds"
            },
        )
    });
    let smooth = {
        let mut settings = Settings::new(Technique::TwoPhase);
        settings.switches.multisampled = true;
        (settings, "two-phase, MSAA")
    };
    let sixteen = Settings {
        heights: Heights::Sixteen,
        ..Settings::new(Technique::Heightfield)
    };
    let all = Technique::ALL.map(|t| (Settings::new(t), t.name()));
    for (settings, name) in all
        .into_iter()
        .chain(more)
        .chain([smooth, (sixteen, "heightfield, 16 bits")])
    {
        let start = Instant::now();
        let mut renderer = GpuRenderer::new(settings);
        let mut image = Image::default();
        renderer.render(&scene, &frame, &view, &mut image, &|_| true)?;
        let first = start.elapsed().as_secs_f64();
        let map = flip::flip(size, &display(&truth), &display(&image), flip::PIXELS_PER_DEGREE)?;
        let Some(s) = Summary::of(&map, Some(&water)) else {
            continue;
        };
        let missing = renderer.missing();
        println!(
            "  {:<22} {:.4} {:.4}   first frame {:.2} s, {} pipelines, {:.1} MiB held, missing {missing:?}",
            name,
            s.mean,
            s.p95,
            first,
            renderer.pipelines(),
            renderer.held_bytes() as f64 / 1_048_576.0
        );
    }
    Ok(())
}

fn refraction(size: UVec2, frames: u32) -> anyhow::Result<()> {
    let view = view(size, Vec3::new(0.5, 1.7, 5.2), Vec3::new(3.1, -0.9, 2.0));
    for (name, plain) in [
        ("refraction alone", true),
        ("with shadows, mirrors and caustics", false),
    ] {
        for triangles in [16_000, 128_000] {
            let scene = scene(triangles)?;
            let frame = waves(&scene, 0.01);
            println!("{name}, {} triangles", scene.meshes[0].triangles.len());
            let techniques = [
                Technique::NoRefraction,
                Technique::TwoPhase,
                Technique::Offset,
                Technique::ScreenSpace,
                Technique::DistanceField,
                Technique::Heightfield,
            ];
            let mut entries: Vec<(String, Settings)> = techniques
                .map(|t| (t.name().to_owned(), settings(t, plain)))
                .to_vec();
            for rounds in [2, 3] {
                let mut more = settings(Technique::TwoPhase, plain);
                more.switches.narrow_steps = rounds;
                entries.push((format!("two-phase, {rounds} rounds"), more));
            }
            let mut msaa = settings(Technique::TwoPhase, plain);
            msaa.switches.multisampled = true;
            entries.push(("two-phase, MSAA".to_owned(), msaa));
            let (labels, all): (Vec<_>, Vec<_>) = entries.into_iter().unzip();
            let times = race(all, &scene, &frame, &view, frames)?;
            for (label, t) in labels.iter().zip(&times) {
                line(label, t);
            }
            let of = |which: Technique| {
                let found = techniques.iter().zip(&times).find(|(t, _)| **t == which);
                found.map_or(f64::NAN, |(_, v)| v.total)
            };
            let [rounds @ .., smooth] = [6, 7, 8].map(|k| times.get(k).map_or(f64::NAN, |t| t.total));
            let two = of(Technique::TwoPhase);
            println!(
                "  two-phase / no-refraction {:.3}   (paper 1.03, 1.01; bar 1.10)",
                two / of(Technique::NoRefraction)
            );
            for (n, t) in [2, 3].into_iter().zip(rounds) {
                println!(
                    "  the same with {n} rounds {:.3}",
                    t / of(Technique::NoRefraction)
                );
            }
            println!("  with MSAA / without {:.3}", smooth / two);
            println!(
                "  ray-traced / two-phase {:.2}   (paper 6.5, 20)",
                of(Technique::Heightfield) / two
            );
            println!(
                "  distance field / two-phase {:.2}   (paper 2.2, 10)",
                of(Technique::DistanceField) / two
            );
            println!(
                "  screen space / two-phase {:.2}   (paper 1.23, 1.42)",
                of(Technique::ScreenSpace) / two
            );
        }
    }
    Ok(())
}

fn heightfield(size: UVec2, frames: u32) -> anyhow::Result<()> {
    let scene = scene(4_000)?;
    let frame = waves(&scene, 0.01);
    println!("heightfield: cost against water pixels");
    let mut renderer = GpuRenderer::from(Technique::Heightfield);
    let mut rows = Vec::new();
    for pitch in [0.0_f32, 0.15, 0.3, 0.5, 0.7] {
        let eye = Vec3::new(3.0, 2.2, 5.6);
        let view = view(size, eye, eye + Vec3::new(0.0, -pitch.sin(), -pitch.cos()));
        let met = renderer.met(&scene, &frame, &view)?;
        let water = met.iter().filter(|m| m.water).count() as f64 / met.len().max(1) as f64;
        let pass = of_pass(&only(
            Settings::new(Technique::Heightfield),
            &scene,
            &frame,
            &view,
            frames,
        )?);
        println!(
            "  pitch {pitch:.2}: water {:.3} of the picture, {pass:.3} ms",
            water
        );
        rows.push((water, pass));
    }
    if let (Some(first), Some(last)) = (rows.first(), rows.last()) {
        let slope = (last.1 - first.1) / (last.0 - first.0);
        println!(
            "  {slope:.3} ms a picture of water, {:.3} ms without",
            first.1 - slope * first.0
        );
    }
    let view = view(size, Vec3::new(0.5, 1.7, 5.2), Vec3::new(3.1, -0.9, 2.0));
    println!("heightfield: effects switched");
    let changes: [(&str, &dyn Fn(&mut Settings)); 9] = [
        ("everything", &|_| {}),
        ("without self-reflection", &|s| s.switches.self_reflection = false),
        ("without caustics", &|s| s.caustics = false),
        ("without shadows", &|s| s.switches.shadows = false),
        ("without absorption", &|s| s.switches.absorption = false),
        ("cut-off at 1 % of light", &|s| s.absorption_cutoff = 0.01),
        ("safety radius instead of pyramid", &|s| s.walk = Walk::Safety),
        ("interface depth 3", &|s| s.switches.interface_depth = 3),
        ("smooth edges", &|s| s.switches.multisampled = true),
    ];
    let all = changes.map(|(_, change)| {
        let mut settings = Settings::new(Technique::Heightfield);
        change(&mut settings);
        settings
    });
    let times = race(all.to_vec(), &scene, &frame, &view, frames)?;
    let whole = times.first().map_or(f64::NAN, |t| t.total);
    for ((name, _), t) in changes.iter().zip(&times) {
        line(name, t);
        println!("    everything / this {:.3}", whole / t.total);
    }
    println!("caustics: cost against coverage of the picture");
    for distance in [1.0_f32, 3.0, 9.0] {
        let target = Vec3::new(3.0, -0.5, 2.0);
        let view = self::view(size, target + distance * Vec3::new(-0.4, 0.8, 0.9), target);
        let t = only(
            Settings::new(Technique::Heightfield),
            &scene,
            &frame,
            &view,
            frames,
        )?;
        let caustics: f64 = t
            .passes
            .iter()
            .filter(|(n, _)| ["photons", "light sums", "light on the ground", "filter"].contains(n))
            .map(|(_, v)| v)
            .sum();
        println!(
            "  at {distance} m: caustics {caustics:.3} ms of {:.3} ms",
            t.total
        );
    }
    Ok(())
}

/// Error against time of the ways in which rays find heightfields, over ground that they graze.
fn walks(size: UVec2, frames: u32) -> anyhow::Result<()> {
    let scene = tiled_pool::ridged(0.02)?;
    let frame = waves(&scene, 0.025);
    let view = view(size, Vec3::new(0.5, 1.7, 5.2), Vec3::new(3.1, -0.9, 2.0));
    println!("walks over ridges: ms of the traced pass, FLIP mean against the pyramid's picture");
    let mut exact: Option<Vec<Vec3>> = None;
    let mut one = |label: &str, settings: Settings| -> anyhow::Result<()> {
        let total = of_pass(&only(settings, &scene, &frame, &view, frames)?);
        let mut renderer = GpuRenderer::new(settings);
        let mut image = Image::default();
        renderer.render(&scene, &frame, &view, &mut image, &|_| true)?;
        let shown = display(&image);
        let truth = exact.get_or_insert_with(|| shown.clone());
        let map = flip::flip(size, truth, &shown, flip::PIXELS_PER_DEGREE)?;
        let mean = Summary::of(&map, None).map_or(f64::NAN, |s| s.mean);
        println!(
            "  {label:<34} {total:>9.3} ms, FLIP {mean:.5}, {:.2} MiB held",
            renderer.held_bytes() as f64 / 1_048_576.0
        );
        Ok(())
    };
    let base = Settings::new(Technique::Heightfield);
    one("pyramid", base)?;
    let heights = Heights::Sixteen;
    one("pyramid, 16 bits", Settings { heights, ..base })?;
    for (walk, name) in [(Walk::Safety, "one radius"), (Walk::SafetyMap, "radius a texel")] {
        for safety_scale in [0.25, 0.5, 1.0, 2.0, 4.0] {
            let settings = Settings {
                walk,
                safety_scale,
                ..base
            };
            one(&format!("{name} x {safety_scale}"), settings)?;
        }
    }
    Ok(())
}

fn main() -> anyhow::Result<()> {
    let mut arguments = std::env::args().skip(1);
    let size = match arguments.next() {
        Some(text) => {
            let (w, h) = text.split_once('x').unwrap_or((&text, &text));
            UVec2::new(w.parse()?, h.parse()?)
        }
        None => UVec2::new(1280, 720),
    };
    let frames: u32 = arguments.next().map_or(Ok(20), |n| n.parse())?;
    let start = Instant::now();
    for adapter in meniscus_render_gpu::adapters::list() {
        println!(
            "adapter: {} ({}, {}, {})",
            adapter.name, adapter.kind, adapter.backend, adapter.driver
        );
    }
    check(UVec2::new(320, 180).min(size))?;
    {
        let scene = scene(1_000)?;
        let frame = waves(&scene, 0.01);
        let mut renderer = GpuRenderer::from(Technique::NoRefraction);
        let view = view(
            UVec2::splat(64),
            Vec3::new(0.5, 1.7, 5.2),
            Vec3::new(3.1, -0.9, 2.0),
        );
        renderer.render(&scene, &frame, &view, &mut Image::default(), &|_| true)?;
        println!(
            "timed on {} by {}",
            renderer.adapter().map_or("?", |a| a.name.as_str()),
            if is_software(&renderer) {
                "processor time of whole frames, and timestamps of the passes"
            } else if renderer.is_timed() {
                "timestamps of the passes"
            } else {
                "wall time of whole frames"
            }
        );
    }
    println!("{} x {} pixels, best of {frames} frames in turns", size.x, size.y);
    refraction(size, frames)?;
    heightfield(size, frames)?;
    walks(size, frames)?;
    println!("all in {:.0} s", start.elapsed().as_secs_f64());
    Ok(())
}
