//! Recordings in, frames out: readers, bindings, resampling, target selection, derived channels.

pub mod binding;
pub mod convex;
pub mod csv;
mod dead;
mod derive;
mod dropouts;
pub mod flow;
pub mod formats;
pub mod frames;
pub mod inspect;
mod jumps;
pub mod labels;
mod measured;
mod missing;
pub mod names;
mod open;
pub mod series;
pub mod sheet;
pub mod skeleton;
mod strangers;
pub mod table;
pub mod text;
mod timebase;
pub mod whole;

#[cfg(feature = "internals")]
pub use derive::frames;
pub use derive::trusted;
pub use open::{OpenRequest, Opened, hand_file_of, open, open_memory, open_source};
