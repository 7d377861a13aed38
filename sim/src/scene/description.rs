//! The contents of a scene file, one struct a table. Every key has a default or is required; both are documented in
//! `docs/scene-file.md`, which a test keeps complete.

use crate::optics;
use glam::{DVec2, Quat, Vec2, Vec3};
use serde::{Deserialize, Serialize, Serializer};
use std::path::{Path, PathBuf};

/// A whole scene file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Description {
    /// Name for titles and reports.
    pub name: String,
    /// Seed of everything random.
    #[serde(default, with = "seed_text")]
    pub seed: u64,
    /// Default length of a recording in seconds.
    #[serde(default = "default_duration")]
    pub duration: f64,
    /// The simulated rectangle.
    #[serde(default)]
    pub domain: Domain,
    /// The water and its optics.
    #[serde(default)]
    pub water: Water,
    /// The ground; absent for deep water.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub terrain: Option<Terrain>,
    /// How ground is drawn.
    #[serde(default)]
    pub ground: GroundLook,
    /// The method and its parameters.
    pub solver: Solver,
    /// What happens at the edges of the domain.
    #[serde(default)]
    pub boundary: Boundary,
    /// Solid objects.
    #[serde(default, rename = "object", skip_serializing_if = "Vec::is_empty")]
    pub objects: Vec<Object>,
    /// Sun and sky.
    #[serde(default)]
    pub light: Light,
    /// Named cameras; the first is the default. Without any, one is placed that sees the whole domain.
    #[serde(default, rename = "camera", skip_serializing_if = "Vec::is_empty")]
    pub cameras: Vec<Camera>,
    /// What acts on the water, by time.
    #[serde(default, rename = "event", skip_serializing_if = "Vec::is_empty")]
    pub events: Vec<Event>,
    /// What is recorded.
    #[serde(default)]
    pub recording: Recording,
}

fn default_duration() -> f64 {
    10.0
}

/// The simulated rectangle, from its first to its last sample.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Domain {
    /// Smallest X and Z in metres; default: the terrain's, else (0, 0).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub origin: Option<Vec2>,
    /// Length along X and Z in metres; default: the terrain's extent. Required without terrain.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub size: Option<Vec2>,
}

/// The water.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Water {
    /// Elevation of the surface at rest above datum, metres.
    pub level: f32,
    /// State at time 0.
    pub initial: Initial,
    /// Refractive index.
    pub index: f32,
    /// Absorption per metre for red, green, blue.
    pub absorption: Vec3,
    /// Scattering per metre for red, green, blue.
    pub scattering: Vec3,
}

impl Default for Water {
    fn default() -> Self {
        Self {
            level: 0.0,
            initial: Initial::Still,
            index: optics::WATER_INDEX,
            absorption: optics::WATER_ABSORPTION,
            scattering: optics::WATER_SCATTERING,
        }
    }
}

/// State of the water at time 0.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub enum Initial {
    /// At rest at `water.level`.
    #[default]
    Still,
    /// A dam: inside the rectangle (or beyond the line) the surface stands higher.
    Dam {
        /// Smallest X and Z of the reservoir, metres.
        min: Vec2,
        /// Largest X and Z of the reservoir, metres.
        max: Vec2,
        /// Elevation of the reservoir's surface above datum, metres.
        level: f32,
    },
    /// A smooth Gaussian hump: `height · exp(−|x − position|²/(2 radius²))`.
    Disturbance {
        /// Centre, metres.
        position: Vec2,
        /// Standard deviation, metres.
        radius: f32,
        /// Height at the centre above `water.level`, metres; negative for a trough.
        height: f32,
    },
    /// Elevation above datum from a `.npy` array of shape `(nz, nx)`, stretched over the domain.
    Array {
        /// The file, relative to the scene file.
        #[serde(serialize_with = "path_text")]
        file: PathBuf,
    },
}

