//! Simulation: a robot carries out commands in the world, which is recorded and judged.

pub mod cause;
mod hand_agent;
mod observer;
pub mod observers;
pub mod run;
pub mod trace;
pub mod warnings;

pub use observers::judge::{TaskOutcome, Verdict};
pub use observers::{arm_clearance, force_tolerance, judge, recorder};
pub use run::{Performance, simulate, simulate_seeing};
