//! Holds `docs/scene-file.md` against the schema and the schema against the description.

use super::description::Description;
use super::schema::{ANYWHERE, Key, Kind, NOT_NEGATIVE, POSITIVE, Range, SCENE, Variant};
use super::units::Quantity;
use crate::frame::Channels;
use std::collections::BTreeMap;
use std::path::Path;
use toml::Value as Toml;

const PAGE: &str = include_str!("../../../docs/scene-file.md");

/// A row of a table: type, unit, default, range, as they stand in the page.
#[derive(Debug, PartialEq)]
struct Row {
    kind: String,
    unit: String,
    default: String,
    range: String,
}

/// The tables of the page by heading, each with its rows by key.
fn page() -> BTreeMap<String, BTreeMap<String, Row>> {
    let mut sections: BTreeMap<String, BTreeMap<String, Row>> = BTreeMap::new();
    let mut heading = String::new();
    for line in PAGE.lines() {
        if let Some(title) = line.strip_prefix('#') {
            heading = title.trim_start_matches('#').trim().to_string();
            assert!(
                sections.insert(heading.clone(), BTreeMap::new()).is_none(),
                "{heading} is there twice"
            );
        } else if line.starts_with("| `") {
            let cells: Vec<&str> = line.trim_matches('|').split('|').map(str::trim).collect();
            let [key, kind, unit, default, range, meaning] = cells[..] else {
                panic!("cells: {line}")
            };
            assert!(meaning.len() > 3, "{heading}: {key} says nothing");
            let text = |s: &str| s.to_string();
            let row = Row {
                kind: text(kind),
                unit: text(unit),
                default: text(default),
                range: text(range),
            };
            let rows = sections.get_mut(&heading).unwrap();
            assert!(
                rows.insert(key.trim_matches('`').to_string(), row).is_none(),
                "{heading}: {key} twice"
            );
        }
    }
    sections
}

/// One table of the schema.
struct Section {
    heading: String,
    keys: &'static [Key],
    /// How to get from the root of a scene to such a table: names of keys and, for tables with a kind, the form.
    path: Vec<(&'static str, Option<&'static Variant>)>,
}

fn sections() -> Vec<Section> {
    let mut out = vec![Section {
        heading: "Scene".into(),
        keys: SCENE,
        path: Vec::new(),
    }];
    let mut next = 0;
    while next < out.len() {
        let (keys, path) = (out[next].keys, out[next].path.clone());
        for key in keys {
            let mut inner = path.clone();
            inner.push((key.name, None));
            let dotted = inner.iter().map(|(name, _)| *name).collect::<Vec<_>>().join(".");
            match key.kind {
                Kind::Table(keys) | Kind::Tables(keys) => {
                    let heading = format!("`{dotted}`");
                    if out.iter().all(|s| s.heading != heading) {
                        out.push(Section {
                            heading,
                            keys,
                            path: inner,
                        });
                    }
                }
                Kind::Tagged(variants) | Kind::TaggedTables(variants) => {
                    for variant in variants {
                        let mut inner = path.clone();
                        inner.push((key.name, Some(variant)));
                        let heading = format!("`{dotted}` = `{}`", variant.name);
                        // Forms of a list that share a table say it once.
                        if out.iter().all(|s| s.heading != heading) {
                            out.push(Section {
                                heading,
                                keys: variant.keys,
                                path: inner,
                            });
                        }
                    }
                }
                _ => {}
            }
        }
        next += 1;
    }
    out
}

fn or_list(items: &[&str]) -> String {
    let quoted: Vec<String> = items.iter().map(|i| format!("`{i}`")).collect();
    match quoted.split_last() {
        Some((last, rest)) if !rest.is_empty() => format!("{} or {last}", rest.join(", ")),
        _ => quoted.join(""),
    }
}

/// Type, quantity and range as the page writes them.
fn described(kind: Kind) -> (String, String, String) {
    let range = |r: Range| match r {
        ANYWHERE => "any".to_string(),
        POSITIVE => "> 0".to_string(),
        NOT_NEGATIVE => "≥ 0".to_string(),
        other => other.to_string(),
    };
    let number = |text: String, q: Quantity, r: Range| (text, q.base_unit().to_string(), range(r));
    let plain = |text: &str| (text.to_string(), String::new(), String::new());
    match kind {
        Kind::Text => plain("text"),
        Kind::File => plain("file"),
        Kind::Boolean => plain("true or false"),
        Kind::Seed => plain("whole number"),
        Kind::Counts(n) => plain(&format!("{n} whole numbers")),
        Kind::Number(q, r) | Kind::Wide(q, r) => number("number".into(), q, r),
        Kind::Vector(n, q, r) | Kind::WideVector(n, q, r) => number(format!("{n} numbers"), q, r),
        Kind::Rotation => plain("rotation"),
        Kind::Choice(choices) => plain(&or_list(choices)),
        Kind::Channels => {
            let names: Vec<String> = Channels::names().map(|n| format!("`{n}`")).collect();
            plain(&format!("list of {}", names.join(", ")))
        }
        Kind::Table(_) => plain("table"),
        Kind::Solver => plain("table as `solver`"),
        Kind::Tables(_) => plain("list of tables"),
        Kind::Tagged(_) => plain("table with `kind`"),
        Kind::TaggedTables(_) => plain("list of tables with `kind`"),
    }
}

