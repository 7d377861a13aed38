//! The `meniscus` command, run as users run it: what it prints, and how it exits.
//!
//! One test binary, with a module for each concern. It stands in this package, and not in `tests/`, because Cargo tells
//! the path of a binary only to the tests of its own package.

// Helpers outside `#[test]` functions may unwrap as tests do, and nothing outside can see them.
#![allow(clippy::unwrap_used, unreachable_pub)]

mod bad_input;
mod commands;
mod documentation;
#[cfg(unix)]
mod outputs;
mod pictures;
#[cfg(unix)]
mod stops;
mod streams;
mod support;
