//! The path tracer against closed forms, against the deterministic renderer, and against itself by another way.

mod common;

use common::{floor, scene, square, view};
use meniscus_render_cpu::path::{PathTracer, Settings, SunThroughWaves};
use meniscus_render_cpu::{Whitted, whitted};
use meniscus_sim::glam::{DVec3, UVec2, Vec3};
use meniscus_sim::optics::{fresnel, transmittance};
use meniscus_sim::render::{Image, Renderer, View};
use meniscus_sim::scene::description::{Sky, Sun};
use meniscus_sim::{Frame, Grid, Scene};

fn draw(renderer: &mut dyn Renderer, scene: &Scene, frame: &Frame, view: &View) -> Image {
    let mut image = Image::default();
    renderer
        .render(scene, frame, view, &mut image, &|_| true)
        .expect("a picture");
    image
}

fn path(settings: Settings, scene: &Scene, frame: &Frame, view: &View) -> Image {
    draw(&mut PathTracer::new(settings), scene, frame, view)
}

/// Mean over the picture and its standard error, by colour.
fn mean(image: &Image) -> (DVec3, DVec3) {
    let n = image.pixels.len() as f64;
    let (mut sum, mut square) = (DVec3::ZERO, DVec3::ZERO);
    for p in &image.pixels {
        sum += p.as_dvec3();
        square += p.as_dvec3() * p.as_dvec3();
    }
    let mean = sum / n;
    let variance = (square / n - mean * mean).max(DVec3::ZERO);
    (mean, (variance / n).map_sqrt())
}

trait Root {
    fn map_sqrt(self) -> Self;
}

impl Root for DVec3 {
    fn map_sqrt(self) -> Self {
        Self::new(self.x.sqrt(), self.y.sqrt(), self.z.sqrt())
    }
}

fn calm_air() -> Settings {
    Settings {
        visual_range: None,
        ..Settings::default()
    }
}

/// Waves of slope up to about 0.25 on a grid of 5 cm.
fn waves(scene: &Scene) -> Frame {
    let mut frame = Frame::new(scene.grid);
    frame.elevation = Grid::from_fn(scene.grid, |i, j| {
        let p = scene.grid.position(i, j);
        0.03 * (5.1 * p.x + 1.3 * p.y).sin() + 0.012 * (9.0 * p.y - 4.0 * p.x).cos()
    });
    frame
}

fn grey(scene: &mut Scene, albedo: f32) {
    let look = &mut scene.description.ground;
    look.albedo = Vec3::splat(albedo);
    look.steep_albedo = look.albedo;
    look.shore_albedo = look.albedo;
}

fn sun(scene: &mut Scene, elevation: f32, radius: f32) {
    scene.description.light.sun = Some(Sun {
        elevation,
        azimuth: 40.0,
        irradiance: Vec3::new(3.0, 2.5, 2.0),
        radius,
    });
}

/// Everything white under a white sky is white, whatever the water does to the light.
#[test]
fn a_white_furnace_stays_white() {
    let mut scene = scene(square(64, 0.05));
    floor(&mut scene, -0.4);
    grey(&mut scene, 1.0);
    let frame = waves(&scene);
    for eye in [Vec3::new(1.0, 1.5, 3.0), Vec3::new(1.0, -0.2, 1.2)] {
        let mut view = view(eye, Vec3::new(1.6, -0.3, 1.6), UVec2::new(24, 16));
        view.samples = 64;
        for aim_at_sky in [true, false] {
            let image = path(
                Settings {
                    aim_at_sky,
                    ..calm_air()
                },
                &scene,
                &frame,
                &view,
            );
            let (mean, error) = mean(&image);
            // Four standard errors, and 2e-3 for light that a shading normal sends under the facet it stands on.
            assert!(
                ((mean - 1.0).abs() - 4.0 * error).max_element() < 2e-3,
                "{eye} {aim_at_sky}: {mean} ± {error}"
            );
        }
    }
}

