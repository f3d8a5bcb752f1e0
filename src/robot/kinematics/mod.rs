//! Kinematics: trees of links, fingers as chains, and their forward and inverse kinematics.

pub mod arm_ik;
mod closed_form;
pub mod finger;
mod finger_ik;
pub mod joint_positions;
pub mod shape;
pub mod tree;
