//! From measured runs to charts.

use super::case::{Against, Case, Curves, Study};
use super::plot::{Chart, DrawError, Sample, Series};
use super::row::Row;
use super::schedule::{Measured, Results};

/// A finished figure.
pub(crate) struct Figure {
    /// Name of its file.
    pub file: String,
    /// Index of the case it belongs to; absent for a map of the whole study.
    pub case: Option<usize>,
    /// The drawing.
    pub svg: String,
}

/// Draws every figure of a study.
pub(crate) fn draw(study: &dyn Study, cases: &[Case], results: &Results) -> Result<Vec<Figure>, DrawError> {
    let mut figures = Vec::new();
    for (index, case) in cases.iter().enumerate() {
        for curves in &case.curves {
            let chart = chart(index, case, curves, &results.measured);
            if chart.series.is_empty() {
                continue;
            }
            figures.push(Figure {
                file: file_name(&[study.name(), case.name, curves.metric, axis_name(&curves.against)]),
                case: Some(index),
                svg: chart.to_svg()?,
            });
        }
    }
    let rows: Vec<Row> = results
        .measured
        .iter()
        .flat_map(|m| m.rows.iter().cloned())
        .collect();
    for map in study.maps(&rows) {
        figures.push(Figure {
            file: file_name(&[study.name(), &map.name]),
            case: None,
            svg: map.to_svg()?,
        });
    }
    Ok(figures)
}

/// Lower-case words joined by hyphens, parts by double hyphens.
fn file_name(parts: &[&str]) -> String {
    let slug = |part: &str| {
        let words: Vec<String> = part
            .split(|c: char| !c.is_ascii_alphanumeric())
            .filter(|w| !w.is_empty())
            .map(str::to_ascii_lowercase)
            .collect();
        words.join("-")
    };
    let parts: Vec<String> = parts.iter().map(|p| slug(p)).collect();
    format!("{}.svg", parts.join("--"))
}

fn axis_name(against: &Against) -> &str {
    match against {
        Against::Cpu => "against cpu time",
        Against::CpuPer { parameter, .. } => parameter,
        Against::Resolution => "against resolution",
        Against::Metric { metric, .. } => metric,
    }
}

fn chart(index: usize, case: &Case, curves: &Curves, measured: &[Measured]) -> Chart {
    let mut series: Vec<Series> = Vec::new();
    let mut methods: Vec<&str> = Vec::new();
    for run in measured.iter().filter(|m| m.case == index) {
        let Some(row) = run.rows.iter().find(|row| row.error_metric == curves.metric) else {
            continue;
        };
        let method = methods.iter().position(|m| *m == row.method).unwrap_or_else(|| {
            methods.push(&row.method);
            methods.len() - 1
        });
        let at = series
            .iter()
            .position(|s| s.label == run.series)
            .unwrap_or_else(|| {
                series.push(Series {
                    label: run.series.clone(),
                    method,
                    variant: series.iter().filter(|s| s.method == method).count(),
                    points: Vec::new(),
                });
                series.len() - 1
            });
        if let Some(sample) = sample(curves, row, run) {
            series[at].points.push(sample);
        }
    }
    series.retain(|s| !s.points.is_empty());
    let front = matches!(
        curves.against,
        Against::Cpu | Against::CpuPer { .. } | Against::Metric { front: true, .. }
    );
    let x_label = match &curves.against {
        Against::Cpu => cost_label(measured).to_owned(),
        Against::CpuPer { label, .. } => (*label).to_owned(),
        Against::Resolution => case.resolution.to_owned(),
        Against::Metric { metric, .. } => (*metric).to_owned(),
    };
    let against = match &curves.against {
        Against::Resolution if !curves.slopes.is_empty() => "resolution",
        _ => without_unit(&x_label),
    };
    let title = format!(
        "{}: {} against {against}",
        capitalised(case.name),
        without_unit(curves.metric)
    );
    Chart {
        description: format!("{title}, for {}", list(&series)),
        title,
        x_label,
        y_label: curves.metric.to_owned(),
        series,
        slopes: curves.slopes.to_vec(),
        front,
        ticks_at_points: curves.against == Against::Resolution,
    }
}

fn list(series: &[Series]) -> String {
    let names: Vec<&str> = series.iter().map(|s| s.label.as_str()).collect();
    names.join("; ")
}

fn without_unit(label: &str) -> &str {
    label
        .split(" (")
        .next()
        .unwrap_or(label)
        .split(", ")
        .next()
        .unwrap_or(label)
}

fn capitalised(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or(String::new(), |first| {
        first.to_uppercase().chain(letters).collect()
    })
}

/// Where no CPU clock is, cost is wall time, and the axis says so.
fn cost_label(measured: &[Measured]) -> &'static str {
    if measured.iter().any(|m| m.spread.cpu_s().is_some()) {
        "CPU time (s, all threads)"
    } else {
        "wall time (s; no CPU clock on this system)"
    }
}

fn sample(curves: &Curves, row: &Row, run: &Measured) -> Option<Sample> {
    let (x, x_median) = match &curves.against {
        Against::Resolution => (row.resolution, None),
        Against::Metric { metric, .. } => {
            let other = run.rows.iter().find(|r| r.error_metric == *metric)?;
            (other.error, None)
        }
        Against::Cpu | Against::CpuPer { .. } => {
            let (best, median) = run.spread.cpu_s().or(run.spread.wall_s())?;
            let factor = match &curves.against {
                Against::CpuPer { parameter, scale, .. } => {
                    scale / row.parameters.get(*parameter)?.as_f64()?
                }
                _ => 1.0,
            };
            (best * factor, Some(median * factor))
        }
    };
    // A logarithmic axis has no place for what is not positive; an error of exactly 0 has its own line.
    let drawable = x > 0.0 && x.is_finite() && row.error >= 0.0 && row.error.is_finite();
    drawable.then_some(Sample {
        x,
        y: row.error,
        x_median,
    })
}