/// The ground.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub enum Terrain {
    /// Level ground.
    Flat {
        /// Height above datum, metres.
        height: f32,
    },
    /// A 16-bit (or 8-bit) grey PNG; X runs right, Z runs down the image.
    Image {
        /// The file, relative to the scene file.
        #[serde(serialize_with = "path_text")]
        file: PathBuf,
        /// Distance between pixels along X and Z, metres; unequal distances are resampled to the smaller.
        pixel_size: Vec2,
        /// Metres a grey step.
        #[serde(default = "one_wide")]
        scale: f64,
        /// Height of grey 0 above datum, metres.
        #[serde(default)]
        offset: f64,
        /// First pixel and size in pixels of the part to use: `[x, y, width, height]`; default: all.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        crop: Option<[u32; 4]>,
        /// Where the first sample stands, metres (X, Z).
        #[serde(default)]
        origin: Vec2,
    },
    /// A NumPy array of shape `(nz, nx)`.
    Npy {
        /// The file, relative to the scene file.
        #[serde(serialize_with = "path_text")]
        file: PathBuf,
        /// Distance between samples along X and Z, metres.
        pixel_size: Vec2,
        /// Metres a unit.
        #[serde(default = "one_wide")]
        scale: f64,
        /// Height of value 0 above datum, metres.
        #[serde(default)]
        offset: f64,
        /// Where the first sample stands, metres (X, Z).
        #[serde(default)]
        origin: Vec2,
    },
    /// An ESRI ASCII grid; its first row is the northern one and becomes the smallest Z.
    AsciiGrid {
        /// The file, relative to the scene file.
        #[serde(serialize_with = "path_text")]
        file: PathBuf,
        /// Metres a unit of height.
        #[serde(default = "one_wide")]
        scale: f64,
        /// Height of value 0 above datum, metres.
        #[serde(default)]
        offset: f64,
        /// Height above datum that samples without data get, metres; absent: a grid with such samples is refused.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        nodata_height: Option<f64>,
        /// Easting and northing in the grid's own metres that become X = 0, Z = 0; default: those of the first (north
        /// western) sample.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        map_origin: Option<DVec2>,
    },
    /// Scattered `x y z` soundings, interpolated by natural neighbours.
    Soundings {
        /// The file, relative to the scene file.
        #[serde(serialize_with = "path_text")]
        file: PathBuf,
        /// What x and y are.
        #[serde(default)]
        coordinates: Coordinates,
        /// Spacing of the grid that they are interpolated to, metres.
        spacing: f32,
        /// Metres a unit of height.
        #[serde(default = "one_wide")]
        scale: f64,
        /// Height of value 0 above datum, metres.
        #[serde(default)]
        offset: f64,
        /// The first two numbers of a sounding that becomes X = 0, Z = 0, and about which longitude and latitude are
        /// projected; default: (0, 0) for metres, the centre of the soundings for longitude and latitude.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        map_origin: Option<DVec2>,
    },
}

fn one() -> f32 {
    1.0
}

fn one_wide() -> f64 {
    1.0
}

/// What the first two numbers of a sounding are.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Coordinates {
    /// X and Z in metres.
    #[default]
    Metres,
    /// Longitude and latitude in degrees; projected to metres about their centre, north towards −Z.
    LongitudeLatitude,
}

/// How the ground is drawn.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct GroundLook {
    /// Linear albedo of level ground, 0 to 1.
    pub albedo: Vec3,
    /// Linear albedo of steep ground, 0 to 1.
    pub steep_albedo: Vec3,
    /// Linear albedo of ground below and just above the water, 0 to 1.
    pub shore_albedo: Vec3,
    /// Size of a checkerboard on the ground in metres; 0 for none (for tests of refraction).
    pub checker: f32,
}

impl Default for GroundLook {
    fn default() -> Self {
        Self {
            albedo: Vec3::new(0.16, 0.19, 0.07),
            steep_albedo: Vec3::new(0.24, 0.21, 0.18),
            shore_albedo: Vec3::new(0.36, 0.31, 0.23),
            checker: 0.0,
        }
    }
}

