//! Simulation: a robot carries out commands in the world, which is recorded and judged.

pub mod arm_clearance;
mod drop_detection;
pub mod force_tolerance;
mod hand_agent;
pub mod judge;
mod observer;
pub mod recorder;
pub mod run;
pub mod trace;
mod tracer;

pub use judge::Outcome;
pub use run::{Performance, simulate, simulate_seeing};
