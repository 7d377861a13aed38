//! What must not happen: differences between threads, leaks, panics, pictures of broken frames.
#![allow(clippy::unwrap_used)] // a test may panic

mod common;

use common::{draw, floor, frame, scene, square, view};
use meniscus_render_cpu::{Settings, Whitted, camera};
use meniscus_sim::frame::{BodyPose, Channels};
use meniscus_sim::glam::{Quat, UVec2, Vec2, Vec3};
use meniscus_sim::render::{Image, RenderError, Renderer, View};
use meniscus_sim::scene::description::*;
use meniscus_sim::{Frame, Grid, GridSpec, Scene};

fn in_pool<T: Send>(threads: usize, f: impl FnOnce() -> T + Send) -> T {
    rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .unwrap()
        .install(f)
}

/// A bay: sloping ground that rises out of waves, a sun, objects, droplets, foam.
fn bay() -> (Scene, Frame) {
    let spec = square(65, 0.25);
    let mut scene = scene(spec);
    scene.description.water.absorption = Vec3::new(0.3, 0.05, 0.01);
    scene.description.water.scattering = Vec3::splat(0.1);
    scene.description.light.sun = Some(Sun {
        elevation: 35.0,
        azimuth: 120.0,
        irradiance: Vec3::splat(3.0),
        radius: 0.27,
    });
    scene.description.light.sky = Sky::Daylight {
        turbidity: 3.0,
        scale: 1.0,
    };
    let ground = |p: Vec2| 0.25 * (p.x - 9.0) + 0.3 * (0.9 * p.y).sin();
    scene.terrain = Some(Grid::from_fn(spec, |i, j| ground(spec.position(i, j))));
    scene.description.terrain = Some(Terrain::Flat { height: 0.0 });
    let object = |shape, x: f32| Object {
        name: "thing".to_owned(),
        shape,
        position: Vec3::new(x, 0.1, 5.0),
        rotation: Quat::IDENTITY,
        velocity: meniscus_sim::glam::Vec3::ZERO,
        spin: meniscus_sim::glam::Vec3::ZERO,
        density: 500.0,
        motion: Motion::Free,
        color: None,
    };
    scene.description.objects = vec![
        object(Shape::Sphere { radius: 0.5 }, 3.0),
        object(
            Shape::Box {
                size: Vec3::splat(0.8),
            },
            5.0,
        ),
        object(
            Shape::Cylinder {
                radius: 0.3,
                height: 1.5,
            },
            6.5,
        ),
    ];
    scene.meshes = vec![Default::default(); 3];
    let mut frame = frame(spec, |p| 0.12 * (1.7 * p.x + 0.8 * p.y).sin());
    let channels = Channels::FOAM | Channels::DROPLETS | Channels::BODIES;
    let elevation = frame.elevation.clone();
    frame.prepare(spec, channels);
    frame.elevation = elevation;
    frame.foam = Some(Grid::from_fn(spec, |i, j| {
        if (i / 6 + j / 5) % 4 == 0 { 0.7 } else { 0.0 }
    }));
    let droplets = frame.droplets.as_mut().unwrap();
    for k in 0..40 {
        let t = k as f32;
        droplets.position.push(Vec3::new(
            4.0 + 0.1 * t,
            0.8 + 0.3 * (0.7 * t).sin(),
            7.0 + (1.3 * t).cos(),
        ));
        droplets.velocity.push(Vec3::ZERO);
        droplets.radius.push(0.05);
    }
    frame.bodies = Some(
        scene
            .description
            .objects
            .iter()
            .map(|o| BodyPose {
                position: o.position,
                ..BodyPose::default()
            })
            .collect(),
    );
    (scene, frame)
}

#[test]
fn pictures_do_not_depend_on_threads_or_history() {
    let (scene, waves) = bay();
    let view = View {
        samples: 3,
        ..view(
            Vec3::new(-3.0, 2.5, 9.0),
            Vec3::new(7.0, 0.0, 7.0),
            UVec2::new(97, 71),
        )
    };
    let picture = |threads| in_pool(threads, || draw(&mut Whitted::default(), &scene, &waves, &view));
    let (one, report) = picture(1);
    for threads in [2, 3] {
        let (other, other_report) = picture(threads);
        assert_eq!(one.pixels, other.pixels);
        assert_eq!(report.rays, other_report.rays);
    }
    // A renderer that has drawn other scenes and frames before draws the same.
    let mut used = Whitted::default();
    let other_spec = square(40, 0.5);
    draw(
        &mut used,
        &common::scene(other_spec),
        &frame(other_spec, |p| p.x.sin()),
        &view,
    );
    assert_eq!(draw(&mut used, &scene, &waves, &view).0.pixels, one.pixels);
    assert!(report.rays > u64::from(97 * 71 * 3_u32) && report.stages.iter().all(|s| s.1 >= 0.0));
}

