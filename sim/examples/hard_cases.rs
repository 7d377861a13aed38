//! Prints the table of hard cases of `docs/numerics-shallow-water.md` and the limits of the schemes of
//! `docs/numerics-lattice.md`:
//! `cargo run --release -p meniscus-sim --example hard_cases`. Ends with 1 if a case broke a law.

#![allow(
    clippy::print_stdout,
    clippy::print_stderr,
    reason = "a tool that reports to a person"
)]

use meniscus_sim::shallow_water::stability::{self, Verdict, limits};
use std::process::ExitCode;

fn main() -> ExitCode {
    let rows = stability::table();
    print!("{}", stability::markdown(&rows));
    println!();
    print!("{}", limits::markdown(&limits::relaxations(), &limits::steps()));
    let mut code = ExitCode::SUCCESS;
    for row in &rows {
        if let Verdict::Broken(what) = &row.verdict {
            eprintln!("{} ({}, {:?}): {what}", row.case, row.scheme, row.precision);
            code = ExitCode::FAILURE;
        }
    }
    code
}