/// The method that moves the water.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case")]
pub enum Solver {
    /// Linear wave equation on a grid.
    WaveEquation(WaveEquation),
    /// Sums of directional sines and Gerstner waves, in closed form.
    Procedural(Procedural),
    /// Shallow-water equations.
    ShallowWater(ShallowWater),
}

impl Solver {
    /// Distance between samples in metres.
    pub fn spacing(&self) -> f32 {
        match self {
            Self::WaveEquation(s) => s.spacing,
            Self::Procedural(s) => s.spacing,
            Self::ShallowWater(s) => s.spacing,
        }
    }
}

/// Parameters of the wave equation, ∂²η/∂t² = ∇·(c² ∇η) − damping ∂η/∂t.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WaveEquation {
    /// Distance between samples in metres.
    pub spacing: f32,
    /// How time is stepped.
    #[serde(default)]
    pub scheme: WaveScheme,
    /// Wave speed in m/s; default: √(g · depth), from the terrain where there is one, else from `depth`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub speed: Option<f32>,
    /// Depth in metres that sets the speed where there is no terrain.
    #[serde(default = "one")]
    pub depth: f32,
    /// Rate at which motion is damped, 1/s.
    #[serde(default)]
    pub damping: f32,
    /// Longest sub-step in seconds; default: as long as the scheme allows. The explicit scheme refuses a value above
    /// its Courant limit.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub step: Option<f32>,
}

/// How the wave equation is stepped.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum WaveScheme {
    /// Leap-frog, second order, with a Courant limit.
    #[default]
    Explicit,
    /// Alternating directions after Kass & Miller 1990, stable at any step; second order, conserves energy.
    Implicit,
    /// The same stepped backwards in time, as Kass & Miller did: first order, damps waves that the step is too long
    /// for.
    ImplicitDamped,
}

/// Parameters of procedural waves.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Procedural {
    /// Distance between samples in metres.
    pub spacing: f32,
    /// Water depth for the dispersion relation in metres; absent: deep water.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub depth: Option<f32>,
    /// The waves.
    #[serde(default, rename = "wave")]
    pub waves: Vec<Wave>,
}

/// One plane wave.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Wave {
    /// Amplitude (half the height) in metres.
    pub amplitude: f32,
    /// Wavelength in metres.
    pub wavelength: f32,
    /// Direction of travel in degrees from +X towards +Z.
    #[serde(default)]
    pub direction: f32,
    /// Phase at the origin at time 0, degrees.
    #[serde(default)]
    pub phase: f32,
    /// Steepness of a Gerstner (trochoidal) wave: share of the horizontal displacement, 0 for a sine, 1 for the full
    /// orbital motion.
    #[serde(default)]
    pub steepness: f32,
}

/// Parameters of the shallow-water solver.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ShallowWater {
    /// Distance between samples in metres.
    pub spacing: f32,
    /// Discretisation.
    #[serde(default)]
    pub scheme: ShallowWaterScheme,
    /// Manning's roughness in s/m^⅓; 0 for none.
    #[serde(default)]
    pub manning: f32,
    /// Courant number of the sub-steps, in (0, 1).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub courant: Option<f32>,
    /// Depth in metres below which water is treated as a film; default: 1e-5 of the largest depth.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub film_depth: Option<f32>,
}

/// Discretisation of the shallow-water equations.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ShallowWaterScheme {
    /// Chosen for the scene.
    #[default]
    Auto,
    /// Well-balanced MUSCL-Hancock finite volumes.
    FiniteVolume,
}

/// What happens at each edge of the domain.
#[derive(Clone, Debug, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Boundary {
    /// Edge at the smallest X.
    pub x_min: Edge,
    /// Edge at the largest X.
    pub x_max: Edge,
    /// Edge at the smallest Z.
    pub z_min: Edge,
    /// Edge at the largest Z.
    pub z_max: Edge,
}

/// Behaviour of one edge.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Edge {
    /// Waves are reflected.
    #[default]
    Wall,
    /// Waves leave.
    Open,
    /// What leaves enters at the opposite edge, which must be periodic too.
    Periodic,
}

