//! Clean: columns of a recording in, the same columns without drop-outs, spikes and stuck sensors out. Each change is an issue of the log.

pub mod closed_grippers;
pub mod contact_kinds;
pub mod contact_level;
pub mod dropouts;
pub mod fingertip_level;
pub mod gap_filling;
pub mod held_poses;
pub mod lost_bodies;
pub mod preprocess;
pub mod spikes;
pub mod stuck_sensors;
pub mod timebase;
pub mod unknown_columns;
pub mod untracked_bodies;
