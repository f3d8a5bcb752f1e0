//! The types that all crates share: units, dimensions, names of hands and fingers, sources and diagnostics,
//! the scene and the recording as plain data, and the vocabulary of channels.
//!
//! This crate depends on no rules, no log files, no physics and no robots.

pub mod channels;
pub mod contact_threshold;
pub mod diagnostic;
pub mod digest;
pub mod easing;
pub mod error;
pub mod field_names;
pub mod file_kind;
pub mod geometry;
pub mod guard;
pub mod hands;
pub mod json;
pub mod log_channel;
pub mod meaning;
pub mod pose;
pub mod quantity;
pub mod recording;
pub mod scene;
pub mod short_number;
pub mod socket;
pub mod spelling;
pub mod units;
pub mod yaml;
