//! Control: joint torques that follow targets, and the behaviors of a hand that correct its targets by what it senses.

pub mod behavior;
pub(crate) mod behaviors;
pub mod executor;
mod grip_force;
pub mod impedance;
mod palm_compliance;
pub mod peg_search;
mod pose_correction;
pub mod spiral_path;
mod sway_damping;
