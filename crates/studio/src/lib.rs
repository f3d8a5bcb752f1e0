//! The studio: a page on this machine over a list of recordings, to look at what rules found, correct it, and tune the rules.
//!
//! `routes` maps addresses to answers, `project` keeps the recordings and what was found in them, and `queue` says what
//! is analyzed next. `labels` are what a person corrected, `score` how well rules agree with them, `tuning` turns params, `learning` learns a new primitive, `export` writes labels
//! for other programs. The page in `page` is plain modules, which draw a recording by the scripts of the report; nothing is drawn a second way.
//!
//! Invariants: an analysis of the studio is that of the commands, with the same defaults; nothing leaves this machine; only labels and rule files are
//! written, whole or not at all.

mod background;
mod edits;
mod export;
mod fit;
mod labels;
mod learning;
mod loaded_recording;
mod merged_labels;
mod project;
mod queue;
mod routes;
mod rule_comparison;
mod score;
mod tuning;
mod video;

pub use project::{Options, Studio};
