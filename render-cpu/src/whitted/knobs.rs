//! What of the `whitted` renderer can be changed while it is looked at.

use super::Settings;
use meniscus_sim::knobs::{
    ABOUT_VISUAL_RANGE, Row, VISUAL_RANGE, Value, read_visual_range, write_visual_range,
};
use meniscus_sim::switch_knob;

pub(super) const ROWS: &[Row<Settings>] = &[
    Row {
        name: "interfaces",
        about: "Surfaces at which a ray is split into a mirrored and a refracted one",
        remakes: false,
        applies: |_| true,
        read: |s| Value::Whole {
            now: s.interface_depth,
            range: (1, 8),
        },
        write: |s, v| {
            if let Value::Whole { now, .. } = v {
                s.interface_depth = now.clamp(1, 8);
            }
        },
    },
    Row {
        name: "least share",
        about: "Share of a pixel below which a ray is left out",
        remakes: false,
        applies: |_| true,
        read: |s| Value::Number {
            now: 100.0 * s.cutoff,
            range: (0.001, 10.0),
            unit: "%",
        },
        write: |s, v| {
            if let Value::Number { now, .. } = v {
                s.cutoff = 0.01 * now.clamp(0.001, 10.0);
            }
        },
    },
    switch_knob!(
        "sunlight through waves",
        "Waves focus sunlight on the ground",
        |_| true,
        false,
        caustics
    ),
    Row {
        name: VISUAL_RANGE,
        about: ABOUT_VISUAL_RANGE,
        remakes: false,
        applies: |_| true,
        read: |s| read_visual_range(s.visual_range),
        write: |s, v| write_visual_range(&mut s.visual_range, v),
    },
];
