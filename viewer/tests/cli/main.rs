//! The `meniscus` command, run as users run it: what it prints, and how it exits.
//!
//! One test binary, with a module for each concern. It stands in this package, and not in `tests/`, because Cargo tells
//! the path of a binary only to the tests of its own package.

mod bad_input;
mod commands;
mod documentation;
mod pictures;
#[cfg(unix)]
mod stops;
mod streams;
mod support;
