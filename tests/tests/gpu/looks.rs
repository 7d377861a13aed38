//! Models with materials and textures: the colours of the ray tracer, and nothing of it where no model has any.

use crate::support::*;
use glam::{Quat, UVec2, Vec2, Vec3};
use meniscus_render_gpu::facts::Facts;
use meniscus_render_gpu::shader::Piece;
use meniscus_render_gpu::{Settings, Technique, techniques};
use meniscus_sim::mesh::{Material, Shine, Texture, TriangleMesh, Wrap};
use meniscus_sim::scene::description::{Motion, Object, Shape};
use meniscus_sim::{Frame, Scene};

const SIZE: UVec2 = UVec2::new(128, 72);

fn texture(wrap: [Wrap; 2]) -> Texture {
    let texel = |k: u32| [(k * 67 % 256) as u8, (k * 151 % 256) as u8, (k * 29 % 256) as u8];
    Texture {
        size: UVec2::new(5, 3),
        texels: (0..15).map(texel).collect(),
        wrap,
    }
}

/// A cube with a material a pair of faces: pictures that go on in every way beyond their borders, and a plain colour, which is a
/// gloss at that: like the ray tracer, this renderer leaves the gloss to path tracing.
fn cube(side: f32) -> TriangleMesh {
    let material = |texture, shine| Material {
        color: Vec3::new(1.0, 0.8, 0.6),
        texture,
        shine,
    };
    let mut mesh = TriangleMesh {
        base_color: Vec3::splat(0.5),
        materials: vec![
            material(Some(texture([Wrap::Repeat, Wrap::Mirror])), None),
            material(Some(texture([Wrap::Clamp, Wrap::Repeat])), None),
            material(
                None,
                Some(Shine {
                    roughness: 0.2,
                    metallic: 0.0,
                }),
            ),
        ],
        ..TriangleMesh::default()
    };
    for (face, normal) in [Vec3::X, -Vec3::X, Vec3::Z, -Vec3::Z, Vec3::Y, -Vec3::Y]
        .into_iter()
        .enumerate()
    {
        let u = normal.any_orthonormal_vector();
        let v = normal.cross(u);
        let first = mesh.positions.len() as u32;
        for (a, b) in [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)] {
            mesh.positions.push(0.5 * side * (normal + a * u + b * v));
            mesh.normals.push(normal);
            mesh.texcoords.push(Vec2::new(1.3 * a, 0.9 * b - 0.2));
        }
        mesh.triangles
            .extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
        mesh.material_of.extend([(face / 2) as u16; 2]);
    }
    mesh.validate().unwrap();
    mesh
}

/// The pool with a cube that reaches out of the water.
fn pool() -> (Scene, Frame) {
    let mut scene = scene("pool");
    let frame = frame(&scene, 20);
    scene.description.objects.push(Object {
        name: "cube".to_owned(),
        shape: Shape::Model {
            file: "made by hand".into(),
            scale: 1.0,
        },
        position: Vec3::new(2.3, -0.1, 2.5),
        rotation: Quat::from_rotation_y(0.5) * Quat::from_rotation_x(0.3),
        velocity: Vec3::ZERO,
        spin: Vec3::ZERO,
        density: 600.0,
        motion: Motion::default(),
        color: None,
    });
    scene.meshes.push(cube(1.1));
    (scene, frame)
}

/// Without its materials.
fn bare(scene: &Scene) -> Scene {
    let mut scene = scene.clone();
    let mesh = scene.meshes.last_mut().unwrap();
    mesh.materials.clear();
    mesh.material_of.clear();
    scene
}

#[test]
fn materials_are_those_of_the_truth() {
    let (scene, frame) = pool();
    let view = view(&scene, Some("edge"), SIZE);
    let bare = bare(&scene);
    let (truth, plain) = (
        truth_image(&scene, &frame, &view),
        truth_image(&bare, &frame, &view),
    );
    let shows: Vec<bool> = truth
        .pixels
        .iter()
        .zip(&plain.pixels)
        .map(|(a, b)| (a - b).abs().max_element() > 1e-3)
        .collect();
    let told = score(&truth, &plain, Some(&shows)).mean;
    assert!(shows.iter().filter(|s| **s).count() > 300 && told > 0.1, "{told}");
    for technique in [Technique::Heightfield, Technique::TwoPhase] {
        let mut renderer = gpu(technique);
        let (image, _) = gpu_image(&mut renderer, &scene, &frame, &view);
        keep(&format!("looks-{technique:?}"), &[&truth, &image]);
        let with = score(&truth, &image, Some(&shows)).mean;
        // The same renderer, for a scene that has none of it, and back.
        let (image, _) = gpu_image(&mut renderer, &bare, &frame, &view);
        let without = score(&plain, &image, Some(&shows)).mean;
        println!(
            "{technique:?}: FLIP {with} with materials, {without} without; {told} if they were not seen"
        );
        if technique == Technique::Heightfield {
            assert!(with <= 0.02, "{with}");
        }
        // Materials add nothing to what the technique is off anyway, but for contrast where it looks elsewhere.
        assert!(with <= 1.5 * without + 2e-3, "{technique:?}: {with} {without}");
    }
}

#[test]
fn a_scene_without_materials_has_none_of_it() {
    let (scene, _) = pool();
    let settings = Settings::new(Technique::TwoPhase);
    let of = |scene: &Scene| {
        let facts = Facts::of_scene(scene, &scene.grid, SIZE, &settings).unwrap();
        let passes = techniques::passes(&facts, &settings);
        let pieces: Vec<Piece> = passes
            .graph
            .passes()
            .iter()
            .flat_map(|p| p.work.pieces.clone())
            .collect();
        let bytes = passes.graph.plan(&[passes.picture]).unwrap().bytes;
        let looks = [Piece::Looks, Piece::CornersLook];
        (looks.map(|p| pieces.contains(&p)), facts, bytes)
    };
    let (with, facts, more) = of(&scene);
    let (without, bare, bytes) = of(&bare(&scene));
    assert_eq!((with, without), ([true; 2], [false; 2]));
    // A row a triangle of the cube, for rays and again for drawing (where ball and box have theirs too); three materials of two rows, and
    // twice fifteen texels, four a row.
    let rows = 12 + 3 * 2 + 2 * 4;
    assert_eq!(facts.solid_rows - bare.solid_rows, rows);
    let drawn: u32 = facts.mesh.objects.iter().map(|[_, _, n]| n).sum();
    assert_eq!(more - bytes, 16 * u64::from(rows + drawn));
}
