//! What keys a scene file may have, table by table: type, unit and range of each. [`super::check`] holds a file
//! against it, a test holds `docs/scene-file.md` against it, and another holds it against [`super::description`].

use super::units::Quantity;
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

use Kind::{
    Boolean, Channels, Choice, Counts, File, Number, Rotation, Seed, Table, Tables, Tagged, TaggedTables,
    Text, Vector, Wide, WideVector,
};
use Quantity::{
    Angle, Density, Exposure, Flow, Length, Number as Bare, PerLength, Rate, Roughness, Speed, Time, Volume,
};

/// Bound of every length. Its square is far from the limits of single precision.
const FAR: f64 = 1e9;
pub(crate) const ANYWHERE: Range = Range::new(-FAR, FAR);
pub(crate) const POSITIVE: Range = Range::new(1e-6, FAR);
pub(crate) const NOT_NEGATIVE: Range = Range::new(0.0, FAR);
const SHARE: Range = Range::new(0.0, 1.0);
const TURN: Range = Range::new(-360.0, 360.0);

const fn required(name: &'static str, kind: Kind) -> Key {
    Key {
        name,
        kind,
        required: true,
    }
}

const fn optional(name: &'static str, kind: Kind) -> Key {
    Key {
        name,
        kind,
        required: false,
    }
}

const fn variant(name: &'static str, keys: &'static [Key]) -> Variant {
    Variant { name, keys }
}

const TIME: Kind = Wide(Time, NOT_NEGATIVE);
const POINT: Kind = Vector(2, Length, ANYWHERE);
const POINT_3D: Kind = Vector(3, Length, ANYWHERE);
const POSITIVE_LENGTH: Kind = Number(Length, POSITIVE);
const HEIGHT: Kind = Number(Length, ANYWHERE);
const COLOR: Kind = Vector(3, Bare, SHARE);
const RADIANCE: Kind = Vector(3, Bare, NOT_NEGATIVE);
const FACTOR: Kind = Number(Bare, NOT_NEGATIVE);
const HEIGHT_SCALE: Kind = Wide(Bare, ANYWHERE);
const HEIGHT_OFFSET: Kind = Wide(Length, ANYWHERE);

/// The whole scene file.
pub(crate) const SCENE: &[Key] = &[
    required("name", Text),
    optional("seed", Seed),
    optional("duration", Wide(Time, Range::new(1e-6, FAR))),
    optional("domain", Table(DOMAIN)),
    optional("water", Table(WATER)),
    optional("terrain", Tagged(TERRAIN)),
    optional("ground", Table(GROUND)),
    required("solver", Tagged(SOLVER)),
    optional("layer", Tables(LAYER)),
    optional("detail", Tagged(DETAIL)),
    optional("bed", TaggedTables(BED)),
    optional("boundary", Table(BOUNDARY)),
    optional("object", Tables(OBJECT)),
    optional("light", Table(LIGHT)),
    optional("horizon", Table(HORIZON)),
    optional("camera", Tables(CAMERA)),
    optional("event", TaggedTables(EVENT)),
    optional("recording", Table(RECORDING)),
];

const DOMAIN: &[Key] = &[
    optional("origin", POINT),
    optional("size", Vector(2, Length, POSITIVE)),
];

const WATER: &[Key] = &[
    optional("level", HEIGHT),
    optional("initial", Tagged(INITIAL)),
    optional("index", Number(Bare, Range::new(1.0, 4.0))),
    optional("absorption", Vector(3, PerLength, NOT_NEGATIVE)),
    optional("scattering", Vector(3, PerLength, NOT_NEGATIVE)),
];

const INITIAL: &[Variant] = &[
    variant("still", &[]),
    variant(
        "dam",
        &[
            required("min", POINT),
            required("max", POINT),
            required("level", HEIGHT),
        ],
    ),
    variant(
        "disturbance",
        &[
            required("position", POINT),
            required("radius", POSITIVE_LENGTH),
            required("height", HEIGHT),
        ],
    ),
    variant("array", &[required("file", File)]),
];

