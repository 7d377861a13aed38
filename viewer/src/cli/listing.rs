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
    /// Whether this build can use graphics adapters.
    gpu: bool,
    adapters: Vec<Adapter>,
}

/// A graphics adapter of this machine.
#[derive(Serialize)]
struct Adapter {
    name: String,
    kind: String,
    backend: String,
    driver: String,
}

/// The graphics adapters of this machine, the one that would be used first; none where the build cannot use them.
fn adapters() -> Vec<Adapter> {
    #[cfg(feature = "gpu")]
    {
        let adapters = meniscus_render_gpu::adapters::list().into_iter();
        let adapter = |found: meniscus_render_gpu::AdapterDescription| Adapter {
            name: found.name,
            kind: found.kind.to_owned(),
            backend: found.backend,
            driver: found.driver,
        };
        adapters.map(adapter).collect()
    }
    #[cfg(not(feature = "gpu"))]
    {
        Vec::new()
    }
}

/// The techniques of the renderer on graphics adapters; none where the build has none.
fn gpu_renderers(adapters: &[Adapter]) -> Vec<Entry> {
    #[cfg(feature = "gpu")]
    {
        let entry = |technique: meniscus_render_gpu::Technique| Entry {
            name: technique.name(),
            available: !adapters.is_empty(),
            summary: technique.summary(),
            reason: adapters.is_empty().then(|| "no graphics adapter".to_owned()),
        };
        meniscus_render_gpu::Technique::ALL.map(entry).into()
    }
    #[cfg(not(feature = "gpu"))]
    {
        let _ = adapters;
        Vec::new()
    }
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
    let adapters = adapters();
    let mut renderers: Vec<Entry> = renderers::available().into_iter().map(entry).collect();
    renderers.extend(gpu_renderers(&adapters));
    let gpu = cfg!(feature = "gpu");
    if args.json {
        return console.json(&Renderers {
            renderers,
            gpu,
            adapters,
        });
    }
    let mut text = table(&renderers) + "\n";
    if !gpu {
        text += "graphics adapters: not used by this build (Cargo feature `gpu`)\n";
    } else if adapters.is_empty() {
        text += "graphics adapters: none found; install a Vulkan, Metal or Direct3D 12 driver\n";
    }
    for Adapter {
        name,
        kind,
        backend,
        driver,
    } in &adapters
    {
        text += &format!("graphics adapter: {name} ({kind}, {backend}, {driver})\n");
    }
    console.result(text)
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
