//! Sizes, times and tables for people. Programs read `--json`.

use std::fmt::Write as _;

/// Bytes in binary units: `512 B`, `1.50 KiB`, `23.4 MiB`.
pub(crate) fn bytes(bytes: u64) -> String {
    const UNITS: [&str; 6] = ["KiB", "MiB", "GiB", "TiB", "PiB", "EiB"];
    if bytes < 1024 {
        return format!("{bytes} B");
    }
    let mut value = bytes as f64 / 1024.0;
    let mut unit = 0;
    // 999.95 and not 1024, so that a value never needs four digits before the point.
    while value >= 999.95 && unit + 1 < UNITS.len() {
        value /= 1024.0;
        unit += 1;
    }
    format!("{} {}", three_digits(value), UNITS[unit])
}

/// Seconds: `0.45 ms`, `12.3 s`, `2 min 05 s`, `3 h 07 min`. Infinity, the step limit of a method without one, is `none`.
pub(crate) fn seconds(seconds: f64) -> String {
    let rounded = seconds.abs().round();
    if seconds == f64::INFINITY {
        "none".to_owned()
    } else if !seconds.is_finite() {
        format!("{seconds} s")
    } else if seconds == 0.0 {
        "0 s".to_owned()
    } else if seconds.abs() < 1e-3 {
        format!("{} µs", three_digits(seconds * 1e6))
    } else if seconds.abs() < 1.0 {
        format!("{} ms", three_digits(seconds * 1e3))
    } else if rounded < 100.0 {
        format!("{} s", three_digits(seconds))
    } else if rounded < 3600.0 {
        format!("{} min {:02} s", (rounded / 60.0).floor(), rounded % 60.0)
    } else {
        let minutes = (seconds / 60.0).round();
        format!("{} h {:02} min", (minutes / 60.0).floor(), minutes % 60.0)
    }
}

/// A number with three significant digits, without an exponent from 0.01 to 999.
pub(crate) fn three_digits(value: f64) -> String {
    match value.abs() {
        0.0 => "0".to_owned(),
        v if !(0.01..1e6).contains(&v) => format!("{value:.2e}"),
        v if v < 9.995 => format!("{value:.2}"),
        v if v < 99.95 => format!("{value:.1}"),
        _ => format!("{value:.0}"),
    }
}

/// `1 frame`, `2 frames`.
pub(crate) fn count(number: u64, thing: &str) -> String {
    format!("{number} {thing}{}", if number == 1 { "" } else { "s" })
}

/// Lines of `name  value`, the values in one column.
#[derive(Default)]
pub(crate) struct Facts(Vec<(String, String)>);

impl Facts {
    /// Adds a line.
    pub(crate) fn add(&mut self, name: impl Into<String>, value: impl Into<String>) -> &mut Self {
        self.0.push((name.into(), value.into()));
        self
    }

    /// The lines.
    pub(crate) fn render(&self) -> String {
        let width = self
            .0
            .iter()
            .map(|(name, _)| name.chars().count())
            .max()
            .unwrap_or(0);
        let mut text = String::new();
        for (name, value) in &self.0 {
            let _ = writeln!(text, "{name:width$}  {value}");
        }
        text
    }
}

/// Where the text of a column stands.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Align {
    Left,
    Right,
}

/// A table of text columns, two spaces apart.
pub(crate) struct Table {
    columns: Vec<(&'static str, Align)>,
    rows: Vec<Vec<String>>,
}

impl Table {
    /// An empty table with these headings.
    pub(crate) fn new(columns: &[(&'static str, Align)]) -> Self {
        Self {
            columns: columns.to_vec(),
            rows: Vec::new(),
        }
    }

    /// Adds a row; as many cells as there are columns.
    pub(crate) fn row(&mut self, cells: Vec<String>) {
        debug_assert_eq!(cells.len(), self.columns.len());
        self.rows.push(cells);
    }

    /// Whether it has no row.
    pub(crate) fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }

    /// The headings and the rows, each line indented by two spaces.
    pub(crate) fn render(&self) -> String {
        let headings: Vec<String> = self.columns.iter().map(|(name, _)| (*name).to_owned()).collect();
        let lines: Vec<&Vec<String>> = std::iter::once(&headings).chain(&self.rows).collect();
        let width = |column: usize| {
            let lengths = lines.iter().filter_map(|line| line.get(column));
            lengths.map(|cell| cell.chars().count()).max().unwrap_or(0)
        };
        let widths: Vec<usize> = (0..self.columns.len()).map(width).collect();
        let mut text = String::new();
        for line in lines {
            let mut row = String::from("  ");
            for ((cell, (_, align)), width) in line.iter().zip(&self.columns).zip(&widths) {
                let _ = match align {
                    Align::Left => write!(row, "{cell:<width$}  "),
                    Align::Right => write!(row, "{cell:>width$}  "),
                };
            }
            let _ = writeln!(text, "{}", row.trim_end());
        }
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_keep_three_digits() {
        for (value, text) in [
            (0, "0 B"),
            (1023, "1023 B"),
            (1024, "1.00 KiB"),
            (1024 * 1024 - 1, "1.00 MiB"),
            (25 << 20, "25.0 MiB"),
            (u64::MAX, "16.0 EiB"),
        ] {
            assert_eq!(bytes(value), text);
        }
    }

    #[test]
    fn times_have_a_unit_that_fits() {
        for (value, text) in [
            (0.0, "0 s"),
            (2.5e-5, "25.0 µs"),
            (0.0123, "12.3 ms"),
            (59.96, "60.0 s"),
            (125.4, "2 min 05 s"),
            (3599.9, "1 h 00 min"),
            (11_220.0, "3 h 07 min"),
            (f64::INFINITY, "none"),
        ] {
            assert_eq!(seconds(value), text);
        }
    }

    #[test]
    fn columns_line_up() {
        let mut table = Table::new(&[("name", Align::Left), ("bytes", Align::Right)]);
        table.row(vec!["élan".into(), "12".into()]);
        table.row(vec!["x".into(), "123456".into()]);
        assert_eq!(table.render(), "  name   bytes\n  élan      12\n  x     123456\n");
    }
}
