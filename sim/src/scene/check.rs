//! Holds the tree of a scene file against the schema: unknown keys, wrong types, units and ranges.
//!
//! What comes out can always be deserialised: a value that cannot be used is told, left out or replaced by a
//! placeholder, and marked, so that the rest can be checked too.

use super::document::{Node, Number, Value};
use super::report::Report;
use super::schema::{Key, Kind, Plain, Range, SOLVER, Variant};
use super::suggest;
use super::units::Quantity;
use crate::frame::Channels;
use glam::{DQuat, DVec3};
use std::collections::BTreeMap;
use toml::Value as Toml;

/// How far the length of a quaternion may be from 1: enough for three decimals a component.
const UNIT_TOLERANCE: f64 = 2e-3;

/// The scene's root table in the form that [`super::description::Description`] is made from.
pub(crate) fn scene(root: &Node, keys: &'static [Key], report: &mut Report) -> toml::Table {
    match &root.value {
        Value::Table(entries) => table(entries, keys, &[], "", report),
        _ => toml::Table::new(),
    }
}

fn join(path: &str, key: &str) -> String {
    if path.is_empty() {
        key.to_string()
    } else {
        format!("{path}.{key}")
    }
}

/// Checks the keys of one table. `siblings` are the other forms that the table could have had.
fn table(
    entries: &BTreeMap<String, Node>,
    keys: &'static [Key],
    siblings: &'static [Variant],
    path: &str,
    report: &mut Report,
) -> toml::Table {
    let mut out = toml::Table::new();
    for (name, node) in entries {
        if !siblings.is_empty() && name == "kind" {
            continue;
        }
        let at = join(path, name);
        match keys.iter().find(|k| k.name == name) {
            Some(key) => {
                if let Some(value) = value(node, key.kind, &at, report) {
                    out.insert(name.clone(), value);
                }
            }
            None => {
                report.at_lazily(&at, || unknown_key(name, keys, siblings));
            }
        }
    }
    for key in keys.iter().filter(|k| k.required) {
        let at = join(path, key.name);
        if !entries.contains_key(key.name) {
            report.unusable(
                &at,
                format!("`{}` is missing", key.name),
                format!("add it: {}", expected(key.kind)),
            );
        }
        if !out.contains_key(key.name) {
            out.insert(key.name.to_string(), placeholder(key.kind));
        }
    }
    out
}

fn unknown_key(name: &str, keys: &[Key], siblings: &[Variant]) -> (String, String) {
    let known = || keys.iter().map(|k| k.name);
    let message = format!("unknown key `{}`", shorten(name));
    let owners: Vec<_> = siblings
        .iter()
        .filter(|v| v.keys.iter().any(|k| k.name == name))
        .map(|v| format!("\"{}\"", v.name))
        .collect();
    let mut remedy = match suggest::nearest(name, known()) {
        Some(near) => format!("did you mean `{near}`?"),
        None if !owners.is_empty() => format!("it belongs to kind = {}", owners.join(" or ")),
        None if keys.is_empty() => "remove it: there are no keys here besides `kind`".to_string(),
        None => format!("known here: {}", known().collect::<Vec<_>>().join(", ")),
    };
    if remedy.is_empty() {
        remedy = "remove it".into();
    }
    (message, remedy)
}

/// Texts from files end up in messages; long ones are cut.
fn shorten(text: &str) -> String {
    if text.chars().count() <= 60 {
        text.to_string()
    } else {
        text.chars().take(60).chain(['…']).collect()
    }
}

