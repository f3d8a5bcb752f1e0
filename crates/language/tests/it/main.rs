//! Tests of `language`: rule text in, rules and reports out.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test says what went wrong by panicking")]
#![allow(missing_docs, reason = "tests are read, not linked")]

mod diagram;
mod editors;
mod evidence;
mod graph;
mod language;

/// The folder of the project.
const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");
