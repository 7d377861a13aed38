//! The report: one HTML page that holds its figures, tables and style, and asks the network for nothing.

use super::expectation::Verdict;
use super::machine::Machine;
use super::plot::number;
use super::plot::theme::{dark_rules, escape, without_style};
use super::report::StudyReport;
use super::row::Row;
use super::schedule::Measured;
use std::fmt::Write as _;

/// Everything that one page shows.
pub(crate) struct Page<'a> {
    pub command: &'a str,
    pub machine: &'a Machine,
    pub quick: bool,
    pub studies: &'a [StudyReport],
}

const STYLE: &str = include_str!("report.css");
const SCRIPT: &str = include_str!("report.js");

impl Page<'_> {
    /// The whole page.
    pub(crate) fn to_html(&self) -> String {
        let mut html = String::new();
        self.write(&mut html);
        html
    }

    /// Writing to a string cannot fail, so results of `write!` are dropped here and below.
    fn write(&self, html: &mut String) {
        let titles: Vec<&str> = self.studies.iter().map(|s| s.title).collect();
        let _ = write!(
            html,
            "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
             <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
             <meta name=\"color-scheme\" content=\"light dark\">\n<title>Meniscus studies: {}</title>\n\
             <style>\n{STYLE}{}\n</style>\n</head>\n<body>\n<main>\n",
            escape(&titles.join(", ")),
            dark_rules(".figure")
        );
        let _ = write!(
            html,
            "<header>\n<h1>Error against run time</h1>\n<dl>\n<dt>Command</dt><dd><code>{}</code></dd>\n\
             <dt>Machine</dt><dd>{}</dd>\n<dt>Kind</dt><dd>{}</dd>\n</dl>\n</header>\n",
            escape(self.command),
            escape(&self.machine.line()),
            if self.quick {
                "quick: short sweeps, few repetitions"
            } else {
                "full sweeps"
            }
        );
        html.push_str(READING);
        if self.studies.len() > 1 {
            html.push_str("<nav><ul>\n");
            for study in self.studies {
                let _ = writeln!(
                    html,
                    "<li><a href=\"#{}\">{}</a></li>",
                    study.name,
                    escape(study.title)
                );
            }
            html.push_str("</ul></nav>\n");
        }
        for study in self.studies {
            write_study(html, study);
        }
        let _ = write!(html, "</main>\n<script>\n{SCRIPT}</script>\n</body>\n</html>\n");
    }
}

const READING: &str = "<details class=\"reading\">\n<summary>How to read this page</summary>\n\
    <p>Each case has a truth that does not come from the methods under test. A point is one run; a curve joins the runs \
    of one method along its sweep. Down is better, left is cheaper. Filled markers on the pale band are on the Pareto \
    front: no other run here is both cheaper and more accurate. In figures against resolution the slope triangle shows \
    how steeply a first- and a second-order method fall.</p>\n\
    <p>CPU time is that of the whole process with all its threads, the best of the repetitions; a thin line reaches to \
    their median. Repetitions go over all runs in turn, each round in another order, so that a machine that slows down \
    slows all methods alike. Peak memory counts heap bytes held at once above what was held when the run began. A row is \
    <em>ok</em> if its run ended as it should and every repetition gave the same result, bit for bit.</p>\n\
    <p>Click a column head to sort. The same rows are in <code>rows.json</code> and <code>rows.csv</code>, every single \
    repetition in <code>timings.csv</code>.</p>\n</details>\n";

fn write_study(html: &mut String, study: &StudyReport) {
    let _ = writeln!(
        html,
        "<section id=\"{}\">\n<h2>{}</h2>",
        study.name,
        escape(study.title)
    );
    for paragraph in study.about.split("\n\n") {
        let _ = writeln!(html, "<p>{}</p>", prose(paragraph));
    }
    if study.interrupted {
        html.push_str(
            "<p class=\"bad\">The study was interrupted; what had been measured by then is shown.</p>\n",
        );
    }
    if !study.verdicts.is_empty() {
        write_verdicts(html, &study.verdicts);
    }
    write_figures(html, study, None);
    for (index, case) in study.cases.iter().enumerate() {
        let _ = writeln!(
            html,
            "<h3>Case: {}</h3>\n<p>{}</p>",
            escape(case.name),
            prose(&case.truth)
        );
        write_figures(html, study, Some(index));
        let runs: Vec<&Measured> = study
            .results
            .measured
            .iter()
            .filter(|m| m.case == index)
            .collect();
        write_table(html, case.resolution, &runs);
    }
    html.push_str("</section>\n");
}

