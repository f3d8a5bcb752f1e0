//! Kinematics: arms and fingers as chains of a tree of links, and their forward and inverse kinematics.

pub(crate) mod arm_distance;
pub mod arm_ik;
mod closed_form;
pub mod finger;
mod finger_ik;
pub mod joint_positions;
pub mod surroundings;
