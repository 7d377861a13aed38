//! What a study must show: `data/expectations/NAME.toml`, and holding rows against it.
//!
//! Errors, orders and ratios only. Wall times are never bounded: they are the machine's. A ratio of CPU times taken in
//! the same run may be, with a wide margin.

use super::row::{Parameters, Row, parameters_text};
use serde::Deserialize;
use serde_json::Value;
use std::fmt;

/// An expectation file.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Expectations {
    /// Name of the study.
    pub study: String,
    /// Cases that the quick study leaves out: what is expected of them is expected of the full study alone.
    #[serde(default)]
    pub full_only: Vec<String>,
    /// Orders of convergence.
    #[serde(default)]
    pub order: Vec<Order>,
    /// Bounds on errors.
    #[serde(default)]
    pub bound: Vec<Bound>,
    /// Bounds on ratios of two rows.
    #[serde(default)]
    pub ratio: Vec<Ratio>,
}

/// Which rows are meant.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Selector {
    /// Case; absent: any.
    case: Option<String>,
    /// Method; absent: any.
    method: Option<String>,
    /// Parameters that must have these values; others may have any.
    #[serde(default, rename = "where")]
    parameters: Parameters,
    /// Error metric.
    metric: String,
    /// Resolution; absent: any.
    resolution: Option<f64>,
    /// Smallest resolution; absent: any.
    at_resolution_from: Option<f64>,
}

/// The error falls as resolution^−order.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Order {
    /// The rows of one sweep.
    rows: Selector,
    /// Expected order of convergence.
    order: f64,
    /// Largest deviation of the fitted order.
    tolerance: f64,
    /// Smallest resolution that takes part.
    #[serde(default)]
    from: f64,
    /// Largest resolution that takes part, such as where rounding begins to show.
    #[serde(default = "infinity")]
    to: f64,
    /// Where the bar comes from.
    source: String,
}

fn infinity() -> f64 {
    f64::INFINITY
}

/// Every selected error is within the bounds.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Bound {
    /// The rows, at least one.
    rows: Selector,
    /// Whether there may be none: of a case whose data is not part of the repository.
    #[serde(default)]
    may_be_absent: bool,
    /// Largest allowed value.
    at_most: Option<f64>,
    /// Smallest allowed value.
    at_least: Option<f64>,
    /// Where the bar comes from.
    source: String,
}

/// A quantity of one row divided by that of another is within the bounds.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Ratio {
    /// What is compared.
    #[serde(default)]
    quantity: Quantity,
    /// The row above the line.
    of: Selector,
    /// The row below the line.
    to: Selector,
    /// Largest allowed ratio.
    at_most: Option<f64>,
    /// Smallest allowed ratio.
    at_least: Option<f64>,
    /// Where the bar comes from.
    source: String,
}

/// What a ratio compares.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
enum Quantity {
    #[default]
    Error,
    CpuS,
    PeakBytes,
}

impl fmt::Display for Quantity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Error => "error",
            Self::CpuS => "CPU time",
            Self::PeakBytes => "peak memory",
        })
    }
}

impl fmt::Display for Selector {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let any = |name: &Option<String>| name.clone().unwrap_or_else(|| "any".to_owned());
        write!(f, "{}, {}", any(&self.case), any(&self.method))?;
        if !self.parameters.is_empty() {
            write!(f, " ({})", parameters_text(&self.parameters))?;
        }
        if let Some(resolution) = self.resolution {
            write!(f, " at {resolution}")?;
        }
        if let Some(from) = self.at_resolution_from {
            write!(f, " at {from} and more")?;
        }
        write!(f, ", {}", self.metric)
    }
}

impl Selector {
    fn select<'a>(&'a self, rows: &'a [Row]) -> impl Iterator<Item = &'a Row> {
        rows.iter().filter(|row| {
            self.case.as_ref().is_none_or(|c| *c == row.case)
                && self.method.as_ref().is_none_or(|m| *m == row.method)
                && self.metric == row.error_metric
                && self.resolution.is_none_or(|r| r == row.resolution)
                && self.at_resolution_from.is_none_or(|from| from <= row.resolution)
                && self
                    .parameters
                    .iter()
                    .all(|(name, value)| row.parameters.get(name).is_some_and(|v| equal(v, value)))
        })
    }
}

