//! Planning: from commands and mapped grasps to targets at each instant, for both hands on one time scale.

mod apart;
mod beside;
mod change;
mod couple;
pub mod goal;
pub mod gripper_goal;
pub(crate) mod hand_over;
pub(crate) mod hand_planner;
mod in_hole;
pub(crate) mod interpolation;
pub mod late_start;
mod lifted;
mod moving;
mod own_axis;
pub mod plan;
pub mod posture;
mod precedence;
pub(crate) mod resolved_grasp;
pub(crate) mod schedule;
pub mod start;
pub mod time_scale;
pub mod toppra;
pub mod trajectory;
pub mod validation;
pub(crate) mod walk;