/// A solid object.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Object {
    /// Name for reports.
    pub name: String,
    /// Its geometry.
    pub shape: Shape,
    /// Position of its origin in metres.
    #[serde(default)]
    pub position: Vec3,
    /// Rotation as a unit quaternion `[x, y, z, w]`.
    #[serde(default)]
    pub rotation: Quat,
    /// Density in kg/m³; used by solvers that move bodies.
    #[serde(default = "default_density")]
    pub density: f32,
    /// How it moves.
    #[serde(default)]
    pub motion: Motion,
    /// Linear base colour, 0 to 1; default: the model's, else grey.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub color: Option<Vec3>,
}

fn default_density() -> f32 {
    600.0
}

/// Geometry of an object.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub enum Shape {
    /// A sphere about the origin.
    Sphere {
        /// Radius in metres.
        radius: f32,
    },
    /// A box about the origin.
    Box {
        /// Full lengths along X, Y, Z in metres.
        size: Vec3,
    },
    /// An upright cylinder about the origin.
    Cylinder {
        /// Radius in metres.
        radius: f32,
        /// Full height in metres.
        height: f32,
    },
    /// A glTF or GLB model.
    Model {
        /// The file, relative to the scene file.
        #[serde(serialize_with = "path_text")]
        file: PathBuf,
        /// Metres a model unit.
        #[serde(default = "one")]
        scale: f32,
    },
}

/// How an object moves.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub enum Motion {
    /// It stays.
    #[default]
    Fixed,
    /// It follows way points, linearly in time; before the first and after the last it rests there.
    Path {
        /// Way points in order of time.
        points: Vec<WayPoint>,
    },
    /// It floats freely (solvers with bodies).
    Free,
}

/// A pose at a time.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WayPoint {
    /// Seconds.
    pub time: f64,
    /// Position in metres.
    pub position: Vec3,
    /// Rotation as a unit quaternion.
    #[serde(default)]
    pub rotation: Quat,
}

/// Sun and sky.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Light {
    /// The sun; absent: none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sun: Option<Sun>,
    /// The sky.
    pub sky: Sky,
}

/// The sun.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sun {
    /// Height above the horizon in degrees, −90 to 90.
    pub elevation: f32,
    /// Azimuth in degrees from −Z (north) towards +X (east).
    pub azimuth: f32,
    /// Linear RGB irradiance on a surface that faces the sun.
    #[serde(default = "default_sun_irradiance")]
    pub irradiance: Vec3,
    /// Angular radius of the disc in degrees.
    #[serde(default = "default_sun_radius")]
    pub radius: f32,
}

fn default_sun_irradiance() -> Vec3 {
    Vec3::new(3.2, 3.0, 2.6)
}

fn default_sun_radius() -> f32 {
    optics::SUN_ANGULAR_RADIUS.to_degrees()
}

/// The sky.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub enum Sky {
    /// The same radiance from everywhere.
    Uniform {
        /// Linear RGB radiance.
        radiance: Vec3,
    },
    /// An equirectangular HDR picture.
    Picture {
        /// The file (EXR), relative to the scene file.
        #[serde(serialize_with = "path_text")]
        file: PathBuf,
        /// Turn about +Y in degrees.
        #[serde(default)]
        rotation: f32,
        /// Factor on its radiance.
        #[serde(default = "one")]
        scale: f32,
    },
    /// Hosek & Wilkie's daylight for the position of the sun.
    Daylight {
        /// Turbidity, 1 (clear) to 10 (hazy).
        #[serde(default = "default_turbidity")]
        turbidity: f32,
        /// Factor on its radiance.
        #[serde(default = "one")]
        scale: f32,
    },
}

impl Default for Sky {
    fn default() -> Self {
        Self::Uniform {
            radiance: Vec3::new(0.55, 0.70, 0.95),
        }
    }
}

fn default_turbidity() -> f32 {
    2.5
}