/// Equality of parameter values; 1 and 1.0 are the same.
fn equal(a: &Value, b: &Value) -> bool {
    match (a.as_f64(), b.as_f64()) {
        (Some(x), Some(y)) => x == y,
        _ => a == b,
    }
}

/// One expectation held against the rows.
#[derive(Clone, Debug, PartialEq)]
pub struct Verdict {
    /// What was expected, of what, and where the bar comes from.
    pub expected: String,
    /// What was measured.
    pub measured: String,
    /// Whether it holds.
    pub holds: bool,
}

impl fmt::Display for Verdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let word = if self.holds { "holds" } else { "FAILS" };
        write!(f, "{word}: {}: measured {}", self.expected, self.measured)
    }
}

impl Expectations {
    /// Reads an expectation file.
    ///
    /// # Errors
    /// What the TOML reader says, with the line.
    pub fn parse(text: &str) -> Result<Self, toml::de::Error> {
        toml::from_str(text)
    }

    /// The expectations of a quick study that took `rows`: those that name a case of [`Self::full_only`] go, unless it was
    /// taken after all.
    #[must_use]
    pub fn of_quick(mut self, rows: &[Row]) -> Self {
        let left_out = std::mem::take(&mut self.full_only);
        let taken = |selector: &Selector| {
            let missing = |case: &String| left_out.contains(case) && rows.iter().all(|row| row.case != *case);
            !selector.case.as_ref().is_some_and(missing)
        };
        self.order.retain(|e| taken(&e.rows));
        self.bound.retain(|e| taken(&e.rows));
        self.ratio.retain(|e| taken(&e.of) && taken(&e.to));
        self
    }

    /// The expectations about `rows`, which are part of the study's, without those of processor time.
    #[cfg(test)]
    pub(crate) fn about(mut self, rows: &[Row]) -> Self {
        let any = |selector: &Selector| selector.select(rows).next().is_some();
        self.order.retain(|e| e.rows.select(rows).count() >= 3);
        self.bound.retain(|e| any(&e.rows));
        self.ratio
            .retain(|e| e.quantity != Quantity::CpuS && any(&e.of) && any(&e.to));
        self
    }

    /// Holds the rows of the study against every expectation; also, every row must be `ok`.
    pub fn check(&self, rows: &[Row]) -> Vec<Verdict> {
        let mut verdicts = vec![all_ok(rows)];
        verdicts.extend(self.order.iter().map(|e| e.check(rows)));
        verdicts.extend(self.bound.iter().map(|e| e.check(rows)));
        verdicts.extend(self.ratio.iter().map(|e| e.check(rows)));
        verdicts
    }
}

fn all_ok(rows: &[Row]) -> Verdict {
    let bad: Vec<&Row> = rows.iter().filter(|row| !row.ok).collect();
    let first = bad.first().map_or(String::new(), |row| {
        format!(
            "; the first: {}, {} ({}) at {}: {}",
            row.case,
            row.method,
            row.parameters_text(),
            row.resolution,
            row.note
        )
    });
    Verdict {
        expected: "every row is ok".to_owned(),
        measured: format!("{} of {} are not{first}", bad.len(), rows.len()),
        holds: bad.is_empty() && !rows.is_empty(),
    }
}

impl Order {
    fn check(&self, rows: &[Row]) -> Verdict {
        let points: Vec<(f64, f64)> = self
            .rows
            .select(rows)
            .filter(|row| (self.from..=self.to).contains(&row.resolution))
            .map(|row| (row.resolution, row.error))
            .collect();
        let fitted = fitted_order(&points);
        Verdict {
            expected: format!(
                "{}: order {} ± {} ({})",
                self.rows, self.order, self.tolerance, self.source
            ),
            measured: fitted.map_or_else(
                || format!("no order: {} usable rows, at least 3 are needed", points.len()),
                |order| format!("{order:.3} over {} resolutions", points.len()),
            ),
            holds: fitted.is_some_and(|order| (order - self.order).abs() <= self.tolerance),
        }
    }
}

