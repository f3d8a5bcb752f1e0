//! Tests of `logs`: names of columns, labels, files that are written as a whole. The readers are tested in `frames`, which binds what they read.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test says what went wrong by panicking")]
#![allow(missing_docs, reason = "tests are read, not linked")]

mod atomic_write;
mod channel_names;
mod labels;
