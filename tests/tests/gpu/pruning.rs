//! What is not needed is not there: the passes and bytes of each scene, exactly.

use crate::support::*;
use glam::UVec2;
use meniscus_render_gpu::facts::Facts;
use meniscus_render_gpu::shader::Piece;
use meniscus_render_gpu::{Settings, Technique, pass_names, techniques};

fn planned(name: &str, technique: Technique) -> (Vec<&'static str>, u64) {
    let scene = scene(name);
    let settings = Settings::new(technique);
    let facts = Facts::of_scene(&scene, &scene.grid, UVec2::new(64, 36), &settings).unwrap();
    let passes = techniques::passes(&facts, &settings);
    let plan = passes.graph.plan(&[passes.picture]).unwrap();
    (pass_names(&passes, &plan), plan.bytes)
}

const GROUND: [&str; 2] = ["slopes of the ground", "pyramid of the ground"];
const WATER: [&str; 2] = ["slopes of the water", "pyramid of the water"];
const CAUSTICS: [&str; 3] = ["photons", "light sums", "light on the ground"];
const TRACED: [&str; 2] = ["heightfield", "picture"];
const DRAWN: [&str; 5] = [
    "things beyond",
    "background",
    "things before",
    "water surface",
    "picture",
];

/// The bytes of the ripple tank by hand, for 64 × 36 pixels: water 33² samples with slopes and 341 blocks, ground 4² with 5 blocks, 96 values of
/// haze, 64² photons of 16 bytes, two maps of 33², and 36 bytes a pixel (radiance, depth, picture). The others were counted
/// by the same plan and stand for "nothing else came in".
#[test]
fn six_scenes_have_exactly_these_passes_and_bytes() {
    let tank = 4 * (3 * 33 * 33 + 2 * 341)
        + 4 * (3 * 16 + 2 * 5)
        + 4 * 96
        + 16 * 64 * 64
        + 8 * 33 * 33
        + 36 * 64 * 36;
    let traced = [&WATER[..], &GROUND, &CAUSTICS, &TRACED].concat();
    let drawn = [&WATER[..], &GROUND, &CAUSTICS, &DRAWN].concat();
    for (name, technique, passes, bytes) in [
        // Deep sea: no ground, hence no caustics.
        (
            "swell",
            Technique::Heightfield,
            [&WATER[..], &TRACED].concat(),
            5_344_948,
        ),
        ("ripple-tank", Technique::Heightfield, traced.clone(), tank),
        ("pool", Technique::Heightfield, traced.clone(), 5_294_340),
        ("lagoon", Technique::Heightfield, traced, 6_961_156),
        ("pool", Technique::TwoPhase, drawn.clone(), 5_750_148),
        ("calm-bay", Technique::NoRefraction, drawn, 11_448_220),
    ] {
        assert_eq!(planned(name, technique), (passes, bytes), "{name} {technique:?}");
    }
}

/// A march through voxels does not look at what lies beyond the surface: its pass is dropped, with its four textures.
#[test]
fn a_pass_whose_pictures_nobody_reads_is_dropped() {
    let (found, _) = planned("pool", Technique::DistanceField);
    assert!(
        !found.contains(&"things beyond") && found.contains(&"water surface"),
        "{found:?}"
    );
}

/// What a scene and its frame do not have is in no pipeline, not even as a branch that is never taken.
#[test]
fn pipelines_hold_no_code_for_what_is_not_there() {
    let code = |name: &str, technique| {
        let scene = scene(name);
        let settings = Settings::new(technique);
        let facts = Facts::of_scene(&scene, &scene.grid, UVec2::new(64, 36), &settings).unwrap();
        let passes = techniques::passes(&facts, &settings);
        let plan = passes.graph.plan(&[passes.picture]).unwrap();
        let work = |&k: &usize| passes.graph.passes()[k].work.pieces.clone();
        let pieces: Vec<Piece> = plan.passes.iter().flat_map(work).collect();
        let optional = [
            Piece::Caustics,
            Piece::Photons,
            Piece::Solids,
            Piece::Foam,
            Piece::Spray,
            Piece::SkyPicture,
            Piece::Looks,
            Piece::HeightfieldEdges,
            Piece::Foreign,
        ];
        optional
            .into_iter()
            .filter(|p| pieces.contains(p))
            .collect::<Vec<_>>()
    };
    for technique in [Technique::Heightfield, Technique::TwoPhase] {
        assert_eq!(code("swell", technique), [Piece::SkyPicture], "{technique:?}");
        assert_eq!(
            code("ripple-tank", technique),
            [Piece::Caustics, Piece::Photons],
            "{technique:?}"
        );
        assert_eq!(
            code("pool", technique),
            [Piece::Caustics, Piece::Photons, Piece::Solids],
            "{technique:?}"
        );
    }
}

#[test]
fn switched_off_means_not_there() {
    let scene = scene("pool");
    let off = Settings {
        caustics: false,
        ..Settings::new(Technique::Heightfield)
    };
    let facts = Facts::of_scene(&scene, &scene.grid, UVec2::new(64, 36), &off).unwrap();
    let passes = techniques::passes(&facts, &off);
    let plan = passes.graph.plan(&[passes.picture]).unwrap();
    let names = pass_names(&passes, &plan);
    assert!(CAUSTICS.iter().all(|c| !names.contains(c)), "{names:?}");
    let on = Settings::new(Technique::Heightfield);
    let more = techniques::passes(
        &Facts::of_scene(&scene, &scene.grid, UVec2::new(64, 36), &on).unwrap(),
        &on,
    );
    assert!(more.graph.plan(&[more.picture]).unwrap().bytes > plan.bytes);
}
