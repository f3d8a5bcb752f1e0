//! Tests of `frames`, and of the readers of `logs`: logs in, frames out.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test says what went wrong by panicking")]
#![allow(missing_docs, reason = "tests are read, not linked")]

mod inspect;
mod propose;
mod shared;
mod stream;

/// The folder of the project.
const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");
