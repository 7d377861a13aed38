//! What a study is made of: cases with a known truth, and runs of methods over them.
//!
//! A new study is one file: implement [`Study`], and add it to the list in `study/mod.rs`.

use super::measure::Probe;
use super::plot::Map;
use super::row::{Parameters, Row};
use serde_json::Value;

/// Compares methods with a truth over a sweep of what they cost.
pub trait Study: Sync {
    /// Name on the command line.
    fn name(&self) -> &'static str;

    /// Heading of its report.
    fn title(&self) -> &'static str;

    /// One line for `--list`: what is compared with what.
    fn summary(&self) -> &'static str;

    /// A few sentences for the report: which methods, which truth, how it is computed, how to read the figures.
    /// Paragraphs are separated by an empty line.
    fn about(&self) -> &'static str;

    /// What the study must show, in the form of [`super::expectation`].
    fn expectations(&self) -> &'static str;

    /// The cases with their runs. With `quick` the sweeps are shorter, so that one round of all runs takes at most some
    /// 15 seconds on two cores; each quick run is one of the full ones.
    ///
    /// # Errors
    /// If a case cannot be set up at all; what fails inside a run becomes a row that is not `ok`.
    fn cases(&self, quick: bool) -> anyhow::Result<Vec<Case>>;

    /// Whether its costs matter, so that runs are repeated. A study of right and wrong runs once.
    fn timed(&self) -> bool {
        true
    }

    /// Maps drawn from the rows beside the curves.
    fn maps(&self, _rows: &[Row]) -> Vec<Map> {
        Vec::new()
    }
}

/// One problem with a known truth.
pub struct Case {
    /// Name in rows, lower case.
    pub name: &'static str,
    /// One or two sentences: the problem, the truth and where it comes from.
    pub truth: String,
    /// What `resolution` counts in this case.
    pub resolution: &'static str,
    /// The curves to draw.
    pub curves: Vec<Curves>,
    /// The runs, in the order of the table.
    pub runs: Vec<Run>,
}

/// A figure of curves: one metric of a case against what is swept or spent.
#[derive(Clone, Debug, PartialEq)]
pub struct Curves {
    /// The metric on the vertical axis.
    pub metric: &'static str,
    /// The horizontal axis.
    pub against: Against,
    /// Orders of convergence for which slope triangles are drawn.
    pub slopes: &'static [u32],
}

/// Horizontal axis of a figure.
#[derive(Clone, Debug, PartialEq)]
pub enum Against {
    /// CPU seconds, with the Pareto front.
    Cpu,
    /// CPU seconds divided by the parameter of this name (rays, bytes …), times `scale`, with the Pareto front.
    CpuPer {
        /// The parameter that says how much was done.
        parameter: &'static str,
        /// Factor from seconds a unit to what the label says.
        scale: f64,
        /// Label with unit.
        label: &'static str,
    },
    /// The resolution of the case.
    Resolution,
    /// Another metric of the same run.
    Metric {
        /// Its name.
        metric: &'static str,
        /// Whether it is a cost (bytes …), so that the Pareto front is drawn.
        front: bool,
    },
}

impl Curves {
    /// The two standard figures of a metric: error against CPU seconds, and error against resolution with slope
    /// triangles for first and second order.
    pub fn standard(metric: &'static str) -> Vec<Self> {
        vec![
            Self {
                metric,
                against: Against::Cpu,
                slopes: &[],
            },
            Self {
                metric,
                against: Against::Resolution,
                slopes: &[1, 2],
            },
        ]
    }
}

/// What a run does: times its work through the probe and compares the result with the truth.
type Body = Box<dyn Fn(&mut Probe) -> anyhow::Result<Outcome> + Send + Sync>;

/// One method with one set of parameters on one case.
pub struct Run {
    /// Name of the method.
    pub method: &'static str,
    /// What is drawn as one curve, and its label.
    pub series: String,
    /// Parameters of the method.
    pub parameters: Parameters,
    /// Where the run stands in the sweep.
    pub resolution: f64,
    body: Body,
}

impl Run {
    /// A run of `method`. `body` is called once a repetition and must do the same each time.
    pub fn new(
        method: &'static str,
        resolution: f64,
        body: impl Fn(&mut Probe) -> anyhow::Result<Outcome> + Send + Sync + 'static,
    ) -> Self {
        Self {
            method,
            series: method.to_owned(),
            parameters: Parameters::new(),
            resolution,
            body: Box::new(body),
        }
    }

    /// With a parameter.
    #[must_use]
    pub fn with(mut self, name: &str, value: impl Into<Value>) -> Self {
        self.parameters.insert(name.to_owned(), value.into());
        self
    }

    /// As part of the curve of that label, instead of one curve a method.
    #[must_use]
    pub fn on_curve(mut self, label: impl Into<String>) -> Self {
        self.series = label.into();
        self
    }

    pub(crate) fn repeat(&self, probe: &mut Probe) -> anyhow::Result<Outcome> {
        (self.body)(probe)
    }
}

/// What a run found.
#[derive(Clone, Debug, PartialEq)]
pub struct Outcome {
    /// The errors measured, with the name and unit of each; one row each.
    pub errors: Vec<(&'static str, f64)>,
    /// Change of the mass of water, relative to the mass that the case names.
    pub mass_drift: Option<f64>,
    /// Whether everything was as it should be.
    pub ok: bool,
    /// Remark for the rows.
    pub note: String,
}

impl Outcome {
    /// A good outcome with one error.
    pub fn of(metric: &'static str, error: f64) -> Self {
        Self {
            errors: vec![(metric, error)],
            mass_drift: None,
            ok: true,
            note: String::new(),
        }
    }

    /// With another error.
    #[must_use]
    pub fn and(mut self, metric: &'static str, error: f64) -> Self {
        self.errors.push((metric, error));
        self
    }

    /// With the change of mass.
    #[must_use]
    pub fn drift(mut self, mass_drift: f64) -> Self {
        self.mass_drift = Some(mass_drift);
        self
    }

    /// With a remark.
    #[must_use]
    pub fn remark(mut self, note: impl Into<String>) -> Self {
        self.note = note.into();
        self
    }

    /// Not as it should be, and why.
    #[must_use]
    pub fn wrong(mut self, note: impl Into<String>) -> Self {
        self.ok = false;
        self.note = note.into();
        self
    }
}
