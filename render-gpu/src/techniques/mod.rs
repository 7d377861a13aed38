//! The passes of each technique.

mod caustics;
mod heightfield;
mod rasterised;

use crate::facts::{Facts, blocks_of};
use crate::graph::{Format, Graph, Kind, ResourceId};
use crate::settings::{Heights, Settings, Technique, Walk};
use crate::shader::Piece;
use crate::work::{Action, Attachment, Cadence, Dispatch, DrawCall, Work};
use meniscus_sim::glam::UVec2;

/// A graph with what can be wanted of it.
#[derive(Clone, Debug)]
pub struct Passes {
    /// All passes of the technique.
    pub graph: Graph<Work>,
    /// The picture: linear radiance, four values a pixel.
    pub picture: ResourceId,
    /// First place met and refracted place met, a texture each.
    pub met: [ResourceId; 2],
    /// Reversed depth of what was met first.
    pub depth: ResourceId,
}

/// Names of the imported resources, under which the renderer provides them.
pub mod names {
    /// Heights, slopes and pyramids of water and ground.
    pub const HEIGHTS: &str = "heights";
    /// Haze, irradiance, noise, openness.
    pub const TABLES: &str = "tables";
    /// The sky's picture.
    pub const SKY: &str = "sky";
    /// Objects.
    pub const SOLIDS: &str = "solids";
    /// Objects as triangles.
    pub const MESHES: &str = "meshes";
    /// Distances to the nearest surface.
    pub const VOXELS: &str = "voxels";
    /// Counts of look-ups that found nothing.
    pub const MISSING: &str = "missing";
    /// What the caller has drawn.
    pub const FOREIGN: &str = "foreign";
    /// The picture.
    pub const PICTURE: &str = "picture";
    /// Sunlight on the ground.
    pub const MAP: &str = "illumination_map";
}

/// How heights are read and rays find them.
fn field_pieces(settings: &Settings) -> Vec<Piece> {
    let store = match settings.heights {
        Heights::Single => Piece::StoreSingle,
        Heights::Sixteen => Piece::StoreSixteen,
    };
    let walk: &[Piece] = match settings.walk {
        Walk::Pyramid => &[Piece::WalkPyramid],
        Walk::Safety => &[Piece::RadiusConstant, Piece::WalkSafety],
        Walk::SafetyMap => &[Piece::RadiusMap, Piece::WalkSafety],
    };
    [&[store, Piece::Field], walk].concat()
}

/// The pieces that every shader of the scene shares, chosen by what the scene has.
pub fn scene_pieces(facts: &Facts, settings: &Settings) -> Vec<Piece> {
    let choose = |yes: bool, there: Piece, none: Piece| if yes { there } else { none };
    let mut pieces = vec![Piece::Optics, Piece::Stage];
    pieces.extend(field_pieces(settings));
    pieces.extend([
        Piece::Light,
        choose(facts.sky.is_some(), Piece::SkyPicture, Piece::SkyUniform),
        Piece::Ground,
        Piece::Edges,
    ]);
    if facts.objects > 0 || facts.spray {
        pieces.push(Piece::Bounds);
    }
    if facts.objects > 0 {
        pieces.push(choose(facts.looks, Piece::Looks, Piece::LooksNone));
    }
    pieces.extend([
        choose(facts.objects > 0, Piece::Solids, Piece::SolidsNone),
        choose(facts.spray, Piece::Spray, Piece::SprayNone),
        choose(facts.foam > 0, Piece::Foam, Piece::FoamNone),
        choose(facts.caustics.is_some(), Piece::Caustics, Piece::CausticsNone),
        Piece::World,
    ]);
    pieces
}

fn tiles(size: [u32; 2]) -> [u32; 3] {
    [size[0].div_ceil(8).max(1), size[1].div_ceil(8).max(1), 1]
}

/// What all techniques build on.
struct Common {
    graph: Graph<Work>,
    /// What must be ready before a ray is cast.
    ready: Vec<ResourceId>,
    /// What must be ready before matt surfaces are lit.
    lights: Vec<ResourceId>,
}

/// Names of what a field has, and of the passes that make it.
struct FieldNames {
    heights: &'static str,
    slopes: (&'static str, &'static str),
    radii: (&'static str, &'static str),
    pyramid: (&'static str, &'static str),
}

