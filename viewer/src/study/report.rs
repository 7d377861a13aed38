//! Writes what studies found: rows, timings, figures and the page.

use super::case::Case;
use super::expectation::{Verdict, fitted_order};
use super::figures::Figure;
use super::html::Page;
use super::machine::Machine;
use super::plot::number;
use super::row::{Row, quoted, to_csv};
use super::schedule::Results;
use anyhow::Context as _;
use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

/// A study with all that it found.
pub(crate) struct StudyReport {
    pub name: &'static str,
    pub title: &'static str,
    pub about: &'static str,
    pub cases: Vec<Case>,
    pub results: Results,
    pub figures: Vec<Figure>,
    /// Empty unless it was held against its expectations.
    pub verdicts: Vec<Verdict>,
    pub interrupted: bool,
}

impl StudyReport {
    /// All rows, in the order of cases and runs.
    pub(crate) fn rows(&self) -> impl Iterator<Item = &Row> {
        self.results.measured.iter().flat_map(|m| &m.rows)
    }

    /// A few lines for a terminal: for each curve the ends of its sweep, and the order between.
    pub(crate) fn summary(&self) -> String {
        let mut text = format!("{}\n", self.title);
        for (index, case) in self.cases.iter().enumerate() {
            let mut metrics: Vec<&str> = case.curves.iter().map(|c| c.metric).collect();
            metrics.dedup();
            for metric in metrics {
                let _ = writeln!(text, "  {}, {metric} by {}:", case.name, case.resolution);
                self.summarise_metric(&mut text, index, metric);
            }
        }
        for verdict in self.verdicts.iter().filter(|v| !v.holds) {
            let _ = writeln!(text, "  {verdict}");
        }
        if !self.verdicts.is_empty() {
            let held = self.verdicts.iter().filter(|v| v.holds).count();
            let _ = writeln!(text, "  {held} of {} expectations hold", self.verdicts.len());
        }
        text
    }

    fn summarise_metric(&self, text: &mut String, case: usize, metric: &str) {
        let mut curves: Vec<(&str, Vec<&Row>)> = Vec::new();
        for run in self.results.measured.iter().filter(|m| m.case == case) {
            let Some(row) = run.rows.iter().find(|r| r.error_metric == metric) else {
                continue;
            };
            match curves.iter_mut().find(|c| c.0 == run.series) {
                Some(curve) => curve.1.push(row),
                None => curves.push((&run.series, vec![row])),
            }
        }
        for (label, rows) in curves {
            let (Some(first), Some(last)) = (rows.first(), rows.last()) else {
                continue;
            };
            let points: Vec<(f64, f64)> = rows.iter().map(|r| (r.resolution, r.error)).collect();
            let order = fitted_order(&points).map_or(String::new(), |p| format!(", order {p:.2}"));
            let seconds = |row: &Row| number(row.cpu_s.unwrap_or(row.wall_s));
            let _ = writeln!(
                text,
                "    {label:<28} {} → {}: {} → {}{order}; {} → {} s",
                number(first.resolution),
                number(last.resolution),
                number(first.error),
                number(last.error),
                seconds(first),
                seconds(last)
            );
        }
    }
}

/// Makes the directory for the results, before the work: it may take minutes.
pub(crate) fn prepare(dir: &Path) -> anyhow::Result<()> {
    fs::create_dir_all(dir)
        .with_context(|| format!("{}: cannot make this directory for the results", dir.display()))
}

/// Writes everything into `dir`, which is there, and tells the files.
pub(crate) fn write(
    dir: &Path,
    command: &str,
    machine: &Machine,
    quick: bool,
    studies: &[StudyReport],
) -> anyhow::Result<Vec<PathBuf>> {
    let rows: Vec<Row> = studies.iter().flat_map(|s| s.rows().cloned()).collect();
    let page = Page {
        command,
        machine,
        quick,
        studies,
    };
    let mut contents = vec![
        (
            "rows.json".to_owned(),
            serde_json::to_string_pretty(&rows)? + "\n",
        ),
        ("rows.csv".to_owned(), to_csv(&rows)),
        ("timings.csv".to_owned(), timings(studies)),
        ("report.html".to_owned(), page.to_html()),
    ];
    for figure in studies.iter().flat_map(|s| &s.figures) {
        contents.push((figure.file.clone(), figure.svg.clone()));
    }
    let mut files = Vec::new();
    for (name, text) in contents {
        let path = dir.join(name);
        fs::write(&path, text).with_context(|| format!("{}: cannot be written", path.display()))?;
        files.push(path);
    }
    Ok(files)
}

/// Every repetition in the order in which they ran.
fn timings(studies: &[StudyReport]) -> String {
    let mut text =
        String::from("study,case,method,parameters,resolution,round,begun_at_s,cpu_s,wall_s,peak_bytes\n");
    for study in studies {
        let mut seen = vec![0_usize; study.results.measured.len()];
        for entry in &study.results.log {
            let run = &study.results.measured[entry.run];
            let cost = run.spread.repetitions.get(seen[entry.run]);
            seen[entry.run] += 1;
            let (Some(row), Some(cost)) = (run.rows.first(), cost) else {
                continue;
            };
            let _ = writeln!(
                text,
                "{},{},{},{},{},{},{:.3},{},{:e},{}",
                quoted(&row.study),
                quoted(&row.case),
                quoted(&row.method),
                quoted(&row.parameters_text()),
                row.resolution,
                entry.round,
                entry.at_s,
                cost.cpu_s.map_or(String::new(), |s| format!("{s:e}")),
                cost.wall_s,
                cost.peak_bytes
            );
        }
    }
    text
}
