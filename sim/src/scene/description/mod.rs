//! The contents of a scene file, one file a table. Every key has a default or is required; both are documented in
//! `docs/scene-file.md`, which a test keeps complete.

mod bed;
mod boundary;
mod camera;
mod event;
mod ground;
mod horizon;
mod layer;
mod light;
mod object;
mod ocean;
mod procedural;
mod seed_text;
mod shallow_water;
mod solver;
mod sph;
mod water;
mod wave_equation;
mod wave_particles;

pub use bed::{Bed, PlanPoint};
pub use boundary::{Boundary, Drive, Driven, Edge, EdgeName, SeriesPoint};
pub use camera::Camera;
pub use event::Event;
pub use ground::{Coordinates, GroundLook, Terrain};
pub use horizon::{Horizon, NormalBlend};
pub use layer::{Detail, Layer};
pub use light::{Light, Sky, SkyLayout, Sun};
pub use object::{Motion, Object, Shape, WayPoint};
pub use ocean::{Cascade, Ocean, OceanFoam, Sea, Spectrum, Spreading};
pub use procedural::{Procedural, Wave};
pub use shallow_water::{ShallowWater, ShallowWaterScheme, Splash};
pub use solver::Solver;
pub use sph::{Drain, Emitter, Sph, SphDroplets, SphModel, SphSurface, SphWalls, Tilt, Vessel};
pub use water::{Initial, Water};
pub use wave_equation::{WaveEquation, WaveScheme};
pub use wave_particles::{AmplitudeLaw, WaveFront, WaveParticles};

use glam::Vec2;
use serde::{Deserialize, Serialize, Serializer};
use std::path::Path;

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
    /// Waves of other methods over the solver's water.
    #[serde(default, rename = "layer", skip_serializing_if = "Vec::is_empty")]
    pub layers: Vec<Layer>,
    /// Small waves and wrinkles over the water; absent: none, at no cost.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub detail: Option<Detail>,
    /// What moves the ground under shallow water.
    #[serde(default, rename = "bed", skip_serializing_if = "Vec::is_empty")]
    pub beds: Vec<Bed>,
    /// What happens at the edges of the domain.
    #[serde(default)]
    pub boundary: Boundary,
    /// Solid objects.
    #[serde(default, rename = "object", skip_serializing_if = "Vec::is_empty")]
    pub objects: Vec<Object>,
    /// Sun and sky.
    #[serde(default)]
    pub light: Light,
    /// The room of pictures of the renderer `horizon`; absent: its defaults.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub horizon: Option<Horizon>,
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

fn one() -> f32 {
    1.0
}

fn one_wide() -> f64 {
    1.0
}

/// File names as text. One that is not Unicode has no TOML form; its odd bytes become U+FFFD.
fn path_text<S: Serializer>(path: &Path, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(&path.to_string_lossy())
}
