//! `meniscus study`: every method's error against its run time.
//!
//! A [`Study`] lists cases with a known truth and runs of methods over them. The harness runs them in rounds
//! (`schedule`), measures each (`measure`), holds the rows against `data/expectations/NAME.toml` ([`expectation`]),
//! draws them (`plot`, `figures`) and writes rows, figures and one page (`report`, `html`).
//!
//! To add a study, write one file with an implementation of [`Study`] and its expectations, and name it in [`all`].

#[cfg(all(feature = "bodies", feature = "shallow-water"))]
mod bodies;
pub mod case;
pub mod expectation;
mod figures;
mod html;
mod light;
pub mod machine;
mod march;
pub mod measure;
#[cfg(feature = "ocean")]
mod ocean;
pub mod plot;
mod raycast;
mod recording;
#[cfg(feature = "gpu")]
mod render;
mod report;
pub mod row;
mod scenes;
mod schedule;
#[cfg(test)]
mod selftest;
#[cfg(feature = "shallow-water")]
mod shallow_water;
#[cfg(feature = "shallow-water")]
mod shallow_water_coupling;
#[cfg(feature = "sph")]
mod sph;
#[cfg(feature = "sph")]
mod sph_pressure;
#[cfg(feature = "sph")]
mod sph_surface;
mod stability;
#[cfg(feature = "sph")]
mod stability_sph;
#[cfg(test)]
mod subset;
#[cfg(feature = "gpu")]
pub mod tiled_pool;
mod truth;
mod wave_equation;
#[cfg(feature = "wave-particles")]
mod wave_particles;

pub use case::{Against, Case, Curves, Outcome, Run, Study};
pub use expectation::{Expectations, Verdict};
pub use machine::Machine;
pub use row::Row;

use anyhow::Context as _;
use report::StudyReport;
use schedule::Budget;
use serde_json::json;
use std::fmt::Write as _;
use std::io::Write as _;
use std::path::PathBuf;
use std::sync::atomic::AtomicBool;

/// What `meniscus study` was asked for.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct StudyOptions {
    /// Studies to run, in this order; none means all.
    pub names: Vec<String>,
    /// Tell which studies there are instead of running any.
    pub list: bool,
    /// Short sweeps: at most a minute a study.
    pub quick: bool,
    /// Hold each study against its expectations.
    pub check: bool,
    /// The caller will print [`StudyOutcome::to_json`]; so nothing needs to be written.
    pub json: bool,
    /// Where rows, figures and the page go. Needed unless something is only checked, listed or printed as JSON.
    pub out: Option<PathBuf>,
}

/// Why no study was begun: what was asked for is wrong.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum StudyError {
    /// There is no study of that name.
    #[error("unknown study `{name}`; the studies are {known}")]
    Unknown {
        /// The name that was given.
        name: String,
        /// The names that there are.
        known: String,
    },
    /// Nothing says where the results should go.
    #[error(
        "nowhere to write the results: name a directory with `-o DIR`, or ask for `--json`, `--check` or `--list`"
    )]
    NoOutput,
}

/// What came of it.
#[derive(Clone, Debug, PartialEq)]
pub struct StudyOutcome {
    /// Names of the studies, in the order in which they ran.
    pub studies: Vec<&'static str>,
    /// The machine that they ran on.
    pub machine: Machine,
    /// All rows.
    pub rows: Vec<Row>,
    /// Each study's expectations and whether they hold; empty unless `check` was asked for.
    pub verdicts: Vec<(&'static str, Verdict)>,
    /// What was written.
    pub files: Vec<PathBuf>,
    /// Whether the flag stopped it before its end.
    pub interrupted: bool,
    /// What a person reads on standard output.
    pub text: String,
}

impl StudyOutcome {
    /// The expectations that do not hold, one line each. With any, the command fails.
    pub fn failures(&self) -> Vec<String> {
        let failed = self.verdicts.iter().filter(|(_, v)| !v.holds);
        failed
            .map(|(study, v)| format!("{study}: {}; measured {}", v.expected, v.measured))
            .collect()
    }

    /// One JSON object with the rows, the machine, the verdicts and the files.
    pub fn to_json(&self) -> serde_json::Value {
        let verdicts: Vec<_> = self
            .verdicts
            .iter()
            .map(|(study, v)| json!({"study": study, "expected": v.expected, "measured": v.measured, "holds": v.holds}))
            .collect();
        json!({
            "studies": self.studies,
            "machine": self.machine,
            "rows": self.rows,
            "checks": verdicts,
            "files": self.files,
            "interrupted": self.interrupted,
        })
    }
}

/// Every study there is.
pub fn all() -> Vec<&'static dyn Study> {
    vec![
        #[cfg(all(feature = "bodies", feature = "shallow-water"))]
        &bodies::BodiesStudy,
        &wave_equation::WaveEquationStudy,
        #[cfg(feature = "shallow-water")]
        &shallow_water::ShallowWaterStudy,
        &raycast::RaycastStudy,
        &light::LightStudy,
        &recording::RecordingStudy,
        #[cfg(feature = "gpu")]
        &render::RenderStudy,
        #[cfg(feature = "sph")]
        &sph::SphStudy,
        &stability::StabilityStudy,
        #[cfg(feature = "ocean")]
        &ocean::OceanStudy,
        #[cfg(feature = "wave-particles")]
        &wave_particles::WaveParticlesStudy,
    ]
}

