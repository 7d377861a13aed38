//! The passes of each technique.

use crate::facts::{Facts, blocks_of};
use crate::graph::{Format, Graph, Kind, ResourceId};
use crate::settings::{Settings, Technique, Walk};
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
    /// First place met and refracted place met, a texture each, where the technique can tell.
    pub met: Option<[ResourceId; 2]>,
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
    /// The picture.
    pub const PICTURE: &str = "picture";
    /// Sunlight on the ground.
    pub const MAP: &str = "illumination_map";
}

/// The pieces that every shader of the scene shares, chosen by what the scene has.
pub fn scene_pieces(facts: &Facts, settings: &Settings) -> Vec<Piece> {
    let choose = |yes: bool, there: Piece, none: Piece| if yes { there } else { none };
    vec![
        Piece::Optics,
        Piece::Stage,
        Piece::Field,
        choose(
            settings.walk == Walk::Pyramid,
            Piece::WalkPyramid,
            Piece::WalkSafety,
        ),
        Piece::Light,
        choose(facts.sky.is_some(), Piece::SkyPicture, Piece::SkyUniform),
        Piece::Ground,
        Piece::Edges,
        choose(facts.objects > 0, Piece::Solids, Piece::SolidsNone),
        choose(facts.spray, Piece::Spray, Piece::SprayNone),
        choose(facts.foam > 0, Piece::Foam, Piece::FoamNone),
        choose(facts.caustics.is_some(), Piece::Caustics, Piece::CausticsNone),
        Piece::World,
    ]
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

fn common(facts: &Facts, settings: &Settings) -> Common {
    let mut graph = Graph::default();
    let mut ready = Vec::new();
    let words = |n: u64| Kind::Imported { bytes: 4 * n };
    let samples = |f: usize| u64::from(facts.fields[f].size[0]) * u64::from(facts.fields[f].size[1]);
    let fields: [(usize, Cadence, [&'static str; 5]); 2] = [
        (
            0,
            Cadence::Frame,
            [
                "water heights",
                "water slopes",
                "water pyramid",
                "slopes of the water",
                "pyramid of the water",
            ],
        ),
        (
            1,
            Cadence::Scene,
            [
                "ground heights",
                "ground slopes",
                "ground pyramid",
                "slopes of the ground",
                "pyramid of the ground",
            ],
        ),
    ];
    for (f, cadence, [heights, slopes, pyramid, slope_pass, pyramid_pass]) in fields {
        let shape = &facts.fields[f];
        if !shape.is_present() {
            continue;
        }
        let heights = graph.resource(heights, words(samples(f)));
        let slopes = graph.resource(slopes, words(2 * samples(f)));
        let last = u64::from(shape.end) - u64::from(shape.slopes) - 2 * samples(f);
        let pyramid = graph.resource(pyramid, words(last));
        // Resources are parts of one buffer, which the shaders bind under another name when they write it.
        let work = |piece, entry, dispatches| Work {
            pieces: vec![Piece::Stage, piece],
            action: Action::Compute { entry, dispatches },
            bind: vec![],
            zero: vec![],
            cadence,
        };
        let one = vec![Dispatch {
            groups: tiles(shape.size),
            which: [f as u32, 0, 0, 0],
        }];
        graph.pass(
            slope_pass,
            &[heights],
            &[slopes],
            work(Piece::Slopes, "slopes", one),
        );
        ready.extend([heights, slopes]);
        if settings.walk == Walk::Pyramid {
            let levels = (1..=shape.levels)
                .map(|level| Dispatch {
                    groups: tiles(blocks_of(UVec2::from(shape.size) - 1, level).to_array()),
                    which: [f as u32, level, 0, 0],
                })
                .collect();
            graph.pass(
                pyramid_pass,
                &[heights],
                &[pyramid],
                work(Piece::Pyramid, "pyramid", levels),
            );
            ready.push(pyramid);
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
    if let Some(map) = caustics(&mut graph, facts, settings, &ready) {
        lights.push(map);
    }
    Common { graph, ready, lights }
}

/// Photons from the surface to the ground, their sum on the map, and its filter.
fn caustics(
    graph: &mut Graph<Work>,
    facts: &Facts,
    settings: &Settings,
    ready: &[ResourceId],
) -> Option<ResourceId> {
    let sizes = facts.caustics?;
    let count = u64::from(sizes.photons[0]) * u64::from(sizes.photons[1]);
    let texels = u64::from(sizes.map[0]) * u64::from(sizes.map[1]);
    let photons = graph.resource("photons", Kind::Buffer { bytes: 16 * count });
    let sums = graph.resource("light sums", Kind::Buffer { bytes: 4 * texels });
    // The map itself is kept beyond the frame, so that later samples of a pixel can use it.
    let map = graph.resource(names::MAP, Kind::Imported { bytes: 4 * texels });
    let base = vec![Piece::Optics, Piece::Stage, Piece::Field];
    let with_walk = |piece: Piece| {
        let mut pieces = base.clone();
        pieces.push(if settings.walk == Walk::Pyramid {
            Piece::WalkPyramid
        } else {
            Piece::WalkSafety
        });
        pieces.push(piece);
        pieces
    };
    let work = |piece, entry, groups, bind, zero| Work {
        pieces: with_walk(piece),
        action: Action::Compute {
            entry,
            dispatches: vec![Dispatch {
                groups,
                which: [0; 4],
            }],
        },
        bind,
        zero,
        cadence: Cadence::Frame,
    };
    graph.pass(
        "photons",
        ready,
        &[photons],
        work(
            Piece::Photons,
            "emit",
            tiles(sizes.photons),
            vec![("photons", photons)],
            vec![],
        ),
    );
    let rows = u32::try_from(count.div_ceil(64)).unwrap_or(u32::MAX);
    graph.pass(
        "light sums",
        &[photons],
        &[sums],
        work(
            Piece::Illumination,
            "scatter",
            [rows, 1, 1],
            vec![("photons", photons), ("sums", sums)],
            vec![sums],
        ),
    );
    let raw = if sizes.filter {
        graph.resource("light before the filter", Kind::Buffer { bytes: 4 * texels })
    } else {
        map
    };
    let mut reads = ready.to_vec();
    reads.push(sums);
    graph.pass(
        "light on the ground",
        &reads,
        &[raw],
        work(
            Piece::IlluminationMap,
            "normalise",
            tiles(sizes.map),
            vec![("sums", sums), ("map", raw)],
            vec![],
        ),
    );
    if sizes.filter {
        graph.pass(
            "filter",
            &[raw],
            &[map],
            work(
                Piece::Bilateral,
                "bilateral",
                tiles(sizes.map),
                vec![("map", raw), ("filtered", map)],
                vec![],
            ),
        );
    }
    Some(map)
}

/// The passes of a technique for what a scene and a frame have.
pub fn passes(facts: &Facts, settings: &Settings) -> Passes {
    let mut common = common(facts, settings);
    match settings.technique {
        Technique::Heightfield => heightfield(facts, settings, &mut common),
        _ => rasterised(facts, settings, &mut common),
    }
}

fn full_picture(graph: &mut Graph<Work>, facts: &Facts, name: &'static str, format: Format) -> ResourceId {
    graph.resource(
        name,
        Kind::Texture {
            size: facts.size,
            format,
        },
    )
}

fn heightfield(facts: &Facts, settings: &Settings, common: &mut Common) -> Passes {
    let radiance = full_picture(&mut common.graph, facts, "radiance", Format::Full);
    let depth = full_picture(&mut common.graph, facts, "depth", Format::Depth);
    let mut pieces = scene_pieces(facts, settings);
    let mut tracing = pieces.clone();
    tracing.extend([Piece::Trace, Piece::FullScreen, Piece::Heightfield]);
    let attach = |id| Attachment { id, clear: true };
    let whole = vec![DrawCall {
        vertices: 3,
        instances: 1,
        which: [0; 4],
    }];
    let draw = |pieces, fragment, colors, depth| Work {
        pieces,
        action: Action::Draw {
            vertex: "fullscreen",
            fragment,
            colors,
            depth,
            draws: whole.clone(),
        },
        bind: vec![],
        zero: vec![],
        cadence: Cadence::Sample,
    };
    let work = draw(
        tracing,
        "heightfield",
        vec![attach(radiance)],
        Some(attach(depth)),
    );
    common
        .graph
        .pass("heightfield", &common.lights, &[radiance, depth], work);
    let met = met(&mut common.graph, facts);
    pieces.extend([Piece::FullScreen, Piece::HeightfieldAux]);
    let work = draw(pieces, "heightfield_aux", met.map(attach).to_vec(), None);
    common.graph.pass("places met", &common.ready, &met, work);
    let picture = accumulate(&mut common.graph, facts, radiance);
    Passes {
        graph: std::mem::take(&mut common.graph),
        picture,
        met: Some(met),
    }
}

/// Draw calls of everything opaque; see `shaders/shared/geometry.wgsl`.
fn opaque_draws(facts: &Facts) -> Vec<DrawCall> {
    let call = |vertices: u32, which| DrawCall {
        vertices,
        instances: 1,
        which,
    };
    let mesh = &facts.mesh;
    let mut draws = Vec::new();
    if facts.fields[1].is_present() {
        let [x, z] = mesh.ground;
        draws.push(call(6 * (x + 2) * (z + 2), [0, x, z, 0]));
    }
    for (k, _) in facts.sides.iter().enumerate().filter(|(_, glass)| !**glass) {
        let squares = 6 * mesh.wall * mesh.wall;
        draws.push(call(squares, [1, k as u32, mesh.wall, 0]));
        draws.push(call(squares, [2, k as u32, mesh.wall, 0]));
    }
    for &[object, first, triangles] in &mesh.objects {
        draws.push(call(3 * triangles, [3, object, first, 0]));
    }
    draws
}

/// Draw calls of the water's surface; see `shaders/surface.wgsl`.
fn surface_draws(facts: &Facts) -> Vec<DrawCall> {
    let [x, z] = facts.fields[0].size.map(|n| n - 1);
    let tiles = facts.mesh.tiles;
    let mut draws = vec![DrawCall {
        vertices: 6 * (x + 2) * (z + 2),
        instances: tiles * tiles,
        which: [0, x, z, tiles],
    }];
    for (k, _) in facts.sides.iter().enumerate().filter(|(_, glass)| **glass) {
        draws.push(DrawCall {
            vertices: 6 * x.max(z),
            instances: 1,
            which: [1, k as u32, x.max(z), 0],
        });
    }
    draws
}

/// Triangles: what is beyond the surface, what is before it, and the surface that looks the former up.
fn rasterised(facts: &Facts, settings: &Settings, common: &mut Common) -> Passes {
    let graph = &mut common.graph;
    let mut ready = common.lights.clone();
    if !facts.mesh.objects.is_empty() {
        let bytes = 16 * u64::from(facts.mesh.rows());
        ready.push(graph.resource(names::MESHES, Kind::Imported { bytes }));
    }
    let radiance = full_picture(graph, facts, "radiance", Format::Full);
    let depth = full_picture(graph, facts, "depth", Format::Depth);
    let far = [
        full_picture(graph, facts, "light beyond", Format::Half),
        full_picture(graph, facts, "places beyond", Format::Full),
        full_picture(graph, facts, "normals beyond", Format::Half),
    ];
    let far_depth = full_picture(graph, facts, "depth beyond", Format::Depth);
    let missing = graph.resource(names::MISSING, Kind::Imported { bytes: 16 });
    let scene = scene_pieces(facts, settings);
    let with = |more: &[Piece]| {
        let mut pieces = scene.clone();
        pieces.extend(more);
        pieces
    };
    let objects = if facts.objects > 0 {
        Piece::Objects
    } else {
        Piece::ObjectsNone
    };
    let draw = |pieces, vertex, fragment, colors, depth, draws, bind| Work {
        pieces,
        action: Action::Draw {
            vertex,
            fragment,
            colors,
            depth,
            draws,
        },
        bind,
        zero: vec![],
        cadence: Cadence::Sample,
    };
    let fresh = |id| Attachment { id, clear: true };
    let onto = |id| Attachment { id, clear: false };
    let whole = || {
        vec![DrawCall {
            vertices: 3,
            instances: 1,
            which: [0; 4],
        }]
    };
    let opaque = opaque_draws(facts);

    let mut writes = far.to_vec();
    writes.push(far_depth);
    let work = draw(
        with(&[Piece::Geometry, objects, Piece::Apparent, Piece::Far]),
        "far_vertex",
        "far",
        far.map(fresh).to_vec(),
        Some(fresh(far_depth)),
        opaque.clone(),
        vec![],
    );
    graph.pass("things beyond", &ready, &writes, work);

    let work = draw(
        with(&[Piece::FullScreen, Piece::Background]),
        "fullscreen",
        "background",
        vec![fresh(radiance)],
        None,
        whole(),
        vec![],
    );
    graph.pass("background", &ready, &[radiance], work);

    let mut reads = ready.clone();
    reads.push(radiance);
    let work = draw(
        with(&[Piece::Geometry, objects, Piece::Near]),
        "near_vertex",
        "near",
        vec![onto(radiance)],
        Some(fresh(depth)),
        opaque,
        vec![],
    );
    graph.pass("things before", &reads, &[radiance, depth], work);

    let refraction = match settings.technique {
        Technique::Heightfield | Technique::NoRefraction => Piece::RefractionNone,
        Technique::TwoPhase => Piece::RefractionTwoPhase,
        Technique::Offset => Piece::RefractionOffset,
        Technique::ScreenSpace => Piece::RefractionScreenSpace,
        Technique::DistanceField => Piece::RefractionDistanceField,
    };
    let mut reads = ready.clone();
    let mut bind = vec![("missing", missing)];
    let mut looks = vec![Piece::Trace];
    match settings.technique {
        Technique::DistanceField => {
            let n = u64::from(settings.voxels);
            reads.push(graph.resource(names::VOXELS, Kind::Imported { bytes: 8 * n * n * n }));
        }
        technique => {
            if technique == Technique::TwoPhase {
                looks.push(Piece::Apparent);
            }
            looks.push(Piece::Beyond);
            reads.extend(far);
            bind.extend(["far_radiance", "far_place", "far_normal"].into_iter().zip(far));
        }
    }
    looks.extend([refraction, Piece::Surface]);
    // Before the pass that adds the surface's own depth.
    let met = met(graph, facts);
    let mut depth_and = reads.clone();
    depth_and.push(depth);
    let surface = surface_draws(facts);
    let work = draw(
        with(&looks),
        "surface_vertex",
        "surface_met",
        met.map(fresh).to_vec(),
        Some(onto(depth)),
        surface.clone(),
        bind.clone(),
    );
    graph.pass("places met", &depth_and, &met, work);
    depth_and.push(radiance);
    let work = draw(
        with(&looks),
        "surface_vertex",
        "surface",
        vec![onto(radiance)],
        Some(onto(depth)),
        surface,
        bind,
    );
    graph.pass("water surface", &depth_and, &[radiance, depth], work);
    if facts.spray {
        let work = draw(
            with(&[Piece::Trace, Piece::FullScreen, Piece::Droplets]),
            "fullscreen",
            "droplets",
            vec![onto(radiance)],
            Some(onto(depth)),
            whole(),
            vec![],
        );
        graph.pass("droplets", &depth_and, &[radiance, depth], work);
    }
    let picture = accumulate(graph, facts, radiance);
    Passes {
        graph: std::mem::take(graph),
        picture,
        met: Some(met),
    }
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