/// With everything matt glowing and nothing else, only reflection and refraction are left, and both renderers
/// do the same to light.
#[test]
fn the_optics_are_those_of_the_deterministic_renderer() {
    let mut scene = scene(square(64, 0.05));
    floor(&mut scene, -0.5);
    grey(&mut scene, 0.2);
    scene.description.ground.shore_albedo = Vec3::new(0.9, 0.7, 0.4);
    scene.description.ground.checker = 0.3;
    scene.description.water.absorption = Vec3::new(0.3, 0.05, 0.01);
    let frame = waves(&scene);
    let mut view = view(
        Vec3::new(1.0, 0.9, 2.9),
        Vec3::new(1.6, -0.3, 1.6),
        UVec2::new(24, 15),
    );
    view.samples = 1024;
    let random = path(
        Settings {
            glow: true,
            ..calm_air()
        },
        &scene,
        &frame,
        &view,
    );
    let truth = draw(
        &mut Whitted::new(whitted::Settings {
            glow: true,
            cutoff: 0.0,
            visual_range: None,
            interface_depth: 6,
            caustics: false,
            ..whitted::Settings::default()
        }),
        &scene,
        &frame,
        &view,
    );
    let (mut bias, mut square, mut sum) = (DVec3::ZERO, 0.0, DVec3::ZERO);
    for (a, b) in random.pixels.iter().zip(&truth.pixels) {
        let d = a.as_dvec3() - b.as_dvec3();
        bias += d;
        sum += b.as_dvec3();
        square += d.length_squared() / 3.0;
    }
    let rms =
        (square / random.pixels.len() as f64).sqrt() / (sum.element_sum() / 3.0) * random.pixels.len() as f64;
    let bias = (bias / sum).abs().max_element();
    println!("bias {bias:.2e}, RMS {rms:.2e}");
    assert!(bias < 1e-3, "bias {bias}");
    // The noise of 1024 choices between reflection and refraction, 1 % by the issue.
    assert!(rms < 1e-2, "RMS {rms}");
}

/// Sunlight through flat water has a closed form.
#[test]
fn the_sun_lights_a_flat_pool_by_snell_fresnel_and_beer() {
    let mut scene = scene(square(64, 0.05));
    floor(&mut scene, -0.8);
    grey(&mut scene, 0.3);
    scene.description.light.sky = Sky::Uniform { radiance: Vec3::ZERO };
    scene.description.water.absorption = Vec3::new(0.3, 0.05, 0.01);
    sun(&mut scene, 35.0, 0.2665);
    let frame = Frame::new(scene.grid);
    // From below, so that nothing but the floor and the water before it is seen; light that the floor sends up and the
    // surface back down is left out by a floor that is nearly black.
    grey(&mut scene, 0.02);
    let mut view = view(
        Vec3::new(1.6, -0.4, 1.61),
        Vec3::new(1.6, -0.8, 1.6),
        UVec2::new(8, 8),
    );
    view.vertical_fov = 0.2;
    view.samples = 32;
    let (found, error) = mean(&path(calm_air(), &scene, &frame, &view));
    let (sin_i, cos_i) = (35.0_f64.to_radians().cos(), 35.0_f64.to_radians().sin());
    let n = f64::from(scene.description.water.index);
    let cos_t = (1.0 - (sin_i / n).powi(2)).sqrt();
    let passed = f64::from(1.0 - fresnel(cos_i as f32, 1.0 / n as f32));
    let left = transmittance(scene.description.water.absorption, (0.8 / cos_t) as f32).as_dvec3();
    let seen = transmittance(scene.description.water.absorption, 0.4).as_dvec3();
    let sun = DVec3::new(3.0, 2.5, 2.0);
    let truth = sun * cos_i * passed / (n * n) * left * seen * 0.02 / std::f64::consts::PI;
    let off = ((found - truth) / truth).abs();
    println!("{found} ± {error}, closed form {truth}");
    // Light up and down again: at most albedo × internal diffuse reflectance (0.48) of it.
    assert!(off.max_element() < 0.012, "{found} {truth}");
}

