//! Costs of the techniques on this machine's first graphics adapter, as ratios taken in one run, and a check that what was timed
//! is right. Needs no other file and takes two or three minutes.
//!
//!     cargo build --release -p meniscus --features gpu --example gpu_ratios
//!     target/release/examples/gpu_ratios [WIDTHxHEIGHT] [FRAMES]
#![allow(clippy::print_stdout)]

use meniscus_render_cpu::metrics::{Summary, flip};
use meniscus_render_cpu::tonemap::{ToneMap, srgb};
use meniscus_render_cpu::{Settings as CpuSettings, Whitted};
use meniscus_render_gpu::{GpuRenderer, Settings, Technique, Walk};
use meniscus_sim::glam::{UVec2, Vec2, Vec3};
use meniscus_sim::mesh::TriangleMesh;
use meniscus_sim::render::{Image, Renderer as _, View};
use meniscus_sim::{Frame, Grid, Scene};
use std::path::Path;
use std::time::Instant;

const POOL: &str = r#"
name = "pool"
domain = { size = [6.0, 4.0] }
terrain = { kind = "flat", height = -1.5 }
ground = { albedo = [0.78, 0.80, 0.80], shore_albedo = [0.16, 0.40, 0.52], steep_albedo = [0.55, 0.53, 0.49], checker = 0.5 }
solver = { kind = "wave-equation", spacing = 0.02 }
light = { sun = { elevation = 55.0, azimuth = 150.0 } }
[[object]]
name = "ball"
shape = { kind = "model", file = "bunny.glb" }
position = [3.0, -0.9, 2.0]
color = [0.80, 0.16, 0.10]
"#;

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
    let folder = tempfile::tempdir()?;
    std::fs::write(
        folder.path().join("bunny.glb"),
        include_bytes!("../../data/models/bunny.glb"),
    )?;
    let mut scene = Scene::from_toml(POOL, Path::new("pool.toml"), folder.path(), &[])?;
    scene.meshes[0] = ball(0.55, triangles);
    Ok(scene)
}

