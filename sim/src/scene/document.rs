//! The text of a scene file as a tree in which every value knows where it came from, with `--set` overrides applied.

use super::problem::Problem;
use std::collections::BTreeMap;
use std::path::Path;
use toml::de::{DeTable, DeValue};

/// Where a value was written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Origin {
    /// In the file, at this line.
    Line(u32),
    /// On the command line: the number of the override.
    Override(usize),
}

/// A value and where it was written (a table: where its header or key is).
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Node {
    pub(crate) value: Value,
    pub(crate) origin: Origin,
}

/// The kinds of value that TOML has.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Value {
    Text(String),
    Number(Number),
    Boolean(bool),
    /// Scene files have no use for times of day.
    Datetime,
    List(Vec<Node>),
    Table(BTreeMap<String, Node>),
}

/// A number as written, correctly rounded to each type that a scene may want.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Number {
    /// The value, if it was written as a whole number.
    pub(crate) integer: Option<i128>,
    pub(crate) wide: f64,
    pub(crate) narrow: f32,
}

impl From<f64> for Number {
    fn from(wide: f64) -> Self {
        Self {
            integer: None,
            wide,
            narrow: wide as f32,
        }
    }
}

impl Value {
    /// What it is, for messages.
    pub(crate) fn kind(&self) -> &'static str {
        match self {
            Self::Text(_) => "a text",
            Self::Number(_) => "a number",
            Self::Boolean(_) => "true or false",
            Self::Datetime => "a date or time of day",
            Self::List(_) => "a list",
            Self::Table(_) => "a table",
        }
    }
}

impl Node {
    /// The tree of a scene file.
    ///
    /// # Errors
    /// The first fault of syntax.
    pub(crate) fn parse(text: &str, file: &Path) -> Result<Self, Problem> {
        let lines = Lines::new(text);
        match DeTable::parse(text) {
            Ok(root) => Ok(Self {
                value: convert_table(root.get_ref(), &|at| Origin::Line(lines.of(at))),
                origin: Origin::Line(1),
            }),
            Err(error) => Err(Problem {
                file: file.to_path_buf(),
                line: error.span().map(|s| lines.of(s.start)),
                key: String::new(),
                message: format!("this is not TOML: {}", error.message().trim().replace('\n', ", ")),
                remedy: "correct the syntax at this line; the rest is checked after that".into(),
            }),
        }
    }

    /// Sets what `key=value` says; `number` is the override's own for later messages.
    ///
    /// # Errors
    /// Key, message and remedy, if the override makes no sense.
    pub(crate) fn apply(&mut self, text: &str, number: usize) -> Result<(), (String, String, String)> {
        let usage = || "write key=value, such as solver.spacing=0.5 or camera.0.fov=30".to_string();
        let Some((path, value)) = text.split_once('=') else {
            return Err((String::new(), format!("`--set {text}` has no `=`"), usage()));
        };
        let steps: Vec<&str> = path.split('.').map(str::trim).collect();
        let path = steps.join(".");
        if steps.iter().any(|s| s.is_empty()) || steps.len() > 16 {
            return Err((
                String::new(),
                format!("`--set {text}`: `{path}` is not a key"),
                usage(),
            ));
        }
        let origin = Origin::Override(number);
        let value = parse_value(value.trim(), origin).map_err(|message| {
            (
                path.clone(),
                format!("{message} (from `--set {text}`)"),
                "write the value as in a scene file".into(),
            )
        })?;
        self.set(&steps, value)
            .map_err(|(message, remedy)| (path.clone(), format!("{message} (from `--set {text}`)"), remedy))
    }

