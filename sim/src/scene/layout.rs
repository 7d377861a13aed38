//! Where the solver's samples stand.

use super::description::{Description, Edge, Terrain};
use super::report::Report;
use crate::grid::GridSpec;
use glam::{DVec2, UVec2};

/// The solver's grid: it begins at `domain.origin` (default: the terrain's first sample, else (0, 0)) and has
/// `round(size / spacing) + 1` samples along an axis, or `round(size / spacing)` along a periodic one, whose last
/// sample is one spacing before the first of the next period. `domain.size` defaults to the terrain's extent.
///
/// `None` if there is none; that is then reported, unless it follows from something reported before.
pub(super) fn grid(
    description: &Description,
    terrain: Option<&GridSpec>,
    report: &mut Report,
) -> Option<GridSpec> {
    if !report.usable(&[
        "solver.kind",
        "solver.spacing",
        "domain.origin",
        "domain.size",
        "boundary",
    ]) {
        return None;
    }
    let origin = description
        .domain
        .origin
        .or(terrain.map(|t| t.origin))
        .unwrap_or_default();
    let Some(size) = description.domain.size.or(terrain.map(GridSpec::extent)) else {
        // A terrain that could not be read would have told the size.
        let told = !matches!(description.terrain, None | Some(Terrain::Flat { .. }));
        if !told && report.usable(&["terrain"]) {
            let remedy = "add size = [x, z] in metres under [domain], or a terrain from a file";
            report.at("domain.size", "the size of the domain is not given", remedy);
        }
        return None;
    };
    let spacing = description.solver.spacing();
    let edges = &description.boundary;
    let periodic = [edges.x_min == Edge::Periodic, edges.z_min == Edge::Periodic];
    let ends = DVec2::from(periodic.map(|p| if p { 0.0 } else { 1.0 }));
    // In double precision, so that no count overflows before it is refused.
    let count = (size.as_dvec2() / f64::from(spacing)).round() + ends;
    let described = format!("{} m x {} m at a spacing of {spacing} m", size.x, size.y);
    if count.min_element() < 2.0 {
        let message = format!(
            "{described} has {:.0} x {:.0} samples; at least 2 are needed",
            count.x, count.y
        );
        report.at(
            "solver.spacing",
            message,
            "use a finer spacing or a larger domain",
        );
        return None;
    }
    let total = count.x * count.y;
    if total > GridSpec::MAX_SAMPLES as f64 {
        let message = format!(
            "{described} has {:.0} x {:.0} samples, {} a channel; a grid holds at most {} ({} a channel)",
            count.x,
            count.y,
            bytes(4.0 * total),
            GridSpec::MAX_SAMPLES,
            bytes(4.0 * GridSpec::MAX_SAMPLES as f64),
        );
        let enough = f64::from(spacing) * (total / GridSpec::MAX_SAMPLES as f64).sqrt();
        report.at(
            "solver.spacing",
            message,
            format!(
                "use a spacing of at least {:.2e} m or a smaller domain",
                1.01 * enough
            ),
        );
        return None;
    }
    // Single precision has 24 bits; with four of them left for places between two samples, the rest number the samples.
    let farthest = origin.abs().max((origin + size).abs()).max_element();
    if farthest > spacing * (1 << 20) as f32 {
        let message =
            format!("at {farthest} m from the origin, samples {spacing} m apart cannot be told apart");
        let key = if description.domain.origin.is_some() {
            "domain.origin"
        } else {
            "terrain"
        };
        report.at(key, message, "put the origin of coordinates near the domain");
        return None;
    }
    let spec = GridSpec {
        origin,
        spacing,
        size: UVec2::new(count.x as u32, count.y as u32),
    };
    if let Err(e) = spec.validate() {
        report.at("solver.spacing", e.to_string(), "check domain and spacing");
        return None;
    }
    if let Some(terrain) = terrain {
        within(&spec, terrain, report)?;
    }
    Some(spec)
}

/// Reports a domain that reaches beyond its terrain by more than a sample of either.
fn within(grid: &GridSpec, terrain: &GridSpec, report: &mut Report) -> Option<()> {
    let slack = grid.spacing.max(terrain.spacing) * 1.01;
    let (low, high) = (grid.origin, grid.origin + grid.extent());
    let (first, last) = (terrain.origin, terrain.origin + terrain.extent());
    if low.cmpge(first - slack).all() && high.cmple(last + slack).all() {
        return Some(());
    }
    let message = format!(
        "the domain covers X {} to {}, Z {} to {}, beyond the terrain's X {} to {}, Z {} to {}",
        low.x, high.x, low.y, high.y, first.x, last.x, first.y, last.y
    );
    report.at(
        "domain",
        message,
        "choose domain.origin and domain.size within the terrain",
    );
    None
}

fn bytes(count: f64) -> String {
    match count {
        b if b >= 1e12 => format!("{:.1} TB", b / 1e12),
        b if b >= 1e9 => format!("{:.1} GB", b / 1e9),
        b => format!("{:.1} MB", b / 1e6),
    }
}
