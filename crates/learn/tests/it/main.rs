//! Tests of `learn`: planted rules are found, files mean what the learner computed, the same input gives the same bytes.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test says what went wrong by panicking")]
#![allow(missing_docs, reason = "tests are read, not linked")]

mod extension;
mod learned;
mod relearned;
mod relearned_groups;
mod synthetic;