/// Checks one value. `None` if it cannot be used; that is then reported.
fn value(node: &Node, kind: Kind, path: &str, report: &mut Report) -> Option<Toml> {
    match (kind, &node.value) {
        (Kind::Text | Kind::File, Value::Text(text)) if text.trim().is_empty() => {
            report.unusable(path, "the text is empty", expected(kind));
            None
        }
        (Kind::File, Value::Text(text)) if text.contains('\0') => {
            report.unusable(path, "the file name contains a zero byte", expected(kind));
            None
        }
        (Kind::Text | Kind::File, Value::Text(text)) => Some(Toml::String(text.clone())),
        (Kind::Boolean, Value::Boolean(b)) => Some(Toml::Boolean(*b)),
        (Kind::Seed, Value::Number(n)) => seed(n, path, report),
        (Kind::Seed, Value::Text(text)) => {
            let digits = text
                .strip_prefix("0x")
                .and_then(|t| u64::from_str_radix(t, 16).ok());
            if digits.is_none() {
                report.unusable(
                    path,
                    format!("\"{}\" is not a seed", shorten(text)),
                    expected(kind),
                );
            }
            digits.map(|_| Toml::String(text.clone()))
        }
        (Kind::Number(quantity, range), _) => number(node, quantity, range, false, path, report),
        (Kind::Wide(quantity, range), _) => number(node, quantity, range, true, path, report),
        (Kind::Vector(n, quantity, range), Value::List(items)) => {
            vector(items, n, kind, path, report, |item, at, report| {
                number(item, quantity, range, false, at, report)
            })
        }
        (Kind::WideVector(n, quantity, range), Value::List(items)) => {
            vector(items, n, kind, path, report, |item, at, report| {
                number(item, quantity, range, true, at, report)
            })
        }
        (Kind::Counts(n), Value::List(items)) => vector(items, n, kind, path, report, count),
        (Kind::Rotation, Value::List(items)) => quaternion(items, path, report),
        (Kind::Rotation, Value::Table(entries)) => axis_and_angle(entries, path, report),
        (Kind::Choice(choices), Value::Text(text)) => choice(text, choices, path, report),
        (Kind::Channels, Value::List(items)) => Some(channels(items, path, report)),
        (Kind::Table(keys), Value::Table(entries)) => {
            Some(Toml::Table(table(entries, keys, &[], path, report)))
        }
        (Kind::Tables(keys), Value::List(items)) => Some(list(
            items,
            Kind::Table(keys),
            path,
            report,
            |entries, at, report| Some(Toml::Table(table(entries, keys, &[], at, report))),
        )),
        (Kind::Tagged(variants), Value::Table(entries)) => tagged(entries, variants, path, report),
        (Kind::Solver, Value::Table(entries)) => tagged(entries, SOLVER, path, report),
        (Kind::TaggedTables(variants), Value::List(items)) => Some(list(
            items,
            Kind::Tagged(variants),
            path,
            report,
            |entries, at, report| tagged(entries, variants, at, report),
        )),
        (_, found) => {
            report.unusable(
                path,
                format!("expected {}, found {}", name_of(kind), found.kind()),
                hint(kind, found, path),
            );
            None
        }
    }
}

fn seed(n: &Number, path: &str, report: &mut Report) -> Option<Toml> {
    let Some(seed) = n.integer.and_then(|k| u64::try_from(k).ok()) else {
        report.unusable(
            path,
            format!("{} is not a whole number from 0 to 2^64 - 1", Plain(n.wide)),
            expected(Kind::Seed),
        );
        return None;
    };
    // TOML's own integers end at 2^63 - 1.
    Some(i64::try_from(seed).map_or_else(|_| Toml::String(format!("{seed:#x}")), Toml::Integer))
}

fn count(node: &Node, path: &str, report: &mut Report) -> Option<Toml> {
    match &node.value {
        Value::Number(n) => match n.integer.and_then(|k| u32::try_from(k).ok()) {
            Some(k) => Some(Toml::Integer(i64::from(k))),
            None => {
                let message = format!("{} is not a whole number from 0 to 4294967295", Plain(n.wide));
                report.unusable(path, message, "write a whole number");
                None
            }
        },
        found => {
            report.unusable(
                path,
                format!("expected a whole number, found {}", found.kind()),
                "write a whole number",
            );
            None
        }
    }
}

fn number(
    node: &Node,
    quantity: Quantity,
    range: Range,
    wide: bool,
    path: &str,
    report: &mut Report,
) -> Option<Toml> {
    let n = match &node.value {
        Value::Number(n) => *n,
        Value::Text(text) => match quantity.parse(text) {
            Ok(value) => Number::from(value),
            Err((message, remedy)) => {
                report.unusable(path, shorten_message(message), remedy);
                return None;
            }
        },
        found => {
            report.unusable(
                path,
                format!("expected {}, found {}", quantity.with_article(), found.kind()),
                quantity.remedy(),
            );
            return None;
        }
    };
    // What counts is the value that will be used, after rounding to its type.
    let value = if wide { n.wide } else { f64::from(n.narrow) };
    if !range.contains(value, wide) {
        let unit = quantity.base_unit();
        let space = if unit.is_empty() { "" } else { " " };
        let message = if n.wide.is_finite() {
            format!("{}{space}{unit} is out of range", Plain(n.wide))
        } else {
            format!("{} is not a finite number", n.wide)
        };
        report.unusable(
            path,
            message,
            format!("write {}, {range}{space}{unit}", quantity.with_article()),
        );
        return None;
    }
    Some(Toml::Float(value))
}

