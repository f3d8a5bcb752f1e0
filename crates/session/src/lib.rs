//! The public interface: a log and rules in, tasks out, with the same defaults as the command line.
//!
//! The modules follow the steps: `log` reads a log, `rules` loads the rules for it, `run` and `streaming` evaluate the rules over the log (in
//! memory, or in windows), `analysis` is the result, `explain` answers questions about it, `observability` lists what the rules cannot
//! detect in a log. `cli` and `lsp` go through this crate.

mod analysis;
pub mod binding_check;
mod confidence;
pub mod edited_rules;
mod error;
mod explain;
pub mod files;
pub mod fitting;
mod growing_log;
mod live;
mod log;
mod log_contents;
mod observability;
pub mod patch;
pub mod project_file;
mod rules;
mod run;
pub mod score;
pub mod signals;
mod streaming;
mod success_fields;
mod table;
mod tracks;
mod varied_logs;

pub use analysis::Analysis;
#[doc(hidden)]
pub use analysis::AnalysisInternals;
#[doc(hidden)]
pub use error::ErrorInternals;
pub use error::{Diagnostic, Error, Position};
pub use explain::{Choice, Explanation, Explanations, Question};
pub use files::paths as recordings;
pub use growing_log::{ClosedSegment, OnSegment};
pub use live::{Calibration, Live, LiveEvent};
pub use live::{CalibrationSource, Feed, FeedOptions};
pub use log::{Column, Log, LogOptions, Scene};
#[doc(hidden)]
pub use log::{LogInternals, SceneInternals};
pub use observability::{Observability, TrackObservability, Undetectable};
pub use rules::{Rules, RulesOptions};
#[doc(hidden)]
pub use rules::{RulesInternals, RulesOptionsInternals};
pub use run::Run;
pub use run::leaves;
#[doc(hidden)]
pub use score::LabelsInternals;
pub use score::{Labels, Score};
#[doc(hidden)]
pub use table::FrameTableInternals;
pub use table::{FrameTable, FrameValues};
pub use tracks::{Composite, Segment, Task, Track};
