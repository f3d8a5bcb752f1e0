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
//! - rules: [`Rules::for_log`] (the shipped ones), [`Rules::options`] (files, texts, params, hand model);
//! - results: [`Analysis`], [`Track`], [`Task`], [`Segment`], [`Issue`]; [`Rules::observability`] lists what cannot be detected in a log;
//! - errors: [`Error`] with its [`ErrorKind`], place and help, and for rules each [`Diagnostic`].
//!
//! docs/embedding.md goes through all of it. Features: `parquet`, `mcap`, `hdf5` and `arrays` (formats of logs), `cli` (the program, with all formats),
//! `zenoh` (of `teachtree live`) and `tls` (of `teachtree teach --live`), which are not on by default; with `default-features = false` the library
//! reads and analyzes logs in text formats.

#[cfg(feature = "cli")]
mod cli;

#[cfg(feature = "cli")]
#[doc(hidden)]
pub use cli::{main as command_line, run as command_line_of};
#[doc(inline)]
pub use teachtree_analysis::outcome::{Outcome, OutcomeKind, OutcomeReason, ReasonKind};
#[doc(inline)]
pub use teachtree_analysis::{Confidence, TrackId};
#[doc(inline)]
pub use teachtree_base::diagnostic::Severity;
#[doc(inline)]
pub use teachtree_base::error::ErrorKind;
#[doc(inline)]
pub use teachtree_base::hands::Side;
#[doc(inline)]
pub use teachtree_logs::issue::{Issue, IssueKind};
#[doc(inline)]
pub use teachtree_report::Style;
#[doc(hidden)]
pub use teachtree_session::project_file::ProjectSettings;
#[doc(inline)]
pub use teachtree_session::{
    Analysis, Calibration, Choice, ClosedSegment, Column, Composite, Diagnostic, Error, Explanation, Explanations,
    FrameTable, FrameValues, Labels, Live, LiveEvent, Log, LogOptions, Observability, OnSegment, Position, Question,
    Rules, RulesOptions, Scene, Score, Segment, Task, Track, TrackObservability, Undetectable, recordings,
};
