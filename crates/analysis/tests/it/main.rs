//! Tests of `analysis`: leaves in, named tasks out.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test says what went wrong by panicking")]
#![allow(missing_docs, reason = "tests are read, not linked")]

mod analysis;
mod both_hands;
mod campaign;
mod closed_grippers;
mod clutter;
mod composites;
mod fit;
mod grippers;
mod kinds;
mod lifted_objects;
mod lost_bodies;
#[path = "../../../engine/tests/it/numbers.rs"]
#[allow(dead_code, reason = "the tests of `engine` use all of it")]
mod numbers;
mod object_motion;
mod one_gripper;
mod opening_jaws;
mod outcome;
mod pairs;
mod robosuite;
mod scenarios;
mod score;
mod seen_and_felt;
mod signals;
mod slips;
mod toppled_objects;

/// The folder of the project.
const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");
