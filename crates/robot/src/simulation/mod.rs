//! Simulation: a robot carries out commands in the world, which is recorded and judged.

pub mod cause;
pub mod cell_variation;
pub mod fault;
mod hand_agent;
mod observer;
pub mod observers;
pub mod pose_sensor;
pub mod run;
pub mod trace;
pub mod warnings;

pub use cell_variation::CellVariation;
pub use fault::{Fault, FaultKind};
pub use observers::judge::{TaskOutcome, Verdict};
pub use observers::{arm_clearance, force_tolerance, judge, recorder};
pub use run::{Extent, Performance, simulate, simulate_varied, simulate_within};
