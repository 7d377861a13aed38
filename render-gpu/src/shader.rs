//! Shaders: pieces of WGSL put together for one pass, behind constants that Rust generates.
//!
//! Every optical constant stands in `sim/src/optics.rs`, every size of a table beside the table. What a technique is
//! told to leave out becomes a constant too, so that the compiler removes the code.

use meniscus_sim::{optics, stage};
use std::fmt::Write as _;

macro_rules! pieces {
    ($($name:ident = $path:literal),* $(,)?) => {
        /// A piece of WGSL.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
        #[allow(missing_docs)]
        pub enum Piece { $($name),* }

        impl Piece {
            /// All of them.
            pub const ALL: &'static [Self] = &[$(Self::$name),*];

            /// Its text.
            pub const fn text(self) -> &'static str {
                match self { $(Self::$name => include_str!(concat!("shaders/", $path))),* }
            }

            /// Its file below `shaders/`.
            pub const fn path(self) -> &'static str {
                match self { $(Self::$name => $path),* }
            }
        }
    };
}

pieces! {
    Optics = "shared/optics.wgsl",
    Stage = "shared/stage.wgsl",
    Field = "shared/field.wgsl",
    StoreSingle = "shared/store_single.wgsl",
    StoreSixteen = "shared/store_sixteen.wgsl",
    KeepSingle = "shared/keep_single.wgsl",
    KeepSixteen = "shared/keep_sixteen.wgsl",
    Samples = "shared/samples.wgsl",
    WalkPyramid = "shared/walk_pyramid.wgsl",
    WalkSafety = "shared/walk_safety.wgsl",
    RadiusConstant = "shared/radius_constant.wgsl",
    RadiusMap = "shared/radius_map.wgsl",
    SkyUniform = "shared/sky_uniform.wgsl",
    SkyPicture = "shared/sky_picture.wgsl",
    Light = "shared/light.wgsl",
    Ground = "shared/ground.wgsl",
    Edges = "shared/edges.wgsl",
    Bounds = "shared/bounds.wgsl",
    Solids = "shared/solids.wgsl",
    SolidsNone = "shared/solids_none.wgsl",
    Looks = "shared/looks.wgsl",
    LooksNone = "shared/looks_none.wgsl",
    Spray = "shared/spray.wgsl",
    SprayNone = "shared/spray_none.wgsl",
    Foam = "shared/foam.wgsl",
    FoamNone = "shared/foam_none.wgsl",
    Caustics = "shared/caustics.wgsl",
    CausticsNone = "shared/caustics_none.wgsl",
    World = "shared/world.wgsl",
    Trace = "shared/trace.wgsl",
    Corners = "shared/corners.wgsl",
    CornersLook = "shared/corners_look.wgsl",
    Geometry = "shared/geometry.wgsl",
    Objects = "shared/objects.wgsl",
    ObjectsNone = "shared/objects_none.wgsl",
    Apparent = "shared/apparent.wgsl",
    Beyond = "shared/beyond.wgsl",
    FullScreen = "shared/fullscreen.wgsl",
    Slopes = "slopes.wgsl",
    Pyramid = "pyramid.wgsl",
    Radii = "radii.wgsl",
    Photons = "photons.wgsl",
    Illumination = "illumination.wgsl",
    IlluminationMap = "illumination_map.wgsl",
    Bilateral = "bilateral.wgsl",
    Heightfield = "heightfield.wgsl",
    HeightfieldAux = "heightfield_aux.wgsl",
    HeightfieldEdges = "heightfield_edges.wgsl",
    FrontNone = "shared/front_none.wgsl",
    FrontForeign = "shared/front_foreign.wgsl",
    Background = "background.wgsl",
    Foreign = "foreign.wgsl",
    Near = "near.wgsl",
    Far = "far.wgsl",
    Surface = "surface.wgsl",
    Droplets = "droplets.wgsl",
    RefractionNone = "refraction_none.wgsl",
    RefractionOffset = "refraction_offset.wgsl",
    RefractionScreenSpace = "refraction_screen_space.wgsl",
    RefractionTwoPhase = "refraction_two_phase.wgsl",
    RefractionDistanceField = "refraction_distance_field.wgsl",
    Accumulate = "accumulate.wgsl",
    Parity = "parity.wgsl",
    ParityApparent = "parity_apparent.wgsl",
}