/// Order of convergence: minus the slope of the least-squares line through (ln resolution, ln error). `None` with fewer
/// than three points, equal resolutions or an error that is not positive and finite.
pub(crate) fn fitted_order(points: &[(f64, f64)]) -> Option<f64> {
    if points.len() < 3
        || points
            .iter()
            .any(|&(x, e)| !(x > 0.0 && e > 0.0 && e.is_finite()))
    {
        return None;
    }
    let n = points.len() as f64;
    let (sx, sy) = points
        .iter()
        .fold((0.0, 0.0), |(a, b), &(x, e)| (a + x.ln(), b + e.ln()));
    let (mx, my) = (sx / n, sy / n);
    let (sxx, sxy) = points.iter().fold((0.0, 0.0), |(a, b), &(x, e)| {
        let dx = x.ln() - mx;
        (a + dx * dx, b + dx * (e.ln() - my))
    });
    (sxx > 0.0).then(|| -sxy / sxx)
}

impl Bound {
    fn check(&self, rows: &[Row]) -> Verdict {
        let errors: Vec<f64> = self.rows.select(rows).map(|row| row.error).collect();
        let inside = |&e: &f64| within(e, self.at_least, self.at_most);
        let (low, high) = errors
            .iter()
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), &e| {
                (lo.min(e), hi.max(e))
            });
        Verdict {
            expected: format!(
                "{}: {} ({})",
                self.rows,
                bounds_text(self.at_least, self.at_most),
                self.source
            ),
            measured: match errors.len() {
                0 if self.may_be_absent => "no such row, as may be".to_owned(),
                0 => "no such row".to_owned(),
                1 => format!("{low:.3e}"),
                n => format!("{low:.3e} to {high:.3e} in {n} rows"),
            },
            holds: (self.may_be_absent || !errors.is_empty()) && errors.iter().all(inside),
        }
    }
}

impl Ratio {
    fn check(&self, rows: &[Row]) -> Verdict {
        let value = |selector: &Selector| -> Result<f64, String> {
            let found: Vec<&Row> = selector.select(rows).collect();
            let [row] = found.as_slice() else {
                return Err(format!(
                    "{} rows for `{selector}`, exactly one is needed",
                    found.len()
                ));
            };
            match self.quantity {
                Quantity::Error => Ok(row.error),
                Quantity::CpuS => row.cpu_s.ok_or_else(|| "no CPU clock on this system".to_owned()),
                Quantity::PeakBytes => Ok(row.peak_bytes as f64),
            }
        };
        let ratio = value(&self.of).and_then(|a| Ok(a / value(&self.to)?));
        let bounds = bounds_text(self.at_least, self.at_most);
        Verdict {
            expected: format!(
                "{} of {} / of {}: {bounds} ({})",
                self.quantity, self.of, self.to, self.source
            ),
            holds: ratio
                .as_ref()
                .is_ok_and(|&r| within(r, self.at_least, self.at_most)),
            measured: ratio.map_or_else(|reason| reason, |r| format!("{r:.4}")),
        }
    }
}

/// Whether `value` is inside bounds of which at least one is given. NaN never is.
fn within(value: f64, at_least: Option<f64>, at_most: Option<f64>) -> bool {
    (at_least.is_some() || at_most.is_some())
        && at_least.is_none_or(|low| value >= low)
        && at_most.is_none_or(|high| value <= high)
}

