//! Scenes and frames for tests, benches and the fuzzer of recordings.

// Each of them uses a part, and includes this file as a module of its own.
#![allow(dead_code, unreachable_pub, clippy::unwrap_used)]

use meniscus_sim::glam::{Quat, UVec2, Vec2, Vec3};
use meniscus_sim::mesh::{Material, Shine, Texture, TriangleMesh, Wrap};
use meniscus_sim::rng::Rng;
use meniscus_sim::scene::Panorama;
use meniscus_sim::scene::description::Description;
use meniscus_sim::{BodyPose, Channels, Droplets, Frame, Grid, GridSpec, Scene, StepReport};

/// Spacing of the samples in metres.
pub const SPACING: f32 = 0.5;

/// A scene over `size` samples with everything that a header can hold.
pub fn scene(size: UVec2, tolerance: f32) -> Scene {
    let grid = grid(size);
    let files = "[terrain]\nkind = 'npy'\nfile = 'ground.npy'\npixel_size = [1.0, 1.0]\n\
                 [water]\ninitial = { kind = 'array', file = 'start.npy' }\n\
                 [light]\nsky = { kind = 'picture', file = 'sky.exr' }\n\
                 [[object]]\nname = 'kite'\nshape = { kind = 'model', file = 'kite.glb' }\n";
    // Reaches a little beyond the water.
    let spacing = (grid.extent().max_element() + 3.0) / 22.0;
    let ground = GridSpec::new(grid.origin - Vec2::ONE, spacing, UVec2::splat(23)).unwrap();
    let mesh = TriangleMesh {
        positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y, -Vec3::Z],
        normals: vec![Vec3::Y; 4],
        texcoords: vec![Vec2::ZERO, Vec2::X, Vec2::Y, Vec2::ONE],
        triangles: vec![[0, 1, 2], [2, 1, 3]],
        base_color: Vec3::new(0.2, 0.3, 0.4),
        materials: materials(),
        material_of: vec![1, 0],
    };
    let sky = Panorama {
        size: UVec2::new(8, 4),
        pixels: (0..32).map(|k| Vec3::new(0.5, 0.25 * k as f32, 1024.0)).collect(),
    };
    Scene::from_parts(
        description(grid, tolerance, files),
        Some(Grid::from_fn(ground, |i, j| {
            (0.3 * i as f32).sin() - 0.05 * j as f32 - 2.0
        })),
        vec![mesh],
        Some(sky),
        Some(Grid::from_fn(grid, |i, j| (0.1 * (i + 2 * j) as f32).cos())),
    )
    .unwrap()
}

/// A painted and a shiny one.
fn materials() -> Vec<Material> {
    let texture = Texture {
        size: UVec2::new(3, 2),
        texels: (0..6).map(|k| [k, 40 * k, 255 - k]).collect(),
        wrap: [Wrap::Clamp, Wrap::Mirror],
    };
    let painted = Material {
        color: Vec3::new(0.9, 0.5, 0.25),
        texture: Some(texture),
        shine: None,
    };
    let shine = Shine {
        roughness: 0.3,
        metallic: 1.0,
    };
    let shiny = Material {
        color: Vec3::splat(0.2),
        texture: None,
        shine: Some(shine),
    };
    vec![painted, shiny]
}

/// A scene with nothing but its grid; at least two samples along each axis.
pub fn bare_scene(size: UVec2, tolerance: f32) -> Scene {
    let description = description(grid(size), tolerance, "");
    Scene::from_parts(description, None, Vec::new(), None, None).unwrap()
}

fn grid(size: UVec2) -> GridSpec {
    GridSpec::new(Vec2::new(-3.0, 4.0), SPACING, size).unwrap()
}

fn description(grid: GridSpec, tolerance: f32, more: &str) -> Description {
    let (origin, extent) = (grid.origin, grid.extent());
    let text = format!(
        "name = 'waves'\nseed = 7\nsolver = {{ kind = 'procedural', spacing = {SPACING:?} }}\n\
         domain = {{ origin = [{:?}, {:?}], size = [{:?}, {:?}] }}\n\
         recording = {{ rate = 30.0, tolerance = {tolerance:?} }}\n{more}",
        origin.x, origin.y, extent.x, extent.y
    );
    Description::from_toml(&text, "test scene".as_ref(), &[]).unwrap()
}

/// A lively sea: a sum of many waves of random direction and phase that travel by the deep-water dispersion relation.
pub struct Sea {
    /// Wave vector, amplitude, phase, angular frequency.
    waves: Vec<([f64; 2], f64, f64, f64)>,
}

impl Sea {
    /// `count` waves of `shortest` to `longest` metres whose amplitudes grow with the wavelength to `power`, scaled to
    /// a significant height of `height` metres.
    pub fn new(seed: u64, count: usize, [shortest, longest]: [f64; 2], power: f64, height: f64) -> Self {
        let mut rng = Rng::new(seed, 11);
        let mut waves: Vec<_> = (0..count)
            .map(|_| {
                let length = shortest * (longest / shortest).powf(rng.uniform());
                let k = std::f64::consts::TAU / length;
                let (s, c) = (std::f64::consts::TAU * rng.uniform()).sin_cos();
                let phase = std::f64::consts::TAU * rng.uniform();
                ([k * c, k * s], length.powf(power), phase, (9.81 * k).sqrt())
            })
            .collect();
        let variance: f64 = waves.iter().map(|w| 0.5 * w.1 * w.1).sum();
        let scale = height / (4.0 * variance.sqrt());
        waves.iter_mut().for_each(|w| w.1 *= scale);
        Self { waves }
    }

