//! What became of the water in a run: how its volume changed, and how much of that nothing accounts for.

use super::format;
use meniscus_sim::Scene;
use meniscus_sim::events::{Action, Schedule};
use meniscus_sim::optics::WATER_DENSITY;
use meniscus_sim::reduce;
use serde::Serialize;

/// Change of the water's volume from the first to the last frame.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct VolumeAccount {
    /// Volume at the end less the volume at the start, m³; absent where the solver does not tell.
    pub volume_change: Option<f64>,
    /// Volume of the drops that fell meanwhile, m³.
    pub volume_added: f64,
    /// What neither the start nor the drops account for, as a share of the water at rest; absent without ground.
    /// Open edges let water in and out, which counts here too.
    pub volume_drift: Option<f64>,
}

impl VolumeAccount {
    /// The account of a run from time 0 to `end` that began and ended with these masses (kg).
    pub(crate) fn of(scene: &Scene, masses: Option<(f64, f64)>, end: f64) -> Self {
        let volume_change = masses.map(|(first, last)| (last - first) / WATER_DENSITY);
        let volume_added = added(scene, end);
        let still = still_volume(scene).filter(|&volume| volume > 0.0);
        Self {
            volume_change,
            volume_added,
            volume_drift: volume_change
                .zip(still)
                .map(|(change, still)| (change - volume_added) / still),
        }
    }

    /// For people.
    pub(crate) fn text(&self) -> String {
        let Some(change) = self.volume_change else {
            return "not told by the solver".to_owned();
        };
        let change = format!("{} m³ of change", format::three_digits(change));
        let added = format!("{} m³ added by events", format::three_digits(self.volume_added));
        match self.volume_drift {
            Some(drift) => format!("drift {drift:.1e} of the water at rest ({change}, {added})"),
            None => format!("{change}, {added}"),
        }
    }
}

/// Volume of the drops that a scene's events let fall before `end`, m³.
fn added(scene: &Scene, end: f64) -> f64 {
    let description = &scene.description;
    let mut actions = Vec::new();
    Schedule::new(&description.events, description.seed, scene.grid).take_until(end, &mut actions);
    let drops = actions.iter().filter_map(|(_, action)| match action {
        Action::Drop { volume, .. } => Some(f64::from(*volume)),
        _ => None,
    });
    drops.sum()
}

/// Volume of the water at rest, m³; absent where there is no ground.
fn still_volume(scene: &Scene) -> Option<f64> {
    let ground = scene.ground_on_grid()?;
    let level = scene.description.water.level;
    let depth = |k: usize| f64::from((level - ground.as_slice()[k]).max(0.0));
    Some(reduce::sum(ground.as_slice().len(), depth) * scene.grid.cell_area())
}
