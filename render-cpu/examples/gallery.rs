//! Pictures of scenes made by hand, to look at: `cargo run --release -p meniscus-render-cpu --example gallery -- OUT [NAME…]`
//! writes one PNG a scene. `--size WxH` and `--samples N` set what they say.
#![allow(clippy::print_stdout)]

use meniscus_render_cpu::output::write_png;
use meniscus_render_cpu::tonemap::ToneMap;
use meniscus_render_cpu::{Whitted, camera};
use meniscus_sim::glam::{Quat, UVec2, Vec2, Vec3};
use meniscus_sim::render::{Image, Renderer};
use meniscus_sim::scene::Panorama;
use meniscus_sim::scene::description::*;
use meniscus_sim::{Frame, Grid, GridSpec, Scene};
use std::error::Error;
use std::path::{Path, PathBuf};
use std::time::Instant;

type Result<T> = std::result::Result<T, Box<dyn Error>>;

fn data(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../data").join(name)
}

fn description(name: &str, size: Vec2) -> Description {
    Description {
        name: name.to_owned(),
        seed: 1,
        duration: 1.0,
        domain: Domain {
            origin: None,
            size: Some(size),
        },
        water: Water::default(),
        terrain: None,
        ground: GroundLook::default(),
        solver: Solver::Procedural(Procedural {
            spacing: 1.0,
            depth: None,
            waves: Vec::new(),
        }),
        beds: Vec::new(),
        boundary: Boundary::default(),
        layers: Vec::new(),
        detail: None,
        horizon: None,
        objects: Vec::new(),
        light: Light::default(),
        cameras: Vec::new(),
        events: Vec::new(),
        recording: Recording::default(),
    }
}

fn scene(description: Description, grid: GridSpec) -> Scene {
    Scene {
        description,
        grid,
        terrain: None,
        meshes: Vec::new(),
        sky: None,
        initial_elevation: None,
        uplifts: Vec::new(),
    }
}

fn picture_sky(scene: &mut Scene, name: &str, rotation: f32, scale: f32) -> Result<()> {
    let picture = image::open(data(name))?.into_rgb32f();
    scene.sky = Some(Panorama {
        size: UVec2::new(picture.width(), picture.height()),
        pixels: picture.pixels().map(|p| Vec3::from(p.0)).collect(),
    });
    scene.description.light.sky = Sky::Picture {
        file: name.into(),
        layout: SkyLayout::Panorama,
        rotation,
        scale,
    };
    Ok(())
}

fn sun(elevation: f32, azimuth: f32, irradiance: Vec3) -> Option<Sun> {
    Some(Sun {
        elevation,
        azimuth,
        irradiance,
        radius: 0.2665,
    })
}

fn look(position: Vec3, target: Vec3, fov: f32, exposure: f32) -> Vec<Camera> {
    vec![Camera {
        name: "main".to_owned(),
        position,
        target,
        fov,
        exposure,
    }]
}

fn object(name: &str, shape: Shape, position: Vec3, rotation: Quat, color: Vec3) -> Object {
    Object {
        name: name.to_owned(),
        shape,
        position,
        rotation,
        velocity: meniscus_sim::glam::Vec3::ZERO,
        spin: meniscus_sim::glam::Vec3::ZERO,
        density: 500.0,
        motion: Motion::Fixed,
        color: Some(color),
    }
}

/// A ring wave: a packet of the given length whose front has gone out by `radius`.
fn ring(p: Vec2, centre: Vec2, radius: f32, length: f32, amplitude: f32) -> f32 {
    let r = (p - centre).length();
    let x = (r - radius) / (1.4 * length);
    amplitude * (-x * x).exp() * (std::f32::consts::TAU * (r - radius) / length).cos() / (1.0 + r).sqrt()
}

fn pool_frame(spec: GridSpec) -> Frame {
    let mut frame = Frame::new(spec);
    frame.elevation = Grid::from_fn(spec, |i, j| {
        let p = spec.position(i, j);
        ring(p, Vec2::new(1.9, 1.5), 1.1, 0.34, 0.022)
            + ring(p, Vec2::new(4.6, 2.9), 0.7, 0.26, 0.016)
            + ring(p, Vec2::new(3.4, 0.6), 1.9, 0.42, 0.014)
            + 0.002 * (3.1 * p.x + 4.0 * p.y).sin()
            + 0.0015 * (9.0 * p.x - 5.0 * p.y).sin()
    });
    frame
}

