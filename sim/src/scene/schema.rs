//! What keys a scene file may have, table by table: type, unit and range of each. [`super::check`] holds a file
//! against it, a test holds `docs/scene-file.md` against it, and another holds it against [`super::description`].

mod kind;
mod solver;

use kind::*;
pub(crate) use kind::{ANYWHERE, Key, Kind, NOT_NEGATIVE, POSITIVE, Plain, Range, Variant};
pub(crate) use solver::SOLVER;
use solver::{SEA_DIRECTION, WIND};

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
        "tilt",
        &[required("time", TIME), required("gravity", solver::ACCELERATION)],
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
