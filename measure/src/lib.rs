//! What the programs that measure share.

pub mod calibration;
pub mod confidence;
pub mod seeds;