fn pool() -> Result<(Scene, Frame)> {
    let spec = GridSpec::new(Vec2::ZERO, 0.02, UVec2::new(301, 201))?;
    let mut d = description("pool", Vec2::new(6.0, 4.0));
    d.terrain = Some(Terrain::Flat { height: -1.3 });
    d.ground.checker = 0.4;
    d.ground.albedo = Vec3::new(0.55, 0.66, 0.68);
    d.ground.shore_albedo = Vec3::new(0.80, 0.82, 0.80);
    d.ground.steep_albedo = Vec3::new(0.62, 0.60, 0.56);
    d.objects = vec![
        object(
            "ball",
            Shape::Sphere { radius: 0.36 },
            Vec3::new(2.35, 0.06, 2.35),
            Quat::IDENTITY,
            Vec3::new(0.75, 0.10, 0.05),
        ),
        object(
            "crate",
            Shape::Box {
                size: Vec3::new(0.62, 0.62, 0.62),
            },
            Vec3::new(4.1, -0.02, 1.7),
            Quat::from_euler(meniscus_sim::glam::EulerRot::XYZ, 0.12, 0.6, -0.1),
            Vec3::new(0.55, 0.36, 0.16),
        ),
        object(
            "post",
            Shape::Cylinder {
                radius: 0.12,
                height: 2.0,
            },
            Vec3::new(5.2, -0.5, 3.2),
            Quat::IDENTITY,
            Vec3::new(0.7, 0.7, 0.72),
        ),
    ];
    d.cameras = look(Vec3::new(2.0, 2.2, 5.6), Vec3::new(3.0, -0.45, 2.0), 44.0, 0.0);
    let mut scene = scene(d, spec);
    picture_sky(&mut scene, "sky/sky.exr", 0.0, 1.0)?;
    scene.terrain = Some(Grid::filled(
        GridSpec::new(Vec2::ZERO, 1.0, UVec2::new(7, 5))?,
        -1.3,
    ));
    Ok((scene, pool_frame(spec)))
}

fn below() -> Result<(Scene, Frame)> {
    let (mut scene, frame) = pool()?;
    scene.description.name = "below".to_owned();
    scene.description.water.scattering = Vec3::splat(0.3);
    scene.description.cameras = look(Vec3::new(0.8, -0.95, 3.4), Vec3::new(3.2, -0.25, 1.7), 75.0, 1.6);
    Ok((scene, frame))
}

fn aquarium() -> Result<(Scene, Frame)> {
    let (mut scene, frame) = pool()?;
    scene.description.name = "aquarium".to_owned();
    scene.description.cameras = look(Vec3::new(2.4, -0.35, 9.0), Vec3::new(3.0, -0.6, 2.0), 34.0, 0.0);
    Ok((scene, frame))
}

fn lake() -> Result<(Scene, Frame)> {
    let picture = image::open(data("terrain/jacksboro.png"))?.into_luma16();
    // 74.5 by 92.6 m a pixel, brought to square spacing.
    let spacing = 74.5_f32;
    let raw_spec = GridSpec::new(Vec2::ZERO, 1.0, UVec2::new(picture.width(), picture.height()))?;
    let raw = Grid::from_vec(raw_spec, picture.pixels().map(|p| f32::from(p.0[0])).collect())?;
    let rows = ((picture.height() - 1) as f32 * 92.6 / spacing) as u32 + 1;
    let spec = GridSpec::new(Vec2::ZERO, spacing, UVec2::new(picture.width(), rows))?;
    let terrain = Grid::from_fn(spec, |i, j| {
        raw.sample(Vec2::new(i as f32, j as f32 * spacing / 92.6))
    });
    let mut d = description("lake", spec.extent());
    let level = 348.0;
    d.water.level = level;
    d.terrain = Some(Terrain::Flat { height: 0.0 });
    d.water.scattering = Vec3::splat(0.25);
    d.cameras = look(
        Vec3::new(28_200.0, 1_050.0, 8_200.0),
        Vec3::new(19_500.0, 320.0, 15_800.0),
        38.0,
        0.0,
    );
    let mut scene = scene(d, spec);
    picture_sky(&mut scene, "sky/sky.exr", 0.0, 1.0)?;
    scene.terrain = Some(terrain);
    let mut frame = Frame::new(spec);
    frame.elevation = Grid::from_fn(spec, |i, j| level + 0.3 * (0.7 * i as f32 + 0.4 * j as f32).sin());
    Ok((scene, frame))
}

fn shore() -> Result<(Scene, Frame)> {
    let (mut scene, frame) = lake()?;
    scene.description.name = "shore".to_owned();
    scene.description.cameras = look(
        Vec3::new(21_000.0, 372.0, 14_600.0),
        Vec3::new(14_500.0, 500.0, 17_800.0),
        48.0,
        0.0,
    );
    Ok((scene, frame))
}

