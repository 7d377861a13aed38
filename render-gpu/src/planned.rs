//! What drawing a scene runs and keeps, and what it leaves out (`meniscus plan`).

use crate::facts::Facts;
use crate::settings::Settings;
use crate::techniques;
use meniscus_sim::Scene;
use meniscus_sim::glam::UVec2;
use meniscus_sim::render::PlanItem;

fn item(name: impl Into<String>, active: bool, reason: impl Into<String>, bytes: u64) -> PlanItem {
    PlanItem {
        name: name.into(),
        active,
        reason: reason.into(),
        bytes: if active { bytes } else { 0 },
    }
}

/// The plan of a scene before it has a frame.
pub(crate) fn items(scene: &Scene, size: UVec2, settings: &Settings) -> Vec<PlanItem> {
    let facts = match Facts::of_scene(scene, &scene.grid, size, settings) {
        Ok(facts) => facts,
        Err(error) => return vec![item("everything", false, error.to_string(), 0)],
    };
    let passes = techniques::passes(&facts, settings);
    let plan = match passes.graph.plan(&[passes.picture]) {
        Ok(plan) => plan,
        Err(error) => return vec![item("everything", false, error.to_string(), 0)],
    };
    let mut items: Vec<PlanItem> = Vec::new();
    for &k in &plan.passes {
        let pass = &passes.graph.passes()[k];
        let writes: Vec<&str> = pass.writes.iter().map(|&id| passes.graph.name(id)).collect();
        items.push(item(
            format!("pass: {}", pass.name),
            true,
            format!("writes {}", writes.join(", ")),
            0,
        ));
    }
    for &k in &plan.dropped {
        let pass = &passes.graph.passes()[k];
        items.push(item(
            format!("pass: {}", pass.name),
            false,
            "nothing in the picture depends on it",
            0,
        ));
    }
    for &id in &plan.imported {
        let graph = &passes.graph;
        items.push(item(
            graph.name(id),
            true,
            "kept from frame to frame",
            graph.kind(id).bytes(),
        ));
    }
    for slot in &plan.slots {
        let names: Vec<&str> = slot.members.iter().map(|&id| passes.graph.name(id)).collect();
        items.push(item(names.join(" / "), true, "within a frame", slot.kind.bytes()));
    }
    let why = match (
        facts.caustics,
        settings.caustics,
        facts.sun,
        scene.terrain.is_some(),
    ) {
        (Some(_), ..) => "sun, waves and ground; left out for frames whose waves are too slight",
        (None, false, ..) => "switched off",
        (None, _, false, _) => "the scene has no sun",
        (None, _, _, false) => "the scene has no ground",
        _ => "the grid is a single row",
    };
    items.push(item("caustics", facts.caustics.is_some(), why, 0));
    items.push(item(
        "objects",
        facts.objects > 0,
        if facts.objects > 0 {
            "traced by the shaders"
        } else {
            "the scene has no objects"
        },
        0,
    ));
    items.push(item(
        "materials",
        facts.looks,
        if facts.looks {
            "models have more than one colour"
        } else {
            "no model has more than one colour"
        },
        0,
    ));
    items.push(item("foam", false, "taken up only by frames that carry it", 0));
    items.push(item(
        "droplets",
        false,
        "taken up only by frames that carry them",
        0,
    ));
    items
}
