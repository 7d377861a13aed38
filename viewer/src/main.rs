//! Simulate, record, render, export and compare water surfaces.

use std::process::ExitCode;

fn main() -> ExitCode {
    ExitCode::from(meniscus::cli::run(std::env::args_os()))
}
