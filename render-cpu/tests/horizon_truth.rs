//! The room of pictures against closed forms, and the faults that the paper lists of its own program.

mod common;

use common::{draw, floor, frame, scene, square, view};
use meniscus_render_cpu::{HorizonRenderer, camera};
use meniscus_sim::Scene;
use meniscus_sim::frame::Frame;
use meniscus_sim::glam::{UVec2, Vec2, Vec3};
use meniscus_sim::render::{Image, View};
use meniscus_sim::scene::Panorama;
use meniscus_sim::scene::description::{Horizon, NormalBlend, Sky, SkyLayout};
use std::path::Path;

fn picture(scene: &Scene, frame: &Frame, view: &View) -> Image {
    draw(&mut HorizonRenderer::default(), scene, frame, view).0
}

fn looks(scene: &mut Scene, look: Horizon) {
    scene.description.horizon = Some(look);
}

fn choppy(p: Vec2) -> f32 {
    0.2 * (1.1 * p.x + 0.4 * p.y).sin() + 0.12 * (2.3 * p.y - 1.4 * p.x).cos()
}

/// A sky whose radiance says where it was looked at: red by the sine of the azimuth, green by its cosine, blue by
/// elevation, all of them smooth.
fn telling(scene: &mut Scene) {
    let size = UVec2::new(512, 256);
    let pixels = (0..size.x * size.y)
        .map(|k| {
            let around = ((k % size.x) as f32 + 0.5) / size.x as f32 * std::f32::consts::TAU;
            let up = 1.0 - 2.0 * ((k / size.x) as f32 + 0.5) / size.y as f32;
            Vec3::new(1.0 + around.sin(), 1.0 + around.cos(), 1.0 + up)
        })
        .collect();
    scene.sky = Some(Panorama { size, pixels });
    scene.description.light.sky = Sky::Picture {
        file: "made by hand".into(),
        layout: SkyLayout::Panorama,
        rotation: 0.0,
        scale: 1.0,
    };
}

fn told(direction: Vec3) -> Vec3 {
    let level = Vec2::new(direction.x, -direction.z).normalize();
    let up = direction.normalize().y.asin() / std::f32::consts::FRAC_PI_2;
    Vec3::new(1.0 + level.x, 1.0 + level.y, 1.0 + up)
}

/// The paper's backdrop "shifts over a couple dozen pixels when ray tracing". Here it is where it hangs, and so is its
/// mirror image in still water.
#[test]
fn backdrop_and_reflection_are_where_the_closed_form_has_them() {
    let mut scene = scene(square(41, 0.25));
    telling(&mut scene);
    looks(
        &mut scene,
        Horizon {
            distance: Some(3.0),
            mix: Some(1.0),
            ..Horizon::default()
        },
    );
    let view = view(
        Vec3::new(6.0, 1.5, 9.0),
        Vec3::new(4.0, 0.6, 0.0),
        UVec2::new(61, 47),
    );
    let image = picture(&scene, &frame(scene.grid, |_| 0.0), &view);
    // The room: 3 m beyond 0 to 10 m; seen from its middle at the water's level.
    let (low, high, middle) = (Vec3::splat(-3.0), Vec3::splat(13.0), Vec3::new(5.0, 0.0, 5.0));
    let on_wall = |o: Vec3, d: Vec3| {
        let along = |o: f32, d: f32, low: f32, high: f32| (if d > 0.0 { high } else { low } - o) / d;
        let t = along(o.x, d.x, low.x, high.x).min(along(o.z, d.z, low.z, high.z));
        o + t * d
    };
    let forward = (view.target - view.position).normalize();
    let right = forward.cross(Vec3::Y).normalize();
    let up = right.cross(forward);
    let half = (0.5 * view.vertical_fov).tan();
    let (mut sky, mut water, mut worst) = (0, 0, 0.0_f32);
    for y in 0..view.size.y {
        for x in 0..view.size.x {
            let h = view.size.y as f32;
            let px = (2.0 * (x as f32 + 0.5) - view.size.x as f32) / h * half;
            let py = (h - 2.0 * (y as f32 + 0.5)) / h * half;
            let d = (forward + px * right + py * up).normalize();
            let direct = on_wall(view.position, d);
            let seen = if direct.y >= 0.0 {
                sky += 1;
                direct
            } else {
                water += 1;
                let at = view.position - d * (view.position.y / d.y);
                on_wall(at, Vec3::new(d.x, -d.y, d.z))
            };
            let off = (image.pixel(x, y) - told(seen - middle)).abs().max_element();
            worst = worst.max(off);
        }
    }
    println!("{sky} pixels of backdrop, {water} of water: off by {worst}");
    assert!(sky > 500 && water > 500);
    // A texel is 2π/512 = 0.012 of azimuth and 2/256 of elevation; linear between texels.
    assert!(worst < 4e-3, "{worst}");
}

