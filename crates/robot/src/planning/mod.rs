//! Planning: from commands and mapped grasps to targets at each instant, for both hands on one time scale.

mod axial_retreat;
mod bimanual_separation;
mod change;
pub mod delayed_start;
mod detour;
pub mod goal;
mod grasp_pair;
pub mod gripper_goal;
pub(crate) mod hand_planner;
pub(crate) mod handover_grasps;
mod insertion_yaw;
pub(crate) mod interpolation;
mod lift_over;
mod moving;
pub mod plan;
pub mod posture;
mod precedence;
pub(crate) mod resolved_grasp;
pub(crate) mod rollout;
pub(crate) mod schedule;
pub mod start;
pub mod time_scale;
pub mod toppra;
pub mod trajectory;
pub mod validation;