/// Deep-water waves of a wind sea as a periodic grid: elevation only.
fn sea_frame(spec: GridSpec) -> Frame {
    let period = spec.spacing * spec.size.x as f32;
    let mut waves = Vec::new();
    let mut rng = meniscus_sim::rng::Rng::new(4, 9);
    for _ in 0..90 {
        // Whole numbers of waves in the period, falling off in amplitude as a wind sea does.
        let k = 2.0 * (45.0_f64).powf(rng.uniform());
        let angle = 0.5 * rng.normal();
        let (kx, kz) = ((k * angle.cos()).round(), (k * angle.sin()).round());
        let length = (kx * kx + kz * kz).sqrt();
        if length < 1.0 {
            continue;
        }
        let amplitude = 0.0105 * f64::from(period) / length.powf(1.35) * (0.5 + rng.uniform()) * 0.18;
        waves.push((
            kx as f32,
            kz as f32,
            amplitude as f32,
            std::f32::consts::TAU * rng.uniform_f32(),
        ));
    }
    let mut frame = Frame::new(spec);
    let n = spec.size.as_vec2();
    frame.elevation = Grid::from_fn(spec, |i, j| {
        waves
            .iter()
            .map(|&(kx, kz, a, phase)| {
                let x = std::f32::consts::TAU * (kx * i as f32 / n.x + kz * j as f32 / n.y) + phase;
                // A little sharper at the crest than at the trough.
                a * (x.cos() + 0.15 * (2.0 * x).cos())
            })
            .sum()
    });
    frame
}

fn sea(sky: &str, elevation: f32, azimuth: f32, eye: Vec3) -> Result<(Scene, Frame)> {
    let spec = GridSpec::new(Vec2::ZERO, 0.25, UVec2::splat(512))?;
    let mut d = description("sea", Vec2::splat(128.0));
    d.boundary = Boundary {
        drives: Vec::new(),
        x_min: Edge::Periodic,
        x_max: Edge::Periodic,
        z_min: Edge::Periodic,
        z_max: Edge::Periodic,
    };
    d.water.scattering = Vec3::splat(0.08);
    d.cameras = look(eye, eye + Vec3::new(30.0, -5.0, -60.0), 45.0, 0.0);
    let mut scene = scene(d, spec);
    if sky.is_empty() {
        scene.description.light.sun = sun(elevation, azimuth, Vec3::new(3.2, 3.0, 2.6));
        scene.description.light.sky = Sky::Daylight {
            turbidity: 3.0,
            scale: 1.0,
        };
    } else {
        picture_sky(&mut scene, sky, 0.0, 1.0)?;
    }
    Ok((scene, sea_frame(spec)))
}

fn main() -> Result<()> {
    let mut out = PathBuf::from(".");
    let (mut size, mut samples) = (UVec2::new(960, 540), 9);
    let mut wanted: Vec<String> = Vec::new();
    let mut arguments = std::env::args().skip(1);
    let mut first = true;
    while let Some(argument) = arguments.next() {
        match argument.as_str() {
            "--size" => {
                let text = arguments.next().unwrap_or_default();
                let (w, h) = text.split_once('x').ok_or("--size takes WIDTHxHEIGHT")?;
                size = UVec2::new(w.parse()?, h.parse()?);
            }
            "--samples" => samples = arguments.next().unwrap_or_default().parse()?,
            _ if first => {
                out = argument.into();
                first = false;
            }
            _ => wanted.push(argument),
        }
    }
    std::fs::create_dir_all(&out)?;
    type Make = fn() -> Result<(Scene, Frame)>;
    let scenes: [(&str, Make); 7] = [
        ("pool", pool),
        ("below", below),
        ("aquarium", aquarium),
        ("lake", lake),
        ("shore", shore),
        ("sea", || sea("", 32.0, 20.0, Vec3::new(0.0, 5.0, 0.0))),
        ("sunset", || {
            sea("sky/sunset.exr", 8.0, 200.0, Vec3::new(0.0, 4.0, 0.0))
        }),
    ];
    for (name, make) in scenes {
        if !wanted.is_empty() && !wanted.iter().any(|w| w == name) {
            continue;
        }
        let (scene, frame) = make()?;
        let view = camera::view(&scene, None, size, samples)?;
        let map = ToneMap::new(camera::exposure(&scene, None)?);
        let mut image = Image::default();
        let mut renderer = Whitted::default();
        let start = Instant::now();
        let report = renderer.render(&scene, &frame, &view, &mut image, &|_| true)?;
        let seconds = start.elapsed().as_secs_f64();
        let rate = f64::from(size.x * size.y * samples) / seconds / 1e6;
        println!(
            "{name}: {seconds:.2} s, {rate:.2} M samples/s, {:.2} M rays/s, stages {:?}",
            report.rays as f64 / seconds / 1e6,
            report.stages
        );
        write_png(&out.join(format!("{name}.png")), &image, &map)?;
        if std::env::var_os("GALLERY_RAW").is_some() {
            let bytes: Vec<u8> = image
                .pixels
                .iter()
                .flat_map(|p| p.to_array())
                .flat_map(f32::to_le_bytes)
                .collect();
            std::fs::write(out.join(format!("{name}.raw")), bytes)?;
        }
    }
    Ok(())
}
