//! Control: joint torques that follow targets, and the behaviors of a hand that correct its targets by what it senses.

pub mod behavior;
pub mod behaviors;
pub mod executor;
pub mod impedance;
mod palm_compliance;
