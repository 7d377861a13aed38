//! What the values of a scene have to do with each other.

use super::description::{
    Bed, Description, Edge, EdgeName, Event, Initial, Motion, Object, Procedural, Sky, Solver, Terrain,
};
use super::report::Report;
use crate::grid::{Grid, GridSpec};
use glam::Vec2;
use std::collections::HashMap;
use std::f32::consts::TAU;

/// Most frames of a recording.
const MAX_FRAMES: f64 = 1e7;
/// Most objects: a sphere holds a tenth of a megabyte.
const MAX_OBJECTS: usize = 1000;

/// Reports what can be told without any other file.
pub(super) fn description(d: &Description, report: &mut Report) {
    edges(d, report);
    drives(d, report);
    beds(d, report);
    initial(d, report);
    if let Solver::Procedural(p) = &d.solver {
        waves(p, report);
    }
    if let Some(Terrain::Image {
        crop: Some([_, _, w, h]),
        ..
    }) = d.terrain
        && w.min(h) < 2
        && report.usable(&["terrain"])
    {
        report.unusable(
            "terrain.crop",
            format!("a part of {w} x {h} pixels is too small"),
            "write [x, y, width, height] with at least 2 pixels a side",
        );
    }
    if d.objects.len() > MAX_OBJECTS {
        let message = format!("there are {} objects", d.objects.len());
        report.unusable("object", message, format!("write at most {MAX_OBJECTS}"));
    }
    unique(d.objects.iter().map(|o| o.name.as_str()), "object", report);
    unique(d.cameras.iter().map(|c| c.name.as_str()), "camera", report);
    for (k, object) in d.objects.iter().enumerate() {
        path(object, k, report);
    }
    light(d, report);
    for (k, camera) in d.cameras.iter().enumerate() {
        let at = |key: &str| format!("camera.{k}.{key}");
        if camera.position == camera.target && report.usable(&[&at("position"), &at("target")]) {
            let remedy = "point the camera at another place than its own";
            report.at(&at("target"), "position and target are the same", remedy);
        }
    }
    for (k, event) in d.events.iter().enumerate() {
        times(d, event, k, report);
        flow(event, k, report);
        acted_on(d, event, k, report);
    }
    let frames = d.duration * d.recording.rate;
    if frames > MAX_FRAMES && report.usable(&["duration", "recording.rate"]) {
        let message = format!(
            "{} s at {} frames a second are {frames:.0} frames",
            d.duration, d.recording.rate
        );
        report.at(
            "recording.rate",
            message,
            format!("record at most {MAX_FRAMES:.0} frames"),
        );
    }
}

fn edges(d: &Description, report: &mut Report) {
    let b = &d.boundary;
    let pairs = [
        ("x_min", b.x_min, "x_max", b.x_max),
        ("z_min", b.z_min, "z_max", b.z_max),
    ];
    for (first, a, second, b) in pairs {
        let (one, other) = (format!("boundary.{first}"), format!("boundary.{second}"));
        if (a == Edge::Periodic) != (b == Edge::Periodic) && report.usable(&[&one, &other]) {
            let (key, partner) = if a == Edge::Periodic {
                (one, second)
            } else {
                (other, first)
            };
            let message = format!("this edge is periodic, but {partner} is not");
            report.unusable(&key, message, "make both edges of an axis periodic or neither");
        }
    }
}

