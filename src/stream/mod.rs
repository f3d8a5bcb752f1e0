//! Recordings in, frames out: readers, bindings, resampling, target selection, derived channels.

pub mod binding;
pub mod csv;
mod dead;
mod derive;
pub mod frames;
mod geometry;
pub mod labels;
mod measured;
pub mod names;
mod open;
pub mod table;
mod timebase;
pub mod whole;

pub use derive::frames;
pub use open::{OpenRequest, Opened, open};
