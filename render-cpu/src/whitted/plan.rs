//! What drawing a scene keeps and runs, and what it leaves out (`meniscus plan`).

use super::Settings;
use super::caustics::Caustics;
use crate::sky::Sky;
use crate::stage::continuation::continued_samples;
use crate::stage::objects::Model;
use crate::stage::surface::bytes_for;
use crate::stage::{ground, surroundings};
use glam::{UVec2, Vec3};
use meniscus_sim::Scene;
use meniscus_sim::render::PlanItem;
use meniscus_sim::scene::description::{Shape, Sky as SkyKind};

fn item(name: &str, active: bool, reason: impl Into<String>, bytes: u64) -> PlanItem {
    PlanItem {
        name: name.to_owned(),
        active,
        reason: reason.into(),
        bytes: if active { bytes } else { 0 },
    }
}

/// [`plan`] for renderers that cast the same rays and find the sun's light in another way.
pub(crate) fn without_caustics(scene: &Scene, size: UVec2, visual_range: Option<f32>) -> Vec<PlanItem> {
    let settings = Settings {
        caustics: false,
        visual_range,
        ..Settings::default()
    };
    let mut items = plan(scene, size, &settings);
    items.retain(|item| item.name != "caustics");
    items
}

/// What `whitted` with these settings runs and keeps.
pub(crate) fn plan(scene: &Scene, size: UVec2, settings: &Settings) -> Vec<PlanItem> {
    let d = &scene.description;
    let mut items = Vec::new();

    let how = surroundings::water_continuation(scene);
    let samples = continued_samples(&scene.grid, &how);
    items.push(item(
        "water heightfield",
        true,
        format!(
            "{} x {} samples and how they go on beyond the edges",
            scene.grid.size.x, scene.grid.size.y
        ),
        bytes_for(samples) + 4 * scene.grid.len() as u64,
    ));

    let relief = scene.terrain.as_ref().is_some_and(|t| {
        let (low, high) = t.range();
        low < high
    });
    items.push(match &scene.terrain {
        Some(terrain) => {
            let samples = continued_samples(
                terrain.spec(),
                &surroundings::ground_continuation(terrain, d.water.level),
            );
            let reason = format!(
                "{} x {} heights of the ground",
                terrain.spec().size.x,
                terrain.spec().size.y
            );
            item(
                "ground heightfield",
                true,
                reason,
                bytes_for(samples) + 4 * scene.grid.len() as u64,
            )
        }
        None => item("ground heightfield", false, "the scene has no ground", 0),
    });
    items.push(match &scene.terrain {
        Some(terrain) if relief => item(
            "sky seen by the ground",
            true,
            "the ground has relief",
            4 * terrain.spec().len() as u64,
        ),
        _ => item("sky seen by the ground", false, "no ground with relief", 0),
    });
    let detail = relief && d.ground.checker <= 0.0;
    let why = if detail {
        "ground with relief, finer than its samples"
    } else if relief {
        "a checkerboard has none"
    } else {
        "no ground with relief"
    };
    items.push(item("ground detail", detail, why, ground::Ground::noise_bytes()));

    let sky = Sky::planned_bytes(scene);
    let why = match &d.light.sky {
        SkyKind::Uniform { .. } => "the sky is uniform",
        SkyKind::Picture { .. } if scene.sky.is_none() => "the scene names a picture that it does not hold",
        SkyKind::Picture { .. } => "picture, its coarser levels and irradiance by normal",
        SkyKind::Daylight { .. } => {
            "daylight model as a picture, its coarser levels and irradiance by normal"
        }
    };
    items.push(item("sky picture", sky > 0, why, sky));
    let sun = d.light.sun.is_some() || Sky::new(scene).sun().is_some();
    items.push(item(
        "sun and its shadows",
        sun,
        if sun {
            "the scene has a sun"
        } else {
            "the scene has no sun"
        },
        0,
    ));

    let caustics = sun && scene.terrain.is_some() && settings.caustics;
    let why = if !settings.caustics {
        "switched off"
    } else if !sun {
        "the scene has no sun"
    } else if scene.terrain.is_none() {
        "the scene has no ground"
    } else {
        "sun, waves and ground; left out for frames whose waves are too slight"
    };
    items.push(item(
        "caustics",
        caustics,
        why,
        Caustics::bytes_for(scene.grid.len() as u64),
    ));

    let objects = d.objects.len();
    let models: Vec<u64> = d
        .objects
        .iter()
        .zip(&scene.meshes)
        .filter(|(o, _)| matches!(o.shape, Shape::Model { .. }))
        .map(|(_, mesh)| mesh.triangles.len() as u64)
        .collect();
    items.push(if objects == 0 {
        item("objects", false, "the scene has no objects", 0)
    } else {
        item(
            "objects",
            true,
            format!("{objects} at their poses"),
            256 * objects as u64,
        )
    });
    items.push(if models.is_empty() {
        item("object triangles", false, "no object is a model", 0)
    } else {
        let triangles: u64 = models.iter().sum();
        item(
            "object triangles",
            true,
            format!("{triangles} triangles under hierarchies"),
            Model::bytes_for(triangles),
        )
    });
    items.push(item(
        "droplets",
        false,
        "taken up only by frames that carry them",
        0,
    ));
    items.push(item("foam", false, "taken up only by frames that carry it", 0));

    let absorbs = d.water.absorption.max_element() > 0.0;
    let why = if absorbs {
        "the water absorbs"
    } else {
        "the water absorbs nothing"
    };
    items.push(item("absorption in the water", absorbs, why, 0));
    let scatters = d.water.scattering != Vec3::ZERO;
    let why = if scatters {
        "the water scatters"
    } else {
        "the water scatters nothing"
    };
    items.push(item("scattering in the water", scatters, why, 0));
    let basin = surroundings::is_basin(scene);
    let why = if basin {
        "walls that stand in water all along"
    } else {
        "water and ground go on beyond the edges"
    };
    items.push(item("walls and deck of a basin", basin, why, 0));
    items.push(match settings.visual_range {
        Some(range) => item("haze", true, format!("visual range of {range} m"), 0),
        None => item("haze", false, "perfectly clear air was asked for", 0),
    });

    let pixels = u64::from(size.x) * u64::from(size.y);
    items.push(item(
        "picture",
        true,
        format!("{} x {} pixels", size.x, size.y),
        12 * pixels,
    ));
    items
}