const TERRAIN: &[Variant] = &[
    variant("flat", &[required("height", HEIGHT)]),
    variant(
        "image",
        &[
            required("file", File),
            required("pixel_size", Vector(2, Length, POSITIVE)),
            optional("scale", HEIGHT_SCALE),
            optional("offset", HEIGHT_OFFSET),
            optional("crop", Counts(4)),
            optional("origin", POINT),
        ],
    ),
    variant(
        "npy",
        &[
            required("file", File),
            required("pixel_size", Vector(2, Length, POSITIVE)),
            optional("scale", HEIGHT_SCALE),
            optional("offset", HEIGHT_OFFSET),
            optional("origin", POINT),
        ],
    ),
    variant(
        "ascii-grid",
        &[
            required("file", File),
            optional("scale", HEIGHT_SCALE),
            optional("offset", HEIGHT_OFFSET),
            optional("nodata_height", HEIGHT_OFFSET),
            optional("map_origin", WideVector(2, Length, ANYWHERE)),
        ],
    ),
    variant(
        "soundings",
        &[
            required("file", File),
            optional("coordinates", Choice(&["metres", "longitude-latitude"])),
            required("spacing", POSITIVE_LENGTH),
            optional("scale", HEIGHT_SCALE),
            optional("offset", HEIGHT_OFFSET),
            optional("map_origin", WideVector(2, Bare, ANYWHERE)),
        ],
    ),
];

const GROUND: &[Key] = &[
    optional("albedo", COLOR),
    optional("steep_albedo", COLOR),
    optional("shore_albedo", COLOR),
    optional("checker", Number(Length, NOT_NEGATIVE)),
];

const LAYER: &[Key] = &[
    required("solver", Kind::Solver),
    optional("fade_depth", Number(Length, NOT_NEGATIVE)),
];

const LIFETIME: Key = optional("lifetime", Wide(Time, Range::new(0.01, 1e6)));

const DETAIL: &[Variant] = &[
    variant(
        "noise",
        &[
            required("period", Wide(Length, POSITIVE)),
            required("height", Wide(Length, NOT_NEGATIVE)),
            optional("rate", Wide(Rate, Range::new(0.0, 1e3))),
            LIFETIME,
        ],
    ),
    variant(
        "waves",
        &[
            required("period", Wide(Length, POSITIVE)),
            WIND,
            optional("fetch", Wide(Length, NOT_NEGATIVE)),
            SEA_DIRECTION,
            LIFETIME,
        ],
    ),
];

pub(crate) const SOLVER: &[Variant] = &[
    variant(
        "wave-equation",
        &[
            required("spacing", POSITIVE_LENGTH),
            optional("scheme", Choice(&["explicit", "implicit", "implicit-damped"])),
            optional("speed", Number(Speed, Range::new(1e-6, 1e6))),
            optional("depth", POSITIVE_LENGTH),
            optional("damping", Number(Rate, NOT_NEGATIVE)),
            optional("step", Number(Time, POSITIVE)),
        ],
    ),
    variant(
        "procedural",
        &[
            required("spacing", POSITIVE_LENGTH),
            optional("depth", POSITIVE_LENGTH),
            optional("wave", Tables(WAVE)),
        ],
    ),
    variant(
        "shallow-water",
        &[
            required("spacing", POSITIVE_LENGTH),
            optional("scheme", Choice(&["auto", "finite-volume", "lattice", "bgk"])),
            optional("relaxation", Number(Bare, Range::new(0.5, 5.0))),
            optional("manning", Number(Roughness, Range::new(0.0, 10.0))),
            optional("smagorinsky", Number(Bare, Range::new(0.0, 0.2))),
            optional(
                "courant",
                Number(
                    Bare,
                    Range {
                        min: 0.0,
                        max: 1.0,
                        open: true,
                    },
                ),
            ),
            optional("film_depth", Number(Length, Range::new(1e-12, FAR))),
            optional("splash", Table(SPLASH)),
        ],
    ),
    variant(
        "ocean",
        &[
            required("spacing", POSITIVE_LENGTH),
            optional("depth", Wide(Length, POSITIVE)),
            optional("capillary", Boolean),
            optional("choppiness", Wide(Bare, Range::new(0.0, 10.0))),
            optional("loop_period", Wide(Time, Range::new(0.1, 1e6))),
            optional("sea", TaggedTables(SEA)),
            optional("cascade", Tables(CASCADE)),
            optional("foam", Table(OCEAN_FOAM)),
        ],
    ),
    variant(
        "wave-particles",
        &[
            required("spacing", POSITIVE_LENGTH),
            optional("speed", Number(Speed, Range::new(1e-6, 1e6))),
            optional("depth", POSITIVE_LENGTH),
            optional("law", Choice(&["volume", "energy"])),
            optional("train", Number(Bare, Range::new(1.0, 64.0))),
            optional("radius", POSITIVE_LENGTH),
            optional("split", Number(Bare, Range::new(0.02, 2.0))),
            optional("smallest", Number(Length, Range::new(1e-12, FAR))),
            optional("limit", Number(Bare, Range::new(1.0, 1e8))),
            optional("horizontal", Number(Bare, SHARE)),
            optional("front", Tables(FRONT)),
        ],
    ),
    variant(
        "sph",
        &[
            required("spacing", POSITIVE_LENGTH),
            optional("particle", POSITIVE_LENGTH),
            optional("model", Choice(&["dfsph", "mcg03"])),
            optional("vessel", Choice(&["box", "round"])),
            optional("viscosity", Number(Bare, Range::new(0.0, 1e6))),
            optional("walls", Choice(&["slip", "stick"])),
            optional("surface_tension", Number(Bare, Range::new(0.0, 1e3))),
            optional("stiffness", Number(Bare, Range::new(1e-6, FAR))),
            optional("gravity", ACCELERATION),
            optional("tilt", Tables(TILT)),
            optional("courant", Number(Bare, Range::new(0.01, 1.0))),
            optional("step", Number(Time, POSITIVE)),
            optional("most_steps", Number(Bare, Range::new(1.0, 1e9))),
            optional("surface", Choice(&["fast", "exact"])),
            optional("droplets", Choice(&["clear", "all"])),
            optional("emitter", Tables(EMITTER)),
            optional("drain", Tables(DRAIN)),
        ],
    ),
];

