//! What every floor shares: units, dimensions, names of hands and fingers, sources and diagnostics,
//! the scene and the recording as plain data, and the vocabulary of channels.
//!
//! Nothing here knows rules, logs on disk, physics or robots.

pub mod channels;
pub mod diagnostic;
pub mod error;
pub mod geometry;
pub mod hands;
pub mod json;
pub mod quantity;
pub mod recording;
pub mod scene;
pub mod shown;
pub mod units;
pub mod yaml;