fn write_figures(html: &mut String, study: &StudyReport, case: Option<usize>) {
    let figures: Vec<_> = study.figures.iter().filter(|f| f.case == case).collect();
    if figures.is_empty() {
        return;
    }
    html.push_str("<div class=\"figures\">\n");
    for figure in figures {
        let _ = writeln!(html, "<figure>{}</figure>", without_style(&figure.svg));
    }
    html.push_str("</div>\n");
}

fn write_verdicts(html: &mut String, verdicts: &[Verdict]) {
    let failed = verdicts.iter().filter(|v| !v.holds).count();
    let _ = writeln!(
        html,
        "<details class=\"verdicts\"{}>\n<summary>Held against its expectations: {} of {} hold</summary>\n<ul>",
        if failed > 0 { " open" } else { "" },
        verdicts.len() - failed,
        verdicts.len()
    );
    for verdict in verdicts {
        let (class, word) = if verdict.holds {
            ("good", "holds")
        } else {
            ("bad", "fails")
        };
        let _ = writeln!(
            html,
            "<li><span class=\"{class}\">{word}</span> {}; measured {}</li>",
            escape(&verdict.expected),
            escape(&verdict.measured)
        );
    }
    html.push_str("</ul>\n</details>\n");
}

fn write_table(html: &mut String, resolution: &str, runs: &[&Measured]) {
    let rows: usize = runs.iter().map(|m| m.rows.len()).sum();
    let _ = writeln!(
        html,
        "<details class=\"table\">\n<summary>{rows} rows</summary>\n<div class=\"scroll\">\n<table>\n<thead><tr>"
    );
    let heads = [
        "method",
        "parameters",
        resolution,
        "metric",
        "error",
        "CPU, best (s)",
        "CPU, median (s)",
        "wall, best (s)",
        "peak (MiB)",
        "mass drift",
        "ok",
        "note",
    ];
    for head in heads {
        let _ = write!(html, "<th scope=\"col\">{}</th>", escape(head));
    }
    html.push_str("</tr></thead>\n<tbody>\n");
    for run in runs {
        let median = run.spread.cpu_s().map(|(_, median)| median);
        for row in &run.rows {
            write_row(html, row, median);
        }
    }
    html.push_str("</tbody>\n</table>\n</div>\n</details>\n");
}

/// Text with names between backticks.
fn prose(text: &str) -> String {
    let parts = text.split('`').enumerate();
    parts
        .map(|(n, part)| match n % 2 {
            1 => format!("<code>{}</code>", escape(part)),
            _ => escape(part),
        })
        .collect()
}

fn write_row(html: &mut String, row: &Row, cpu_median: Option<f64>) {
    let numeric = |value: Option<f64>| match value {
        Some(v) if v.is_finite() => format!("<td class=\"n\" data-value=\"{v:e}\">{}</td>", number(v)),
        _ => "<td class=\"n\">–</td>".to_owned(),
    };
    let plain = |text: &str| format!("<td>{}</td>", escape(text));
    let cells = [
        plain(&row.method),
        plain(&row.parameters_text()),
        numeric(Some(row.resolution)),
        plain(&row.error_metric),
        numeric(Some(row.error)),
        numeric(row.cpu_s),
        numeric(cpu_median),
        numeric(Some(row.wall_s)),
        numeric(Some(row.peak_bytes as f64 / f64::from(1 << 20))),
        numeric(row.mass_drift),
        format!(
            "<td class=\"{}\">{}</td>",
            if row.ok { "good" } else { "bad" },
            if row.ok { "yes" } else { "no" }
        ),
        plain(&row.note),
    ];
    let _ = writeln!(html, "<tr>{}</tr>", cells.concat());
}
