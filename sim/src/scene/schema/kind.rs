//! What the value of a key may be: its type, unit and range.

use crate::scene::units::Quantity;
use std::fmt;

/// One key of a table.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Key {
    pub(crate) name: &'static str,
    pub(crate) kind: Kind,
    pub(crate) required: bool,
}

/// One form of a table that is told apart by its key `kind`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Variant {
    pub(crate) name: &'static str,
    pub(crate) keys: &'static [Key],
}

/// What the value of a key may be.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Kind {
    /// A text that is not empty.
    Text,
    /// A file, relative to the scene file.
    File,
    Boolean,
    /// A whole number from 0 to 2⁶⁴ − 1.
    Seed,
    /// This many whole numbers from 0 to 2³² − 1.
    Counts(usize),
    /// A single-precision number.
    Number(Quantity, Range),
    /// A double-precision number.
    Wide(Quantity, Range),
    /// This many single-precision numbers.
    Vector(usize, Quantity, Range),
    /// This many double-precision numbers.
    WideVector(usize, Quantity, Range),
    /// A unit quaternion `[x, y, z, w]`, or a table of `axis` and `angle`.
    Rotation,
    /// One of these texts.
    Choice(&'static [&'static str]),
    /// Names of optional frame channels, each once.
    Channels,
    Table(&'static [Key]),
    /// `[[name]]`, any number of them.
    Tables(&'static [Key]),
    /// A table whose form is told by its key `kind`.
    Tagged(&'static [Variant]),
    /// `[[name]]`, each with a `kind`.
    TaggedTables(&'static [Variant]),
    /// A table as `[solver]`.
    Solver,
}

/// The values that a number may have.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Range {
    pub(crate) min: f64,
    pub(crate) max: f64,
    /// Whether the bounds themselves are excluded.
    pub(crate) open: bool,
}

impl Range {
    pub(crate) const fn new(min: f64, max: f64) -> Self {
        Self {
            min,
            max,
            open: false,
        }
    }

    /// Whether `value` is a number in the range, whose bounds are rounded as `value` was (to double precision if
    /// `wide`, else to single).
    pub(crate) fn contains(&self, value: f64, wide: bool) -> bool {
        let round = |bound: f64| if wide { bound } else { f64::from(bound as f32) };
        let (min, max) = (round(self.min), round(self.max));
        if self.open {
            value > min && value < max
        } else {
            value >= min && value <= max
        }
    }

    /// A value in the range, to go on with where a scene has a wrong one.
    pub(crate) fn inside(&self) -> f64 {
        if self.contains(1.0, true) {
            1.0
        } else {
            0.5 * (self.min + self.max)
        }
    }
}

impl fmt::Display for Range {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (min, max) = (Plain(self.min), Plain(self.max));
        if self.open {
            write!(f, "between {min} and {max}")
        } else {
            write!(f, "{min} to {max}")
        }
    }
}

/// A number for people: powers of ten beyond 10⁵ and below 10⁻³.
pub(crate) struct Plain(pub(crate) f64);

impl fmt::Display for Plain {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let v = self.0;
        if v == 0.0 || (1e-3..1e5).contains(&v.abs()) || !v.is_finite() {
            write!(f, "{v}")
        } else {
            write!(f, "{v:e}")
        }
    }
}

pub(super) use Kind::{
    Boolean, Channels, Choice, Counts, File, Number, Rotation, Seed, Table, Tables, Tagged, TaggedTables,
    Text, Vector, Wide, WideVector,
};
pub(super) use Quantity::{
    Angle, Density, Exposure, Flow, Length, Number as Bare, PerLength, Rate, Roughness, Speed, Time, Volume,
};

/// Bound of every length. Its square is far from the limits of single precision.
pub(super) const FAR: f64 = 1e9;
pub(crate) const ANYWHERE: Range = Range::new(-FAR, FAR);
pub(crate) const POSITIVE: Range = Range::new(1e-6, FAR);
pub(crate) const NOT_NEGATIVE: Range = Range::new(0.0, FAR);
pub(super) const SHARE: Range = Range::new(0.0, 1.0);
pub(super) const TURN: Range = Range::new(-360.0, 360.0);

pub(super) const fn required(name: &'static str, kind: Kind) -> Key {
    Key {
        name,
        kind,
        required: true,
    }
}

pub(super) const fn optional(name: &'static str, kind: Kind) -> Key {
    Key {
        name,
        kind,
        required: false,
    }
}

pub(super) const fn variant(name: &'static str, keys: &'static [Key]) -> Variant {
    Variant { name, keys }
}

pub(super) const TIME: Kind = Wide(Time, NOT_NEGATIVE);
pub(super) const POINT: Kind = Vector(2, Length, ANYWHERE);
pub(super) const POINT_3D: Kind = Vector(3, Length, ANYWHERE);
pub(super) const POSITIVE_LENGTH: Kind = Number(Length, POSITIVE);
pub(super) const HEIGHT: Kind = Number(Length, ANYWHERE);
pub(super) const COLOR: Kind = Vector(3, Bare, SHARE);
pub(super) const RADIANCE: Kind = Vector(3, Bare, NOT_NEGATIVE);
pub(super) const FACTOR: Kind = Number(Bare, NOT_NEGATIVE);
pub(super) const HEIGHT_SCALE: Kind = Wide(Bare, ANYWHERE);
pub(super) const HEIGHT_OFFSET: Kind = Wide(Length, ANYWHERE);