    /// The sea that the bars on size and speed are measured on: 300 waves of 4 to 60 m on samples 0.5 m apart, Hs 1 m.
    pub fn lively() -> Self {
        Self::new(7, 300, [4.0, 60.0], 1.5, 1.0)
    }

    /// Elevation in metres on `spec` at `time` seconds.
    pub fn elevation(&self, spec: GridSpec, time: f64) -> Grid<f32> {
        let (w, h) = (spec.width(), spec.height());
        let mut sum = vec![0.0_f64; w * h];
        let dx = f64::from(spec.spacing);
        for &([kx, kz], amplitude, phase, omega) in &self.waves {
            let (turn_sin, turn_cos) = (kx * dx).sin_cos();
            for (j, row) in sum.chunks_mut(w).enumerate() {
                // A rotation a sample is cheaper than a sine.
                let (mut s, mut c) = (kz * dx * j as f64 + phase - omega * time).sin_cos();
                for v in row {
                    *v += amplitude * s;
                    (s, c) = (s * turn_cos + c * turn_sin, c * turn_cos - s * turn_sin);
                }
            }
        }
        Grid::from_vec(spec, sum.iter().map(|&v| v as f32).collect()).unwrap()
    }
}

/// A frame with all of `channels`, different for every `index`.
pub fn frame(spec: GridSpec, channels: Channels, index: u64) -> Frame {
    let time = index as f64 / 30.0;
    let sea = Sea::new(3, 12, [3.0, 40.0], 1.2, 0.8);
    let mut frame = Frame::new(spec);
    frame.prepare(spec, channels);
    (frame.time, frame.index) = (time, index);
    frame.elevation = sea.elevation(spec, time);
    let eta = frame.elevation.clone();
    let map = |f: &dyn Fn(f32) -> f32| Grid::from_fn(spec, |i, j| f(eta[(i, j)]));
    if let Some(depth) = &mut frame.depth {
        *depth = map(&|v| (v + 0.1).max(0.0));
    }
    if let Some(foam) = &mut frame.foam {
        *foam = map(&|v| (4.0 * v).clamp(0.0, 1.0));
    }
    if let Some(velocity) = &mut frame.velocity {
        *velocity = Grid::from_fn(spec, |i, j| {
            Vec2::new(3.0 * eta[(i, j)], -eta[(i, j)] * eta[(i, j)])
        });
    }
    if let Some(displacement) = &mut frame.displacement {
        *displacement = Grid::from_fn(spec, |i, j| Vec2::new(0.3 * eta[(i, j)], 0.01 * i as f32));
    }
    let mut rng = Rng::new(index, 5);
    let mut vector = || Vec3::new(rng.normal() as f32, rng.normal() as f32, rng.normal() as f32);
    for (list, count) in [
        (&mut frame.droplets, index * 37 % 300),
        (&mut frame.particles, 100 + index * 91 % 500),
    ] {
        if let Some(list) = list {
            *list = Droplets {
                position: (0..count).map(|_| 10.0 * vector()).collect(),
                velocity: (0..count).map(|_| vector()).collect(),
                radius: (0..count).map(|_| 1e-3 * vector().x.abs()).collect(),
            };
        }
    }
    if frame.bodies.is_some() {
        let pose = |_| BodyPose {
            position: vector(),
            rotation: Quat::from_scaled_axis(vector()),
            velocity: vector(),
            angular_velocity: vector(),
        };
        frame.bodies = Some((0..3).map(pose).collect());
    }
    frame
}

/// Totals that differ from frame to frame.
pub fn report(index: u64) -> StepReport {
    StepReport {
        substeps: 3,
        largest_stable_step: f64::INFINITY,
        mass: 1e6 + index as f64,
        momentum: [1.5, -2.5],
        energy: 4e5 - index as f64,
        courant: 0.7,
        froude: 0.2,
        clamps: index,
    }
}

/// Every bit of a frame, so that −0 differs from 0.
pub fn bits(frame: &Frame) -> Vec<u32> {
    fn vectors(grid: &Grid<Vec2>) -> impl Iterator<Item = f32> {
        grid.as_slice().iter().flat_map(|v| v.to_array())
    }
    let mut all: Vec<f32> = frame.elevation.as_slice().to_vec();
    all.extend(frame.depth.iter().flat_map(|g| g.as_slice()));
    all.extend(frame.foam.iter().flat_map(|g| g.as_slice()));
    all.extend(frame.velocity.iter().flat_map(vectors));
    all.extend(frame.displacement.iter().flat_map(vectors));
    for d in frame.droplets.iter().chain(&frame.particles) {
        all.extend(d.position.iter().chain(&d.velocity).flat_map(|v| v.to_array()));
        all.extend(&d.radius);
    }
    for b in frame.bodies.iter().flatten() {
        all.extend(b.position.to_array());
        all.extend(b.rotation.to_array());
        all.extend(b.velocity.to_array());
        all.extend(b.angular_velocity.to_array());
    }
    let time = frame.time.to_bits();
    let mut bits = vec![
        time as u32,
        (time >> 32) as u32,
        frame.index as u32,
        frame.channels().bits(),
    ];
    bits.extend(all.iter().map(|v| v.to_bits()));
    bits
}
