//! The passes of Baboud & Décoret's technique.

use super::{Common, Passes, accumulate, draw, foreign, full_picture, met, scene_pieces, whole};
use crate::facts::Facts;
use crate::graph::{Format, ResourceId};
use crate::settings::Settings;
use crate::shader::Piece;
use crate::work::Attachment;

/// The traced picture and the places that its rays meet.
pub(super) fn heightfield(facts: &Facts, settings: &Settings, common: &mut Common) -> Passes {
    let radiance = full_picture(&mut common.graph, facts, "radiance", Format::Full);
    let depth = full_picture(&mut common.graph, facts, "depth", Format::Depth);
    let mut pieces = scene_pieces(facts, settings);
    let mut tracing = pieces.clone();
    tracing.extend([Piece::Trace, Piece::FullScreen, Piece::Heightfield]);
    let mut reads = common.lights.clone();
    let mut begin: fn(ResourceId) -> Attachment = Attachment::fresh;
    if facts.foreign {
        foreign(
            &mut common.graph,
            facts,
            &pieces,
            radiance,
            Attachment::fresh(radiance),
            depth,
        );
        reads.extend([radiance, depth]);
        begin = Attachment::onto;
    }
    let work = draw(
        tracing,
        "fullscreen",
        "heightfield",
        vec![begin(radiance)],
        Some(begin(depth)),
        whole(),
    );
    common.graph.pass("heightfield", &reads, &[radiance, depth], work);
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
    let picture = accumulate(&mut common.graph, facts, radiance);
    Passes {
        graph: std::mem::take(&mut common.graph),
        picture,
        met,
        depth,
    }
}