/// A smallest scene in which the section's table is there, with `set` in it if given.
fn smallest(section: &Section, set: Option<(&str, Toml)>) -> toml::Table {
    let mut root = required(SCENE);
    let mut table = &mut root;
    let mut keys = SCENE;
    for &(name, variant) in &section.path {
        let key = keys.iter().find(|k| k.name == name).unwrap();
        keys = match (key.kind, variant) {
            (Kind::Table(keys) | Kind::Tables(keys), _) => keys,
            (_, Some(variant)) => variant.keys,
            _ => unreachable!("not a table"),
        };
        let mut inner = required(keys);
        if let Some(variant) = variant {
            inner.insert("kind".into(), Toml::String(variant.name.into()));
        }
        let is_list = matches!(key.kind, Kind::Tables(_) | Kind::TaggedTables(_));
        let value = if is_list {
            Toml::Array(vec![Toml::Table(inner)])
        } else {
            Toml::Table(inner)
        };
        table.insert(name.into(), value);
        table = match table.get_mut(name) {
            Some(Toml::Array(items)) => items[0].as_table_mut().unwrap(),
            other => other.unwrap().as_table_mut().unwrap(),
        };
    }
    if let Some((key, value)) = set {
        table.insert(key.into(), value);
    }
    root
}

fn required(keys: &[Key]) -> toml::Table {
    let present = keys.iter().filter(|k| k.required);
    present
        .map(|k| (k.name.to_string(), super::check::placeholder(k.kind)))
        .collect()
}

/// The section's table in a scene that was read and written again.
fn written(section: &Section, scene: &Description) -> toml::Table {
    let mut value = Toml::try_from(scene).unwrap();
    for (name, _) in &section.path {
        value = match value.get(*name).unwrap().clone() {
            Toml::Array(mut items) => items.swap_remove(0),
            other => other,
        };
    }
    value.as_table().unwrap().clone()
}

#[test]
fn the_page_has_every_key_and_says_what_is_true() {
    let mut page = page();
    for section in sections() {
        let heading = &section.heading;
        let rows = page
            .remove(heading)
            .unwrap_or_else(|| panic!("docs/scene-file.md has no section {heading}"));
        let listed: Vec<&str> = rows.keys().map(String::as_str).collect();
        let mut known: Vec<&str> = section.keys.iter().map(|k| k.name).collect();
        known.sort_unstable();
        assert_eq!(listed, known, "keys of {heading}");
        for key in section.keys {
            let row = &rows[key.name];
            let what = format!("{heading}: {}", key.name);
            let (kind, unit, range) = described(key.kind);
            assert_eq!(
                (&row.kind, &row.unit, &row.range),
                (&kind, &unit, &range),
                "type, unit and range of {what}"
            );
            check_default(&section, key, &row.default, &what);
        }
    }
    // What is left are chapters that only introduce others.
    for (heading, rows) in page {
        assert!(
            rows.is_empty(),
            "docs/scene-file.md has a table {heading} that scenes do not have"
        );
    }
}

/// The documented default, written out, must give the scene that leaving it out gives.
fn check_default(section: &Section, key: &Key, default: &str, what: &str) {
    let without: Description = smallest(section, None).try_into().unwrap();
    let is_written = written(section, &without).contains_key(key.name);
    match (default, key.required) {
        ("required", required) => assert!(required, "{what} is not required"),
        (_, true) => panic!("{what} is required"),
        ("none", _) => assert!(!is_written, "{what} has a default"),
        // A table all of whose keys have defaults.
        ("", _) => assert!(
            matches!(key.kind, Kind::Table(_)) && is_written,
            "{what} has no default"
        ),
        (text, _) => {
            let text = text.trim_matches('`');
            let value = toml::from_str::<toml::Table>(&format!("v = {text}"))
                .unwrap()
                .remove("v")
                .unwrap();
            let with: Description = smallest(section, Some((key.name, value))).try_into().unwrap();
            assert_eq!(with, without, "default of {what}");
        }
    }
}

#[test]
fn every_example_of_the_page_is_right() {
    let blocks: Vec<&str> = PAGE
        .split("```toml\n")
        .skip(1)
        .map(|b| b.split("```").next().unwrap())
        .collect();
    assert!(blocks.len() > sections().len(), "an example a table");
    for block in blocks {
        let mut scene: toml::Table =
            toml::from_str("name = 'x'\nsolver = { kind = 'procedural', spacing = 1 }").unwrap();
        scene.extend(toml::from_str::<toml::Table>(block).unwrap());
        let text = toml::to_string(&scene).unwrap();
        if let Err(e) = Description::from_toml(&text, Path::new("example"), &[]) {
            panic!("{e}\n{block}");
        }
    }
}

#[test]
fn the_schema_and_the_description_have_the_same_keys() {
    for section in sections() {
        // Every key at once: whatever the schema lets pass, the description takes.
        let mut full = smallest(&section, None);
        for key in section.keys.iter().filter(|k| !k.required) {
            let with = smallest(&section, Some((key.name, super::check::placeholder(key.kind))));
            let scene: Description = with
                .clone()
                .try_into()
                .unwrap_or_else(|e| panic!("{}: {e}", section.heading));
            drop(written(&section, &scene));
            full = with;
        }
        // And the description has no key that the schema does not know.
        let scene: Description = full.try_into().unwrap();
        for name in written(&section, &scene).keys() {
            let known = section.keys.iter().any(|k| k.name == name) || name == "kind";
            assert!(known, "{}: {name} is in the description only", section.heading);
        }
    }
}
