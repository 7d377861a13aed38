//! The passes of the techniques that draw triangles.

use super::{Common, Passes, accumulate, draw, foreign, full_picture, met, names, scene_pieces, whole};
use crate::facts::Facts;
use crate::graph::{Format, Graph, Kind, ResourceId};
use crate::settings::{Settings, Technique};
use crate::shader::Piece;
use crate::work::{Attachment, DrawCall, Work};

/// Samples a pixel of MSAA; every device has four.
const SAMPLES: u32 = 4;

/// What the picture is drawn into.
struct Target {
    /// With all its samples.
    radiance: ResourceId,
    depth: ResourceId,
    /// One value a pixel; `radiance` itself where that has one sample.
    resolved: ResourceId,
}

impl Target {
    fn new(graph: &mut Graph<Work>, facts: &Facts, multisampled: bool) -> Self {
        if !multisampled {
            let radiance = full_picture(graph, facts, "radiance", Format::Full);
            return Self {
                radiance,
                depth: full_picture(graph, facts, "depth", Format::Depth),
                resolved: radiance,
            };
        }
        // Single precision cannot be resolved.
        let mut sampled = |name, format| {
            let size = facts.size;
            graph.resource(
                name,
                Kind::Texture {
                    size,
                    format,
                    samples: SAMPLES,
                },
            )
        };
        Self {
            radiance: sampled("radiance of samples", Format::Half),
            depth: sampled("depth of samples", Format::Depth),
            resolved: full_picture(graph, facts, "radiance", Format::Half),
        }
    }

    /// The attachment of a pass; the last one resolves.
    fn last_if(&self, last: bool) -> Attachment {
        Attachment {
            resolve: (last && self.resolved != self.radiance).then_some(self.resolved),
            ..Attachment::onto(self.radiance)
        }
    }

    /// What such a pass writes.
    fn written(&self, last: bool) -> Vec<ResourceId> {
        let resolve = self.last_if(last).resolve;
        [self.radiance, self.depth].into_iter().chain(resolve).collect()
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
pub(super) fn rasterised(facts: &Facts, settings: &Settings, common: &mut Common) -> Passes {
    let graph = &mut common.graph;
    let mut ready = common.lights.clone();
    if !facts.mesh.objects.is_empty() {
        let bytes = 16 * u64::from(facts.mesh.rows());
        ready.push(graph.resource(names::MESHES, Kind::Imported { bytes }));
    }
    let target = Target::new(graph, facts, settings.switches.multisampled);
    let (radiance, depth) = (target.radiance, target.depth);
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
    let corners = if facts.looks {
        Piece::CornersLook
    } else {
        Piece::Corners
    };
    let opaque = opaque_draws(facts);

    let mut writes = far.to_vec();
    writes.push(far_depth);
    let work = draw(
        with(&[corners, Piece::Geometry, objects, Piece::Apparent, Piece::Far]),
        "far_vertex",
        "far",
        far.map(Attachment::fresh).to_vec(),
        Some(Attachment::fresh(far_depth)),
        opaque.clone(),
    );
    graph.pass("things beyond", &ready, &writes, work);

    let work = draw(
        with(&[Piece::FullScreen, Piece::Background]),
        "fullscreen",
        "background",
        vec![Attachment::fresh(radiance)],
        None,
        whole(),
    );
    graph.pass("background", &ready, &[radiance], work);

    let mut reads = ready.clone();
    reads.push(radiance);
    let mut begin: fn(ResourceId) -> Attachment = Attachment::fresh;
    if facts.foreign {
        foreign(graph, facts, &scene, radiance, Attachment::onto(radiance), depth);
        reads.push(depth);
        begin = Attachment::onto;
    }
    let work = draw(
        with(&[corners, Piece::Geometry, objects, Piece::Near]),
        "near_vertex",
        "near",
        vec![Attachment::onto(radiance)],
        Some(begin(depth)),
        opaque,
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
        met.map(Attachment::fresh).to_vec(),
        Some(Attachment::onto(depth)),
        surface.clone(),
    );
    let work = Work {
        bind: bind.clone(),
        ..work
    };
    graph.pass("places met", &depth_and, &met, work);
    depth_and.push(radiance);
    let work = draw(
        with(&looks),
        "surface_vertex",
        "surface",
        vec![target.last_if(!facts.spray)],
        Some(Attachment::onto(depth)),
        surface,
    );
    let work = Work { bind, ..work };
    graph.pass("water surface", &depth_and, &target.written(!facts.spray), work);
    if facts.spray {
        let work = draw(
            with(&[Piece::Trace, Piece::FullScreen, Piece::Droplets]),
            "fullscreen",
            "droplets",
            vec![target.last_if(true)],
            Some(Attachment::onto(depth)),
            whole(),
        );
        graph.pass("droplets", &depth_and, &target.written(true), work);
    }
    let picture = accumulate(graph, facts, target.resolved);
    Passes {
        graph: std::mem::take(graph),
        picture,
        met,
        depth,
    }
}
