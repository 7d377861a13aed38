//! Light followed through the water against closed forms, against the path tracer, and against itself.

mod common;

use common::{draw, floor, frame, scene, square, view};
use meniscus_render_cpu::path::{self, PathTracer};
use meniscus_render_cpu::photon::{Maps, PhotonMapper, Settings};
use meniscus_sim::frame::Frame;
use meniscus_sim::glam::{DVec3, Quat, UVec2, Vec2, Vec3};
use meniscus_sim::optics::{fresnel, transmittance};
use meniscus_sim::render::{Image, View};
use meniscus_sim::scene::description::*;
use meniscus_sim::{Grid, GridSpec, Scene};

const IRRADIANCE: Vec3 = Vec3::new(3.0, 2.5, 2.0);

fn sun(scene: &mut Scene, elevation: f32, radius: f32) {
    scene.description.light.sun = Some(Sun {
        elevation,
        azimuth: 40.0,
        irradiance: IRRADIANCE,
        radius,
    });
}

fn grey(scene: &mut Scene, albedo: f32) {
    let look = &mut scene.description.ground;
    look.albedo = Vec3::splat(albedo);
    look.steep_albedo = look.albedo;
    look.shore_albedo = look.albedo;
}

fn maps(settings: Settings, scene: &Scene, frame: &Frame) -> Maps {
    PhotonMapper::new(settings)
        .maps(scene, frame, &above(scene), &|_| true)
        .expect("maps")
}

/// From straight above the middle.
fn above(scene: &Scene) -> View {
    let middle = scene.grid.origin + 0.5 * scene.grid.extent();
    let eye = Vec3::new(middle.x, 3.0, middle.y);
    view(eye, eye - Vec3::Y, UVec2::new(16, 12))
}

fn choppy(p: Vec2) -> f32 {
    0.03 * (5.1 * p.x + 1.3 * p.y).sin() + 0.012 * (9.0 * p.y - 4.0 * p.x).cos()
}

/// Still water: what Snell, Fresnel and Beer say, everywhere alike; as even as so many photons can be.
#[test]
fn still_water_lights_the_floor_evenly_and_as_the_closed_form_says() {
    let mut scene = scene(square(33, 0.1));
    floor(&mut scene, -0.8);
    sun(&mut scene, 35.0, 0.2665);
    scene.description.water.absorption = Vec3::new(0.4, 0.1, 0.02);
    let photons = 1 << 17;
    let maps = maps(Settings::caustics(photons), &scene, &frame(scene.grid, |_| 0.0));
    let map = maps.floor.expect("a floor");
    let irradiance = map.irradiance();

    let (sin, cos) = (35.0_f64.to_radians().cos(), 35.0_f64.to_radians().sin());
    let n = f64::from(scene.description.water.index);
    let cos_t = (1.0 - (sin / n).powi(2)).sqrt();
    let entered = f64::from(1.0 - fresnel(cos as f32, 1.0 / n as f32)) * cos;
    let left = transmittance(scene.description.water.absorption, (0.8 / cos_t) as f32);
    let truth = IRRADIANCE.as_dvec3() * entered * left.as_dvec3();

    let cells = irradiance.as_slice();
    let mean = cells.iter().map(|e| e.as_dvec3()).sum::<DVec3>() / cells.len() as f64;
    // The disc's half a degree widens Fresnel's share by its second derivative: far below 1e-4.
    let off = ((mean - truth) / truth).abs().max_element();
    println!("mean {mean}, closed form {truth}: {off:.1e}");
    assert!(off < 2e-3, "{mean} {truth}");
    // Photons on a cell, were they thrown at random: stratified ones scatter less.
    let each = maps.ledger.emitted.x / maps.photons as f64;
    let count = f64::from(map.spec().spacing).powi(2) * f64::from(IRRADIANCE.x) * cos / each;
    let sigma = 1.0 / count.sqrt();
    let worst = cells
        .iter()
        .map(|e| (f64::from(e.x) / truth.x - 1.0).abs())
        .fold(0.0, f64::max);
    println!("{count:.0} photons a cell, sigma {sigma:.4}, worst cell {worst:.4}");
    assert!(worst < 3.0 * sigma, "{worst} {sigma}");
    let relative = map.relative();
    let mean = relative.as_slice().iter().sum::<f32>() / relative.as_slice().len() as f32;
    assert!((mean - 1.0).abs() < 2e-3, "{mean}");
}