#[test]
fn every_way_of_looking_gives_light() {
    // No black pixel and no leak: under a bright sky with pale ground everything shines, from above, at grazing
    // angles, from below, from far away and through the sides.
    let (mut scene, waves) = bay();
    scene.description.ground.albedo = Vec3::splat(0.6);
    scene.description.ground.steep_albedo = Vec3::splat(0.6);
    scene.description.ground.shore_albedo = Vec3::splat(0.6);
    scene.description.water.absorption = Vec3::splat(0.02);
    let eyes = [
        Vec3::new(-3.0, 2.5, 9.0),
        Vec3::new(2.0, 0.15, 2.0),
        Vec3::new(2.0, -0.6, 9.0),
        Vec3::new(8.0, 60.0, 8.1),
        Vec3::new(-400.0, 5.0, 30.0),
    ];
    for eye in eyes {
        let view = View {
            samples: 2,
            ..view(eye, Vec3::new(6.0, 0.0, 7.0), UVec2::new(120, 80))
        };
        let (image, _) = draw(&mut Whitted::default(), &scene, &waves, &view);
        for (k, p) in image.pixels.iter().enumerate() {
            assert!(p.min_element() > 1e-3, "eye {eye}, pixel {k}: {p}");
        }
    }
}

#[test]
fn basins_seas_and_tanks_close_the_picture() {
    for edges in [Edge::Wall, Edge::Open, Edge::Periodic] {
        for ground in [None, Some(-1.5)] {
            let spec = square(65, 0.25);
            let mut scene = scene(spec);
            scene.description.boundary = Boundary {
                drives: Vec::new(),
                x_min: edges,
                x_max: edges,
                z_min: edges,
                z_max: edges,
            };
            scene.description.water.scattering = Vec3::splat(0.2);
            scene.description.water.absorption = Vec3::splat(0.02);
            scene.description.ground.albedo = Vec3::splat(0.5);
            scene.description.ground.shore_albedo = Vec3::splat(0.5);
            if let Some(height) = ground {
                floor(&mut scene, height);
            }
            let k = std::f32::consts::TAU / (64.0 * 0.25) * 4.0;
            let waves = frame(spec, |p| 0.1 * (k * p.x).sin() + 0.08 * (k * p.y).cos());
            for eye in [
                Vec3::new(-9.0, 3.0, 4.0),
                Vec3::new(-9.0, -0.5, 8.0),
                Vec3::new(8.0, -0.7, 8.0),
                Vec3::new(8.0, 1.0, 8.0),
            ] {
                let view = View {
                    samples: 2,
                    ..view(eye, Vec3::new(12.0, -0.3, 9.0), UVec2::new(90, 60))
                };
                let (image, _) = draw(&mut Whitted::default(), &scene, &waves, &view);
                for (n, p) in image.pixels.iter().enumerate() {
                    assert!(
                        p.min_element() > 1e-3,
                        "{edges:?}, ground {ground:?}, eye {eye}, pixel {n}: {p}"
                    );
                }
            }
        }
    }
}

#[test]
fn a_periodic_sea_has_no_seams() {
    // The same waves seen from places a whole period apart.
    let spec = square(64, 0.5);
    let mut scene = scene(spec);
    let edges = Edge::Periodic;
    scene.description.boundary = Boundary {
        drives: Vec::new(),
        x_min: edges,
        x_max: edges,
        z_min: edges,
        z_max: edges,
    };
    scene.description.light.sky = Sky::Daylight {
        turbidity: 3.0,
        scale: 1.0,
    };
    let k = std::f32::consts::TAU / 32.0;
    let waves = frame(spec, |p| {
        0.3 * (3.0 * k * p.x).sin() + 0.2 * (2.0 * k * (p.x + p.y)).cos()
    });
    let at = |shift: Vec3| {
        let eye = Vec3::new(16.0, 3.0, 16.0) + shift;
        draw(
            &mut Whitted::default(),
            &scene,
            &waves,
            &view(eye, eye + Vec3::new(4.0, -1.0, 2.0), UVec2::new(80, 60)),
        )
        .0
    };
    let (a, b) = (at(Vec3::ZERO), at(Vec3::new(32.0, 0.0, -64.0)));
    let differ = a
        .pixels
        .iter()
        .zip(&b.pixels)
        .filter(|(a, b)| (**a - **b).abs().max_element() > 1e-3)
        .count();
    // Rounding moves a few rays across silhouettes.
    assert!(differ < 20, "{differ} pixels differ");
}

