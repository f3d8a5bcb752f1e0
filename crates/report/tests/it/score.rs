//! What is written of a score.

#[path = "../../../analysis/tests/it/score/build.rs"]
#[allow(dead_code, reason = "the tests of `analysis` use all of it")]
mod build;
mod written;
