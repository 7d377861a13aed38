//! The rows that a study makes, and how they are written.

use serde::{Serialize, Serializer};
use serde_json::Value;
use std::collections::BTreeMap;

/// Named parameters of a run, in alphabetical order.
pub type Parameters = BTreeMap<String, Value>;

/// One measured error of one run: the public contract of `rows.json` and `rows.csv`.
///
/// A run that measures several errors makes one row for each, with the same costs.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Row {
    /// Name of the study.
    pub study: String,
    /// Name of the case, which has one truth.
    pub case: String,
    /// Name of the method.
    pub method: String,
    /// Parameters of the method in this run.
    pub parameters: Parameters,
    /// What the case sweeps: samples a wavelength, march steps …; the case says what it counts.
    pub resolution: f64,
    /// The error; `null` in JSON and empty in CSV if the run gave none.
    #[serde(serialize_with = "finite_or_null")]
    pub error: f64,
    /// What the error is, with its unit where it has one.
    pub error_metric: String,
    /// CPU seconds of the process, best repetition; `null` where the system has no CPU clock.
    pub cpu_s: Option<f64>,
    /// Wall seconds, best repetition.
    pub wall_s: f64,
    /// Largest number of heap bytes held at once.
    pub peak_bytes: u64,
    /// Change of the mass of water over the run, relative to the mass that the case names; `null` where none is kept.
    pub mass_drift: Option<f64>,
    /// Whether the run ended as it should: a finite error, the same in every repetition, and whatever else the study asks.
    pub ok: bool,
    /// Anything else: what went wrong, how many repetitions there were and how they spread.
    pub note: String,
}

fn finite_or_null<S: Serializer>(value: &f64, serializer: S) -> Result<S::Ok, S::Error> {
    if value.is_finite() {
        serializer.serialize_f64(*value)
    } else {
        serializer.serialize_none()
    }
}

impl Row {
    /// The parameters as `name=value` separated by spaces.
    pub fn parameters_text(&self) -> String {
        parameters_text(&self.parameters)
    }
}

/// Parameters as `name=value` separated by spaces.
pub(crate) fn parameters_text(parameters: &Parameters) -> String {
    let list: Vec<String> = parameters
        .iter()
        .map(|(name, value)| match value {
            Value::String(text) => format!("{name}={text}"),
            other => format!("{name}={other}"),
        })
        .collect();
    list.join(" ")
}

/// The rows as CSV (RFC 4180) with the keys of the JSON form as header; parameters as `name=value …`.
pub fn to_csv(rows: &[Row]) -> String {
    let mut text = String::from(
        "study,case,method,parameters,resolution,error,error_metric,cpu_s,wall_s,peak_bytes,mass_drift,ok,note\n",
    );
    for row in rows {
        let optional = |v: Option<f64>| v.map_or(String::new(), |v| format!("{v:e}"));
        let fields = [
            quoted(&row.study),
            quoted(&row.case),
            quoted(&row.method),
            quoted(&row.parameters_text()),
            row.resolution.to_string(),
            optional(row.error.is_finite().then_some(row.error)),
            quoted(&row.error_metric),
            optional(row.cpu_s),
            format!("{:e}", row.wall_s),
            row.peak_bytes.to_string(),
            optional(row.mass_drift),
            row.ok.to_string(),
            quoted(&row.note),
        ];
        text.push_str(&fields.join(","));
        text.push('\n');
    }
    text
}

/// A CSV field, quoted where it must be.
pub(crate) fn quoted(field: &str) -> String {
    if field.contains([',', '"', '\n', '\r']) {
        format!("\"{}\"", field.replace('"', "\"\""))
    } else {
        field.to_owned()
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    pub(crate) fn row(method: &str, resolution: f64, error: f64) -> Row {
        Row {
            study: "self-test".to_owned(),
            case: "a, \"b\"".to_owned(),
            method: method.to_owned(),
            parameters: Parameters::from([
                ("courant".to_owned(), Value::from(0.5)),
                ("order".to_owned(), Value::from("second")),
            ]),
            resolution,
            error,
            error_metric: "relative L2".to_owned(),
            cpu_s: Some(0.25),
            wall_s: 0.5,
            peak_bytes: 1024,
            mass_drift: None,
            ok: error.is_finite(),
            note: String::new(),
        }
    }

    #[test]
    fn json_rows_have_exactly_the_agreed_keys() {
        let value = serde_json::to_value(row("m", 8.0, f64::NAN)).unwrap();
        let mut keys: Vec<_> = value.as_object().unwrap().keys().map(String::as_str).collect();
        keys.sort_unstable();
        let mut agreed = vec![
            "study",
            "case",
            "method",
            "parameters",
            "resolution",
            "error",
            "error_metric",
            "cpu_s",
            "wall_s",
            "peak_bytes",
            "mass_drift",
            "ok",
            "note",
        ];
        agreed.sort_unstable();
        assert_eq!(keys, agreed);
        assert!(value["error"].is_null() && value["mass_drift"].is_null());
        assert_eq!(value["parameters"]["courant"], 0.5);
    }

    #[test]
    fn csv_quotes_what_needs_it() {
        let text = to_csv(&[row("m", 8.0, 0.125)]);
        let line = text.lines().nth(1).unwrap();
        assert_eq!(
            line,
            "self-test,\"a, \"\"b\"\"\",m,courant=0.5 order=second,8,1.25e-1,relative L2,2.5e-1,5e-1,1024,,true,"
        );
    }
}
