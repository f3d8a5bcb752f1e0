//! teachtree: a declarative rule language that turns a recorded demonstration into named primitives and tasks, and those into a robot program.
//!
//! A [`Log`] is a recording of hands and objects: poses, contact forces, times. [`Rules`] are text: they define primitives, such as *Grasp* and *Release*,
//! and tasks, such as *pick_and_place*, which are sequences of primitives. Rules analyze a log; the [`Analysis`] lists [`Task`]s with their
//! [`Segment`]s, explains the label of each frame ([`Analysis::explain`]), and is written as JSON, CSV, text and HTML.
//! Everything has the defaults of the command line `teachtree analyze`.
//!
//! ```
//! # fn main() -> Result<(), teachtree::Error> {
//! // A recording of robosuite, whose columns a binding describes. `Log::open("demonstration.csv")` reads logs with our own names.
//! let log = teachtree::Log::options()
//!     .binding("demos/robosuite/panda_lift.binding.yaml")
//!     .open("demos/robosuite/lift_demo_1.csv")?;
//! let rules = teachtree::Rules::for_log(&log)?;
//! let analysis = rules.analyze(&log)?;
//! for task in analysis.tasks() {
//!     println!("{task}");
//! }
//! # assert!(!analysis.tasks().is_empty());
//! # Ok(())
//! # }
//! ```
//!
//! - logs: [`Log::open`] (CSV, Parquet, MCAP, HDF5, NPZ, Zarr, ROS bags, LeRobot, …), [`Log::options`] (binding, scene), [`Log::from_columns`] (memory);
//! - rules: [`Rules::for_log`] (the shipped ones), [`Rules::options`] (files, texts, params, hand file);
//! - results: [`Analysis`], [`Track`], [`Task`], [`Segment`], [`Issue`]; [`Rules::observability`] lists what cannot be detected in a log;
//! - errors: [`Error`] with its [`ErrorKind`], place and help, and for rules each [`Diagnostic`].
//!
//! docs/embedding.md goes through all of it. Features: `parquet`, `mcap`, `hdf5` and `arrays` (formats of logs), `world` (simulation, robots), `cli`, `lsp`,
//! `studio`, `teach` (a person in the virtual environment), `zenoh` (of `teachtree live`) and `tls` (of `teachtree teach --live`), which are not on by default; with `default-features = false` the library
//! reads and analyzes logs in text formats.

#![cfg_attr(not(feature = "internals"), allow(unused_imports, reason = "modules hand names on to tests and benches"))]
#![cfg_attr(
    not(any(feature = "internals", feature = "cli")),
    allow(dead_code, reason = "the commands use more of each module than the library alone")
)]

#[cfg(not(feature = "internals"))]
mod analysis;
#[cfg(not(feature = "internals"))]
mod base;
#[cfg(feature = "cli")]
mod cli;
#[cfg(not(feature = "internals"))]
mod command;
#[cfg(not(feature = "internals"))]
mod description;
#[cfg(not(feature = "internals"))]
mod engine;
#[cfg(not(feature = "internals"))]
mod graph;
#[cfg(not(feature = "internals"))]
mod language;
#[cfg(all(not(feature = "internals"), feature = "lsp"))]
mod lsp;
#[cfg(not(feature = "internals"))]
mod report;
#[cfg(all(not(feature = "internals"), feature = "world"))]
mod robot;
#[cfg(all(not(feature = "internals"), feature = "serve"))]
mod serve;
mod session;
#[cfg(not(feature = "internals"))]
mod stream;
#[cfg(all(not(feature = "internals"), feature = "studio"))]
mod studio;
#[cfg(all(not(feature = "internals"), feature = "teach"))]
mod teaching;
#[cfg(all(not(feature = "internals"), feature = "world"))]
mod world;

// Tests, benches, fuzz targets and measuring examples look behind the interface.
#[cfg(all(feature = "internals", feature = "cli", feature = "net"))]
#[doc(hidden)]
pub use cli::foxglove;
#[cfg(feature = "internals")]
#[doc(hidden)]
pub mod analysis;
#[cfg(feature = "internals")]
#[doc(hidden)]
pub mod base;
#[cfg(feature = "internals")]
#[doc(hidden)]
pub mod command;
#[cfg(feature = "internals")]
#[doc(hidden)]
pub mod description;
#[cfg(feature = "internals")]
#[doc(hidden)]
pub mod engine;
#[cfg(feature = "internals")]
#[doc(hidden)]
pub mod graph;
#[cfg(feature = "internals")]
#[doc(hidden)]
pub mod language;
#[cfg(all(feature = "internals", feature = "lsp"))]
#[doc(hidden)]
pub mod lsp;
#[cfg(feature = "internals")]
#[doc(hidden)]
pub mod report;
#[cfg(all(feature = "internals", feature = "world"))]
#[doc(hidden)]
pub mod robot;
#[cfg(all(feature = "internals", feature = "serve"))]
#[doc(hidden)]
pub mod serve;
#[cfg(feature = "internals")]
#[doc(hidden)]
pub mod stream;
#[cfg(all(feature = "internals", feature = "studio"))]
#[doc(hidden)]
pub mod studio;
#[cfg(all(feature = "internals", feature = "teach"))]
#[doc(hidden)]
pub mod teaching;
#[cfg(all(feature = "internals", feature = "world"))]
#[doc(hidden)]
pub mod world;

pub use analysis::{Confidence, Who};
pub use base::diagnostic::Severity;
pub use base::error::ErrorKind;
pub use base::hands::Side;
#[cfg(feature = "cli")]
#[doc(hidden)]
pub use cli::{main as command_line, run as command_line_of};
pub use report::Style;
pub use session::{
    Analysis, Calibration, Choice, ClosedSegment, Column, Composite, Diagnostic, Error, Explanation, Explanations,
    FrameTable, FrameValues, Labels, Live, LiveEvent, Log, LogOptions, Observability, OnSegment, Position, Question,
    Rules, RulesOptions, Scene, Score, Segment, Task, Track, TrackObservability, Undetectable, recordings,
};
pub use stream::issue::{Issue, IssueKind};
