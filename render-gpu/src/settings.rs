//! What a renderer of this crate does, beyond what the scene says.

use crate::shader::Switches;

/// How water is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Technique {
    /// Water and ground traced as heightfields (Baboud & Décoret 2006).
    Heightfield,
    /// Refraction by flat water a vertex, by waves a pixel (Liu, Han & Fei 2020).
    TwoPhase,
    /// Nothing is refracted.
    NoRefraction,
    /// A look-up moved by the tilt of the normal, as games do.
    Offset,
    /// A march of the refracted ray over the picture (McGuire & Mara 2014).
    ScreenSpace,
    /// A march of the refracted ray through a voxel field of distances (Rodgman & Chen 2006).
    DistanceField,
}

impl Technique {
    /// Every technique.
    pub const ALL: [Self; 6] = [
        Self::Heightfield,
        Self::TwoPhase,
        Self::NoRefraction,
        Self::Offset,
        Self::ScreenSpace,
        Self::DistanceField,
    ];

    /// Name on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Heightfield => "gpu:heightfield",
            Self::TwoPhase => "gpu:two-phase",
            Self::NoRefraction => "gpu:no-refraction",
            Self::Offset => "gpu:offset",
            Self::ScreenSpace => "gpu:screen-space",
            Self::DistanceField => "gpu:distance-field",
        }
    }

    /// One line on what it does.
    pub const fn summary(self) -> &'static str {
        match self {
            Self::Heightfield => {
                "ray tracing of water and ground as heightfields on the GPU: refraction, reflection, absorption, caustics"
            }
            Self::TwoPhase => {
                "triangles on the GPU; refraction by flat water a vertex, then by waves a pixel"
            }
            Self::NoRefraction => "triangles on the GPU; what is under water is seen where it is: a baseline",
            Self::Offset => {
                "triangles on the GPU; a look-up moved by the tilt of the water, as games do: a baseline"
            }
            Self::ScreenSpace => "triangles on the GPU; refracted rays march over the picture: a baseline",
            Self::DistanceField => {
                "triangles on the GPU; refracted rays march through voxels of distance: a baseline"
            }
        }
    }

    /// The technique of that name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|t| t.name() == name)
    }
}

/// How rays find a heightfield.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Walk {
    /// A minimum-maximum pyramid over the patches: exact.
    #[default]
    Pyramid,
    /// Steps of a safety radius and a binary search, one radius a field, as the paper has it for moving water: misses what is
    /// thinner than the radius.
    Safety,
    /// The same with a radius a texel, as the paper has it for the ground; here for both fields, and for rays from below too.
    SafetyMap,
}

impl Walk {
    /// Every walk.
    pub const ALL: [Self; 3] = [Self::Pyramid, Self::Safety, Self::SafetyMap];
}

/// How heights are kept on the device.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Heights {
    /// In single precision, with slopes and bounds.
    #[default]
    Single,
    /// In 16 bits of the range from the lowest to the highest, slopes in half precision: half the memory and upload.
    Sixteen,
}

impl Heights {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Single, Self::Sixteen];
}

/// How sunlight is gathered.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PhotonMap {
    /// Two photons a sample of the water's grid along each axis, on a map of that grid.
    Grid {
        /// Whether the map is filtered.
        filter: bool,
    },
    /// A square of photons on a square map over the water's grid, whatever its shape.
    Square {
        /// Photons along a side.
        photons: u32,
        /// Texels along a side.
        map: u32,
        /// Whether the map is filtered.
        filter: bool,
    },
}

/// See the module.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// How water is drawn.
    pub technique: Technique,
    /// How rays find a heightfield.
    pub walk: Walk,
    /// Factor on the safety radii: larger is faster and misses more. Default 1.
    pub safety_scale: f32,
    /// How heights are kept.
    pub heights: Heights,
    /// What is left out of the shaders.
    pub switches: Switches,
    /// Whether waves focus sunlight on the ground.
    pub caustics: bool,
    /// How that light is gathered.
    pub photon_map: PhotonMap,
    /// Distance in metres at which haze leaves 2 % of contrast; `None` for perfectly clear air. Default 150 km.
    pub visual_range: Option<f32>,
    /// Share of the light from the ground below which it is not looked for: rays under water end where absorption has
    /// left so much in every colour. 0 (the default) follows them to the end.
    pub absorption_cutoff: f32,
    /// Voxels along a side of the distance field. Default 64.
    pub voxels: u32,
    /// Error in pixels that straight edges between the vertices of the broad phase may make. Default 0.25.
    pub tessellation: f32,
}

impl Settings {
    /// The defaults of a technique.
    pub fn new(technique: Technique) -> Self {
        Self {
            technique,
            walk: Walk::default(),
            safety_scale: 1.0,
            heights: Heights::default(),
            switches: Switches {
                broad: technique == Technique::TwoPhase,
                ..Switches::default()
            },
            caustics: true,
            photon_map: PhotonMap::Grid { filter: false },
            visual_range: Some(150_000.0),
            absorption_cutoff: 0.0,
            voxels: 64,
            tessellation: 0.25,
        }
    }
}
