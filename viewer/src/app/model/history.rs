//! What happened from frame to frame, for plots and CSV files.

use meniscus_sim::StepReport;
use std::collections::BTreeMap;
use std::io::Write as _;
use std::path::Path;

/// Most frames that are kept; beyond, every other one goes.
const MOST: usize = 20_000;

/// Density of water that reports count with, kg/m³.
const DENSITY: f64 = 1000.0;

/// Named stages with their seconds.
pub type Stages = Vec<(&'static str, f64)>;

/// What is known of one frame.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Row {
    /// Its time in seconds.
    pub time: f64,
    /// Totals of the step that led to it.
    pub report: Option<StepReport>,
    /// Seconds that solving or decoding took, and handing it to the recording.
    pub seconds: [f64; 2],
    /// Where the time of solving went.
    pub solving: Stages,
    /// Seconds that drawing it took, where it was drawn.
    pub drawing: Option<f64>,
    /// Where that time went: passes of a graphics adapter, or stages on the processor.
    pub passes: Stages,
    /// Elevation at the probe, metres.
    pub probe: Option<f32>,
}

/// How a curve is read of a row.
#[derive(Clone, Copy, Debug)]
pub enum Read {
    /// A quantity.
    Of(fn(&Row) -> Option<f64>),
    /// Milliseconds of a stage of the solver.
    Solving(&'static str),
    /// Milliseconds of a pass, or stage, of the renderer.
    Drawing(&'static str),
}

impl Read {
    /// The value, where the row has it.
    pub fn of(&self, row: &Row) -> Option<f64> {
        let stage = |stages: &Stages, name: &str| {
            let found = stages.iter().find(|(known, _)| *known == name);
            found.map(|(_, seconds)| 1e3 * seconds)
        };
        match self {
            Self::Of(read) => read(row),
            Self::Solving(name) => stage(&row.solving, name),
            Self::Drawing(name) => stage(&row.passes, name),
        }
    }
}

/// A curve: its name, and how it is read.
pub type Curve = (&'static str, Read);

/// A quantity that can be plotted.
#[derive(Clone, Debug)]
pub struct Quantity {
    /// Title of the plot.
    pub title: &'static str,
    /// Unit of the axis.
    pub unit: &'static str,
    /// Curves by name.
    pub curves: Vec<Curve>,
}

/// Titles of what can be plotted against time.
pub const TITLES: [&str; 9] = [
    "Volume",
    "Momentum",
    "Energy",
    "Courant and Froude",
    "Sub-steps",
    "Time of a frame",
    "Stages of solving",
    "Passes of drawing",
    "Probe",
];

/// Title of the elevation at the probe.
pub const PROBED: &str = TITLES[8];

/// Curves that every history has, with titles and units.
fn fixed() -> Vec<(&'static str, &'static str, Vec<Curve>)> {
    vec![
        (
            TITLES[0],
            "m³",
            vec![("volume", Read::Of(|row| Some(row.report?.mass / DENSITY)))],
        ),
        (
            TITLES[1],
            "kg m/s",
            vec![
                ("along X", Read::Of(|row| Some(row.report?.momentum[0]))),
                ("along Z", Read::Of(|row| Some(row.report?.momentum[1]))),
            ],
        ),
        (
            TITLES[2],
            "J",
            vec![("energy", Read::Of(|row| Some(row.report?.energy)))],
        ),
        (
            TITLES[3],
            "",
            vec![
                (
                    "largest Courant number",
                    Read::Of(|row| Some(row.report?.courant)),
                ),
                ("largest Froude number", Read::Of(|row| Some(row.report?.froude))),
            ],
        ),
        (
            TITLES[4],
            "a frame",
            vec![
                ("sub-steps", Read::Of(|row| Some(f64::from(row.report?.substeps)))),
                ("clamps", Read::Of(|row| Some(row.report?.clamps as f64))),
            ],
        ),
        (
            TITLES[5],
            "ms",
            vec![
                ("solving or decoding", Read::Of(|row| Some(1e3 * row.seconds[0]))),
                ("recording", Read::Of(|row| Some(1e3 * row.seconds[1]))),
                ("drawing", Read::Of(|row| Some(1e3 * row.drawing?))),
            ],
        ),
        (TITLES[6], "ms", Vec::new()),
        (TITLES[7], "ms", Vec::new()),
        (
            PROBED,
            "m",
            vec![("elevation", Read::Of(|row| Some(f64::from(row.probe?))))],
        ),
    ]
}

/// See the module.
#[derive(Clone, Debug, Default)]
pub struct History {
    rows: BTreeMap<u64, Row>,
    changes: u64,
    /// Names of stages and passes, in the order in which they were met.
    solving: Vec<&'static str>,
    drawing: Vec<&'static str>,
}

/// Takes up the names that are new.
fn meet(names: &mut Vec<&'static str>, stages: &Stages) {
    for (name, _) in stages {
        if !names.contains(name) {
            names.push(name);
        }
    }
}

impl History {
    /// The row of frame `index`, made if there is none.
    pub fn row(&mut self, index: u64, time: f64) -> &mut Row {
        if self.rows.len() >= MOST && !self.rows.contains_key(&index) {
            let mut odd = false;
            self.rows.retain(|_, _| {
                odd = !odd;
                odd
            });
        }
        self.changes += 1;
        let row = self.rows.entry(index).or_default();
        row.time = time;
        row
    }

    /// Solving frame `index` took this in its stages; nothing if it is not known any more.
    pub fn solved(&mut self, index: u64, stages: Stages) {
        if let Some(row) = self.rows.get_mut(&index) {
            meet(&mut self.solving, &stages);
            row.solving = stages;
            self.changes += 1;
        }
    }

    /// Drawing frame `index` took so many seconds, and this in its passes; nothing if it is not known any more.
    pub fn drawn(&mut self, index: u64, seconds: f64, passes: Stages) {
        if let Some(row) = self.rows.get_mut(&index) {
            meet(&mut self.drawing, &passes);
            row.drawing = Some(seconds);
            row.passes = passes;
            self.changes += 1;
        }
    }

    /// Stages of solving the latest frame whose stages are known.
    pub fn latest_stages(&self) -> &[(&'static str, f64)] {
        let mut latest = self.rows.values().rev().take(8);
        let known = latest.find(|row| !row.solving.is_empty());
        known.map_or(&[], |row| &row.solving)
    }

    /// What can be plotted, in the order of [`TITLES`], with the stages and passes that were met so far.
    pub fn quantities(&self) -> Vec<Quantity> {
        let quantity = |(title, unit, mut curves): (&'static str, &'static str, Vec<Curve>)| {
            if title == TITLES[6] {
                curves = self
                    .solving
                    .iter()
                    .map(|name| (*name, Read::Solving(name)))
                    .collect();
            } else if title == TITLES[7] {
                curves = self
                    .drawing
                    .iter()
                    .map(|name| (*name, Read::Drawing(name)))
                    .collect();
            }
            Quantity { title, unit, curves }
        };
        fixed().into_iter().map(quantity).collect()
    }

    /// Counts what may have changed: as long as it stands, the rows do.
    pub fn changes(&self) -> u64 {
        self.changes
    }

    /// The rows in order of time.
    pub fn rows(&self) -> impl Iterator<Item = &Row> {
        self.rows.values()
    }

    /// Number of rows.
    pub fn len(&self) -> usize {
        self.rows.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }

    /// Forgets all.
    pub fn clear(&mut self) {
        self.changes += 1;
        self.rows.clear();
        self.solving.clear();
        self.drawing.clear();
    }

    /// Forgets what the probe saw, because it stands elsewhere now.
    pub fn clear_probe(&mut self) {
        self.changes += 1;
        for row in self.rows.values_mut() {
            row.probe = None;
        }
    }

    /// Writes everything as CSV, a row a frame; what is not known is empty.
    ///
    /// # Errors
    /// A message that says what cannot be written.
    pub fn write_csv(&self, path: &Path) -> Result<(), String> {
        let write = || -> std::io::Result<()> {
            let mut out = std::io::BufWriter::new(std::fs::File::create(path)?);
            write!(out, "frame,time s")?;
            let quantities = self.quantities();
            for quantity in &quantities {
                for (name, _) in &quantity.curves {
                    let unit = if quantity.unit.is_empty() {
                        String::new()
                    } else {
                        format!(" {}", quantity.unit)
                    };
                    write!(out, ",{name}{unit}")?;
                }
            }
            writeln!(out)?;
            for (index, row) in &self.rows {
                write!(out, "{index},{}", row.time)?;
                for (_, read) in quantities.iter().flat_map(|quantity| &quantity.curves) {
                    match read.of(row) {
                        Some(value) => write!(out, ",{value}")?,
                        None => write!(out, ",")?,
                    }
                }
                writeln!(out)?;
            }
            out.flush()
        };
        write().map_err(|error| format!("{}: cannot be written: {error}", path.display()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn csv_has_a_column_a_curve_and_stays_within_its_bounds() {
        let mut history = History::default();
        for k in 0..(3 * MOST as u64) {
            history.row(k, k as f64 * 0.1).report = Some(StepReport {
                mass: 2000.0,
                ..StepReport::default()
            });
            assert!(history.len() <= MOST);
        }
        history.clear();
        history.row(4, 0.4).probe = Some(0.25);
        history.drawn(4, 0.01, vec![("water", 0.004), ("ground", 0.006)]);
        history.solved(4, vec![("flow", 0.002)]);
        // Of a frame that is not known nothing is kept.
        history.drawn(9, 0.01, vec![("no such pass", 1.0)]);
        history.row(3, 0.3).report = Some(StepReport {
            mass: 2000.0,
            ..StepReport::default()
        });
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("plots.csv");
        history.write_csv(&file).unwrap();
        let text = std::fs::read_to_string(&file).unwrap();
        let lines: Vec<Vec<&str>> = text.lines().map(|line| line.split(',').collect()).collect();
        assert_eq!(lines.len(), 3);
        let columns = 2 + history.quantities().iter().map(|q| q.curves.len()).sum::<usize>();
        assert!(lines.iter().all(|line| line.len() == columns), "{text}");
        assert_eq!((lines[1][0], lines[1][2], lines[1][columns - 1]), ("3", "2", ""));
        assert_eq!(
            (lines[2][0], lines[2][2], lines[2][columns - 1]),
            ("4", "", "0.25")
        );
        for (name, value) in [("flow ms", "2"), ("water ms", "4"), ("ground ms", "6")] {
            let column = lines[0].iter().position(|title| *title == name).unwrap();
            assert_eq!((lines[1][column], lines[2][column]), ("", value), "{text}");
        }
        assert!(!text.contains("no such pass"));
        history.clear_probe();
        assert!(history.rows().all(|row| row.probe.is_none()));
    }
}
