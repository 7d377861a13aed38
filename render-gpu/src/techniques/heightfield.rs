//! The passes of Baboud & Décoret's technique.

use super::{Common, Passes, accumulate, draw, foreign, full_picture, met, scene_pieces, whole};
use crate::facts::Facts;
use crate::graph::{Format, ResourceId};
use crate::settings::Settings;
use crate::shader::Piece;
use crate::work::{Attachment, Work};

/// The traced picture and the places that its rays meet.
pub(super) fn heightfield(facts: &Facts, settings: &Settings, common: &mut Common) -> Passes {
    let radiance = full_picture(&mut common.graph, facts, "radiance", Format::Full);
    let depth = full_picture(&mut common.graph, facts, "depth", Format::Depth);
    let mut pieces = scene_pieces(facts, settings);
    let tracing = |more: &[Piece]| {
        [
            &scene_pieces(facts, settings)[..],
            &[Piece::Trace, Piece::FullScreen],
            more,
        ]
        .concat()
    };
    let mut reads = common.lights.clone();
    let mut begin: fn(ResourceId) -> Attachment = Attachment::fresh;
    let mut front = Piece::FrontNone;
    if facts.foreign {
        let layer = foreign(
            &mut common.graph,
            facts,
            &pieces,
            radiance,
            Attachment::fresh(radiance),
            depth,
        );
        reads.extend([radiance, depth, layer]);
        begin = Attachment::onto;
        front = Piece::FrontForeign;
    }
    let work = draw(
        tracing(&[Piece::Heightfield]),
        "fullscreen",
        "heightfield",
        vec![begin(radiance)],
        Some(begin(depth)),
        whole(),
    );
    common.graph.pass("heightfield", &reads, &[radiance, depth], work);
    let mut shown = radiance;
    if settings.switches.multisampled {
        shown = full_picture(
            &mut common.graph,
            facts,
            "radiance with smooth edges",
            Format::Full,
        );
        let work = draw(
            tracing(&[front, Piece::HeightfieldEdges]),
            "fullscreen",
            "heightfield_edges",
            vec![Attachment::fresh(shown)],
            None,
            whole(),
        );
        let work = Work {
            bind: vec![("traced", radiance)],
            ..work
        };
        reads.push(radiance);
        common.graph.pass("edges", &reads, &[shown], work);
    }
    let met = met(&mut common.graph, facts);
    pieces.extend([Piece::FullScreen, Piece::HeightfieldAux]);
    let work = draw(
        pieces,
        "fullscreen",
        "heightfield_aux",
        met.map(Attachment::fresh).to_vec(),
        None,
        whole(),
    );
    common.graph.pass("places met", &common.ready, &met, work);
    let picture = accumulate(&mut common.graph, facts, shown);
    Passes {
        graph: std::mem::take(&mut common.graph),
        picture,
        met,
        depth,
    }
}
