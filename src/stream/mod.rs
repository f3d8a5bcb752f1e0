//! Recordings in, frames out, in four stages: `read` files, `clean` their columns, `bind` columns to channels, `derive` the channels that no log
//! contains. `open` runs the stages on a whole log, `streaming` in windows.

#[cfg_attr(not(feature = "studio"), allow(dead_code, reason = "the studio is what asks for all of it"))]
pub mod allowed_folders;
pub mod atomic_write;
pub mod bind;
mod clean;
mod derive;
pub mod frames;
mod groups;
pub mod inspect;
pub mod issue;
pub mod live;
pub mod names;
mod open;
pub mod read;
pub mod spilled_columns;
pub mod streaming;

#[cfg(feature = "internals")]
pub use derive::frames;
pub use derive::{averaging_lag, convex, trusted};
pub use open::{OpenRequest, Opened, hand_file_of, open, open_memory, open_source};