fn shorten_message(message: String) -> String {
    if message.chars().count() <= 160 {
        message
    } else {
        message.chars().take(160).chain(['…']).collect()
    }
}

/// A list of a fixed number of elements.
fn vector(
    items: &[Node],
    count: usize,
    kind: Kind,
    path: &str,
    report: &mut Report,
    element: impl Fn(&Node, &str, &mut Report) -> Option<Toml>,
) -> Option<Toml> {
    if items.len() != count {
        report.unusable(
            path,
            format!("{} values where {count} are needed", items.len()),
            expected(kind),
        );
        return None;
    }
    let values: Vec<_> = items
        .iter()
        .enumerate()
        .map(|(k, item)| element(item, &join(path, &k.to_string()), report))
        .collect();
    values.into_iter().collect::<Option<Vec<_>>>().map(Toml::Array)
}

const COMPONENT: Range = Range::new(-1.0 - UNIT_TOLERANCE, 1.0 + UNIT_TOLERANCE);

fn quaternion(items: &[Node], path: &str, report: &mut Report) -> Option<Toml> {
    let parts = vector(items, 4, Kind::Rotation, path, report, |item, at, report| {
        number(item, Quantity::Number, COMPONENT, false, at, report)
    })?;
    let square: f64 = parts
        .as_array()?
        .iter()
        .filter_map(Toml::as_float)
        .map(|v| v * v)
        .sum();
    if (square.sqrt() - 1.0).abs() > UNIT_TOLERANCE {
        let message = format!("the quaternion has length {:.4}, not 1", square.sqrt());
        report.unusable(path, message, expected(Kind::Rotation));
        return None;
    }
    Some(parts)
}

/// The keys of a rotation that is written as axis and angle.
const AXIS_AND_ANGLE: &[Key] = &[
    Key {
        name: "axis",
        kind: Kind::Vector(3, Quantity::Number, Range::new(-1e3, 1e3)),
        required: true,
    },
    Key {
        name: "angle",
        kind: Kind::Number(Quantity::Angle, Range::new(-360.0, 360.0)),
        required: true,
    },
];

fn axis_and_angle(entries: &BTreeMap<String, Node>, path: &str, report: &mut Report) -> Option<Toml> {
    let before = report.unusable_count();
    let parts = table(entries, AXIS_AND_ANGLE, &[], path, report);
    if report.unusable_count() > before {
        return None;
    }
    let axis: Vec<f64> = parts
        .get("axis")?
        .as_array()?
        .iter()
        .filter_map(Toml::as_float)
        .collect();
    let Some(axis) = DVec3::from_slice(axis.get(..3)?).try_normalize() else {
        report.unusable(
            &join(path, "axis"),
            "the axis has no direction",
            "write an axis such as [0, 1, 0]",
        );
        return None;
    };
    let turn = DQuat::from_axis_angle(axis, parts.get("angle")?.as_float()?.to_radians()).as_quat();
    Some(Toml::Array(
        turn.to_array().map(|v| Toml::Float(f64::from(v))).to_vec(),
    ))
}

fn choice(text: &str, choices: &[&str], path: &str, report: &mut Report) -> Option<Toml> {
    if choices.contains(&text) {
        return Some(Toml::String(text.to_string()));
    }
    let (message, remedy) = unknown_choice(text, choices);
    report.unusable(path, message, remedy);
    None
}

fn unknown_choice(text: &str, choices: &[&str]) -> (String, String) {
    let all = choices
        .iter()
        .map(|c| format!("\"{c}\""))
        .collect::<Vec<_>>()
        .join(", ");
    let remedy = match suggest::nearest(text, choices.iter().copied()) {
        Some(near) => format!("did you mean \"{near}\"? Known: {all}"),
        None => format!("known: {all}"),
    };
    (format!("\"{}\" is not known here", shorten(text)), remedy)
}

