//! The keys of the solvers and of what they carry.

use super::kind::*;

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

pub(super) const WIND: Key = required("wind", Wide(Speed, Range::new(0.0, 100.0)));
const FETCH: Key = required("fetch", Wide(Length, NOT_NEGATIVE));
const GAMMA: Key = optional("gamma", Wide(Bare, Range::new(1.0, 20.0)));
const WAVE_HEIGHT: Key = required("height", Wide(Length, Range::new(0.0, 100.0)));
pub(super) const SEA_DIRECTION: Key = optional("direction", Wide(Angle, TURN));
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

pub(super) const ACCELERATION: Kind = Vector(3, Bare, Range::new(-1e4, 1e4));

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
