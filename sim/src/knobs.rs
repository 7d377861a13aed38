//! What of a renderer can be changed while it is looked at, as the renderer itself lists it: a window that shows knobs
//! knows no renderer by name.

use std::collections::BTreeMap;

/// What a knob can be turned to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Value {
    /// On or off.
    Switch(bool),
    /// A whole number.
    Whole {
        /// What it is.
        now: u32,
        /// The least and the most it can be.
        range: (u32, u32),
    },
    /// A number.
    Number {
        /// What it is.
        now: f32,
        /// The least and the most it can be, both positive: it is turned by factors.
        range: (f32, f32),
        /// Its unit.
        unit: &'static str,
    },
    /// One of several.
    Choice {
        /// Which.
        now: usize,
        /// Their names.
        names: &'static [&'static str],
    },
}

/// Something that can be changed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Knob {
    /// Its name, unique among those of a renderer.
    pub name: &'static str,
    /// What it does.
    pub about: &'static str,
    /// What it is.
    pub value: Value,
    /// Whether shaders are made again for a value that was not seen before: the next picture then takes longer.
    pub remakes: bool,
}

/// Knobs that were turned from what they are by default, by name.
pub type Turned = BTreeMap<&'static str, Value>;

/// A knob of settings `S`: how it is read and turned.
#[derive(Debug)]
pub struct Row<S> {
    /// See [`Knob::name`].
    pub name: &'static str,
    /// See [`Knob::about`].
    pub about: &'static str,
    /// See [`Knob::remakes`].
    pub remakes: bool,
    /// Whether settings have that knob.
    pub applies: fn(&S) -> bool,
    /// Reads it.
    pub read: fn(&S) -> Value,
    /// Turns it, within its range; a value of another kind changes nothing.
    pub write: fn(&mut S, Value),
}

/// What of these settings can be changed, as it is now.
pub fn list<S>(rows: &[Row<S>], settings: &S) -> Vec<Knob> {
    let rows = rows.iter().filter(|row| (row.applies)(settings));
    rows.map(|row| Knob {
        name: row.name,
        about: row.about,
        value: (row.read)(settings),
        remakes: row.remakes,
    })
    .collect()
}

/// Turns the knob of that name; nothing if there is none.
pub fn turn<S>(rows: &[Row<S>], settings: &mut S, name: &str, value: Value) {
    if let Some(row) = rows.iter().find(|row| row.name == name) {
        (row.write)(settings, value);
    }
}

/// Turns every knob to what it is in `default`, and then those of `turned` to their values.
pub fn restore<S>(rows: &[Row<S>], settings: &mut S, default: &S, turned: &Turned) {
    for row in rows {
        (row.write)(settings, (row.read)(default));
    }
    for (name, value) in turned {
        turn(rows, settings, name, *value);
    }
}

/// A [`Row`] of a switch: name, what it does, which settings have it, whether it remakes shaders, and the field.
#[macro_export]
macro_rules! switch_knob {
    ($name:literal, $about:literal, $applies:expr, $remakes:literal, $($field:tt)+) => {
        $crate::knobs::Row {
            name: $name,
            about: $about,
            remakes: $remakes,
            applies: $applies,
            read: |s| $crate::knobs::Value::Switch(s.$($field)+),
            write: |s, v| {
                if let $crate::knobs::Value::Switch(on) = v {
                    s.$($field)+ = on;
                }
            },
        }
    };
}

/// A [`Row`] of a whole number of which settings have one: name, what it does, which settings have it, whether it remakes shaders, its range, and the field.
#[macro_export]
macro_rules! whole_knob {
    ($name:literal, $about:literal, $applies:expr, $remakes:literal, ($least:literal, $most:literal), $($field:tt)+) => {
        $crate::knobs::Row {
            name: $name,
            about: $about,
            remakes: $remakes,
            applies: $applies,
            read: |s| $crate::knobs::Value::Whole {
                now: s.$($field)+,
                range: ($least, $most),
            },
            write: |s, v| {
                if let $crate::knobs::Value::Whole { now, .. } = v {
                    s.$($field)+ = now.clamp($least, $most);
                }
            },
        }
    };
}

/// The [`Row`] of a field `visual_range` in metres, `None` being perfectly clear air.
#[macro_export]
macro_rules! visual_range_knob {
    () => {
        $crate::knobs::Row {
            name: "visual range",
            about: "Distance at which haze leaves 2 % of contrast; the most is perfectly clear air",
            remakes: false,
            applies: |_| true,
            read: |s| $crate::knobs::read_visual_range(s.visual_range),
            write: |s, v| $crate::knobs::write_visual_range(&mut s.visual_range, v),
        }
    };
}

/// Visual range that counts as perfectly clear air, kilometres.
const CLEAR: f32 = 1000.0;

/// The knob of a visual range in metres, `None` being perfectly clear air.
pub fn read_visual_range(metres: Option<f32>) -> Value {
    Value::Number {
        now: metres.map_or(CLEAR, |metres| metres / 1e3).min(CLEAR),
        range: (0.1, CLEAR),
        unit: "km",
    }
}

/// Turns a visual range by its knob.
pub fn write_visual_range(metres: &mut Option<f32>, value: Value) {
    if let Value::Number { now, .. } = value {
        *metres = (now < CLEAR).then_some(1e3 * now.max(0.1));
    }
}

impl Value {
    /// Another value of the same kind and range: for tests that turn every knob there is.
    #[must_use]
    pub fn other(self) -> Self {
        match self {
            Self::Switch(on) => Self::Switch(!on),
            Self::Whole { now, range } => Self::Whole {
                now: if now == range.0 { range.1 } else { range.0 },
                range,
            },
            Self::Number { now, range, unit } => Self::Number {
                now: if now == range.0 { range.1 } else { range.0 },
                range,
                unit,
            },
            Self::Choice { now, names } => Self::Choice {
                now: (now + 1) % names.len().max(1),
                names,
            },
        }
    }
}