const WIND: Key = required("wind", Wide(Speed, Range::new(0.0, 100.0)));
const FETCH: Key = required("fetch", Wide(Length, NOT_NEGATIVE));
const GAMMA: Key = optional("gamma", Wide(Bare, Range::new(1.0, 20.0)));
const WAVE_HEIGHT: Key = required("height", Wide(Length, Range::new(0.0, 100.0)));
const SEA_DIRECTION: Key = optional("direction", Wide(Angle, TURN));
const SEA_SPREADING: Key = optional("spreading", Tagged(SPREADING));

const SEA: &[Variant] = &[
    variant("phillips", &[WIND, WAVE_HEIGHT, SEA_DIRECTION, SEA_SPREADING]),
    variant("pierson-moskowitz", &[WIND, SEA_DIRECTION, SEA_SPREADING]),
    variant("jonswap", &[WIND, FETCH, GAMMA, SEA_DIRECTION, SEA_SPREADING]),
    variant("tma", &[WIND, FETCH, GAMMA, SEA_DIRECTION, SEA_SPREADING]),
    variant(
        "swell",
        &[
            WAVE_HEIGHT,
            required("period", Wide(Time, Range::new(0.01, 1e3))),
            GAMMA,
            SEA_DIRECTION,
            SEA_SPREADING,
        ],
    ),
];

const SPREADING: &[Variant] = &[
    variant("hasselmann", &[]),
    variant("mitsuyasu", &[]),
    variant("donelan-banner", &[]),
    variant(
        "cosine-power",
        &[required("exponent", Wide(Bare, Range::new(0.0, 1e4)))],
    ),
    variant(
        "swell",
        &[required("elongation", Wide(Bare, Range::new(0.0, 10.0)))],
    ),
];

const CASCADE: &[Key] = &[required("period", Wide(Length, POSITIVE))];

const OCEAN_FOAM: &[Key] = &[
    optional("threshold", Wide(Bare, Range::new(-10.0, 1.0))),
    optional("growth", Wide(Rate, Range::new(0.0, 1e3))),
    optional("fade", Wide(Rate, Range::new(1e-3, 1e3))),
];

const SPLASH: &[Key] = &[
    optional("droplets", Boolean),
    optional("foam", Boolean),
    optional("slope", Number(Bare, Range::new(1e-3, 100.0))),
    optional("amount", Number(Bare, SHARE)),
    optional("droplet_radius", Number(Length, Range::new(1e-6, 1e4))),
    optional("foam_life", Number(Time, POSITIVE)),
];

