//! Tests of `engine`: the evaluators, and what `language` says about rules, on logs.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test says what went wrong by panicking")]
#![allow(missing_docs, reason = "tests are read, not linked")]

mod diagram;
mod engine;
mod explain;
mod graph;
mod language;
mod numbers;
mod palm;
#[path = "../../../frames/tests/it/shared/recordings.rs"]
#[allow(dead_code, reason = "the tests of `frames` use all of it")]
mod recordings;

/// The folder of the project.
const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");