/// In the paper, waves whose fronts face the eye reflect nothing and let the floor show. Here every direction meets a
/// picture: under an even sky all of the water is as bright as the sky, however high the waves.
#[test]
fn no_wave_reflects_nothing() {
    for normals in [NormalBlend::Face, NormalBlend::Distance, NormalBlend::Area] {
        for height in [1.0, 6.0] {
            let mut scene = scene(square(41, 0.25));
            looks(
                &mut scene,
                Horizon {
                    mix: Some(1.0),
                    normals,
                    ..Horizon::default()
                },
            );
            let frame = frame(scene.grid, |p| height * choppy(p));
            let view = view(
                Vec3::new(5.0, 3.0, 14.0),
                Vec3::new(5.0, 0.0, 4.0),
                UVec2::new(80, 60),
            );
            let image = picture(&scene, &frame, &view);
            let off = |p: &Vec3| (*p - Vec3::ONE).abs().max_element();
            let worst = image.pixels.iter().map(off).fold(0.0, f32::max);
            assert!(worst < 1e-5, "{normals:?}, waves times {height}: {worst}");
        }
    }
}

/// On still water a mix is the mix of its ends, and an oily floor is a darker floor.
#[test]
fn reflection_and_floor_are_mixed_as_the_scene_says() {
    let mut scene = scene(square(41, 0.25));
    floor(&mut scene, -1.0);
    scene.description.ground.checker = 0.8;
    let frame = frame(scene.grid, |_| 0.0);
    let view = view(
        Vec3::new(5.0, 6.0, 12.0),
        Vec3::new(5.0, 0.0, 5.0),
        UVec2::new(40, 30),
    );
    let mut with = |mix: f32, floor: f32| {
        looks(
            &mut scene,
            Horizon {
                mix: Some(mix),
                floor,
                ..Horizon::default()
            },
        );
        picture(&scene, &frame, &view)
    };
    let (none, all) = (with(0.0, 1.0), with(1.0, 1.0));
    assert_ne!(none, all);
    for (mix, oil) in [(0.7, 1.0), (0.6, 0.5)] {
        let mixed = with(mix, oil);
        let pixels = mixed.pixels.iter().zip(&all.pixels).zip(&none.pixels);
        // The backdrop itself is the same in all.
        let water: Vec<_> = pixels.filter(|((_, a), b)| a != b).collect();
        assert!(water.len() > 600, "{}", water.len());
        for ((m, a), b) in water {
            let truth = mix * *a + (1.0 - mix) * oil * *b;
            assert!((*m - truth).abs().max_element() < 1e-5, "{m} {truth}");
        }
    }
}

fn waves(count: usize) -> (Scene, Frame) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../data/scenes/five-waves.toml");
    let scene = Scene::load(&path, &[]).expect("the scene of the paper");
    let frame = common::rings(&scene, count, 4.0);
    (scene, frame)
}

#[test]
fn pictures_of_any_size_are_the_same_for_any_number_of_threads() {
    let (scene, frame) = waves(5);
    assert_eq!(scene.grid.size, UVec2::splat(100));
    for size in [UVec2::new(97, 61), UVec2::new(1, 1), UVec2::new(3, 200)] {
        let view = camera::view(&scene, None, size, 2).expect("the scene's camera");
        let with = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new()
                .num_threads(threads)
                .build()
                .expect("threads");
            pool.install(|| draw(&mut HorizonRenderer::default(), &scene, &frame, &view))
        };
        let (one, report) = with(1);
        for threads in [2, 3, 7] {
            let (other, again) = with(threads);
            assert_eq!(one, other, "{size}, {threads} threads");
            assert_eq!(report.rays, again.rays);
        }
    }
}

/// The paper's program took twelve times as long with 20 waves as with 5, because rays go to and fro between waves.
/// How many rays there are does not depend on the machine.
#[test]
fn twenty_waves_take_hardly_more_rays_than_five() {
    let rays = |count| {
        let (scene, frame) = waves(count);
        let view = camera::view(&scene, None, UVec2::new(160, 120), 1).expect("the scene's camera");
        let report = draw(&mut HorizonRenderer::default(), &scene, &frame, &view).1;
        report.rays as f64
    };
    let ratio = rays(20) / rays(5);
    println!("rays with 20 waves over rays with 5: {ratio:.3}");
    assert!(ratio < 1.3, "{ratio}");
}
