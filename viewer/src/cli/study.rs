//! `meniscus study`: error against run time. The studies themselves are in [`crate::study`].

use super::console::Console;
use super::failure::Failure;
use super::format;
use super::interrupt::Interrupt;
use crate::study::{self, Study, StudyError, StudyOptions};
use clap::Args;
use serde::Serialize;
use std::path::PathBuf;

/// What `meniscus help study` says first.
pub(super) const ABOUT: &str = "Measure error against run time.\n\nA study sweeps resolution, step or order of its methods over cases \
    with a known truth and writes CSV, JSON, SVG and one self-contained HTML report. Without names, all studies run. With --check or --json nothing needs to be written.";

/// Arguments of `meniscus study`.
#[derive(Clone, Debug, Args)]
#[command(after_help = "Examples:\n  \
        meniscus study --list\n  \
        meniscus study wave-equation --quick -o studies\n  \
        meniscus study wave-equation --check -o studies")]
pub struct StudyArgs {
    /// Studies to run [default: all]
    #[arg(value_name = "NAME")]
    pub names: Vec<String>,
    /// List the studies and end
    #[arg(long)]
    pub list: bool,
    /// Fewer and smaller cases: within a minute a study
    #[arg(long)]
    pub quick: bool,
    /// Print one JSON object with the rows on standard output
    #[arg(long)]
    pub json: bool,
    /// Hold the results against the studies' expectations; exit code 1 where they are not met
    #[arg(long)]
    pub check: bool,
    /// Folder for tables, plots and the report; made where it is missing
    #[arg(short, long = "out", value_name = "DIR", required_unless_present_any = ["list", "check", "json"])]
    pub out: Option<PathBuf>,
}

pub(super) fn run(args: &StudyArgs, console: &Console) -> Result<(), Failure> {
    let interrupt = Interrupt::install()?;
    let options = StudyOptions {
        names: args.names.clone(),
        list: args.list,
        quick: args.quick,
        check: args.check,
        json: args.json,
        out: args.out.clone(),
    };
    let progress = &mut |line: &str| console.note(line);
    let outcome = study::run_with(&study::all(), &options, interrupt.flag(), progress).map_err(classify)?;
    if args.json && args.list {
        console.json(&Listed::all())?;
    } else if args.json {
        console.json(&outcome.to_json())?;
    } else {
        console.result(&outcome.text)?;
    }
    let measured = outcome.rows.len() as u64;
    interrupt.check(|| format!("{} measured by then", format::count(measured, "row")))?;
    match outcome.failures().as_slice() {
        [] => Ok(()),
        failures => Err(Failure::Unmet(failures.to_vec())),
    }
}

/// A study that does not exist is wrong input; anything else went wrong on the way.
fn classify(error: anyhow::Error) -> Failure {
    if error.is::<StudyError>() {
        Failure::Input(error)
    } else {
        error.into()
    }
}

/// The studies there are.
#[derive(Serialize)]
struct Listed {
    studies: Vec<ListedStudy>,
}

#[derive(Serialize)]
struct ListedStudy {
    name: &'static str,
    summary: &'static str,
}

impl Listed {
    fn all() -> Self {
        let entry = |study: &&'static dyn Study| ListedStudy {
            name: study.name(),
            summary: study.summary(),
        };
        Self {
            studies: study::all().iter().map(entry).collect(),
        }
    }
}