/// Solving for the sun and leaving it to chance have the same mean. The sun is made large, so that chance has one.
#[test]
fn solved_sunlight_through_waves_is_that_found_by_chance() {
    let mut scene = scene(square(64, 0.05));
    floor(&mut scene, -0.9);
    grey(&mut scene, 0.5);
    scene.description.light.sky = Sky::Uniform { radiance: Vec3::ZERO };
    scene.description.water.scattering = Vec3::splat(0.5);
    scene.description.water.absorption = Vec3::new(0.2, 0.1, 0.05);
    sun(&mut scene, 60.0, 15.0);
    let frame = waves(&scene);
    let view = view(
        Vec3::new(1.4, -0.3, 1.3),
        Vec3::new(1.7, -0.9, 1.7),
        UVec2::new(16, 12),
    );
    // Two pictures of other seeds tell the noise of their mean.
    let two = |how: SunThroughWaves, samples: u32| {
        let mut other = scene.clone();
        other.description.seed = 77;
        let settings = Settings {
            sun_through_waves: how,
            ..calm_air()
        };
        let view = View {
            samples,
            ..view.clone()
        };
        let a = path(settings.clone(), &scene, &frame, &view);
        let b = path(settings, &other, &frame, &view);
        let n = a.pixels.len() as f64;
        let (mut sum, mut square) = (0.0, 0.0);
        for (a, b) in a.pixels.iter().zip(&b.pixels) {
            let (a, b) = (f64::from(a.element_sum()), f64::from(b.element_sum()));
            sum += 0.5 * (a + b);
            square += 0.25 * (a - b) * (a - b);
        }
        (sum / n, (square / n / n).sqrt())
    };
    let (solved, noise) = two(SunThroughWaves::Solved, 128);
    let (by_chance, more) = two(SunThroughWaves::Chance, 2048);
    let noise = noise.hypot(more);
    println!("solved {solved}, by chance {by_chance}, standard error {noise}");
    assert!(noise < 0.01 * by_chance, "too noisy to tell: {noise}");
    assert!(
        (solved - by_chance).abs() < 4.0 * noise,
        "{solved} {by_chance} ± {noise}"
    );
}

/// Four times the samples halve the noise.
#[test]
fn noise_falls_with_the_root_of_the_samples() {
    let mut scene = scene(square(64, 0.05));
    floor(&mut scene, -0.5);
    grey(&mut scene, 0.5);
    sun(&mut scene, 45.0, 0.2665);
    let frame = waves(&scene);
    let mut view = view(
        Vec3::new(1.0, 0.9, 2.9),
        Vec3::new(1.6, -0.3, 1.6),
        UVec2::new(16, 12),
    );
    // Two pictures of other seeds differ by √2 times the noise.
    let noise = |view: &View| {
        let mut other = scene.clone();
        other.description.seed = 77;
        let a = path(calm_air(), &scene, &frame, view);
        let b = path(calm_air(), &other, &frame, view);
        let square: f64 = a
            .pixels
            .iter()
            .zip(&b.pixels)
            .map(|(a, b)| f64::from((*a - *b).length_squared()))
            .sum();
        square.sqrt()
    };
    view.samples = 8;
    let coarse = noise(&view);
    view.samples = 128;
    let fine = noise(&view);
    println!("noise at 8 over noise at 128 samples: {}", coarse / fine);
    // 4 but for how well some hundred pixels tell the noise.
    assert!((3.0..5.5).contains(&(coarse / fine)), "{coarse} {fine}");
}

/// The picture is the same for any number of threads and from run to run.
#[test]
fn pictures_do_not_depend_on_threads() {
    let mut scene = scene(square(32, 0.1));
    floor(&mut scene, -0.5);
    sun(&mut scene, 45.0, 0.2665);
    let frame = waves(&scene);
    let mut view = view(
        Vec3::new(1.0, 0.9, 2.9),
        Vec3::new(1.6, -0.3, 1.6),
        UVec2::new(70, 40),
    );
    view.samples = 2;
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .expect("threads");
        pool.install(|| path(calm_air(), &scene, &frame, &view))
    };
    assert_eq!(with(1), with(3));
}