/// Runs the studies that `options` asks for, with a line to standard error now and then. Ends soon after `interrupted`
/// becomes true, with what was measured by then.
///
/// # Errors
/// [`StudyError`] if what was asked for is wrong; otherwise, if a case cannot be set up or a file cannot be written.
pub fn run(options: &StudyOptions, interrupted: &AtomicBool) -> anyhow::Result<StudyOutcome> {
    run_with(&all(), options, interrupted, &mut |line| {
        // Nothing can be done about a closed standard error, and it is no reason to stop.
        let _ = writeln!(std::io::stderr(), "{line}");
    })
}

/// As [`run`], over the given studies and with progress lines to `progress`.
///
/// # Errors
/// As [`run`].
pub fn run_with(
    known: &[&'static dyn Study],
    options: &StudyOptions,
    interrupted: &AtomicBool,
    progress: &mut dyn FnMut(&str),
) -> anyhow::Result<StudyOutcome> {
    let chosen = choose(known, &options.names)?;
    let mut outcome = StudyOutcome {
        studies: chosen.iter().map(|s| s.name()).collect(),
        machine: Machine::describe(),
        rows: Vec::new(),
        verdicts: Vec::new(),
        files: Vec::new(),
        interrupted: false,
        text: String::new(),
    };
    if options.list {
        outcome.text = listing(&chosen);
        return Ok(outcome);
    }
    if options.out.is_none() && !options.json && !options.check {
        return Err(StudyError::NoOutput.into());
    }
    if let Some(dir) = &options.out {
        report::prepare(dir)?;
    }
    let mut reports = Vec::new();
    for study in chosen {
        let report = run_study(study, options, interrupted, progress)?;
        outcome.rows.extend(report.rows().cloned());
        outcome
            .verdicts
            .extend(report.verdicts.iter().map(|v| (report.name, v.clone())));
        outcome.text.push_str(&report.summary());
        outcome.interrupted |= report.interrupted;
        reports.push(report);
        if outcome.interrupted {
            break;
        }
    }
    if let Some(dir) = &options.out {
        let command = command(options);
        outcome.files = report::write(dir, &command, &outcome.machine, options.quick, &reports)?;
        let _ = writeln!(outcome.text, "report: {}", dir.join("report.html").display());
    }
    Ok(outcome)
}

fn run_study(
    study: &'static dyn Study,
    options: &StudyOptions,
    interrupted: &AtomicBool,
    progress: &mut dyn FnMut(&str),
) -> anyhow::Result<StudyReport> {
    let name = study.name();
    let cases = study
        .cases(options.quick)
        .with_context(|| format!("study `{name}` cannot be set up"))?;
    let budget = Budget::new(options.quick, study.timed());
    let results = schedule::measure(name, &cases, budget, interrupted, progress);
    let figures = figures::draw(study, &cases, &results)?;
    let mut report = StudyReport {
        name,
        title: study.title(),
        about: study.about(),
        cases,
        interrupted: results.interrupted,
        results,
        figures,
        verdicts: Vec::new(),
    };
    if options.check {
        let mut expectations = Expectations::parse(study.expectations())
            .with_context(|| format!("the expectations of study `{name}` cannot be read"))?;
        let rows: Vec<Row> = report.rows().cloned().collect();
        if options.quick {
            expectations = expectations.of_quick(&rows);
        }
        report.verdicts = expectations.check(&rows);
    }
    Ok(report)
}

fn choose(known: &[&'static dyn Study], names: &[String]) -> Result<Vec<&'static dyn Study>, StudyError> {
    if names.is_empty() {
        return Ok(known.to_vec());
    }
    names
        .iter()
        .map(|name| {
            let found = known.iter().find(|study| study.name() == name);
            found.copied().ok_or_else(|| StudyError::Unknown {
                name: name.clone(),
                known: known.iter().map(|s| s.name()).collect::<Vec<_>>().join(", "),
            })
        })
        .collect()
}

fn listing(studies: &[&'static dyn Study]) -> String {
    let widest = studies.iter().map(|s| s.name().len()).max().unwrap_or(0);
    let line = |s: &&'static dyn Study| format!("{:<widest$}  {}\n", s.name(), s.summary());
    studies.iter().map(line).collect()
}

/// The command line that asks for the same.
fn command(options: &StudyOptions) -> String {
    let mut words = vec!["meniscus".to_owned(), "study".to_owned()];
    words.extend(options.names.iter().cloned());
    for (flag, set) in [("--quick", options.quick), ("--check", options.check)] {
        if set {
            words.push(flag.to_owned());
        }
    }
    if let Some(out) = &options.out {
        words.extend(["-o".to_owned(), out.display().to_string()]);
    }
    words.join(" ")
}

#[cfg(test)]
mod tests {
    use super::selftest::Quadrature;
    use super::*;
    use std::sync::atomic::Ordering;

    static QUADRATURE: Quadrature = Quadrature;

    fn run_self_test(options: &StudyOptions, flag: bool) -> anyhow::Result<StudyOutcome> {
        run_with(&[&QUADRATURE], options, &AtomicBool::new(flag), &mut |_| ())
    }

    fn quick() -> StudyOptions {
        StudyOptions {
            quick: true,
            check: true,
            ..StudyOptions::default()
        }
    }

    #[test]
    fn known_orders_are_found_and_everything_is_written() {
        let dir = tempfile::tempdir().unwrap();
        let out = dir.path().join("new/folder");
        let options = StudyOptions {
            out: Some(out.clone()),
            ..quick()
        };
        let outcome = run_self_test(&options, false).unwrap();
        assert_eq!(outcome.failures(), Vec::<String>::new());
        assert_eq!(outcome.verdicts.len(), 5);
        assert!(!outcome.interrupted && outcome.rows.len() == 18);
        for name in [
            "rows.json",
            "rows.csv",
            "timings.csv",
            "report.html",
            "quadrature--exponential--absolute-error--against-cpu-time.svg",
            "quadrature--exponential--absolute-error--against-resolution.svg",
            "quadrature--map.svg",
        ] {
            assert!(
                outcome.files.contains(&out.join(name)) && out.join(name).is_file(),
                "{name}"
            );
        }
        let json = std::fs::read_to_string(out.join("rows.json")).unwrap();
        assert_eq!(
            serde_json::from_str::<Vec<serde_json::Value>>(&json)
                .unwrap()
                .len(),
            18
        );
        let html = std::fs::read_to_string(out.join("report.html")).unwrap();
        assert!(html.contains("meniscus study --quick --check -o "));
        assert_eq!(html.matches("<svg ").count(), 3);
        for outside in ["http://", "https://", "src=", "@import", "url("] {
            let inside = html.replace("http://www.w3.org/2000/svg", "");
            assert!(!inside.contains(outside), "the page asks for {outside}");
        }
        let timings = std::fs::read_to_string(out.join("timings.csv")).unwrap();
        assert_eq!(
            timings.lines().count(),
            1 + 18 * 5,
            "5 repetitions of 18 short runs"
        );
    }

    #[test]
    fn unknown_names_list_the_known_ones() {
        let options = StudyOptions {
            names: vec!["quadrature".to_owned(), "cubature".to_owned()],
            ..quick()
        };
        let error = run_self_test(&options, false).unwrap_err();
        assert_eq!(
            error.to_string(),
            "unknown study `cubature`; the studies are quadrature"
        );
        assert!(error.downcast_ref::<StudyError>().is_some());
    }

    #[test]
    fn results_must_go_somewhere() {
        let error = run_self_test(&StudyOptions::default(), false).unwrap_err();
        assert_eq!(error.downcast_ref(), Some(&StudyError::NoOutput));
        let listed = run_self_test(
            &StudyOptions {
                list: true,
                ..StudyOptions::default()
            },
            false,
        );
        assert_eq!(
            listed.unwrap().text,
            "quadrature  three rules against an exact integral\n"
        );
    }

    #[test]
    fn an_interrupted_study_keeps_what_it_has_and_fails_its_check() {
        let outcome = run_self_test(&quick(), true).unwrap();
        assert!(outcome.interrupted && !outcome.failures().is_empty());
        let flag = AtomicBool::new(false);
        let stop_early = &mut |_: &str| flag.store(true, Ordering::Relaxed);
        let outcome = run_with(&[&QUADRATURE], &quick(), &flag, stop_early).unwrap();
        assert!(outcome.interrupted && outcome.rows.iter().filter(|r| r.ok).count() >= 10);
    }

    #[test]
    fn an_unwritable_directory_is_named() {
        let dir = tempfile::tempdir().unwrap();
        let file = dir.path().join("file");
        std::fs::write(&file, "x").unwrap();
        let options = StudyOptions {
            out: Some(file.join("sub")),
            ..quick()
        };
        let error = run_self_test(&options, false).unwrap_err();
        assert!(
            format!("{error:#}").contains("cannot make this directory"),
            "{error:#}"
        );
    }

    #[test]
    fn every_study_has_expectations_that_parse_and_name_it() {
        for study in all() {
            let expectations = Expectations::parse(study.expectations()).unwrap();
            assert_eq!(expectations.study, study.name());
            assert!(!study.about().is_empty() && !study.summary().contains('\n'));
        }
    }
}