    fn set(&mut self, steps: &[&str], value: Node) -> Result<(), (String, String)> {
        let Some((step, rest)) = steps.split_first() else {
            *self = value;
            return Ok(());
        };
        // What a missing key becomes: a list if an index follows, else a table, else the value itself.
        let missing = || Node {
            value: match rest.first() {
                Some(next) if next.parse::<usize>().is_ok() => Value::List(Vec::new()),
                _ => Value::Table(BTreeMap::new()),
            },
            origin: value.origin,
        };
        match &mut self.value {
            Value::Table(entries) => entries
                .entry((*step).to_string())
                .or_insert_with(missing)
                .set(rest, value.clone()),
            Value::List(items) => {
                let count = items.len();
                let Ok(index) = step.parse::<usize>() else {
                    let remedy = format!(
                        "write an index from 0 to {} instead of `{step}`",
                        count.saturating_sub(1)
                    );
                    return Err(("this is a list".into(), remedy));
                };
                if index > count {
                    let message = format!("there is no element {index}: the list has {count}");
                    return Err((
                        message,
                        format!("write an index from 0 to {count}; {count} appends"),
                    ));
                }
                if index == count {
                    items.push(missing());
                }
                items[index].set(rest, value)
            }
            other => Err((
                format!("`{step}` is sought in {}, which has no keys", other.kind()),
                "check the path of the key".into(),
            )),
        }
    }

    /// The node at a key path, or the nearest one above it.
    pub(crate) fn nearest(&self, path: &str) -> &Self {
        let mut node = self;
        for step in path.split('.').filter(|s| !s.is_empty()) {
            let next = match &node.value {
                Value::Table(entries) => entries.get(step),
                Value::List(items) => step.parse::<usize>().ok().and_then(|k| items.get(k)),
                _ => None,
            };
            let Some(next) = next else { break };
            node = next;
        }
        node
    }
}

/// A value from the command line: TOML, or a bare text where it is not TOML.
fn parse_value(text: &str, origin: Origin) -> Result<Node, String> {
    match DeValue::parse(text) {
        Ok(value) => Ok(convert(value.get_ref(), origin, &|_| origin)),
        Err(error) if text.starts_with(['[', '{', '"', '\'']) => Err(format!(
            "`{text}` is not a TOML value: {}",
            error.message().trim().replace('\n', ", ")
        )),
        Err(_) => Ok(Node {
            value: Value::Text(text.to_string()),
            origin,
        }),
    }
}

fn convert_table(table: &DeTable<'_>, origin: &dyn Fn(usize) -> Origin) -> Value {
    let entry = |(key, value): (&toml::Spanned<_>, &toml::Spanned<DeValue<'_>>)| {
        let key_text: &std::borrow::Cow<'_, str> = key.get_ref();
        // A list of tables and its elements stand where their headers do, everything else where its key does.
        (
            key_text.to_string(),
            convert(value.get_ref(), origin(key.span().start), origin),
        )
    };
    Value::Table(table.iter().map(entry).collect())
}

fn convert(value: &DeValue<'_>, at: Origin, origin: &dyn Fn(usize) -> Origin) -> Node {
    let value = match value {
        DeValue::String(text) => Value::Text(text.to_string()),
        DeValue::Integer(digits) => match i128::from_str_radix(digits.as_str(), digits.radix()) {
            Ok(integer) => Value::Number(Number {
                integer: Some(integer),
                wide: integer as f64,
                narrow: integer as f32,
            }),
            // Beyond any integer type; as a number it is merely large.
            Err(_) => Value::Number(Number::from(digits.as_str().parse().unwrap_or(f64::INFINITY))),
        },
        DeValue::Float(digits) => Value::Number(Number {
            integer: None,
            wide: digits.as_str().parse().unwrap_or(f64::NAN),
            narrow: digits.as_str().parse().unwrap_or(f32::NAN),
        }),
        DeValue::Boolean(b) => Value::Boolean(*b),
        DeValue::Datetime(_) => Value::Datetime,
        DeValue::Array(items) => Value::List(
            items
                .iter()
                .map(|v| convert(v.get_ref(), origin(v.span().start), origin))
                .collect(),
        ),
        DeValue::Table(table) => convert_table(table, origin),
    };
    Node { value, origin: at }
}

/// Line numbers of byte positions.
struct Lines {
    starts: Vec<usize>,
}

impl Lines {
    fn new(text: &str) -> Self {
        let breaks = text.bytes().enumerate().filter(|&(_, b)| b == b'\n');
        Self {
            starts: std::iter::once(0).chain(breaks.map(|(at, _)| at + 1)).collect(),
        }
    }

