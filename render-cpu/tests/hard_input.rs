//! What is hard or wrong, for every renderer alike: drawn without a value that is no light, or refused with a reason.

mod common;

use common::{draw, floor, frame, scene, square, view};
use meniscus_render_cpu::{PhotonMapper, photon, renderers};
use meniscus_sim::frame::Frame;
use meniscus_sim::glam::{Quat, UVec2, Vec2, Vec3};
use meniscus_sim::mesh::{Material, Texture, TriangleMesh, Wrap};
use meniscus_sim::render::{Image, RenderError, Renderer, View};
use meniscus_sim::scene::description::{Motion, Object, Shape, Sun};
use meniscus_sim::{Grid, Scene};

fn every() -> impl Iterator<Item = Box<dyn Renderer>> {
    renderers::available()
        .into_iter()
        .map(|info| -> Box<dyn Renderer> {
            if info.name == PhotonMapper::NAME {
                // Fewer photons than by default: what is asked here does not hang on noise.
                return Box::new(PhotonMapper::new(photon::Settings {
                    photons: Some(4096),
                    ..photon::Settings::default()
                }));
            }
            renderers::build(info.name).expect("a renderer that is listed")
        })
}

fn lit(n: u32, spacing: f32) -> Scene {
    let mut scene = scene(square(n, spacing));
    floor(&mut scene, -2.0);
    scene.description.light.sun = Some(Sun {
        elevation: 40.0,
        azimuth: 100.0,
        irradiance: Vec3::splat(3.0),
        radius: 0.27,
    });
    scene
}

fn eye(size: UVec2) -> View {
    view(Vec3::new(-1.0, 2.5, 4.0), Vec3::new(1.6, -0.2, 1.6), size)
}

/// 1e-6 m, steeper than 80°, steeper than 88°, and no wave at all.
#[test]
fn waves_of_any_steepness_are_drawn() {
    let scene = lit(65, 0.05);
    for (amplitude, length) in [(0.0, 1.0), (1e-6, 0.5), (0.6, 0.6), (1.5, 0.25)] {
        let steepest = std::f32::consts::TAU * amplitude / length;
        let waves = frame(scene.grid, |p| {
            amplitude * (std::f32::consts::TAU * (p.x + 0.3 * p.y) / length).sin()
        });
        if amplitude > 0.1 {
            assert!(steepest.atan().to_degrees() > 80.0);
        }
        for mut renderer in every() {
            draw(renderer.as_mut(), &scene, &waves, &eye(UVec2::new(32, 24)));
        }
    }
}

#[test]
fn eyes_on_the_surface_see_and_eyes_in_the_ground_are_refused() {
    let scene = lit(33, 0.1);
    let still = frame(scene.grid, |_| 0.0);
    for mut renderer in every() {
        let on = view(
            Vec3::new(1.6, 0.0, 3.0),
            Vec3::new(1.6, 0.0, 0.0),
            UVec2::new(24, 24),
        );
        let (image, _) = draw(renderer.as_mut(), &scene, &still, &on);
        assert!(image.pixels.iter().any(|p| p.max_element() > 0.0));
        let inside = View {
            position: Vec3::new(1.6, -2.5, 1.6),
            ..on
        };
        let error = refusal(renderer.as_mut(), &scene, &still, &inside).to_string();
        assert!(
            error.contains("inside the ground") && error.contains("raise"),
            "{error}"
        );
    }
}

fn refusal(renderer: &mut dyn Renderer, scene: &Scene, frame: &Frame, view: &View) -> RenderError {
    renderer
        .render(scene, frame, view, &mut Image::default(), &|_| true)
        .expect_err("a refusal")
}

#[test]
fn a_frame_with_a_value_that_is_none_is_refused_and_not_drawn() {
    let scene = lit(33, 0.1);
    for value in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        let mut broken = frame(scene.grid, |_| 0.0);
        broken.elevation[(5, 7)] = value;
        for mut renderer in every() {
            let error = refusal(renderer.as_mut(), &scene, &broken, &eye(UVec2::splat(8)));
            assert!(
                matches!(error, RenderError::NonFinite(_)) && error.to_string().contains("elevation"),
                "{error}"
            );
        }
    }
}