fn frame(scene: &Scene, amplitude: f32) -> Frame {
    let mut frame = Frame::new(scene.grid);
    let spec = scene.grid;
    frame.elevation = Grid::from_fn(spec, |i, j| {
        let p = spec.position(i, j);
        [(1.6_f32, 0.3_f32, 0.5_f32), (0.9, 1.4, 0.3), (0.55, -0.8, 0.2)]
            .into_iter()
            .map(|(length, angle, share)| {
                let along = p.dot(Vec2::from_angle(angle));
                amplitude * share * (std::f32::consts::TAU * along / length + angle).sin()
            })
            .sum()
    });
    frame
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

/// Median milliseconds of a frame on the device: the passes' own times where the device tells, else wall time; and of each
/// pass.
struct Times {
    total: f64,
    passes: Vec<(&'static str, f64)>,
}

const HOST: [&str; 4] = ["scene", "frame", "upload", "device"];

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
}

fn time(
    renderer: &mut GpuRenderer,
    scene: &Scene,
    frame: &Frame,
    view: &View,
    frames: u32,
) -> anyhow::Result<Times> {
    let mut image = Image::default();
    let mut totals = Vec::new();
    let mut passes: Vec<(&'static str, Vec<f64>)> = Vec::new();
    for k in 0..frames + 3 {
        let start = Instant::now();
        let report = renderer.render(scene, frame, view, &mut image, &|_| true)?;
        let wall = start.elapsed().as_secs_f64();
        // The first frames make pipelines.
        if k < 3 {
            continue;
        }
        let mut total = 0.0;
        for (name, seconds) in report.stages.iter().filter(|(n, _)| !HOST.contains(n)) {
            total += seconds;
            match passes.iter_mut().find(|(n, _)| n == name) {
                Some((_, list)) => list.push(1e3 * seconds),
                None => passes.push((name, vec![1e3 * seconds])),
            }
        }
        totals.push(1e3 * if renderer.is_timed() { total } else { wall });
    }
    Ok(Times {
        total: median(totals),
        passes: passes.into_iter().map(|(n, list)| (n, median(list))).collect(),
    })
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
    let frame = frame(&scene, 0.02);
    let view = view(size, Vec3::new(0.5, 1.7, 5.2), Vec3::new(3.1, -0.9, 2.0));
    let mut whitted = Whitted::new(CpuSettings {
        interface_depth: 1,
        ..CpuSettings::default()
    });
    let mut truth = Image::default();
    whitted.render(&scene, &frame, &view, &mut truth, &|_| true)?;
    let places = whitted.render_aux(&scene, &frame, &view, &|_| true)?;
    let water: Vec<bool> = places.pixels.iter().map(|p| p.water).collect();
    let once = {
        let mut settings = Settings::new(Technique::TwoPhase);
        settings.switches.narrow_steps = 1;
        (settings, "two-phase, one look-up")
    };
    let all = Technique::ALL.map(|t| (Settings::new(t), t.name()));
    for (settings, name) in all.into_iter().chain([once]) {
        let start = Instant::now();
        let mut renderer = GpuRenderer::new(settings);
        let mut image = Image::default();
        renderer.render(&scene, &frame, &view, &mut image, &|_| true)?;
        let first = start.elapsed().as_secs_f64();
        let map = flip::flip(size, &display(&truth), &display(&image), flip::PIXELS_PER_DEGREE)?;
        let Some(s) = Summary::of(&map, Some(&water)) else {
            continue;
        };
        println!(
            "  {:<22} {:.4} {:.4}   first frame {:.2} s, {} pipelines, {:.1} MiB held, missing {:?}",
            name,
            s.mean,
            s.p95,
            first,
            renderer.pipelines(),
            renderer.held_bytes() as f64 / 1_048_576.0,
            renderer.missing()
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
            let frame = frame(&scene, 0.01);
            println!("{name}, {} triangles", scene.meshes[0].triangles.len());
            let mut times = Vec::new();
            for technique in [
                Technique::NoRefraction,
                Technique::TwoPhase,
                Technique::Offset,
                Technique::ScreenSpace,
                Technique::DistanceField,
                Technique::Heightfield,
            ] {
                let mut renderer = GpuRenderer::new(settings(technique, plain));
                let t = time(&mut renderer, &scene, &frame, &view, frames)?;
                line(technique.name(), &t);
                times.push((technique, t.total));
            }
            let mut once = settings(Technique::TwoPhase, plain);
            once.switches.narrow_steps = 1;
            let one_look = time(&mut GpuRenderer::new(once), &scene, &frame, &view, frames)?;
            let of = |which: Technique| {
                times
                    .iter()
                    .find(|(t, _)| *t == which)
                    .map_or(f64::NAN, |(_, v)| *v)
            };
            let two = of(Technique::TwoPhase);
            println!(
                "  two-phase / no-refraction {:.3}   (paper 1.03, 1.01; bar 1.10)",
                two / of(Technique::NoRefraction)
            );
            println!(
                "  the same with one look-up, as the paper's, instead of three {:.3}",
                one_look.total / of(Technique::NoRefraction)
            );
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
    let frame = frame(&scene, 0.01);
    println!("heightfield: cost against water pixels");
    let mut renderer = GpuRenderer::from(Technique::Heightfield);
    let mut rows = Vec::new();
    for pitch in [0.0_f32, 0.15, 0.3, 0.5, 0.7] {
        let eye = Vec3::new(3.0, 2.2, 5.6);
        let view = view(size, eye, eye + Vec3::new(0.0, -pitch.sin(), -pitch.cos()));
        let met = renderer.met(&scene, &frame, &view)?.unwrap_or_default();
        let water = met.iter().filter(|m| m.water).count() as f64 / met.len().max(1) as f64;
        let t = time(&mut renderer, &scene, &frame, &view, frames)?;
        let pass = t
            .passes
            .iter()
            .find(|(n, _)| *n == "heightfield")
            .map_or(t.total, |(_, v)| *v);
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
    let with = |change: &dyn Fn(&mut Settings)| -> anyhow::Result<Times> {
        let mut settings = Settings::new(Technique::Heightfield);
        change(&mut settings);
        time(&mut GpuRenderer::new(settings), &scene, &frame, &view, frames)
    };
    let whole = with(&|_| {})?;
    line("everything", &whole);
    for (name, change) in [
        (
            "without self-reflection",
            (&|s: &mut Settings| s.switches.self_reflection = false) as &dyn Fn(&mut Settings),
        ),
        ("without caustics", &|s| s.caustics = false),
        ("without shadows", &|s| s.switches.shadows = false),
        ("without absorption", &|s| s.switches.absorption = false),
        ("cut-off at 1 % of light", &|s| s.absorption_cutoff = 0.01),
        ("safety radius instead of pyramid", &|s| s.walk = Walk::Safety),
        ("interface depth 3", &|s| s.switches.interface_depth = 3),
    ] {
        let t = with(change)?;
        line(name, &t);
        println!("    everything / this {:.3}", whole.total / t.total);
    }
    println!("caustics: cost against coverage of the picture");
    for distance in [1.0_f32, 3.0, 9.0] {
        let target = Vec3::new(3.0, -0.5, 2.0);
        let view = self::view(size, target + distance * Vec3::new(-0.4, 0.8, 0.9), target);
        let mut renderer = GpuRenderer::from(Technique::Heightfield);
        let t = time(&mut renderer, &scene, &frame, &view, frames)?;
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
        let frame = frame(&scene, 0.01);
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
            if renderer.is_timed() {
                "timestamps of the passes"
            } else {
                "wall time of whole frames"
            }
        );
    }
    println!("{} x {} pixels, median of {frames} frames", size.x, size.y);
    refraction(size, frames)?;
    heightfield(size, frames)?;
    println!("all in {:.0} s", start.elapsed().as_secs_f64());
    Ok(())
}