fn common(facts: &Facts, settings: &Settings) -> Common {
    let mut graph = Graph::default();
    let mut ready = Vec::new();
    let words = |n: u64| Kind::Imported { bytes: 4 * n };
    let fields: [(usize, Cadence, FieldNames); 2] = [
        (
            0,
            Cadence::Frame,
            FieldNames {
                heights: "water heights",
                slopes: ("water slopes", "slopes of the water"),
                radii: ("water radii", "radii of the water"),
                pyramid: ("water pyramid", "pyramid of the water"),
            },
        ),
        (
            1,
            Cadence::Scene,
            FieldNames {
                heights: "ground heights",
                slopes: ("ground slopes", "slopes of the ground"),
                radii: ("ground radii", "radii of the ground"),
                pyramid: ("ground pyramid", "pyramid of the ground"),
            },
        ),
    ];
    for (f, cadence, names) in fields {
        let shape = &facts.fields[f];
        if !shape.is_present() {
            continue;
        }
        let heights = graph.resource(names.heights, words(shape.height_words()));
        ready.push(heights);
        // What is made of the heights; all are parts of one buffer, which shaders bind under another name when they write it.
        let mut derive = |(name, pass): (&'static str, &'static str), count, piece, entry, dispatches| {
            let made = graph.resource(name, words(count));
            let keep = match settings.heights {
                Heights::Single => Piece::KeepSingle,
                Heights::Sixteen => Piece::KeepSixteen,
            };
            let work = Work {
                pieces: vec![Piece::Stage, keep, Piece::Samples, piece],
                action: Action::Compute { entry, dispatches },
                bind: vec![],
                zero: vec![],
                cadence,
            };
            graph.pass(pass, &[heights], &[made], work);
            ready.push(made);
        };
        let one = vec![Dispatch {
            groups: tiles(shape.size),
            which: [f as u32, 0, 0, 0],
        }];
        derive(
            names.slopes,
            shape.slope_words(),
            Piece::Slopes,
            "slopes",
            one.clone(),
        );
        match settings.walk {
            Walk::Pyramid => {
                let levels = (1..=shape.levels)
                    .map(|level| Dispatch {
                        groups: tiles(blocks_of(UVec2::from(shape.size) - 1, level).to_array()),
                        which: [f as u32, level, 0, 0],
                    })
                    .collect();
                derive(
                    names.pyramid,
                    shape.pyramid_words(),
                    Piece::Pyramid,
                    "pyramid",
                    levels,
                );
            }
            Walk::SafetyMap => derive(names.radii, shape.radius_words(), Piece::Radii, "radii", one),
            Walk::Safety => {}
        }
    }
    let tables = graph.resource(names::TABLES, words(facts.table_values()));
    ready.push(tables);
    if facts.sky.is_some() {
        ready.push(graph.resource(
            names::SKY,
            Kind::Imported {
                bytes: facts.sky_bytes(),
            },
        ));
    }
    if facts.objects > 0 {
        let bytes = 16 * u64::from(facts.solid_rows);
        ready.push(graph.resource(names::SOLIDS, Kind::Imported { bytes }));
    }
    if facts.foam > 0 {
        ready.push(graph.resource("foam", words(u64::from(facts.foam))));
    }
    let mut lights = ready.clone();
    if let Some(map) = caustics::caustics(&mut graph, facts, settings, &ready) {
        lights.push(map);
    }
    Common { graph, ready, lights }
}

/// The passes of a technique for what a scene and a frame have.
pub fn passes(facts: &Facts, settings: &Settings) -> Passes {
    let mut common = common(facts, settings);
    match settings.technique {
        Technique::Heightfield => heightfield::heightfield(facts, settings, &mut common),
        _ => rasterised::rasterised(facts, settings, &mut common),
    }
}

fn full_picture(graph: &mut Graph<Work>, facts: &Facts, name: &'static str, format: Format) -> ResourceId {
    graph.resource(
        name,
        Kind::Texture {
            size: facts.size,
            format,
            samples: 1,
        },
    )
}

fn met(graph: &mut Graph<Work>, facts: &Facts) -> [ResourceId; 2] {
    ["first place met", "refracted place met"].map(|name| full_picture(graph, facts, name, Format::Full))
}

/// The pass that adds a sample to the picture.
fn accumulate(graph: &mut Graph<Work>, facts: &Facts, radiance: ResourceId) -> ResourceId {
    let pixels = u64::from(facts.size[0]) * u64::from(facts.size[1]);
    let picture = graph.resource(names::PICTURE, Kind::Imported { bytes: 16 * pixels });
    let work = Work {
        pieces: vec![Piece::Stage, Piece::Accumulate],
        action: Action::Compute {
            entry: "accumulate",
            dispatches: vec![Dispatch {
                groups: tiles(facts.size),
                which: [0; 4],
            }],
        },
        bind: vec![("radiance", radiance), ("picture", picture)],
        zero: vec![],
        cadence: Cadence::Sample,
    };
    graph.pass("picture", &[radiance, picture], &[picture], work);
    picture
}

/// A pass that draws, for every sample.
fn draw(
    pieces: Vec<Piece>,
    vertex: &'static str,
    fragment: &'static str,
    colors: Vec<Attachment>,
    depth: Option<Attachment>,
    draws: Vec<DrawCall>,
) -> Work {
    Work {
        pieces,
        action: Action::Draw {
            vertex,
            fragment,
            colors,
            depth,
            draws,
        },
        bind: vec![],
        zero: vec![],
        cadence: Cadence::Sample,
    }
}

/// The triangle that covers the picture.
fn whole() -> Vec<DrawCall> {
    vec![DrawCall {
        vertices: 3,
        instances: 1,
        which: [0; 4],
    }]
}

/// The pass that puts what the caller has drawn, which it returns, into radiance and depth, before anything is drawn by depth.
fn foreign(
    graph: &mut Graph<Work>,
    facts: &Facts,
    scene: &[Piece],
    radiance: ResourceId,
    attachment: Attachment,
    depth: ResourceId,
) -> ResourceId {
    let pixels = u64::from(facts.size[0]) * u64::from(facts.size[1]);
    let layer = graph.resource(names::FOREIGN, Kind::Imported { bytes: 16 * pixels });
    let mut reads = vec![layer];
    if !attachment.clear {
        reads.push(radiance);
    }
    let pieces = [scene, &[Piece::FullScreen, Piece::Foreign]].concat();
    let work = draw(
        pieces,
        "fullscreen",
        "foreign_layer",
        vec![attachment],
        Some(Attachment::fresh(depth)),
        whole(),
    );
    graph.pass("foreign geometry", &reads, &[radiance, depth], work);
    layer
}
