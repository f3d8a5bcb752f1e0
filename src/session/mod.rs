//! The public interface: a log and rules in, tasks out, with the same defaults as the command line.
//!
//! The modules follow the steps: `log` reads a log, `rules` loads the rules for it, `run` and `streaming` evaluate the rules over the log (in
//! memory, or in windows), `analysis` is the result, `explain` answers questions about it, `observability` lists what the rules cannot
//! detect in a log. `cli` and `lsp` go through this module.

mod analysis;
mod confidence;
mod error;
mod explain;
pub(crate) mod files;
#[cfg(feature = "cli")]
pub(crate) mod fitting;
mod follow;
mod live;
mod log;
mod observability;
#[cfg(feature = "cli")]
pub(crate) mod patch;
mod rules;
mod run;
pub(crate) mod score;
pub(crate) mod signals;
mod streaming;
mod table;

pub use analysis::{Analysis, Composite, Segment, Task, Track};
pub use error::{Diagnostic, Error, Position};
pub use explain::{Choice, Explanation, Explanations, Question};
pub use files::paths as recordings;
pub use follow::{ClosedSegment, OnSegment};
pub use live::{Calibration, Live, LiveEvent};
#[cfg(feature = "cli")]
pub(crate) use live::{Feed, FeedOptions, Known};
pub use log::{Column, Log, LogOptions, Scene};
pub use observability::{Observability, TrackObservability, Undetectable};
pub use rules::{Rules, RulesOptions};
#[cfg(feature = "lsp")]
pub(crate) use run::Run;
#[cfg(feature = "cli")]
pub(crate) use run::leaves;
pub use score::{Labels, Score};
pub use table::{FrameTable, FrameValues};
