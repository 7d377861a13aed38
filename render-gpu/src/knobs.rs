//! What of a technique can be changed while it is looked at, as the technique itself lists it.

use crate::settings::{Heights, PhotonMap, Settings, Technique, Walk};
use meniscus_sim::knobs::{self, Knob, Row, Turned, Value};
use meniscus_sim::{switch_knob, visual_range_knob, whole_knob};

fn traced(settings: &Settings) -> bool {
    settings.technique == Technique::Heightfield
}

const fn whole(now: u32, range: (u32, u32)) -> Value {
    Value::Whole { now, range }
}

const WALKS: &[&str] = &["pyramid, exact", "one radius a field", "a radius a texel"];
const HEIGHTS: &[&str] = &["single precision", "16 bits"];

const ROWS: &[Row<Settings>] = &[
    switch_knob!(
        "sunlight through waves",
        "Waves focus sunlight on the ground",
        |_| true,
        true,
        caustics
    ),
    Row {
        name: "smooth that light",
        about: "A bilateral filter over the photon map: less noise, softer lines",
        remakes: true,
        applies: |s| s.caustics,
        read: |s| {
            let (PhotonMap::Grid { filter } | PhotonMap::Square { filter, .. }) = s.photon_map;
            Value::Switch(filter)
        },
        write: |s, v| {
            let (PhotonMap::Grid { filter } | PhotonMap::Square { filter, .. }) = &mut s.photon_map;
            if let Value::Switch(on) = v {
                *filter = on;
            }
        },
    },
    switch_knob!(
        "shadows",
        "What stands in the way of the sun stops its light",
        |_| true,
        true,
        switches.shadows
    ),
    switch_knob!(
        "absorption",
        "Light is lost and scattered on its way through the water",
        |_| true,
        true,
        switches.absorption
    ),
    visual_range_knob!(),
    switch_knob!(
        "mirrored objects",
        "What stands above the water is seen in it, besides the sky",
        traced,
        true,
        switches.self_reflection
    ),
    whole_knob!(
        "interfaces",
        "Surfaces at which a ray is split into a mirrored and a refracted one",
        traced,
        true,
        (1, 3),
        switches.interface_depth
    ),
    Row {
        name: "walk",
        about: "How rays find the water and the ground",
        remakes: true,
        applies: traced,
        read: |s| Value::Choice {
            now: Walk::ALL.iter().position(|w| *w == s.walk).unwrap_or(0),
            names: WALKS,
        },
        write: |s, v| {
            if let Value::Choice { now, .. } = v {
                s.walk = Walk::ALL[now.min(Walk::ALL.len() - 1)];
            }
        },
    },
    Row {
        name: "radius",
        about: "Factor on the safety radii: larger is faster and misses more",
        remakes: false,
        applies: |s| traced(s) && s.walk != Walk::Pyramid,
        read: |s| Value::Number {
            now: s.safety_scale,
            range: (0.25, 4.0),
            unit: "×",
        },
        write: |s, v| {
            if let Value::Number { now, .. } = v {
                s.safety_scale = now.clamp(0.25, 4.0);
            }
        },
    },
    Row {
        name: "heights",
        about: "How heights are kept: 16 bits take half of the memory",
        remakes: true,
        applies: traced,
        read: |s| Value::Choice {
            now: Heights::ALL.iter().position(|h| *h == s.heights).unwrap_or(0),
            names: HEIGHTS,
        },
        write: |s, v| {
            if let Value::Choice { now, .. } = v {
                s.heights = Heights::ALL[now.min(Heights::ALL.len() - 1)];
            }
        },
    },
    switch_knob!(
        "traced mirror image",
        "Mirrored rays are traced; without, the water mirrors the sky alone",
        |s| !traced(s),
        true,
        switches.traced_reflection
    ),
    switch_knob!(
        "smooth edges",
        "Pixels that differ from a neighbour get four more rays",
        traced,
        true,
        switches.multisampled
    ),
    switch_knob!(
        "four samples a pixel",
        "Edges of triangles are smoothed (MSAA); radiance is then kept in half precision",
        |s| !traced(s),
        true,
        switches.multisampled
    ),
    Row {
        name: "rounds",
        about: "Rounds of the second phase; 0 leaves the first one alone",
        remakes: true,
        applies: |s| s.technique == Technique::TwoPhase,
        read: |s| whole(s.switches.narrow_steps, (0, 3)),
        write: |s, v| {
            if let Value::Whole { now, .. } = v {
                s.switches.narrow_steps = now.min(3);
            }
        },
    },
    Row {
        name: "error of edges",
        about: "Pixels by which straight edges of the first phase may be off: less cuts more triangles",
        remakes: false,
        applies: |s| s.technique == Technique::TwoPhase,
        read: |s| Value::Number {
            now: s.tessellation,
            range: (0.1, 8.0),
            unit: "px",
        },
        write: |s, v| {
            if let Value::Number { now, .. } = v {
                s.tessellation = now.clamp(0.1, 8.0);
            }
        },
    },
    Row {
        name: "voxels",
        about: "Voxels along a side of the field of distances",
        remakes: false,
        applies: |s| s.technique == Technique::DistanceField,
        read: |s| whole(s.voxels, (16, 128)),
        write: |s, v| {
            if let Value::Whole { now, .. } = v {
                s.voxels = now.clamp(16, 128);
            }
        },
    },
];

impl Settings {
    /// What can be changed, as it is now.
    pub fn knobs(&self) -> Vec<Knob> {
        knobs::list(ROWS, self)
    }

    /// Turns the knob of that name, within its range; nothing if there is none, or none of that kind.
    pub fn turn(&mut self, name: &str, value: Value) {
        knobs::turn(ROWS, self, name, value);
    }

    /// Turns every knob to what it is by default, and then these.
    pub fn restore(&mut self, turned: &Turned) {
        knobs::restore(ROWS, self, &Self::new(self.technique), turned);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_turned_reads_so_and_changes_nothing_else() {
        for technique in Technique::ALL {
            let start = Settings::new(technique);
            for knob in start.knobs() {
                let mut turned = start;
                turned.turn(knob.name, knob.value.other());
                assert_ne!(turned, start, "{technique:?} {}", knob.name);
                for after in turned.knobs() {
                    let expected = if after.name == knob.name {
                        knob.value.other()
                    } else {
                        match start.knobs().iter().find(|k| k.name == after.name) {
                            Some(before) => before.value,
                            // One that only these settings have.
                            None => continue,
                        }
                    };
                    assert_eq!(after.value, expected, "{technique:?} {}", after.name);
                }
                turned.turn(knob.name, knob.value);
                assert_eq!(turned, start, "{technique:?} {}", knob.name);
            }
            let mut same = start;
            same.turn("no such knob", Value::Switch(true));
            same.turn("walk", Value::Switch(true));
            assert_eq!(same, start);
        }
    }

    #[test]
    fn a_technique_lists_its_own() {
        let names = |t| -> Vec<_> { Settings::new(t).knobs().iter().map(|k| k.name).collect() };
        assert!(names(Technique::TwoPhase).contains(&"rounds"));
        assert!(!names(Technique::Offset).contains(&"rounds"));
        assert!(names(Technique::Heightfield).contains(&"walk"));
        assert!(!names(Technique::Heightfield).contains(&"radius"));
        for technique in Technique::ALL {
            let mut all = names(technique);
            all.sort_unstable();
            all.dedup();
            assert_eq!(all.len(), names(technique).len());
        }
    }
}