/// A named view.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Camera {
    /// Name for `--camera`.
    pub name: String,
    /// Eye position in metres.
    pub position: Vec3,
    /// Point looked at in metres.
    pub target: Vec3,
    /// Full vertical angle of view in degrees.
    #[serde(default = "default_fov")]
    pub fov: f32,
    /// Exposure in stops, applied by tone mapping.
    #[serde(default)]
    pub exposure: f32,
}

fn default_fov() -> f32 {
    40.0
}

/// Something that acts on the water at a time.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub enum Event {
    /// One action at one moment.
    Drop {
        /// Seconds.
        time: f64,
        /// Centre in metres.
        position: Vec2,
        /// Radius in metres.
        radius: f32,
        /// Volume in m³.
        volume: f32,
    },
    /// The surface is pressed down once without adding water.
    Press {
        /// Seconds.
        time: f64,
        /// Centre in metres.
        position: Vec2,
        /// Radius in metres.
        radius: f32,
        /// Depth at the centre in metres.
        depth: f32,
    },
    /// A horizontal push.
    Push {
        /// Seconds.
        time: f64,
        /// Centre in metres.
        position: Vec2,
        /// Radius in metres.
        radius: f32,
        /// Change of velocity at the centre in m/s.
        velocity: Vec2,
    },
    /// A depression that travels from one point to another, pressing as it goes (a boat's path, a gust).
    Sweep {
        /// First moment, seconds.
        start: f64,
        /// Last moment, seconds.
        end: f64,
        /// Where it begins, metres.
        from: Vec2,
        /// Where it ends, metres.
        to: Vec2,
        /// Radius in metres.
        radius: f32,
        /// Rate at which the surface is pressed down at the centre, m/s.
        rate: f32,
    },
    /// Rain: drops at random places and times.
    Rain {
        /// First moment, seconds.
        #[serde(default)]
        start: f64,
        /// Last moment, seconds; default: to the end.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        end: Option<f64>,
        /// Drops a second over the whole domain.
        rate: f32,
        /// Radius of the bump that a drop makes, metres.
        radius: f32,
        /// Volume of a drop in m³.
        volume: f32,
        /// Whether drops add water (`false` presses the surface instead, so that the volume stays).
        #[serde(default)]
        adds_water: bool,
    },
}

/// What is recorded.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Recording {
    /// Frames a second of simulated time.
    pub rate: f64,
    /// Optional channels to record; default: what the solver offers and the `whitted` renderer needs.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub channels: Option<Vec<String>>,
    /// Largest error of a recorded value (metres, m/s, …); 0 for lossless.
    pub tolerance: f32,
}

impl Default for Recording {
    fn default() -> Self {
        Self {
            rate: 30.0,
            channels: None,
            tolerance: 0.0,
        }
    }
}

/// File names as text. One that is not Unicode has no TOML form; its odd bytes become U+FFFD.
fn path_text<S: Serializer>(path: &Path, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(&path.to_string_lossy())
}

/// Seeds are whole numbers; TOML's end at 2⁶³ − 1, larger ones are written as texts such as `"0xffffffffffffffff"`.
mod seed_text {
    use serde::{Deserialize, Deserializer, Serializer, de};

    #[derive(Deserialize)]
    #[serde(untagged)]
    enum Seed {
        Number(u64),
        Text(String),
    }

    pub(super) fn serialize<S: Serializer>(seed: &u64, serializer: S) -> Result<S::Ok, S::Error> {
        match i64::try_from(*seed) {
            Ok(number) => serializer.serialize_i64(number),
            Err(_) => serializer.serialize_str(&format!("{seed:#x}")),
        }
    }

    pub(super) fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<u64, D::Error> {
        match Seed::deserialize(deserializer)? {
            Seed::Number(seed) => Ok(seed),
            Seed::Text(text) => text
                .strip_prefix("0x")
                .and_then(|digits| u64::from_str_radix(digits, 16).ok())
                .ok_or_else(|| de::Error::custom("a seed is a whole number from 0 to 2^64 - 1")),
        }
    }
}