fn bounds_text(at_least: Option<f64>, at_most: Option<f64>) -> String {
    match (at_least, at_most) {
        (Some(low), Some(high)) => format!("between {low} and {high}"),
        (Some(low), None) => format!("at least {low}"),
        (None, Some(high)) => format!("at most {high}"),
        (None, None) => "no bound given, which can never hold".to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::super::row::tests::row;
    use super::*;

    fn rows(order: f64) -> Vec<Row> {
        [8.0, 16.0, 32.0, 64.0]
            .map(|n: f64| row("m", n, 3.0 * n.powf(-order)))
            .to_vec()
    }

    const FILE: &str = r#"
        study = "self-test"
        [[order]]
        rows = { method = "m", where = { courant = 0.5, order = "second" }, metric = "relative L2" }
        order = 2
        tolerance = 0.1
        source = "Taylor series"
        [[bound]]
        rows = { method = "m", metric = "relative L2", resolution = 64 }
        at_most = 1e-3
        source = "Taylor series"
        [[ratio]]
        of = { method = "m", metric = "relative L2", resolution = 32 }
        to = { method = "m", metric = "relative L2", resolution = 16 }
        at_most = 0.26
        source = "second order"
    "#;

    fn failures(rows: &[Row]) -> Vec<String> {
        let verdicts = Expectations::parse(FILE).unwrap().check(rows);
        assert_eq!(verdicts.len(), 4);
        verdicts
            .iter()
            .filter(|v| !v.holds)
            .map(ToString::to_string)
            .collect()
    }

    #[test]
    fn a_second_order_method_passes() {
        assert_eq!(failures(&rows(2.0)), Vec::<String>::new());
    }

    #[test]
    fn a_first_order_method_fails_every_bar_and_says_what_was_measured() {
        let failed = failures(&rows(1.0));
        assert_eq!(failed.len(), 3, "{failed:?}");
        assert!(
            failed[0].contains("measured 1.000 over 4 resolutions"),
            "{}",
            failed[0]
        );
        assert!(
            failed[0].contains("order 2 ± 0.1 (Taylor series)"),
            "{}",
            failed[0]
        );
        assert!(
            failed[1].contains("at most 0.001") && failed[1].contains("4.688e-2"),
            "{}",
            failed[1]
        );
    }

    #[test]
    fn missing_rows_and_rows_that_are_not_ok_fail() {
        let failed = failures(&[]);
        assert_eq!(failed.len(), 4, "{failed:?}");
        let mut bad = rows(2.0);
        bad[1].ok = false;
        bad[1].note = "volume lost".to_owned();
        let failed = failures(&bad);
        assert!(failed.len() == 1 && failed[0].contains("1 of 4") && failed[0].contains("volume lost"));
    }

    #[test]
    fn a_quick_study_is_not_asked_for_what_it_leaves_out() {
        let text = FILE
            .replace("[[order]]", "full_only = [\"other\", \"a case\"]\n[[order]]")
            .replace("rows = { method", "rows = { case = \"other\", method");
        let of_quick = |rows: &[Row]| Expectations::parse(&text).unwrap().of_quick(rows).check(rows);
        let rows = rows(2.0);
        // The order and the bound name a case without rows; the ratio names none.
        assert_eq!(of_quick(&rows).len(), 2);
        assert!(of_quick(&rows).iter().all(|v| v.holds));
        let full = Expectations::parse(&text).unwrap().check(&rows);
        assert_eq!(full.iter().filter(|v| !v.holds).count(), 2);
        // What was taken after all is held to its bar.
        let mut taken = rows.clone();
        taken.extend(rows.iter().map(|row| Row {
            case: "other".to_owned(),
            method: "another".to_owned(),
            ..row.clone()
        }));
        assert_eq!(of_quick(&taken).len(), 4);
    }

    #[test]
    fn a_bound_may_hold_from_a_resolution_on() {
        // 3/32² is 2.9e-3, 3/64² 7.3e-4, below the bound of 1e-3.
        for (from, failures) in [("64", 0), ("32", 1)] {
            let text = FILE.replace("resolution = 64", &format!("at_resolution_from = {from}"));
            let verdicts = Expectations::parse(&text).unwrap().check(&rows(2.0));
            let failed = verdicts.iter().filter(|v| !v.holds).count();
            assert_eq!(failed, failures, "from {from}");
        }
    }

    #[test]
    fn nan_never_passes() {
        let mut bad = rows(2.0);
        bad[3].error = f64::NAN;
        assert_eq!(failures(&bad).len(), 2);
        assert!(!within(f64::NAN, Some(0.0), None) && !within(1.0, None, None));
    }

    #[test]
    fn an_unknown_key_is_refused() {
        let text = FILE.replace("tolerance", "tolerence");
        assert!(Expectations::parse(&text).is_err());
        let text = FILE.replace("resolution = 64", "resolutoin = 64");
        let error = Expectations::parse(&text).unwrap_err().to_string();
        assert!(error.contains("resolutoin"), "{error}");
    }

    #[test]
    fn the_fit_recovers_any_order() {
        for p in [0.5, 1.0, 2.0, 4.0] {
            let points = [
                (3.0, 2.0 * 3_f64.powf(-p)),
                (10.0, 2.0 * 10_f64.powf(-p)),
                (70.0, 2.0 * 70_f64.powf(-p)),
            ];
            assert!((fitted_order(&points).unwrap() - p).abs() < 1e-12);
        }
        assert_eq!(fitted_order(&[(1.0, 1.0), (2.0, 0.5)]), None);
        assert_eq!(fitted_order(&[(1.0, 1.0), (2.0, 0.5), (4.0, 0.0)]), None);
    }
}