/// What a technique leaves out or limits, fixed when its pipelines are made.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Switches {
    /// Interfaces at which a ray is split, 1 to 3.
    pub interface_depth: u32,
    /// A branch whose share of the pixel is smaller is left to the other branch.
    pub cutoff: f32,
    /// RMS slope of ripples finer than the grid.
    pub roughness: f32,
    /// Whether what stands above the water is seen reflected in it, besides the sky.
    pub self_reflection: bool,
    /// Whether light is lost and scattered on its way through the water.
    pub absorption: bool,
    /// Whether sunlight is stopped by what stands in its way.
    pub shadows: bool,
    /// Whether photons start at random places of their patches.
    pub photon_jitter: bool,
    /// Whether rasterised techniques trace the mirrored ray; without, they see the sky in the water.
    pub traced_reflection: bool,
    /// Whether what lies beyond the surface is drawn where flat water shows it. Set by the technique.
    pub broad: bool,
    /// Rounds of the narrow phase. Default 1, as in the paper: more cost more and hardly find better places (`docs/gpu.md`). 0 leaves
    /// the broad phase alone.
    pub narrow_steps: u32,
    /// Whether edges are smoothed: rasterised techniques draw four samples a pixel (MSAA), radiance then in half precision; the traced
    /// one gives pixels that differ from a neighbour four more rays.
    pub multisampled: bool,
}

impl Default for Switches {
    fn default() -> Self {
        Self {
            interface_depth: 1,
            cutoff: 2e-3,
            roughness: 0.0,
            self_reflection: true,
            absorption: true,
            shadows: true,
            photon_jitter: false,
            traced_reflection: true,
            broad: false,
            narrow_steps: 1,
            multisampled: false,
        }
    }
}

/// The generated constants.
pub fn prelude(switches: &Switches) -> String {
    let mut text = String::from("// Generated from Rust.\n");
    let mut scalar = |name: &str, value: f32| {
        let _ = writeln!(text, "const {name}: f32 = {value:?};");
    };
    scalar("PI", std::f32::consts::PI);
    scalar("TAU", std::f32::consts::TAU);
    scalar("WATER_INDEX", optics::WATER_INDEX);
    scalar("FOAM_ALBEDO", stage::FOAM_ALBEDO);
    scalar("DIFFUSE_PATH", stage::light::DIFFUSE_PATH);
    scalar("KOSCHMIEDER", stage::air::KOSCHMIEDER);
    scalar("CUTOFF", switches.cutoff);
    scalar("ROUGHNESS", switches.roughness);
    for (name, v) in [
        ("HAZE_TINT", stage::air::HAZE_TINT),
        ("WATER_ABSORPTION", optics::WATER_ABSORPTION),
        ("WATER_SCATTERING", optics::WATER_SCATTERING),
    ] {
        let _ = writeln!(
            text,
            "const {name}: vec3f = vec3f({:?}, {:?}, {:?});",
            v.x, v.y, v.z
        );
    }
    for (name, value) in [
        ("HORIZON_STEPS", stage::sky::HORIZON_STEPS),
        ("NORMAL_ROWS", stage::sky::NORMAL_ROWS),
        ("NORMAL_COLUMNS", stage::sky::NORMAL_COLUMNS),
        ("LATTICE", stage::ground::LATTICE),
    ] {
        let _ = writeln!(text, "const {name}: i32 = {value};");
    }
    let depth = switches.interface_depth.clamp(1, 3);
    // Each split makes a branch of at most this many more interfaces.
    let unsplit = 8;
    let _ = writeln!(
        text,
        "const NARROW_STEPS: i32 = {};",
        switches.narrow_steps.min(16)
    );
    let _ = writeln!(text, "const MAX_TILES: i32 = 96;");
    let _ = writeln!(text, "const INTERFACE_DEPTH: u32 = {depth}u;");
    let _ = writeln!(text, "const UNSPLIT_INTERFACES: u32 = {unsplit}u;");
    let _ = writeln!(
        text,
        "const MOST_RAYS: i32 = {};",
        (1 << depth) * (depth + unsplit + 1)
    );
    for (name, value) in [
        ("SELF_REFLECTION", switches.self_reflection),
        ("ABSORPTION", switches.absorption),
        ("SHADOWS", switches.shadows),
        ("PHOTON_JITTER", switches.photon_jitter),
        ("TRACED_REFLECTION", switches.traced_reflection),
        ("BROAD", switches.broad),
        ("MULTISAMPLED", switches.multisampled),
    ] {
        let _ = writeln!(text, "const {name}: bool = {value};");
    }
    text
}

/// Where shaders find the numbers that are the same for all threads. Both have the same layout.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Constants {
    /// In uniform buffers, which adapters keep close at hand.
    #[default]
    Uniform,
    /// In storage buffers. Software drivers translate a shader anew for every set of values of the uniforms that its branches
    /// depend on (Mesa's lavapipe: a translation and 12 MB a frame, which it keeps); what lies in storage they only read.
    Storage,
}

/// The source of one shader: constants, then the pieces in order.
pub fn assemble(switches: &Switches, pieces: &[Piece], constants: Constants) -> String {
    let mut text = prelude(switches);
    for piece in pieces {
        let _ = write!(text, "\n// ---- {}\n{}", piece.path(), piece.text());
    }
    match constants {
        Constants::Uniform => text,
        Constants::Storage => text.replace("var<uniform>", "var<storage, read>"),
    }
}