    /// Line of a byte position, from 1.
    fn of(&self, at: usize) -> u32 {
        u32::try_from(self.starts.partition_point(|&s| s <= at)).unwrap_or(u32::MAX)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "\
name = 'x'
[solver]
spacing = 0.5

[[event]]
time = 1
position = [
  0.25,
  2,
]

[[event]]
time = 2
[light.sun]
elevation = 1_0.5
";

    fn tree() -> Node {
        Node::parse(TEXT, Path::new("t.toml")).unwrap()
    }

    fn line(node: &Node, path: &str) -> Origin {
        node.nearest(path).origin
    }

    #[test]
    fn every_value_knows_its_line() {
        let t = tree();
        for (path, at) in [
            ("name", 1),
            ("solver", 2),
            ("solver.spacing", 3),
            ("solver.no-such", 2),
            ("event.0", 5),
            ("event.0.position", 7),
            ("event.0.position.0", 8),
            ("event.1", 12),
            ("event.1.time", 13),
            ("light.sun", 14),
            ("light.sun.elevation", 15),
            ("", 1),
        ] {
            assert_eq!(line(&t, path), Origin::Line(at), "{path}");
        }
    }

    #[test]
    fn numbers_are_rounded_once_to_each_type() {
        // 0.1 rounds differently through f64; what counts is what `parse` gives.
        let t = Node::parse(
            "a = 16777217.0\nb = 1_000\nc = 99999999999999999999999999999999999999999",
            Path::new("t"),
        );
        let Value::Table(entries) = t.unwrap().value else {
            panic!()
        };
        let number = |k: &str| match entries[k].value {
            Value::Number(n) => n,
            _ => panic!(),
        };
        assert_eq!(number("a").narrow, "16777217.0".parse::<f32>().unwrap());
        assert_eq!(number("b").integer, Some(1000));
        assert_eq!((number("c").integer, number("c").wide), (None, 1e41));
    }

    #[test]
    fn overrides_reach_every_place() {
        let mut t = tree();
        for (n, text) in [
            "solver.spacing=2 cm",
            "event.1.time = 3.5",
            "event.2.time=4",
            "camera.0.fov=30",
            "light.sky={ kind = 'uniform', radiance = [1, 1, 1] }",
        ]
        .iter()
        .enumerate()
        {
            t.apply(text, n).unwrap();
        }
        assert_eq!(t.nearest("solver.spacing").value, Value::Text("2 cm".into()));
        assert_eq!(line(&t, "event.1.time"), Origin::Override(1));
        assert_eq!(line(&t, "event.1"), Origin::Line(12));
        assert_eq!(line(&t, "event.2.time"), Origin::Override(2));
        assert!(matches!(t.nearest("camera.0.fov").value, Value::Number(n) if n.integer == Some(30)));
        assert!(matches!(t.nearest("light.sky.kind").value, Value::Text(_)));
    }

    #[test]
    fn senseless_overrides_are_refused() {
        for (text, says) in [
            ("solver.spacing", "has no `=`"),
            ("=3", "is not a key"),
            ("a..b=3", "is not a key"),
            ("name.first=3", "in a text, which has no keys"),
            ("event.7.time=1", "there is no element 7: the list has 2"),
            ("event.first.time=1", "this is a list"),
            ("water.absorption=[1, 2", "is not a TOML value"),
        ] {
            let (_, message, remedy) = tree().apply(text, 0).unwrap_err();
            assert!(
                message.contains(says) && message.contains("--set") && !remedy.is_empty(),
                "{message}"
            );
        }
    }

    #[test]
    fn faults_of_syntax_name_their_line() {
        let problem = Node::parse("a = 1\nb = = 2\n", Path::new("bad.toml")).unwrap_err();
        assert_eq!(problem.line, Some(2));
        let twice = Node::parse("a = 1\na = 2\n", Path::new("bad.toml")).unwrap_err();
        assert_eq!(twice.line, Some(2));
        assert!(twice.message.contains("duplicate key"), "{twice}");
    }
}