/// One pixel, and pictures as long as any may be; one side more is refused.
#[test]
fn pictures_from_one_pixel_to_the_longest_are_drawn() {
    let scene = lit(17, 0.2);
    let still = frame(scene.grid, |_| 0.0);
    for mut renderer in every() {
        for size in [UVec2::ONE, UVec2::new(16_384, 1), UVec2::new(1, 16_384)] {
            let mut view = eye(size);
            // Up and down as well as along, so that the angle across stays below half a turn.
            view.vertical_fov = if size.x > 1 { 1e-4 } else { 0.9 };
            draw(renderer.as_mut(), &scene, &still, &view);
        }
        let error = refusal(renderer.as_mut(), &scene, &still, &eye(UVec2::new(16_385, 1)));
        assert!(error.to_string().contains("1 to 16384"), "{error}");
    }
}

/// Triangles without area, alone and among others; and a texture, seen where it should be.
#[test]
fn models_may_have_triangles_without_area_and_textures() {
    let mut scene = lit(33, 0.1);
    scene.description.light.sun = None;
    let still = frame(scene.grid, |_| -1.0);
    scene.description.objects.push(Object {
        name: "card".to_owned(),
        shape: Shape::Model {
            file: "made by hand".into(),
            scale: 1.0,
        },
        position: Vec3::new(1.6, 0.5, 1.6),
        rotation: Quat::IDENTITY,
        velocity: Vec3::ZERO,
        spin: Vec3::ZERO,
        density: 600.0,
        motion: Motion::default(),
        color: None,
    });
    let nothing = TriangleMesh {
        positions: vec![Vec3::ZERO, Vec3::X, 2.0 * Vec3::X],
        normals: vec![Vec3::Y; 3],
        triangles: vec![[0, 1, 2], [0, 0, 1], [1, 1, 1]],
        base_color: Vec3::ONE,
        ..TriangleMesh::default()
    };
    // A level square, red in its western and green in its eastern half.
    let mut card = nothing.clone();
    card.positions
        .extend([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(|(x, z)| Vec3::new(x, 0.0, z)));
    card.normals.extend([Vec3::Y; 4]);
    card.texcoords = vec![Vec2::ZERO; 3];
    card.texcoords.extend([Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y]);
    card.triangles.extend([[3, 5, 4], [3, 6, 5]]);
    card.materials = vec![Material {
        color: Vec3::ONE,
        texture: Some(Texture {
            size: UVec2::new(2, 1),
            texels: vec![[255, 0, 0], [0, 255, 0]],
            wrap: [Wrap::Clamp; 2],
        }),
        shine: None,
    }];
    card.material_of = vec![0; 5];
    card.validate().expect("a whole mesh");
    let down = view(
        Vec3::new(1.6, 4.0, 1.6),
        Vec3::new(1.6, 0.0, 1.6),
        UVec2::new(33, 33),
    );
    for mut renderer in every() {
        scene.meshes = vec![nothing.clone()];
        draw(renderer.as_mut(), &scene, &still, &down);
        scene.meshes = vec![card.clone()];
        let (image, _) = draw(renderer.as_mut(), &scene, &still, &down);
        // Haze over four metres of air adds 1e-4 of blue.
        let (west, east) = (image.pixel(10, 16), image.pixel(22, 16));
        assert!(
            west.x > 0.1 && west.y.max(west.z) < 1e-3 * west.x,
            "{}: {west}",
            renderer.name()
        );
        assert!(
            east.y > 0.1 && east.x.max(east.z) < 1e-3 * east.y,
            "{}: {east}",
            renderer.name()
        );
    }
}

/// Grids of one sample, of one row, and ground that rises out of the water everywhere.
#[test]
fn grids_without_a_cell_and_water_without_depth_are_drawn() {
    for size in [UVec2::ONE, UVec2::new(40, 1), UVec2::new(1, 40)] {
        let spec = meniscus_sim::GridSpec::new(Vec2::ZERO, 0.1, size).expect("a grid");
        let mut scene = scene(spec);
        floor(&mut scene, -2.0);
        let still = frame(spec, |_| 0.0);
        for mut renderer in every() {
            draw(renderer.as_mut(), &scene, &still, &eye(UVec2::splat(12)));
        }
    }
    let mut dry = lit(33, 0.1);
    dry.terrain = Some(Grid::filled(dry.grid, 0.5));
    let below = frame(dry.grid, |_| 0.0);
    for mut renderer in every() {
        draw(renderer.as_mut(), &dry, &below, &eye(UVec2::splat(12)));
    }
}