/// A long sine wave gathers light of a high sun at the depth f = 1/((1 − 1/n) a k²) below its crests: above it, the
/// light below a crest grows as 1/(1 − d/f).
#[test]
fn a_sine_wave_focuses_at_the_depth_of_the_closed_form() {
    let (amplitude, wavelength) = (0.04_f64, 2.0_f64);
    let k = std::f64::consts::TAU / wavelength;
    let spec = GridSpec::new(Vec2::ZERO, 0.05, UVec2::new(80, 96)).expect("a grid");
    let mut scene = scene(spec);
    let n = f64::from(scene.description.water.index);
    let focus = 1.0 / ((1.0 - 1.0 / n) * amplitude * k * k);
    scene.description.boundary.x_min = Edge::Periodic;
    scene.description.boundary.x_max = Edge::Periodic;
    sun(&mut scene, 90.0, 0.01);
    // The floor falls along the crests, so that one map holds every depth from 0.2 to 1.6 focal lengths.
    let depth = |z: f32| focus * (0.2 + 1.4 * f64::from(z) / f64::from(spec.extent().y));
    scene.description.terrain = Some(Terrain::Flat { height: 0.0 });
    scene.terrain = Some(Grid::from_fn(spec, |i, j| {
        // Below the crest, which itself stands an amplitude above the level.
        (amplitude - depth(spec.position(i, j).y)) as f32
    }));
    let surface = frame(spec, |p| (amplitude * (k * f64::from(p.x)).cos()) as f32);
    let maps = maps(Settings::caustics(1 << 20), &scene, &surface);
    let light = maps.floor.expect("a floor").relative();
    // Crests stand at samples 0 and 40; the row's neighbours are worth little against noise and much against blur.
    let column = |j: usize| 0.5 * f64::from(light[(0, j)] + light[(40, j)]);
    // 1/E against depth is a line that meets zero at the focus. Least squares where the light is less than four-fold.
    let (mut s, mut sx, mut sy, mut sxx, mut sxy) = (0.0, 0.0, 0.0, 0.0, 0.0);
    let mut brightest = (0.0, 0.0);
    for j in 2..spec.height() - 2 {
        let (d, e) = (depth(spec.position(0, j).y), column(j));
        if e > brightest.1 {
            brightest = (d, e);
        }
        if d < 0.75 * focus {
            let (x, y) = (d, 1.0 / e);
            s += 1.0;
            sx += x;
            sy += y;
            sxx += x * x;
            sxy += x * y;
        }
    }
    let slope = (s * sxy - sx * sy) / (s * sxx - sx * sx);
    let zero = (sy - slope * sx) / s;
    let found = -zero / slope;
    println!(
        "focus {found:.3} m, closed form {focus:.3}; brightest {:.1} at {:.3} m",
        brightest.1, brightest.0
    );
    assert!((found / focus - 1.0).abs() < 0.02, "{found} {focus}");
    // A cell gathers from a width that aberration lets grow a little beyond the focus.
    assert!(
        (0.97..1.2).contains(&(brightest.0 / focus)),
        "{brightest:?} {focus}"
    );
    assert!(brightest.1 > 6.0, "{brightest:?}");
}

fn walls(scene: &mut Scene) {
    scene.description.boundary = Boundary {
        x_min: Edge::Wall,
        x_max: Edge::Wall,
        z_min: Edge::Wall,
        z_max: Edge::Wall,
        drives: Vec::new(),
    };
}

/// A basin with a ball in it, absorbing and scattering water, light to and fro.
fn basin() -> (Scene, Frame) {
    let mut scene = scene(square(48, 0.05));
    floor(&mut scene, -0.6);
    grey(&mut scene, 0.5);
    sun(&mut scene, 50.0, 0.2665);
    walls(&mut scene);
    scene.description.water.absorption = Vec3::new(0.4, 0.1, 0.02);
    scene.description.water.scattering = Vec3::splat(0.2);
    scene.description.objects.push(Object {
        name: "ball".to_owned(),
        shape: Shape::Sphere { radius: 0.15 },
        position: Vec3::new(1.2, -0.3, 1.2),
        rotation: Quat::IDENTITY,
        velocity: Vec3::ZERO,
        spin: Vec3::ZERO,
        density: 600.0,
        motion: Motion::default(),
        color: None,
    });
    scene.meshes.push(meniscus_sim::mesh::TriangleMesh::default());
    let frame = frame(scene.grid, choppy);
    (scene, frame)
}

