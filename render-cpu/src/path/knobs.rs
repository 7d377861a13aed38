//! What of the path tracer can be changed while it is looked at.

use super::{Settings, SunThroughWaves};
use meniscus_sim::knobs::{Row, Value};
use meniscus_sim::{switch_knob, visual_range_knob, whole_knob};

const SUNS: &[&str] = &["solved for", "left to chance"];

pub(super) const ROWS: &[Row<Settings>] = &[
    Row {
        name: "sun through waves",
        about: "How sunlight that waves refract is found: solved for, or by rays that happen to meet the sun",
        remakes: false,
        applies: |_| true,
        read: |s| Value::Choice {
            now: usize::from(s.sun_through_waves == SunThroughWaves::Chance),
            names: SUNS,
        },
        write: |s, v| {
            if let Value::Choice { now, .. } = v {
                s.sun_through_waves = if now == 0 {
                    SunThroughWaves::Solved
                } else {
                    SunThroughWaves::Chance
                };
            }
        },
    },
    switch_knob!(
        "aim at the sky",
        "Directions are also chosen by the sky's light: less noise, the same mean",
        |_| true,
        false,
        aim_at_sky
    ),
    whole_knob!(
        "bounces",
        "Bounces after which a path is given up: few leave light out",
        |_| true,
        false,
        (1, 256),
        most_bounces
    ),
    visual_range_knob!(),
];