/// Edges that are driven, and how.
fn drives(d: &Description, report: &mut Report) {
    let b = &d.boundary;
    let mut seen = Vec::new();
    for (k, drive) in b.drives.iter().enumerate() {
        let at = format!("boundary.drive.{k}");
        if !report.usable(&[&at]) {
            continue;
        }
        if !matches!(d.solver, Solver::ShallowWater(_)) && report.usable(&["solver"]) {
            report.at(
                &at,
                "only shallow water can be driven at an edge",
                "use solver.kind = \"shallow-water\", or remove the drive",
            );
        }
        let edge = drive.edge();
        let (name, behaviour) = match edge {
            EdgeName::XMin => ("x_min", b.x_min),
            EdgeName::XMax => ("x_max", b.x_max),
            EdgeName::ZMin => ("z_min", b.z_min),
            EdgeName::ZMax => ("z_max", b.z_max),
        };
        if behaviour == Edge::Periodic {
            report.at(
                &format!("{at}.edge"),
                format!("{name} is periodic, so nothing can be driven there"),
                "drive another edge, or make this one a wall",
            );
        }
        if seen.contains(&edge) {
            report.at(
                &format!("{at}.edge"),
                format!("{name} is driven twice"),
                "keep one of the drives",
            );
        }
        seen.push(edge);
        let Some((file, points)) = drive.series() else {
            continue;
        };
        if file.is_some() && !points.is_empty() {
            report.at(
                &format!("{at}.points"),
                "the series is given by a file and by points",
                "keep one of them",
            );
        }
        if file.is_none() && points.is_empty() {
            report.unusable(
                &at,
                "the drive has no time series",
                "name a `file`, or list `points = [{ time = 0, value = 1 }]`",
            );
        }
        for (n, pair) in points.windows(2).enumerate() {
            if pair[1].time <= pair[0].time {
                report.at(
                    &format!("{at}.points.{}.time", n + 1),
                    format!("{} s does not come after {} s", pair[1].time, pair[0].time),
                    "put points in order of time",
                );
            }
        }
    }
}

/// What moves the ground.
fn beds(d: &Description, report: &mut Report) {
    for (k, bed) in d.beds.iter().enumerate() {
        let at = format!("bed.{k}");
        if !report.usable(&[&at]) {
            continue;
        }
        if !matches!(d.solver, Solver::ShallowWater(_)) && report.usable(&["solver"]) {
            report.at(
                &at,
                "the ground can only move under shallow water",
                "use solver.kind = \"shallow-water\", or remove the motion",
            );
        }
        if let Bed::Patch { min, max, .. } = bed
            && !min.cmplt(*max).all()
        {
            report.at(
                &format!("{at}.max"),
                format!("the patch from {min} to {max} has no area"),
                "write min below max along both axes",
            );
        }
        let times: Vec<f64> = match bed {
            Bed::Slide { path, .. } => {
                if path.is_empty() {
                    report.unusable(&at, "the slide has no way point", "add at least one to `path`");
                }
                path.iter().map(|p| p.time).collect()
            }
            Bed::Patch {
                series,
                points,
                start,
                rise,
                ..
            }
            | Bed::Array {
                series,
                points,
                start,
                rise,
                ..
            } => {
                let timed = *start != 0.0 || *rise != 0.0;
                if usize::from(series.is_some()) + usize::from(!points.is_empty()) + usize::from(timed) > 1 {
                    report.at(
                        &at,
                        "the time of the motion is given twice",
                        "keep one of `start` with `rise`, `points`, and `series`",
                    );
                }
                points.iter().map(|p| p.time).collect()
            }
        };
        let list = if matches!(bed, Bed::Slide { .. }) {
            "path"
        } else {
            "points"
        };
        increasing(&format!("{at}.{list}"), &times, report);
    }
}

/// Reports the first time of a list of points that does not come after the one before.
fn increasing(at: &str, times: &[f64], report: &mut Report) {
    if let Some(n) = times.windows(2).position(|pair| pair[1] <= pair[0]) {
        report.at(
            &format!("{at}.{}.time", n + 1),
            format!("{} s does not come after {} s", times[n + 1], times[n]),
            "put points in order of time",
        );
    }
}

/// How much flows in an inflow must be told once.
fn flow(event: &Event, k: usize, report: &mut Report) {
    let at = format!("event.{k}");
    if let Event::Inflow {
        flow, series, points, ..
    } = event
        && report.usable(&[&at])
    {
        let given =
            usize::from(flow.is_some()) + usize::from(series.is_some()) + usize::from(!points.is_empty());
        if given != 1 {
            let what = if given == 0 { "missing" } else { "given twice" };
            report.unusable(
                &at,
                format!("the flow is {what}"),
                "write one of `flow`, `series` and `points = [{ time = 0, value = 1 }]`",
            );
        }
        let times: Vec<f64> = points.iter().map(|p| p.time).collect();
        increasing(&format!("{at}.points"), &times, report);
    }
}