#[test]
fn steep_and_tiny_waves_are_drawn() {
    for (amplitude, wavelength) in [(3.0_f32, 2.0_f32), (1e-6, 0.5), (2.0, 0.5)] {
        let spec = square(129, 0.06);
        let mut scene = scene(spec);
        floor(&mut scene, -9.0);
        let waves = frame(spec, |p| {
            amplitude * (std::f32::consts::TAU * p.x / wavelength).sin()
        });
        let view = view(
            Vec3::new(-2.0, 5.0, 9.0),
            Vec3::new(4.0, 0.0, 4.0),
            UVec2::new(80, 60),
        );
        draw(&mut Whitted::default(), &scene, &waves, &view);
    }
}

fn error_of(scene: &Scene, frame: &Frame, view: &View) -> RenderError {
    Whitted::default()
        .render(scene, frame, view, &mut Image::default(), &|_| true)
        .unwrap_err()
}

#[test]
fn impossible_views_and_frames_are_refused_with_a_reason() {
    let (scene, waves) = bay();
    let good = view(
        Vec3::new(-3.0, 2.5, 9.0),
        Vec3::new(7.0, 0.0, 7.0),
        UVec2::new(8, 8),
    );
    let message = |view: View| error_of(&scene, &waves, &view).to_string();
    let inside = message(View {
        position: Vec3::new(15.0, 0.2, 5.0),
        ..good.clone()
    });
    assert!(
        inside.contains("inside the ground") && inside.contains("raise"),
        "{inside}"
    );
    assert!(
        message(View {
            size: UVec2::new(0, 8),
            ..good.clone()
        })
        .contains("1 to 16384")
    );
    assert!(
        message(View {
            size: UVec2::new(16_385, 8),
            ..good.clone()
        })
        .contains("1 to 16384")
    );
    assert!(
        message(View {
            samples: 0,
            ..good.clone()
        })
        .contains("at least 1")
    );
    assert!(
        message(View {
            target: good.position,
            ..good.clone()
        })
        .contains("its own position")
    );
    assert!(
        message(View {
            up: good.target - good.position,
            ..good.clone()
        })
        .contains("parallel")
    );
    assert!(
        message(View {
            vertical_fov: 3.2,
            ..good.clone()
        })
        .contains("pi")
    );
    assert!(
        message(View {
            position: Vec3::NAN,
            ..good.clone()
        })
        .contains("finite")
    );
    for value in [f32::NAN, f32::INFINITY] {
        let mut broken = waves.clone();
        broken.elevation[(7, 3)] = value;
        let error = error_of(&scene, &broken, &good);
        assert!(
            matches!(error, RenderError::NonFinite(_)) && error.to_string().contains("elevation"),
            "{error}"
        );
    }
}

#[test]
fn a_camera_exactly_on_the_surface_sees_sky_and_water() {
    let spec = square(65, 0.25);
    let scene = scene(spec);
    for elevation in [0.0_f32, 0.123_456_7] {
        let still = frame(spec, |_| elevation);
        let eye = Vec3::new(8.0, elevation, 8.0);
        let (image, _) = draw(
            &mut Whitted::default(),
            &scene,
            &still,
            &view(eye, eye + Vec3::X, UVec2::new(64, 64)),
        );
        assert!((image.pixel(32, 5).x - 1.0).abs() < 1e-3, "sky above");
        assert!(
            image.pixel(32, 60).x < 0.6,
            "water below: {}",
            image.pixel(32, 60)
        );
    }
}

#[test]
fn rendering_can_be_interrupted_and_reports_progress() {
    let (scene, waves) = bay();
    let good = view(
        Vec3::new(-3.0, 2.5, 9.0),
        Vec3::new(7.0, 0.0, 7.0),
        UVec2::new(200, 200),
    );
    let calls = std::sync::atomic::AtomicUsize::new(0);
    let stop = |_: f32| calls.fetch_add(1, std::sync::atomic::Ordering::Relaxed) < 5;
    let error = Whitted::default()
        .render(&scene, &waves, &good, &mut Image::default(), &stop)
        .unwrap_err();
    assert!(matches!(error, RenderError::Interrupted));
    let last = std::sync::Mutex::new(0.0_f32);
    let note = |share: f32| {
        let mut last = last.lock().unwrap();
        *last = last.max(share);
        true
    };
    Whitted::default()
        .render(&scene, &waves, &good, &mut Image::default(), &note)
        .unwrap();
    assert_eq!(*last.lock().unwrap(), 1.0);
}

#[test]
fn one_pixel_and_one_sample_grids_are_drawn() {
    let spec = GridSpec::new(Vec2::ZERO, 1.0, UVec2::ONE).unwrap();
    let scene = scene(spec);
    draw(
        &mut Whitted::default(),
        &scene,
        &frame(spec, |_| 0.5),
        &view(Vec3::new(0.0, 3.0, 5.0), Vec3::ZERO, UVec2::ONE),
    );
}

