//! `meniscus study`: error against run time. The studies themselves are in [`crate::study`].

use super::console::Console;
use super::failure::Failure;
use clap::Args;
use std::path::PathBuf;

/// Arguments of `meniscus study`.
#[derive(Clone, Debug, Args)]
#[command(
    long_about = "Measure error against run time.\n\nA study sweeps resolution, step or order of its methods over cases \
        with a known truth and writes CSV, JSON, SVG and one self-contained HTML report. Without names, all studies run.",
    after_help = "Examples:\n  \
        meniscus study --list\n  \
        meniscus study wave-equation --quick -o studies\n  \
        meniscus study wave-equation --check -o studies"
)]
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
    #[arg(short, long = "out", value_name = "DIR", required_unless_present_any = ["list", "check"])]
    pub out: Option<PathBuf>,
}
