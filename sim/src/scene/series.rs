//! Time series from CSV files.

use super::description::{Bed, Description, Drive, Event, SeriesPoint};
use super::report::Report;
use super::{Problem, read_text};
use std::path::{Path, PathBuf};

/// Largest file in bytes.
const MAX_BYTES: u64 = 64 << 20;
/// Largest time in s, and largest value.
const LIMIT: f64 = 1e9;

/// One time series of a scene: where its table stands, the key of its file, and the header that the file must have.
struct Named<'a> {
    table: String,
    key: &'static str,
    header: &'static str,
    file: &'a mut Option<PathBuf>,
    points: &'a mut Vec<SeriesPoint>,
}

/// Every time series of a scene.
fn all(description: &mut Description) -> Vec<Named<'_>> {
    let mut out = Vec::new();
    for (k, drive) in description.boundary.drives.iter_mut().enumerate() {
        if let Drive::Series {
            quantity,
            file,
            points,
            ..
        } = drive
        {
            let (table, header) = (format!("boundary.drive.{k}"), quantity.header());
            out.push(Named {
                table,
                key: "file",
                header,
                file,
                points,
            });
        }
    }
    for (k, bed) in description.beds.iter_mut().enumerate() {
        if let Bed::Patch { series, points, .. } | Bed::Array { series, points, .. } = bed {
            let (table, header) = (format!("bed.{k}"), "time_s,share");
            out.push(Named {
                table,
                key: "series",
                header,
                file: series,
                points,
            });
        }
    }
    for (k, event) in description.events.iter_mut().enumerate() {
        if let Event::Inflow { series, points, .. } = event {
            let (table, header) = (format!("event.{k}"), "time_s,flow_m3_s");
            out.push(Named {
                table,
                key: "series",
                header,
                file: series,
                points,
            });
        }
    }
    out
}

/// Puts the points of its file into each time series that names one; what is wrong with a file is told with its line.
pub(super) fn read(description: &mut Description, base_dir: &Path, report: &mut Report) {
    for series in all(description) {
        let key = format!("{}.{}", series.table, series.key);
        let Some(name) = series.file.take() else { continue };
        if !report.usable(&[&series.table]) {
            continue;
        }
        let path = base_dir.join(&name);
        let text = match read_text(&path, MAX_BYTES) {
            Ok(text) => text,
            Err(e) => {
                report.unusable(
                    &key,
                    format!("{}: {}", path.display(), e.reason),
                    "name a file of comma-separated values",
                );
                continue;
            }
        };
        match parse(&text, series.header) {
            Ok(read) => *series.points = read,
            Err((line, message, remedy)) => {
                report.mark_unusable(&key);
                report.add(Problem {
                    file: path,
                    line: Some(line),
                    key,
                    message,
                    remedy,
                });
            }
        }
    }
}

/// The points of a file: a header that names quantities and units, then a time and a value a line. The error is line,
/// message and remedy.
fn parse(text: &str, header: &str) -> Result<Vec<SeriesPoint>, (u32, String, String)> {
    let mut lines = text
        .trim_start_matches('\u{feff}')
        .lines()
        .zip(1_u32..)
        .map(|(line, number)| (line.trim(), number))
        .filter(|(line, _)| !line.is_empty() && !line.starts_with('#'));
    let wanted = || format!("begin with the line `{header}`");
    match lines.next() {
        None => return Err((1, "the series is empty".into(), wanted())),
        Some((line, number)) => {
            let found: String = line.split_whitespace().collect();
            if found != header {
                let shown: String = line.chars().take(60).collect();
                return Err((number, format!("the header is `{shown}`"), wanted()));
            }
        }
    }
    let mut points: Vec<SeriesPoint> = Vec::new();
    for (line, number) in lines {
        let mut cells = line.split(',').map(|cell| cell.trim().parse::<f64>());
        let (Some(Ok(time)), Some(Ok(value)), None) = (cells.next(), cells.next(), cells.next()) else {
            let shown: String = line.chars().take(60).collect();
            let message = format!("`{shown}` is not a time and a value");
            return Err((
                number,
                message,
                "write two numbers with a comma between them".into(),
            ));
        };
        if !(time.abs() <= LIMIT && value.abs() <= LIMIT) {
            let message = format!("{time}, {value} is out of range");
            return Err((number, message, "write finite numbers within 1e9".into()));
        }
        if let Some(last) = points.last()
            && time <= last.time
        {
            let message = format!("{time} s does not come after {} s", last.time);
            return Err((number, message, "put the lines in order of time".into()));
        }
        points.push(SeriesPoint { time, value });
    }
    if points.is_empty() {
        return Err((
            1,
            "the series has no point".into(),
            "add at least one line".into(),
        ));
    }
    Ok(points)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_series_is_read_and_mistakes_are_told_with_their_line() {
        let header = "time_s,elevation_m";
        let points = parse("# gauge 4\ntime_s, elevation_m\n0, 1.5\n\n2.5,-1e-3\n", header).unwrap();
        assert_eq!(
            points,
            [
                SeriesPoint {
                    time: 0.0,
                    value: 1.5
                },
                SeriesPoint {
                    time: 2.5,
                    value: -1e-3
                }
            ]
        );
        for (text, line) in [
            ("", 1),
            ("time,eta\n0,1\n", 1),
            ("time_s,elevation_m\n", 1),
            ("time_s,elevation_m\n0,1\n1;2\n", 3),
            ("time_s,elevation_m\n0,1\n0,2\n", 3),
            ("time_s,elevation_m\n0,NaN\n", 2),
            ("time_s,elevation_m\n0,1,2\n", 2),
        ] {
            assert_eq!(parse(text, header).unwrap_err().0, line, "{text}");
        }
    }
}