const FRONT: &[Key] = &[
    optional("time", TIME),
    required("position", POINT),
    required("direction", Number(Angle, TURN)),
    required("width", POSITIVE_LENGTH),
    optional("spread", Number(Angle, TURN)),
    required("height", HEIGHT),
    required("radius", POSITIVE_LENGTH),
];

const ACCELERATION: Kind = Vector(3, Bare, Range::new(-1e4, 1e4));

const TILT: &[Key] = &[required("time", TIME), required("gravity", ACCELERATION)];

const EMITTER: &[Key] = &[
    required("position", POINT_3D),
    required("velocity", Vector(3, Speed, Range::new(-1e3, 1e3))),
    required("radius", POSITIVE_LENGTH),
    optional("start", TIME),
    optional("end", TIME),
];

const DRAIN: &[Key] = &[required("min", POINT_3D), required("max", POINT_3D)];

const WAVE: &[Key] = &[
    required("amplitude", Number(Length, NOT_NEGATIVE)),
    required("wavelength", POSITIVE_LENGTH),
    optional("direction", Number(Angle, TURN)),
    optional("phase", Number(Angle, TURN)),
    optional("steepness", Number(Bare, SHARE)),
];

const EDGE: Kind = Choice(&["wall", "open", "periodic"]);

const BOUNDARY: &[Key] = &[
    optional("x_min", EDGE),
    optional("x_max", EDGE),
    optional("z_min", EDGE),
    optional("z_max", EDGE),
    optional("drive", TaggedTables(DRIVE)),
];

const EDGE_NAME: Kind = Choice(&["x_min", "x_max", "z_min", "z_max"]);

const DRIVE: &[Variant] = &[
    variant(
        "series",
        &[
            required("edge", EDGE_NAME),
            required("quantity", Choice(&["elevation", "discharge"])),
            optional("file", File),
            optional("points", Tables(POINT_IN_TIME)),
        ],
    ),
    variant(
        "sine",
        &[
            required("edge", EDGE_NAME),
            required("height", NOT_NEGATIVE_LENGTH),
            required("period", Number(Time, POSITIVE)),
        ],
    ),
    variant(
        "solitary",
        &[
            required("edge", EDGE_NAME),
            required("height", NOT_NEGATIVE_LENGTH),
            required("depth", POSITIVE_LENGTH),
            required("time", TIME),
        ],
    ),
];

const BED: &[Variant] = &[
    variant(
        "patch",
        &[
            required("min", POINT),
            required("max", POINT),
            required("height", HEIGHT),
            optional("start", TIME),
            optional("rise", TIME),
            optional("series", File),
            optional("points", Tables(POINT_IN_TIME)),
        ],
    ),
    variant(
        "array",
        &[
            required("file", File),
            optional("scale", Number(Bare, ANYWHERE)),
            optional("start", TIME),
            optional("rise", TIME),
            optional("series", File),
            optional("points", Tables(POINT_IN_TIME)),
        ],
    ),
    variant(
        "slide",
        &[
            required("height", HEIGHT),
            required("radius", POSITIVE_LENGTH),
            required("path", Tables(PLAN_POINT)),
        ],
    ),
];

const PLAN_POINT: &[Key] = &[required("time", TIME), required("position", POINT)];

const NOT_NEGATIVE_LENGTH: Kind = Number(Length, NOT_NEGATIVE);

const POINT_IN_TIME: &[Key] = &[
    required("time", Wide(Time, ANYWHERE)),
    required("value", Wide(Bare, ANYWHERE)),
];

const OBJECT: &[Key] = &[
    required("name", Text),
    required("shape", Tagged(SHAPE)),
    optional("position", POINT_3D),
    optional("rotation", Rotation),
    optional("velocity", Vector(3, Speed, Range::new(-1e3, 1e3))),
    optional("spin", Vector(3, Rate, Range::new(-1e3, 1e3))),
    optional("density", Number(Density, Range::new(1e-3, 1e6))),
    optional("motion", Tagged(MOTION)),
    optional("color", COLOR),
];

const SHAPE: &[Variant] = &[
    variant("sphere", &[required("radius", POSITIVE_LENGTH)]),
    variant("box", &[required("size", Vector(3, Length, POSITIVE))]),
    variant(
        "cylinder",
        &[
            required("radius", POSITIVE_LENGTH),
            required("height", POSITIVE_LENGTH),
        ],
    ),
    variant(
        "model",
        &[required("file", File), optional("scale", Number(Bare, POSITIVE))],
    ),
];

