//! What of the `whitted` renderer can be changed while it is looked at.

use super::Settings;
use meniscus_sim::knobs::{Row, Value};
use meniscus_sim::{switch_knob, visual_range_knob, whole_knob};

pub(super) const ROWS: &[Row<Settings>] = &[
    whole_knob!(
        "interfaces",
        "Surfaces at which a ray is split into a mirrored and a refracted one",
        |_| true,
        false,
        (1, 8),
        interface_depth
    ),
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
    visual_range_knob!(),
];