/// Reports a time series that was to come from a file which was not read.
pub(super) fn series_are_there(d: &Description, report: &mut Report) {
    for (k, drive) in d.boundary.drives.iter().enumerate() {
        let at = format!("boundary.drive.{k}");
        if drive.series().is_some_and(|(_, points)| points.is_empty()) && report.usable(&[&at]) {
            report.at(
                &at,
                "the time series is missing",
                "give its points with the description",
            );
        }
    }
}

fn initial(d: &Description, report: &mut Report) {
    if let Initial::Dam { min, max, .. } = &d.water.initial
        && !min.cmplt(*max).all()
        && report.usable(&["water.initial"])
    {
        let message = format!("the reservoir from {min} to {max} has no area");
        report.at(
            "water.initial.max",
            message,
            "write min below max along both axes",
        );
    }
}

/// A Gerstner surface with more than full orbital motion folds over itself and is no heightfield.
fn waves(p: &Procedural, report: &mut Report) {
    let folding: f32 = p
        .waves
        .iter()
        .map(|w| w.steepness * TAU / w.wavelength * w.amplitude)
        .sum();
    if folding > 1.0 && report.usable(&["solver"]) {
        let message = format!(
            "the waves fold over: steepness times 2 pi amplitude / wavelength sums up to {folding:.3}"
        );
        report.at(
            "solver.wave",
            message,
            "lower amplitudes or steepness until the sum is at most 1",
        );
    }
}

fn unique<'a>(names: impl Iterator<Item = &'a str>, list: &str, report: &mut Report) {
    let mut seen: HashMap<&str, usize> = HashMap::new();
    for (k, name) in names.enumerate() {
        let at = format!("{list}.{k}.name");
        if !report.usable(&[&at]) {
            continue;
        }
        if let Some(first) = seen.insert(name, k) {
            report.at(
                &at,
                format!("\"{name}\" is already the name of {list} {first}"),
                "give each its own name",
            );
        }
    }
}

fn path(object: &Object, k: usize, report: &mut Report) {
    let Motion::Path { points } = &object.motion else {
        return;
    };
    let at = format!("object.{k}.motion.points");
    if !report.usable(&[&at]) {
        return;
    }
    if points.is_empty() {
        report.at(
            &at,
            "the path has no way point",
            "add at least one, or write motion = { kind = \"fixed\" }",
        );
    }
    for (n, pair) in points.windows(2).enumerate() {
        if pair[1].time <= pair[0].time {
            let message = format!(
                "way point {} at {} s does not come after the one at {} s",
                n + 1,
                pair[1].time,
                pair[0].time
            );
            report.at(
                &format!("{at}.{}.time", n + 1),
                message,
                "put way points in order of time",
            );
        }
    }
}

fn light(d: &Description, report: &mut Report) {
    if !matches!(d.light.sky, Sky::Daylight { .. }) || !report.usable(&["light"]) {
        return;
    }
    match &d.light.sun {
        None => report.at(
            "light.sky.kind",
            "daylight depends on the position of the sun, and there is no sun",
            "add [light.sun] with elevation and azimuth",
        ),
        Some(sun) if sun.elevation < 0.0 => report.at(
            "light.sun.elevation",
            format!(
                "the daylight model has no sun {} deg below the horizon",
                -sun.elevation
            ),
            "write an elevation of 0 to 90 deg, or use another sky",
        ),
        Some(_) => {}
    }
}

fn acted_on(d: &Description, event: &Event, k: usize, report: &mut Report) {
    let (Event::Drag { body, .. } | Event::Shove { body, .. }) = event else {
        return;
    };
    let at = format!("event.{k}.body");
    let dragged = matches!(event, Event::Drag { .. });
    let can = |o: &Object| {
        o.name == *body
            && if dragged {
                d.can_drag(o)
            } else {
                o.motion == Motion::Free
            }
    };
    if !d.objects.iter().any(can) && report.usable(&["object", &at]) {
        report.at(
            &at,
            format!("there is no free object \"{body}\""),
            "name an object with motion = { kind = \"free\" }",
        );
    }
}