fn channels(items: &[Node], path: &str, report: &mut Report) -> Toml {
    let known: Vec<_> = Channels::names().collect();
    let mut names: Vec<String> = Vec::new();
    for (k, item) in items.iter().enumerate() {
        let at = join(path, &k.to_string());
        match &item.value {
            Value::Text(name) if names.contains(name) => {
                report.unusable(&at, format!("channel \"{name}\" is named twice"), "remove one");
            }
            Value::Text(name) => {
                if choice(name, &known, &at, report).is_some() {
                    names.push(name.clone());
                }
            }
            found => report.unusable(
                &at,
                format!("expected the name of a channel, found {}", found.kind()),
                format!("known: {}", known.join(", ")),
            ),
        }
    }
    Toml::Array(names.into_iter().map(Toml::String).collect())
}

/// A list of tables. An element that cannot be used is replaced by a placeholder, so that the others keep their places.
fn list(
    items: &[Node],
    element_kind: Kind,
    path: &str,
    report: &mut Report,
    element: impl Fn(&BTreeMap<String, Node>, &str, &mut Report) -> Option<Toml>,
) -> Toml {
    let checked = items.iter().enumerate().map(|(k, item)| {
        let at = join(path, &k.to_string());
        let usable = match &item.value {
            Value::Table(entries) => element(entries, &at, report),
            found => {
                report.unusable(
                    &at,
                    format!("expected a table, found {}", found.kind()),
                    format!("write [[{path}]]"),
                );
                None
            }
        };
        usable.unwrap_or_else(|| placeholder(element_kind))
    });
    Toml::Array(checked.collect())
}

fn tagged(
    entries: &BTreeMap<String, Node>,
    variants: &'static [Variant],
    path: &str,
    report: &mut Report,
) -> Option<Toml> {
    let names: Vec<_> = variants.iter().map(|v| v.name).collect();
    let at = join(path, "kind");
    let refuse = |report: &mut Report, (message, remedy): (String, String)| {
        report.at(&at, message, remedy);
        report.mark_unusable(path);
        None
    };
    let all = || {
        names
            .iter()
            .map(|n| format!("\"{n}\""))
            .collect::<Vec<_>>()
            .join(", ")
    };
    let Some(kind) = entries.get("kind") else {
        return refuse(
            report,
            ("`kind` is missing".into(), format!("add kind = one of {}", all())),
        );
    };
    let Value::Text(kind) = &kind.value else {
        let message = format!("expected a text, found {}", kind.value.kind());
        return refuse(report, (message, format!("write one of {}", all())));
    };
    let Some(variant) = variants.iter().find(|v| v.name == kind) else {
        return refuse(report, unknown_choice(kind, &names));
    };
    let mut out = table(entries, variant.keys, variants, path, report);
    out.insert("kind".into(), Toml::String(kind.clone()));
    Some(Toml::Table(out))
}

/// Name of a type, with its article.
fn name_of(kind: Kind) -> String {
    match kind {
        Kind::Text => "a text".into(),
        Kind::File => "a file name".into(),
        Kind::Boolean => "true or false".into(),
        Kind::Seed => "a whole number".into(),
        Kind::Number(q, _) | Kind::Wide(q, _) => q.with_article().into(),
        Kind::Vector(n, ..) | Kind::WideVector(n, ..) => format!("a list of {n} numbers"),
        Kind::Counts(n) => format!("a list of {n} whole numbers"),
        Kind::Rotation => "a rotation".into(),
        Kind::Choice(_) => "a text".into(),
        Kind::Channels => "a list of channel names".into(),
        Kind::Table(_) | Kind::Tagged(_) | Kind::Solver => "a table".into(),
        Kind::Tables(_) | Kind::TaggedTables(_) => "a list of tables".into(),
    }
}