#[test]
fn what_enters_the_water_is_what_leaves_it() {
    let (scene, frame) = basin();
    for bounces in [0, 6] {
        let settings = Settings {
            photons: Some(40_000),
            bounces: Some(bounces),
            ..Settings::default()
        };
        let ledger = maps(settings, &scene, &frame).ledger;
        println!("{bounces} bounces: off by {:.1e}; {ledger:?}", ledger.imbalance());
        assert!(ledger.imbalance() < 1e-5, "{ledger:?}");
        // Each account is used, or the balance would say little.
        assert!(ledger.floor.min_element() > 0.2 * ledger.transmitted.min_element());
        for account in [ledger.walls, ledger.objects, ledger.absorbed] {
            assert!(
                account.min_element() > 1e-3 * ledger.transmitted.max_element(),
                "{ledger:?}"
            );
        }
        assert_eq!(bounces > 0, ledger.sent_back.min_element() > 0.0);
        // Less enters than is sent out, more than Fresnel's 2 % at the steepest leaves of what falls on the basin.
        assert!(ledger.transmitted.max_element() < ledger.emitted.max_element());
    }
}

/// The map's flux is that of the account of the floor, on the map; the rest fell beyond it.
#[test]
fn maps_hold_what_fell() {
    let (scene, frame) = basin();
    let maps = maps(Settings::caustics(60_000), &scene, &frame);
    let flux: DVec3 = maps
        .floor
        .expect("a floor")
        .flux()
        .as_slice()
        .iter()
        .map(|f| f.as_dvec3())
        .sum();
    // Walls all around: nothing falls beyond. f32 cells round to 1e-7 each.
    let off = ((flux - maps.ledger.floor) / flux).abs().max_element();
    assert!(off < 1e-6, "{flux} {:?}", maps.ledger);
}

#[test]
fn maps_and_pictures_do_not_depend_on_threads() {
    let (scene, frame) = basin();
    let settings = Settings {
        photons: Some(20_000),
        ..Settings::default()
    };
    let view = View {
        position: Vec3::new(1.2, 1.4, 2.2),
        target: Vec3::new(1.2, -0.4, 1.1),
        ..above(&scene)
    };
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .expect("threads");
        pool.install(|| {
            let maps = maps(settings.clone(), &scene, &frame);
            let (image, _) = draw(&mut PhotonMapper::new(settings.clone()), &scene, &frame, &view);
            (maps.floor, maps.ledger, image)
        })
    };
    let one = with(1);
    for threads in [2, 3, 7] {
        assert_eq!(one, with(threads), "{threads} threads");
    }
}

/// The floor seen from below the surface, against paths from the eye: the same light by an unlike way. In a basin with
/// light to and fro between walls, and in open water over a dark floor, which sends hardly any back: what it does send
/// comes from beyond any map, and is left to a closed form.
#[test]
fn the_floor_is_as_bright_as_paths_find_it() {
    for (walled, albedo, bar) in [(true, 0.4, 0.015), (false, 0.02, 0.015)] {
        let mut scene = scene(square(48, 0.05));
        floor(&mut scene, -0.7);
        grey(&mut scene, albedo);
        sun(&mut scene, 60.0, 0.2665);
        scene.description.light.sky = Sky::Uniform {
            radiance: Vec3::splat(0.3),
        };
        scene.description.water.absorption = Vec3::new(0.2, 0.1, 0.05);
        if walled {
            walls(&mut scene);
        }
        let frame = frame(scene.grid, choppy);
        let mut view = view(
            Vec3::new(1.2, -0.3, 1.2),
            Vec3::new(1.2, -0.7, 1.21),
            UVec2::new(16, 12),
        );
        view.samples = 8;
        let settings = Settings {
            photons: Some(1 << 18),
            bounces: walled.then_some(12),
            visual_range: None,
            ..Settings::default()
        };
        let (found, _) = draw(&mut PhotonMapper::new(settings), &scene, &frame, &view);
        view.samples = 96;
        let paths = path::Settings {
            visual_range: None,
            ..path::Settings::default()
        };
        let (truth, _) = draw(&mut PathTracer::new(paths), &scene, &frame, &view);
        let mean = |image: &Image| -> DVec3 {
            image.pixels.iter().map(|p| p.as_dvec3()).sum::<DVec3>() / image.pixels.len() as f64
        };
        let (found_mean, truth_mean) = (mean(&found), mean(&truth));
        let off = ((found_mean - truth_mean) / truth_mean).abs().max_element();
        // Pixel for pixel, as far as cells of 5 cm and the noise of the paths allow.
        let (mut square, mut cross, mut other) = (0.0, 0.0, 0.0);
        for (a, b) in found.pixels.iter().zip(&truth.pixels) {
            let (a, b) = (f64::from(a.y) - found_mean.y, f64::from(b.y) - truth_mean.y);
            square += a * a;
            other += b * b;
            cross += a * b;
        }
        let correlation = cross / f64::sqrt(square * other);
        println!(
            "walls {walled}: photons {found_mean}, paths {truth_mean}: {off:.4}, correlation {correlation:.3}"
        );
        assert!(off < bar, "{walled}: {found_mean} {truth_mean}");
        assert!(correlation > 0.8, "{walled}: {correlation}");
    }
}
