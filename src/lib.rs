//! teachtree: a declarative rule language that turns a recorded demonstration into a robot program.
//!
//! ```text
//! scene + operator ──▶ world ──▶ recording ──▶ stream ──▶ engine ──▶ analysis ──▶ report
//!                                                           ▲
//!                                    rules ──▶ language ──▶ graph
//! ```

pub mod analysis;
pub mod base;
pub mod command;
pub mod engine;
pub mod graph;
pub mod language;
pub mod report;
pub mod stream;

#[cfg(feature = "cli")]
pub mod cli;
#[cfg(feature = "lsp")]
pub mod lsp;
#[cfg(feature = "world")]
pub mod robot;
#[cfg(feature = "world")]
pub mod world;
