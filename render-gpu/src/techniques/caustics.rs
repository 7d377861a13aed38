//! Sunlight through the waves: photons, their sum, and its filter.

use super::{field_pieces, names, tiles};
use crate::facts::Facts;
use crate::graph::{Graph, Kind, ResourceId};
use crate::settings::Settings;
use crate::shader::Piece;
use crate::work::{Action, Cadence, Dispatch, Work};

/// Photons from the surface to the ground, their sum on the map, and its filter.
pub(super) fn caustics(
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
    let with_field = |piece: Piece| {
        let mut pieces = vec![Piece::Optics, Piece::Stage];
        pieces.extend(field_pieces(settings));
        pieces.push(piece);
        pieces
    };
    let work = |piece, entry, groups, bind, zero| Work {
        pieces: with_field(piece),
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
