//! Tests of `robot`: files, grasps, plans, controllers and simulations.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test says what went wrong by panicking")]
#![allow(missing_docs, reason = "tests are read, not linked")]

mod command;
#[path = "../../../command/tests/it/demonstrated.rs"]
#[allow(dead_code, reason = "the tests of `command` use all of it")]
mod demonstrated;
mod robot;

/// The folder of the project.
const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");
