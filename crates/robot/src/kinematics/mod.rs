//! Kinematics: arms and fingers as chains of a tree of links, and their forward and inverse kinematics.

pub mod arm_ik;
mod closed_form;
pub mod finger;
mod finger_ik;
pub mod joint_positions;
pub(crate) mod limb_gap;
pub mod surroundings;
