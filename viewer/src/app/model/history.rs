//! What happened from frame to frame, for plots and CSV files.

use meniscus_sim::StepReport;
use std::collections::BTreeMap;
use std::io::Write as _;
use std::path::Path;

/// Most frames that are kept; beyond, every other one goes.
const MOST: usize = 20_000;

/// Density of water that reports count with, kg/m³.
const DENSITY: f64 = 1000.0;

/// What is known of one frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Row {
    /// Its time in seconds.
    pub time: f64,
    /// Totals of the step that led to it.
    pub report: Option<StepReport>,
    /// Seconds that solving or decoding took, and handing it to the recording.
    pub seconds: [f64; 2],
    /// Seconds that drawing it took, where it was drawn.
    pub drawing: Option<f64>,
    /// Elevation at the probe, metres.
    pub probe: Option<f32>,
}

/// A curve: its name, and how it is read of a row.
pub type Curve = (&'static str, fn(&Row) -> Option<f64>);

/// A quantity that can be plotted: its name with unit, and how it is read.
pub struct Quantity {
    /// Title of the plot.
    pub title: &'static str,
    /// Unit of the axis.
    pub unit: &'static str,
    /// Curves by name.
    pub curves: &'static [Curve],
}

/// What can be plotted against time.
pub const QUANTITIES: [Quantity; 7] = [
    Quantity {
        title: "Volume",
        unit: "m³",
        curves: &[("volume", |row| Some(row.report?.mass / DENSITY))],
    },
    Quantity {
        title: "Momentum",
        unit: "kg m/s",
        curves: &[
            ("along X", |row| Some(row.report?.momentum[0])),
            ("along Z", |row| Some(row.report?.momentum[1])),
        ],
    },
    Quantity {
        title: "Energy",
        unit: "J",
        curves: &[("energy", |row| Some(row.report?.energy))],
    },
    Quantity {
        title: "Courant and Froude",
        unit: "",
        curves: &[
            ("largest Courant number", |row| Some(row.report?.courant)),
            ("largest Froude number", |row| Some(row.report?.froude)),
        ],
    },
    Quantity {
        title: "Sub-steps",
        unit: "a frame",
        curves: &[
            ("sub-steps", |row| Some(f64::from(row.report?.substeps))),
            ("clamps", |row| Some(row.report?.clamps as f64)),
        ],
    },
    Quantity {
        title: "Time of a frame",
        unit: "ms",
        curves: &[
            ("solving or decoding", |row| Some(1e3 * row.seconds[0])),
            ("recording", |row| Some(1e3 * row.seconds[1])),
            ("drawing", |row| Some(1e3 * row.drawing?)),
        ],
    },
    Quantity {
        title: "Probe",
        unit: "m",
        curves: &[("elevation", |row| Some(f64::from(row.probe?)))],
    },
];

/// See the module.
#[derive(Clone, Debug, Default)]
pub struct History {
    rows: BTreeMap<u64, Row>,
    changes: u64,
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

    /// Drawing frame `index` took so many seconds; nothing if it is not known any more.
    pub fn drawn(&mut self, index: u64, seconds: f64) {
        if let Some(row) = self.rows.get_mut(&index) {
            row.drawing = Some(seconds);
            self.changes += 1;
        }
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
            for quantity in &QUANTITIES {
                for (name, _) in quantity.curves {
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
                for (_, read) in QUANTITIES.iter().flat_map(|quantity| quantity.curves) {
                    match read(row) {
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
        let columns = 2 + QUANTITIES.iter().map(|q| q.curves.len()).sum::<usize>();
        assert!(lines.iter().all(|line| line.len() == columns), "{text}");
        assert_eq!((lines[1][0], lines[1][2], lines[1][columns - 1]), ("3", "2", ""));
        assert_eq!(
            (lines[2][0], lines[2][2], lines[2][columns - 1]),
            ("4", "", "0.25")
        );
        history.clear_probe();
        assert!(history.rows().all(|row| row.probe.is_none()));
    }
}
