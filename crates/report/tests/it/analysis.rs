//! What is written of an analysis.

#[path = "../../../analysis/tests/it/analysis/build.rs"]
#[allow(dead_code, reason = "the tests of `analysis` use all of it")]
pub mod build;
mod written;