const MOTION: &[Variant] = &[
    variant("fixed", &[]),
    variant("path", &[required("points", Tables(WAY_POINT))]),
    variant("free", &[]),
];

const WAY_POINT: &[Key] = &[
    required("time", Wide(Time, ANYWHERE)),
    required("position", POINT_3D),
    optional("rotation", Rotation),
];

const LIGHT: &[Key] = &[optional("sun", Table(SUN)), optional("sky", Tagged(SKY))];

const SUN: &[Key] = &[
    required("elevation", Number(Angle, Range::new(-90.0, 90.0))),
    required("azimuth", Number(Angle, TURN)),
    optional("irradiance", RADIANCE),
    optional("radius", Number(Angle, Range::new(1e-3, 45.0))),
];

const SKY: &[Variant] = &[
    variant("uniform", &[required("radiance", RADIANCE)]),
    variant(
        "picture",
        &[
            required("file", File),
            optional("layout", Choice(&["panorama", "cube", "horizon"])),
            optional("rotation", Number(Angle, TURN)),
            optional("scale", FACTOR),
        ],
    ),
    variant(
        "daylight",
        &[
            optional("turbidity", Number(Bare, Range::new(1.0, 10.0))),
            optional("scale", FACTOR),
        ],
    ),
];

const HORIZON: &[Key] = &[
    optional("distance", POSITIVE_LENGTH),
    optional("depth", POSITIVE_LENGTH),
    optional("mix", Number(Bare, SHARE)),
    optional("floor", FACTOR),
    optional("normals", Choice(&["face", "distance", "area"])),
];

const CAMERA: &[Key] = &[
    required("name", Text),
    required("position", POINT_3D),
    required("target", POINT_3D),
    optional("fov", Number(Angle, Range::new(0.1, 179.0))),
    optional("exposure", Number(Exposure, Range::new(-30.0, 30.0))),
];

const EVENT: &[Variant] = &[
    variant(
        "drop",
        &[
            required("time", TIME),
            required("position", POINT),
            required("radius", POSITIVE_LENGTH),
            required("volume", Number(Volume, ANYWHERE)),
        ],
    ),
    variant(
        "press",
        &[
            required("time", TIME),
            required("position", POINT),
            required("radius", POSITIVE_LENGTH),
            required("depth", HEIGHT),
        ],
    ),
    variant(
        "push",
        &[
            required("time", TIME),
            required("position", POINT),
            required("radius", POSITIVE_LENGTH),
            required("velocity", Vector(2, Speed, Range::new(-1e6, 1e6))),
        ],
    ),
    variant(
        "drag",
        &[
            required("start", TIME),
            required("end", TIME),
            required("body", Text),
            optional("grip", POINT_3D),
            required("from", POINT_3D),
            required("to", POINT_3D),
        ],
    ),
    variant(
        "shove",
        &[
            required("time", TIME),
            required("body", Text),
            required("velocity", Vector(3, Speed, Range::new(-1e3, 1e3))),
            optional("spin", Vector(3, Rate, Range::new(-1e3, 1e3))),
        ],
    ),
    variant(
        "sweep",
        &[
            required("start", TIME),
            required("end", TIME),
            required("from", POINT),
            required("to", POINT),
            required("radius", POSITIVE_LENGTH),
            required("rate", Number(Speed, Range::new(-1e6, 1e6))),
        ],
    ),
    variant(
        "inflow",
        &[
            optional("start", TIME),
            optional("end", TIME),
            required("position", POINT),
            required("radius", POSITIVE_LENGTH),
            optional("flow", Number(Flow, ANYWHERE)),
            optional("series", File),
            optional("points", Tables(POINT_IN_TIME)),
        ],
    ),
    variant(
        "rain",
        &[
            optional("start", TIME),
            optional("end", TIME),
            required("rate", Number(Rate, POSITIVE)),
            required("radius", POSITIVE_LENGTH),
            required("volume", Number(Volume, Range::new(1e-15, FAR))),
            optional("adds_water", Boolean),
        ],
    ),
];

const RECORDING: &[Key] = &[
    optional("rate", Wide(Rate, Range::new(1e-6, 1e6))),
    optional("channels", Channels),
    optional("tolerance", Number(Bare, Range::new(0.0, 1e6))),
];
