//! Scenes made by hand.
#![allow(dead_code)]

use meniscus_sim::glam::{UVec2, Vec2, Vec3};
use meniscus_sim::render::{Image, RenderReport, Renderer, View};
use meniscus_sim::scene::description::*;
use meniscus_sim::{Frame, Grid, GridSpec, Scene};

/// A still scene over `spec`: uniform sky of radiance 1, no sun, clear water at level 0, open edges, no ground.
pub(crate) fn scene(spec: GridSpec) -> Scene {
    let open = Boundary {
        drives: Vec::new(),
        x_min: Edge::Open,
        x_max: Edge::Open,
        z_min: Edge::Open,
        z_max: Edge::Open,
    };
    Scene {
        description: Description {
            name: "test".to_owned(),
            seed: 1,
            duration: 1.0,
            domain: Domain {
                origin: Some(spec.origin),
                size: Some(spec.extent()),
            },
            water: Water {
                absorption: Vec3::ZERO,
                scattering: Vec3::ZERO,
                ..Water::default()
            },
            terrain: None,
            ground: GroundLook::default(),
            solver: Solver::Procedural(Procedural {
                spacing: spec.spacing,
                depth: None,
                waves: Vec::new(),
            }),
            beds: Vec::new(),
            boundary: open,
            layers: Vec::new(),
            detail: None,
            horizon: None,
            objects: Vec::new(),
            light: Light {
                sun: None,
                sky: Sky::Uniform { radiance: Vec3::ONE },
            },
            cameras: Vec::new(),
            events: Vec::new(),
            recording: Recording::default(),
        },
        grid: spec,
        terrain: None,
        meshes: Vec::new(),
        sky: None,
        initial_elevation: None,
        uplifts: Vec::new(),
    }
}

pub(crate) fn square(n: u32, spacing: f32) -> GridSpec {
    GridSpec::new(Vec2::ZERO, spacing, UVec2::splat(n)).expect("a grid of the test")
}

/// Level ground at `height`.
pub(crate) fn floor(scene: &mut Scene, height: f32) {
    scene.description.terrain = Some(Terrain::Flat { height });
    scene.terrain = Some(Grid::filled(scene.grid, height));
}

pub(crate) fn view(position: Vec3, target: Vec3, size: UVec2) -> View {
    let across = (target - position).normalize().cross(Vec3::Y).length() > 1e-3;
    View {
        position,
        target,
        up: if across { Vec3::Y } else { Vec3::NEG_Z },
        vertical_fov: 0.9,
        size,
        samples: 1,
        pass: 0,
    }
}

pub(crate) fn frame(spec: GridSpec, elevation: impl Fn(Vec2) -> f32) -> Frame {
    let mut frame = Frame::new(spec);
    frame.elevation = Grid::from_fn(spec, |i, j| elevation(spec.position(i, j)));
    frame
}

pub(crate) fn draw(
    renderer: &mut dyn Renderer,
    scene: &Scene,
    frame: &Frame,
    view: &View,
) -> (Image, RenderReport) {
    let mut image = Image::default();
    let report = renderer
        .render(scene, frame, view, &mut image, &|_| true)
        .expect("the scene of the test is drawn");
    assert_eq!(image.pixels.len(), (view.size.x * view.size.y) as usize);
    assert!(
        image
            .pixels
            .iter()
            .all(|p| p.is_finite() && p.min_element() >= 0.0)
    );
    (image, report)
}

/// The scene of the paper with `count` of its waves: rings of wave particles as dense as can be, whose profile is its
/// equation (4), grown for `time` seconds at 1.5 m/s.
pub(crate) fn rings(scene: &Scene, count: usize, time: f64) -> Frame {
    let starts: Vec<(f64, Vec2)> = scene
        .description
        .events
        .iter()
        .filter_map(|event| match event {
            Event::Drop { time, position, .. } => Some((*time, *position)),
            _ => None,
        })
        .collect();
    frame(scene.grid, |p| {
        (0..count)
            .map(|k| {
                // After the scene's own waves the same again, a step aside.
                let (start, place) = starts[k % starts.len()];
                let round = (k / starts.len()) as f32;
                let centre = (place + Vec2::new(3.0, 1.7) * round).rem_euclid(Vec2::splat(24.0));
                let radius = 1.5 * (time - start).max(0.0) as f32;
                let off = (p.distance(centre) - radius).abs();
                let amplitude = 0.35 / (1.0 + radius).sqrt();
                // Half the width of a wave, metres.
                let reach = 1.2;
                if off < reach {
                    0.5 * amplitude * ((std::f32::consts::PI * off / reach).cos() + 1.0)
                } else {
                    0.0
                }
            })
            .sum()
    })
}
