//! Recordings in, frames out: readers, bindings, resampling, target selection, derived channels.

pub mod frames;