/// What to write for a value of this type.
fn expected(kind: Kind) -> String {
    let names = |list: &[&str]| {
        list.iter()
            .map(|n| format!("\"{n}\""))
            .collect::<Vec<_>>()
            .join(", ")
    };
    match kind {
        Kind::Text => "write a text in quotes".into(),
        Kind::File => "write the name of a file, relative to the scene file, in quotes".into(),
        Kind::Boolean => "write true or false".into(),
        Kind::Seed => "write a whole number such as 1".into(),
        Kind::Number(q, _) | Kind::Wide(q, _) => q.remedy(),
        Kind::Vector(n, q, _) | Kind::WideVector(n, q, _) => {
            let unit = if q.base_unit().is_empty() {
                String::new()
            } else {
                format!(" in {}", q.base_unit())
            };
            format!("write {n} numbers{unit}, such as {}", example(n))
        }
        Kind::Counts(n) => format!("write {n} whole numbers, such as {}", example(n)),
        Kind::Rotation => {
            "write a unit quaternion [x, y, z, w] or { axis = [0, 1, 0], angle = 30 } in degrees".into()
        }
        Kind::Choice(choices) => format!("write one of {}", names(choices)),
        Kind::Channels => format!(
            "write a list of {}",
            Channels::names().collect::<Vec<_>>().join(", ")
        ),
        Kind::Table(keys) => format!(
            "keys: {}",
            keys.iter().map(|k| k.name).collect::<Vec<_>>().join(", ")
        ),
        Kind::Tagged(variants) => {
            format!(
                "a table with kind = one of {}",
                names(&variants.iter().map(|v| v.name).collect::<Vec<_>>())
            )
        }
        Kind::Solver => expected(Kind::Tagged(SOLVER)),
        Kind::Tables(_) | Kind::TaggedTables(_) => "write a list of tables".into(),
    }
}

fn example(n: usize) -> String {
    format!(
        "[{}]",
        (1..=n).map(|k| k.to_string()).collect::<Vec<_>>().join(", ")
    )
}

/// [`expected`], or what the mistake more likely was.
fn hint(kind: Kind, found: &Value, path: &str) -> String {
    match (kind, found) {
        (Kind::Tables(_) | Kind::TaggedTables(_), Value::Table(_)) => {
            format!("write [[{path}]] with double brackets")
        }
        (Kind::Table(_) | Kind::Tagged(_), Value::List(_)) => format!("write [{path}] with single brackets"),
        (Kind::Choice(_) | Kind::Text | Kind::File, Value::Number(n)) => {
            format!("write it in quotes: \"{}\"", Plain(n.wide))
        }
        (Kind::Tagged(variants), Value::Text(text)) if variants.iter().any(|v| v.name == text) => {
            format!("write {{ kind = \"{text}\" }}")
        }
        _ => expected(kind),
    }
}

/// Something that deserialises, to go on with where a required value cannot be used.
pub(super) fn placeholder(kind: Kind) -> Toml {
    let numbers = |n: usize, v: f64| Toml::Array(vec![Toml::Float(v); n]);
    let all = |keys: &[Key]| {
        keys.iter()
            .filter(|k| k.required)
            .map(|k| (k.name.to_string(), placeholder(k.kind)))
            .collect::<toml::Table>()
    };
    match kind {
        Kind::Text | Kind::File => Toml::String("?".into()),
        Kind::Boolean => Toml::Boolean(false),
        Kind::Seed => Toml::Integer(0),
        Kind::Counts(n) => Toml::Array(vec![Toml::Integer(1); n]),
        // Rounded so that single precision represents it.
        Kind::Number(_, range) | Kind::Wide(_, range) => Toml::Float(f64::from(range.inside() as f32)),
        Kind::Vector(n, _, range) | Kind::WideVector(n, _, range) => {
            numbers(n, f64::from(range.inside() as f32))
        }
        Kind::Rotation => Toml::Array([0.0, 0.0, 0.0, 1.0].map(Toml::Float).to_vec()),
        Kind::Choice(choices) => Toml::String(choices.first().copied().unwrap_or("?").into()),
        Kind::Channels | Kind::Tables(_) | Kind::TaggedTables(_) => Toml::Array(Vec::new()),
        Kind::Table(keys) => Toml::Table(all(keys)),
        Kind::Solver => placeholder(Kind::Tagged(SOLVER)),
        Kind::Tagged(variants) => {
            let mut out = toml::Table::new();
            if let Some(first) = variants.first() {
                out = all(first.keys);
                out.insert("kind".into(), Toml::String(first.name.into()));
            }
            Toml::Table(out)
        }
    }
}
