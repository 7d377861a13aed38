//! What of the photon mapper can be changed while it is looked at.

use super::Settings;
use meniscus_sim::knobs::{Row, Value};
use meniscus_sim::{switch_knob, visual_range_knob};

/// Bounces that stand for [`Settings::bounces`] being left to the scene.
const BY_SCENE: u32 = 17;

pub(super) const ROWS: &[Row<Settings>] = &[
    switch_knob!("sunlight", "Light of the sun is followed", |_| true, false, sun),
    switch_knob!("skylight", "Light of the sky is followed", |_| true, false, sky),
    Row {
        name: "bounces under water",
        about: "How often matt surfaces under water send light back; the most leaves it to the scene",
        remakes: false,
        applies: |_| true,
        read: |s| Value::Whole {
            now: s.bounces.unwrap_or(BY_SCENE).min(BY_SCENE),
            range: (0, BY_SCENE),
        },
        write: |s, v| {
            if let Value::Whole { now, .. } = v {
                s.bounces = (now < BY_SCENE).then_some(now);
            }
        },
    },
    visual_range_knob!(),
];
