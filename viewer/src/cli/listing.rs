//! `meniscus renderers` and `meniscus solvers`: what is in this build.

use super::console::Console;
use super::failure::Failure;
use super::format::{Align, Table};
use clap::Args;
use meniscus_render_cpu::renderers;
use meniscus_sim::solvers;
use serde::Serialize;

/// What `meniscus help renderers` says last.
pub(super) const RENDERERS_EXAMPLE: &str = "Example:\n  meniscus renderers --json";

/// What `meniscus help solvers` says last.
pub(super) const SOLVERS_EXAMPLE: &str = "Example:\n  meniscus solvers --json";

/// Arguments of `meniscus renderers` and `meniscus solvers`.
#[derive(Clone, Debug, Args)]
pub struct ListArgs {
    /// Print one JSON object
    #[arg(long)]
    pub json: bool,
}

/// A renderer or solver.
#[derive(Serialize)]
struct Entry {
    name: &'static str,
    available: bool,
    summary: &'static str,
    /// Why it is not available.
    reason: Option<String>,
}

#[derive(Serialize)]
struct Renderers {
    renderers: Vec<Entry>,
}

#[derive(Serialize)]
struct Solvers {
    solvers: Vec<Entry>,
}

pub(super) fn renderers(args: &ListArgs, console: &Console) -> Result<(), Failure> {
    let entry = |info: renderers::RendererInfo| Entry {
        name: info.name,
        available: info.unavailable.is_none(),
        summary: info.summary,
        reason: info.unavailable,
    };
    let renderers: Vec<Entry> = renderers::available().into_iter().map(entry).collect();
    if args.json {
        console.json(&Renderers { renderers })
    } else {
        console.result(table(&renderers))
    }
}

pub(super) fn solvers(args: &ListArgs, console: &Console) -> Result<(), Failure> {
    let entry = |info: solvers::SolverInfo| Entry {
        name: info.name,
        available: info.compiled,
        summary: info.summary,
        reason: (!info.compiled)
            .then(|| format!("not compiled in; build with the Cargo feature `{}`", info.name)),
    };
    let solvers: Vec<Entry> = solvers::available().into_iter().map(entry).collect();
    if args.json {
        console.json(&Solvers { solvers })
    } else {
        console.result(table(&solvers))
    }
}

fn table(entries: &[Entry]) -> String {
    let mut table = Table::new(&[
        ("name", Align::Left),
        ("available", Align::Left),
        ("what it does", Align::Left),
    ]);
    for entry in entries {
        let available = if entry.available { "yes" } else { "no" };
        let summary = match &entry.reason {
            Some(reason) => format!("{} ({reason})", entry.summary),
            None => entry.summary.to_owned(),
        };
        table.row(vec![entry.name.into(), available.into(), summary]);
    }
    table.render()
}
