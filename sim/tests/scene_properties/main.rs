//! Properties of scene files: nothing panics, whatever is written; what is described round-trips.
#![allow(clippy::unwrap_used)] // a test may panic

mod draw;

use draw::Draw;
use meniscus_sim::glam::{DVec2, Quat, Vec2, Vec3};
use meniscus_sim::rng::Rng;
use meniscus_sim::scene::description::*;
use meniscus_sim::{Channels, Scene};
use proptest::prelude::*;
use std::path::{Path, PathBuf};

const SCENES: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../data/scenes");

fn corpus() -> Vec<(PathBuf, String)> {
    let mut paths: Vec<PathBuf> = std::fs::read_dir(SCENES)
        .unwrap()
        .map(|e| e.unwrap().path())
        .collect();
    paths.retain(|p| p.extension().is_some_and(|e| e == "toml"));
    paths.sort();
    paths
        .into_iter()
        .map(|p| (p.clone(), std::fs::read_to_string(p).unwrap()))
        .collect()
}

/// Reads without the files that the scene names.
fn parse(text: &str) -> Result<Description, meniscus_sim::scene::SceneError> {
    Description::from_toml(text, Path::new("scene.toml"), &[])
}

#[test]
fn every_scene_of_the_repository_loads_and_round_trips() {
    let corpus = corpus();
    assert!(corpus.len() >= 6);
    for (path, _) in corpus {
        let scene = Scene::load(&path, &[]).unwrap_or_else(|e| panic!("{e}"));
        let text = scene.description.to_toml();
        assert_eq!(parse(&text).unwrap(), scene.description, "{}", path.display());
        assert_eq!(parse(&text).unwrap().to_toml(), text, "the text is canonical");
        let again = Scene::from_parts(
            scene.description.clone(),
            scene.terrain.clone(),
            scene.meshes.clone(),
            scene.sky.clone(),
            scene.initial_elevation.clone(),
        );
        assert_eq!(again.unwrap(), scene, "{}", path.display());
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    #[test]
    fn descriptions_round_trip(seed: u64) {
        let description = Draw(Rng::new(seed, 0)).description();
        let text = description.to_toml();
        match parse(&text) {
            Ok(again) => {
                prop_assert_eq!(&again, &description);
                prop_assert_eq!(again.to_toml(), text);
            }
            Err(e) => return Err(TestCaseError::fail(format!("{e}\n{text}"))),
        }
    }

    #[test]
    fn any_text_is_read_or_refused(text in ".{0,200}") {
        let _ = parse(&text);
    }

    #[test]
    fn toml_like_text_is_read_or_refused(text in "([a-z]{1,4}|\\[|\\]|=|\\.|\"|[0-9]{1,3}|\n| |,|\\{|\\}|#){0,60}") {
        let _ = parse(&text);
    }

    #[test]
    fn mutated_scenes_are_read_or_refused_with_reasons(
        which in 0_usize..100,
        edits in proptest::collection::vec((any::<prop::sample::Index>(), any::<u8>(), 0_usize..4), 1..8),
    ) {
        let corpus = corpus();
        let (_, text) = &corpus[which % corpus.len()];
        let mut bytes = text.clone().into_bytes();
        for (at, byte, how) in edits {
            if bytes.is_empty() {
                break;
            }
            let at = at.index(bytes.len());
            match how {
                0 => bytes[at] = byte,
                1 => bytes.insert(at, byte),
                2 => drop(bytes.remove(at)),
                _ => bytes.truncate(at.max(1)),
            }
        }
        let text = String::from_utf8_lossy(&bytes);
        if let Err(error) = parse(&text) {
            prop_assert!(!error.problems.is_empty());
            for p in error.problems {
                prop_assert!(!p.message.is_empty() && !p.remedy.is_empty(), "{p:?}");
                prop_assert!(p.line.is_none_or(|l| l >= 1 && l as usize <= text.lines().count() + 1), "{p:?}");
            }
        }
    }

    #[test]
    fn any_override_is_applied_or_refused(key in "[a-z.0-9]{0,20}", value in ".{0,20}") {
        let (_, text) = corpus().swap_remove(0);
        let overrides = [format!("{key}={value}")];
        if let Err(error) = Description::from_toml(&text, Path::new("scene.toml"), &overrides) {
            prop_assert!(error.problems.iter().any(|p| p.message.contains("--set")), "{error}");
        }
    }
}