#[test]
fn the_plan_lists_nothing_that_a_scene_does_not_need() {
    let spec = square(65, 0.25);
    let bare = scene(spec);
    let items = Whitted::default().plan(&bare, UVec2::new(640, 480));
    for name in [
        "objects",
        "object triangles",
        "droplets",
        "foam",
        "ground heightfield",
        "ground detail",
        "sky picture",
        "sun and its shadows",
        "absorption in the water",
        "scattering in the water",
        "walls and deck of a basin",
    ] {
        let item = items
            .iter()
            .find(|i| i.name == name)
            .unwrap_or_else(|| panic!("no item `{name}`"));
        assert!(
            !item.active && item.bytes == 0 && !item.reason.is_empty(),
            "{item:?}"
        );
    }
    assert!(
        items
            .iter()
            .any(|i| i.name == "water heightfield" && i.active && i.bytes > 4 * 65 * 65)
    );
    assert!(Whitted::default().needs(&bare).contains(Channels::FOAM));
    assert!(!Whitted::default().needs(&bare).contains(Channels::BODIES));
    let (full, _) = bay();
    let items = Whitted::default().plan(&full, UVec2::new(640, 480));
    for name in [
        "objects",
        "ground heightfield",
        "ground detail",
        "sky picture",
        "sun and its shadows",
        "absorption in the water",
    ] {
        assert!(items.iter().any(|i| i.name == name && i.active), "{name}");
    }
}

#[test]
fn cameras_are_found_by_name_and_the_automatic_one_sees_the_domain() {
    let (mut scene, waves) = bay();
    let size = UVec2::new(96, 54);
    let auto = camera::view(&scene, None, size, 1).unwrap();
    let aux = Whitted::new(Settings::default())
        .render_aux(&scene, &waves, &auto, &|_| true)
        .unwrap();
    let water = aux.pixels.iter().filter(|p| p.water).count();
    assert!(water > aux.pixels.len() / 10, "{water}");
    scene.description.cameras = vec![
        Camera {
            name: "shore".to_owned(),
            position: Vec3::new(1.0, 2.0, 3.0),
            target: Vec3::ZERO,
            fov: 50.0,
            exposure: 1.5,
        },
        Camera {
            name: "top".to_owned(),
            position: Vec3::new(8.0, 20.0, 8.0),
            target: Vec3::new(8.0, 0.0, 8.0),
            fov: 50.0,
            exposure: 0.0,
        },
    ];
    assert_eq!(
        camera::view(&scene, None, size, 1).unwrap().position,
        Vec3::new(1.0, 2.0, 3.0)
    );
    assert_eq!(camera::exposure(&scene, Some("shore")).unwrap(), 1.5);
    assert_eq!(camera::view(&scene, Some("auto"), size, 1).unwrap(), auto);
    // Straight down works: up is turned away from the view.
    let top = camera::view(&scene, Some("top"), size, 1).unwrap();
    draw(&mut Whitted::default(), &scene, &waves, &top);
    let error = camera::view(&scene, Some("bow"), size, 1)
        .unwrap_err()
        .to_string();
    assert!(
        error.contains("bow") && error.contains("`shore`") && error.contains("`top`"),
        "{error}"
    );
    assert!(camera::view(&scene, None, UVec2::new(0, 4), 1).is_err());
    assert!(camera::view(&scene, None, size, 0).is_err());
}

#[test]
fn ground_that_rises_is_drawn_where_it_stands() {
    let spec = square(33, 0.25);
    let mut moving = scene(spec);
    floor(&mut moving, -1.0);
    moving.description.ground.checker = 0.5;
    let mut risen = moving.clone();
    moving.description.beds = vec![Bed::Patch {
        min: Vec2::splat(2.0),
        max: Vec2::splat(6.0),
        height: 1.5,
        start: 1.0,
        rise: 0.0,
        series: None,
        points: Vec::new(),
    }];
    let still = risen.clone();
    risen.terrain = Some(Grid::from_fn(spec, |i, j| {
        let at = spec.position(i, j);
        let inside = at.cmpge(Vec2::splat(2.0)).all() && at.cmple(Vec2::splat(6.0)).all();
        if inside { 0.5 } else { -1.0 }
    }));
    let mut water = frame(spec, |_| 0.0);
    let seen = view(
        Vec3::new(4.0, 6.0, 11.0),
        Vec3::new(4.0, 0.0, 4.0),
        UVec2::new(48, 36),
    );
    let mut renderer = Whitted::new(Settings::default());
    let mut at = |scene: &Scene, time: f64| {
        water.time = time;
        draw(&mut renderer, scene, &water, &seen).0
    };
    assert_eq!(at(&moving, 0.5).pixels, at(&still, 0.5).pixels);
    assert_eq!(at(&moving, 2.0).pixels, at(&risen, 2.0).pixels);
    assert_ne!(at(&moving, 2.0).pixels, at(&still, 2.0).pixels);
}