fn times(d: &Description, event: &Event, k: usize, report: &mut Report) {
    let at = |key: &str| format!("event.{k}.{key}");
    let (key, start, end) = match *event {
        Event::Drop { time, .. }
        | Event::Press { time, .. }
        | Event::Push { time, .. }
        | Event::Shove { time, .. }
        | Event::Tilt { time, .. } => ("time", time, None),
        Event::Sweep { start, end, .. } | Event::Drag { start, end, .. } => ("start", start, Some(end)),
        Event::Rain { start, end, .. } | Event::Inflow { start, end, .. } => ("start", start, end),
    };
    if let Some(end) = end
        && end <= start
        && report.usable(&[&at("start"), &at("end")])
    {
        report.at(
            &at("end"),
            format!("the end at {end} s is not after the start at {start} s"),
            "write an end after the start",
        );
    }
    if start > d.duration && !report.allows_late_events() && report.usable(&["duration", &at(key)]) {
        let message = format!("{start} s is after the scene's duration of {} s", d.duration);
        report.at(&at(key), message, "move the event or lengthen `duration`");
    }
}

/// Reports what lies where there is no water, once the grid is known.
pub(super) fn places(d: &Description, grid: &GridSpec, report: &mut Report) {
    let (low, high) = (grid.origin, grid.origin + grid.extent());
    let misses = |min: Vec2, max: Vec2| min.cmpgt(high).any() || max.cmplt(low).any();
    let domain = format!("X {} to {}, Z {} to {}", low.x, high.x, low.y, high.y);
    let mut check = |at: &str, key: &str, min: Vec2, max: Vec2| {
        if misses(min, max) && report.usable(&[at]) {
            let message = format!("this lies outside the domain ({domain}) and touches no water");
            report.at(&format!("{at}.{key}"), message, "move it into the domain");
        }
    };
    match d.water.initial {
        Initial::Dam { min, max, .. } => check("water.initial", "min", min, max),
        Initial::Disturbance { position, .. } => check("water.initial", "position", position, position),
        Initial::Still | Initial::Array { .. } => {}
    }
    for (k, event) in d.events.iter().enumerate() {
        let at = format!("event.{k}");
        match *event {
            Event::Drop { position, radius, .. }
            | Event::Press { position, radius, .. }
            | Event::Push { position, radius, .. }
            | Event::Inflow { position, radius, .. } => {
                check(&at, "position", position - radius, position + radius)
            }
            Event::Sweep { from, to, radius, .. } => {
                check(&at, "from", from.min(to) - radius, from.max(to) + radius)
            }
            Event::Rain { .. } | Event::Drag { .. } | Event::Shove { .. } | Event::Tilt { .. } => {}
        }
    }
}

/// Reports a solver that needs a ground and has none, and a sea without water.
pub(super) fn ground(
    d: &Description,
    terrain: Option<&Grid<f32>>,
    initial_elevation: Option<&Grid<f32>>,
    report: &mut Report,
) {
    if !report.usable(&["terrain", "water", "solver.kind"]) {
        return;
    }
    match (&d.solver, terrain) {
        (Solver::ShallowWater(_), None) => report.at(
            "solver.kind",
            "shallow water needs a ground, and there is no [terrain]",
            "add a terrain, such as kind = \"flat\" with a height below water.level",
        ),
        (Solver::Sph(_), None) => report.at(
            "solver.kind",
            "a tank needs a bottom, and there is no [terrain]",
            "add a terrain, such as kind = \"flat\" with a height below water.level",
        ),
        // Shallow water may begin on dry ground; the wave equation has no moving shoreline.
        (Solver::WaveEquation(_), Some(terrain)) => {
            let level = match (&d.water.initial, initial_elevation) {
                (Initial::Dam { level, .. }, _) => level.max(d.water.level),
                (_, Some(elevation)) => elevation.range().1,
                _ => d.water.level,
            };
            let lowest = terrain.range().0;
            if lowest >= level {
                let message =
                    format!("the ground, {lowest} m at its lowest, is nowhere below the water at {level} m");
                let key = if d.terrain.is_some() {
                    "terrain"
                } else {
                    "water.level"
                };
                report.at(key, message, "lower the ground or raise water.level");
            }
        }
        _ => {}
    }
}
