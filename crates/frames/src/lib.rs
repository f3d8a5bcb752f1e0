//! Recordings in, frames out, in three stages: `clean` the columns that `teachtree-logs` read, `bind` columns to channels, `derive` the channels that no
//! log contains. `open` runs the stages on a whole log, `streaming` in windows.

pub mod bind;
mod clean;
mod derive;
pub mod frames;
pub mod hand_models;
pub mod inspect;
pub mod live;
mod open;
mod otsu;
pub mod propose;
pub mod raw_log;
pub mod spilled_columns;
pub mod streaming;
pub mod streams;

pub use derive::frames;
pub use derive::{Misplacement, averaging_lag, convex_gap, misplacements, trusted};
pub use open::{OpenRequest, OpenedLog, assume, hand_file_of, open, open_memory, open_source};
